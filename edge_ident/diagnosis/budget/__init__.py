"""The error budget: where the effort lies that the base model misses, as curves without names.

`account.error_budget` is the entry point; `edge_ident.diagnosis.error_budget` is what it returns.
"""

"""Diagnosis: finds what a model gets wrong about a machine, and names the causes.

`diagnose.diagnose` is the entry point and `result` is what it returns. Four subpackages follow the
data: `prepare`, `fit`, `select`, `present`.
"""

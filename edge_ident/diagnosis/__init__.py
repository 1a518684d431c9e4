"""Diagnosis: finds what a model gets wrong about a machine, and names the causes.

`diagnose.diagnose` is the front door and `result` is what it returns. Four rooms stand behind it,
in the order of the data: `prepare`, `fit`, `select`, `present`.
"""

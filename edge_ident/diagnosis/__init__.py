"""Diagnosis: finds what a model gets wrong about a machine, and names the causes.

`diagnose.diagnose` is the entry point and `result` is what it returns. Seven subpackages follow
the data: `prepare`, `above_band`, `fit`, `select`, `judge`, `budget`, `present`.
"""

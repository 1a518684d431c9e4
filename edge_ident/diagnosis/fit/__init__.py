"""Fits: candidate effects, their regressors, models with several of them, and the noise floor."""

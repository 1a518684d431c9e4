"""The model of a drive: terms per axis, the effects that they stand for, model files."""

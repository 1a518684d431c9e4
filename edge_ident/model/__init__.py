"""What is known about a drive: terms per axis, the effects they stand for, model files."""

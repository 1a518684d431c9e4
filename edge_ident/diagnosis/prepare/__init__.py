"""Preparation: recordings become filtered signals, valid samples and remarks on their quality."""

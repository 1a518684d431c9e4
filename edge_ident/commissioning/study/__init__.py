"""The identification motions of a run, until one explanation is left."""

"""The description of a drive, and the motions that it makes."""

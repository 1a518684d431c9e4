"""The description of a drive, and the motions that it is asked to make."""

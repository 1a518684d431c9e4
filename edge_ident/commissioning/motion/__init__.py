"""Motions on a board: made ready, moved, recorded, stopped."""

"""Candidate causes, and how they and what shakes from outside are fitted to a residual."""

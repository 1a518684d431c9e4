"""Established identification methods, compared on the same samples."""

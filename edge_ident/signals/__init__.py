"""Recordings and their files, and the way from measured samples to smooth signals."""

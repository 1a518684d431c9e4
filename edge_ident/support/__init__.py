"""Helpers that any package may use; they know nothing of drives."""

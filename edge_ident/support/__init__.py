"""Helpers that any room may use: interrupts, stopwatch, JSON text, atomic files."""

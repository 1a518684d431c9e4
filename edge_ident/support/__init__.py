"""What any room may use and what knows of none: interrupts, stopwatch, JSON, whole files."""

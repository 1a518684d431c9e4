"""Everything that runs at the edge: recordings, signals, identification, gains, commands."""

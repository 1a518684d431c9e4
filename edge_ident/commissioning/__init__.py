"""The whole job on a board: capture, run, verification, the life of gains, checks, profiling."""

"""The life of gains: forecast, written, tried on two motions, kept or rolled back."""

"""How long the whole way takes, from the last sample to gains read back."""

"""The position loop, and the gains that are designed for it from identified parameters."""

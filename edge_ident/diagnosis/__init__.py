"""What a model gets wrong about a machine, why, and how much better the model gets without it."""

"""Design of experiments: the motion that separates what a diagnosis cannot tell apart."""

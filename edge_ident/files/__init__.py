"""Tables of numbers from the files that other programs write; what they mean is decided above."""

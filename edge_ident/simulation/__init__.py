"""Forward simulation in closed loop: any model, many drives at once, recordings out."""

"""The estimators, least squares and network, with what they need and when to trust them."""

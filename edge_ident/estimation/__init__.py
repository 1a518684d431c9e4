"""The estimators, least squares and network, with their inputs and when to trust them."""

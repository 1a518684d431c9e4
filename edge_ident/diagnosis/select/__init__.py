"""Selection: which candidates enter the model, by the rule in `acceptance` and its `thresholds`."""

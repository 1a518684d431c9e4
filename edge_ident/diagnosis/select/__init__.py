"""Selection: which candidates become causes, by the rule in `acceptance` and its `thresholds`."""

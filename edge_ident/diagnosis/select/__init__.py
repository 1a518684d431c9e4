"""Selection: which candidates become causes. The rule and its thresholds: `acceptance`."""

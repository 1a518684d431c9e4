"""From a recording to the answer: the estimators side by side, and which of them is taken."""

"""Which candidates become causes, and which of them no motion could have shown."""

"""Results become something to read: documents, tables, figures."""

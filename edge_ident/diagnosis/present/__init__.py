"""What was found becomes something to read: wording, tables, figures, page, document."""

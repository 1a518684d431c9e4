"""Pages: a result as one HTML file that opens anywhere, and as Markdown for other documents."""

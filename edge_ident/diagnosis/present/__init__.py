"""Presentation: a diagnosis as sentences, tables, figures, a page and a JSON document."""

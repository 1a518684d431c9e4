"""Presentation: a diagnosis as sentences, tables, figures and a JSON document."""

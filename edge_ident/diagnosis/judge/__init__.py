"""Judgement: which terms of the selected model are supported causes, and how sure that is."""

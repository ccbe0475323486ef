"""Sixty idioms of a PySINDy 2.1 notebook by theme, written from its public documentation."""

"""Doors for users of other packages: `whirl.compat.pysindy` has the names and arguments of PySINDy 2.1."""

"""Sixty idioms of a PySINDy 2.1 notebook, written from its public documentation; `ps` is the package under that name.

Each is a function of ps whose assertions hold for PySINDy (folder idioms). As a program this counts those that run:

    python3 pysindy_idioms.py whirl.compat.pysindy
"""
import io
import warnings

from idioms import features, fitting, optimizers  # noqa: F401
from idioms.common import IDIOMS


def outcomes(ps):
    """{name: None, or the error} of every idiom."""
    found = {}
    for one in IDIOMS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                one(ps)
            found[one.__name__] = None
        except Exception as error:
            found[one.__name__] = error
    return found


if __name__ == "__main__":
    import contextlib
    import importlib
    import sys

    with contextlib.redirect_stdout(io.StringIO()):
        results = outcomes(importlib.import_module(sys.argv[1]))
    for name, error in results.items():
        if error is not None:
            print(f"{name}: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}")
    print(f"{sum(error is None for error in results.values())} of {len(results)} run")

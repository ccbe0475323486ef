"""Candidate terms: libraries that add and multiply."""
from itertools import combinations, combinations_with_replacement

import numpy as np

from . import _whirl
from ._base import BaseEstimator


class Library:
    """Candidate terms. `a + b`: the terms of both, each once; `a * b`: every product."""

    def terms(self, names):
        """The terms as text in the variables `names`; None where a term is a Python function."""
        raise NotImplementedError

    def names(self, names):
        """Feature names."""
        return self.terms(names)

    def evaluate(self, x, names):
        """Columns of all terms at the rows of x."""
        return _whirl._Terms(self.terms(names), list(names))(np.ascontiguousarray(x, dtype=float))

    def __add__(self, other):
        return _Sum(self, other)

    def __mul__(self, other):
        return _Product(self, other)


class PolynomialLibrary(Library, BaseEstimator):
    """All monomials up to `degree`; with `include_bias` the constant, with `include_interaction` mixed products."""

    def __init__(self, degree=2, include_bias=True, include_interaction=True):
        self.degree = degree
        self.include_bias = include_bias
        self.include_interaction = include_interaction

    def _powers(self, n):
        for degree in range(0 if self.include_bias else 1, self.degree + 1):
            for factors in combinations_with_replacement(range(n), degree):
                if self.include_interaction or len(set(factors)) <= 1:
                    yield factors

    def terms(self, names):
        def text(factors):
            parts = [f"{names[i]}^{factors.count(i)}" if factors.count(i) > 1 else names[i] for i in sorted(set(factors))]
            return "*".join(parts) or "1"

        return [text(f) for f in self._powers(len(names))]

    def names(self, names):
        return [t.replace("*", " ") for t in self.terms(names)]


class FourierLibrary(Library, BaseEstimator):
    """sin(k x) and cos(k x) of every variable for k = 1 to `n_frequencies`."""

    def __init__(self, n_frequencies=1):
        self.n_frequencies = n_frequencies

    def terms(self, names):
        return [f"{f}({k}*{v})" for k in range(1, self.n_frequencies + 1) for v in names for f in ("sin", "cos")]


class TermLibrary(Library, BaseEstimator):
    """Terms written out, in the names of the variables: TermLibrary(["x0", "x0^3", "abs(x1)*x1"])."""

    def __init__(self, terms_=()):
        self.terms_ = terms_

    def terms(self, names):
        return list(self.terms_)


class CustomLibrary(Library, BaseEstimator):
    """Python functions of one or more variables, applied to every combination of variables.

    `function_names`: functions from the variables' names to a feature name; by default f0(x), f1(x, y), ...
    """

    def __init__(self, library_functions=(), function_names=None):
        self.library_functions = library_functions
        self.function_names = function_names

    def _calls(self, n):
        for k, function in enumerate(self.library_functions):
            for variables in combinations(range(n), function.__code__.co_argcount):
                yield k, function, variables

    def terms(self, names):
        return None

    def names(self, names):
        namers = self.function_names or [lambda *v, k=k: f"f{k}({', '.join(v)})" for k in range(len(self.library_functions))]
        return [namers[k](*(names[i] for i in variables)) for k, _, variables in self._calls(len(names))]

    def evaluate(self, x, names):
        columns = [np.broadcast_to(f(*(x[:, i] for i in v)), x.shape[:1]) for _, f, v in self._calls(x.shape[1])]
        return np.column_stack(columns).astype(float) if columns else np.empty((len(x), 0))


class _Sum(Library):
    def __init__(self, *parts):
        self.parts = parts

    def _kept(self, names):
        seen, kept = set(), []
        for i, part in enumerate(self.parts):
            for j, name in enumerate(part.names(names)):
                if name not in seen:
                    seen.add(name)
                    kept.append((i, j))
        return kept

    def terms(self, names):
        lists = [part.terms(names) for part in self.parts]
        return None if any(t is None for t in lists) else [lists[i][j] for i, j in self._kept(names)]

    def names(self, names):
        lists = [part.names(names) for part in self.parts]
        return [lists[i][j] for i, j in self._kept(names)]

    def evaluate(self, x, names):
        columns = [part.evaluate(x, names) for part in self.parts]
        return np.column_stack([columns[i][:, j] for i, j in self._kept(names)])


class _Product(Library):
    def __init__(self, a, b):
        self.a, self.b = a, b

    def terms(self, names):
        a, b = self.a.terms(names), self.b.terms(names)
        return None if a is None or b is None else [f"({p})*({q})" for p in a for q in b]

    def names(self, names):
        return [f"{p} {q}" for p in self.a.names(names) for q in self.b.names(names)]

    def evaluate(self, x, names):
        a, b = self.a.evaluate(x, names), self.b.evaluate(x, names)
        return (a[:, :, None] * b[:, None, :]).reshape(len(x), -1)

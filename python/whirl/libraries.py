"""Candidate terms: libraries that add and multiply."""
import inspect
from itertools import combinations, combinations_with_replacement

import numpy as np

from . import _whirl
from ._base import BaseEstimator, frame_names, not_fitted


class Library(BaseEstimator):
    """Candidate terms. `a + b`: the terms of both, each once; `a * b`: every product.

    `fit(x)`, `transform(x)`, `get_feature_names()` and `n_output_features_` as scikit-learn's transformers have them; x:
    samples x variables, or a list of such.
    """

    def terms(self, names):
        """The terms as text in the variables `names`; None where a term is a Python function."""
        raise NotImplementedError

    def names(self, names):
        """Feature names."""
        return [t.replace("*", " ") for t in self.terms(names)]

    def evaluate(self, x, names):
        """Columns of all terms at the rows of x."""
        terms = self.terms(names)
        if not terms:
            return np.empty((len(x), 0))
        return _whirl._Terms(terms, list(names))(np.ascontiguousarray(x, dtype=float))

    def fit(self, x, y=None):
        part = x[0] if isinstance(x, (list, tuple)) and np.ndim(x[0]) > 1 else x
        x = np.asarray(part, dtype=float)
        if x.ndim != 2:
            raise ValueError(f"x has shape {x.shape}: must be samples x variables")
        self.n_features_in_ = x.shape[1]
        self._columns = frame_names(part)
        self.n_output_features_ = len(self.names(self._variables()))
        return self

    def transform(self, x):
        if isinstance(x, (list, tuple)) and np.ndim(x[0]) > 1:
            return [self.transform(part) for part in x]
        names = self._variables()
        x = np.asarray(x, dtype=float)
        if x.ndim != 2 or x.shape[1] != len(names):
            raise ValueError(f"x has shape {x.shape}: must be samples x {len(names)} variables")
        return self.evaluate(x, names)

    def fit_transform(self, x, y=None):
        return self.fit(x).transform(x)

    def get_feature_names(self, input_features=None):
        return self.names(list(input_features) if input_features is not None else self._variables())

    def get_feature_names_out(self, input_features=None):
        return np.asarray(self.get_feature_names(input_features), dtype=object)

    @property
    def size(self):
        """Number of terms."""
        return len(self.names(self._variables()))

    def _variables(self):
        if not hasattr(self, "n_features_in_"):
            raise not_fitted(self)
        return self._columns or [f"x{i}" for i in range(self.n_features_in_)]

    def __add__(self, other):
        return ConcatLibrary([self, other])

    def __mul__(self, other):
        return TensoredLibrary([self, other])


class PolynomialLibrary(Library):
    """All monomials up to `degree`; `include_bias`: the constant; `include_interaction`: mixed products;
    `interaction_only`: no variable twice in a product."""

    def __init__(self, degree=2, include_interaction=True, interaction_only=False, include_bias=True, order="C"):
        self.degree = degree
        self.include_interaction = include_interaction
        self.interaction_only = interaction_only
        self.include_bias = include_bias
        self.order = order

    def _factors(self, n):
        if self.degree < 0 or int(self.degree) != self.degree:
            raise ValueError(f"degree = {self.degree}: must be a whole number from 0")
        if self.interaction_only and not self.include_interaction:
            raise ValueError("interaction_only needs include_interaction")
        for degree in range(0 if self.include_bias else 1, self.degree + 1):
            for factors in combinations_with_replacement(range(n), degree):
                if (self.include_interaction or len(set(factors)) <= 1) and not (self.interaction_only and len(set(factors)) < degree):
                    yield factors

    @property
    def powers_(self):
        """Exponents: terms x variables."""
        n = len(self._variables())
        return np.array([np.bincount(f, minlength=n) if f else np.zeros(n, int) for f in map(list, self._factors(n))])

    def terms(self, names):
        def text(factors):
            parts = [f"{names[i]}^{factors.count(i)}" if factors.count(i) > 1 else names[i] for i in sorted(set(factors))]
            return "*".join(parts) or "1"

        return [text(f) for f in self._factors(len(names))]


class IdentityLibrary(Library):
    """The variables themselves."""

    def terms(self, names):
        return list(names)


class FourierLibrary(Library):
    """sin(k x) and cos(k x) of every variable for k = 1 to `n_frequencies`."""

    def __init__(self, n_frequencies=1, include_sin=True, include_cos=True):
        self.n_frequencies = n_frequencies
        self.include_sin = include_sin
        self.include_cos = include_cos

    def terms(self, names):
        functions = [f for f, wanted in (("sin", self.include_sin), ("cos", self.include_cos)) if wanted]
        if not functions or self.n_frequencies < 1:
            raise ValueError("a Fourier library needs n_frequencies of at least 1, and sines or cosines")
        return [f"{f}({k}*{v})" for k in range(1, self.n_frequencies + 1) for v in names for f in functions]


class TermLibrary(Library):
    """Terms written out, in the names of the variables: TermLibrary(["x0", "x0^3", "abs(x1)*x1"])."""

    def __init__(self, terms_=()):
        self.terms_ = terms_

    def terms(self, names):
        return list(self.terms_)

    def names(self, names):
        return self.terms(names)


class CustomLibrary(Library):
    """Python functions of one or more variables, applied to every combination of variables.

    `function_names`: functions from the variables' names to a feature name; by default f0(x), f1(x,y), ...
    `interaction_only`: no variable twice in a function; `include_bias`: the constant too.
    """

    def __init__(self, library_functions=(), function_names=None, interaction_only=True, include_bias=False):
        self.library_functions = library_functions
        self.function_names = function_names
        self.interaction_only = interaction_only
        self.include_bias = include_bias

    def _calls(self, n):
        if self.function_names is not None and len(self.function_names) != len(self.library_functions):
            raise ValueError(f"{len(self.function_names)} function_names for {len(self.library_functions)} library_functions: "
                             "must be as many")
        choose = combinations if self.interaction_only else combinations_with_replacement
        for k, function in enumerate(self.library_functions):
            for variables in choose(range(n), len(inspect.signature(function).parameters)):
                yield k, function, variables

    def terms(self, names):
        return None

    def names(self, names):
        namers = self.function_names or [lambda *v, k=k: f"f{k}({','.join(v)})" for k in range(len(self.library_functions))]
        calls = [namers[k](*(names[i] for i in variables)) for k, _, variables in self._calls(len(names))]
        return ["1"] * self.include_bias + calls

    def evaluate(self, x, names):
        columns = [np.ones(len(x))] if self.include_bias else []
        columns += [np.broadcast_to(f(*(x[:, i] for i in v)), x.shape[:1]) for _, f, v in self._calls(x.shape[1])]
        return np.column_stack(columns).astype(float) if columns else np.empty((len(x), 0))


class ConcatLibrary(Library):
    """The terms of all `libraries`, each once."""

    def __init__(self, libraries=()):
        self.libraries = libraries

    def _kept(self, names):
        seen, kept = set(), []
        for i, part in enumerate(self.libraries):
            for j, name in enumerate(part.names(names)):
                if name not in seen:
                    seen.add(name)
                    kept.append((i, j))
        return kept

    def terms(self, names):
        lists = [part.terms(names) for part in self.libraries]
        return None if any(t is None for t in lists) else [lists[i][j] for i, j in self._kept(names)]

    def names(self, names):
        lists = [part.names(names) for part in self.libraries]
        return [lists[i][j] for i, j in self._kept(names)]

    def evaluate(self, x, names):
        columns = [part.evaluate(x, names) for part in self.libraries]
        return np.column_stack([columns[i][:, j] for i, j in self._kept(names)])


class TensoredLibrary(Library):
    """Every product of one term of each of the `libraries`; `inputs_per_library`: indices of the variables that each sees."""

    def __init__(self, libraries=(), inputs_per_library=None):
        self.libraries = libraries
        self.inputs_per_library = inputs_per_library

    def _parts(self):
        if self.inputs_per_library is None:
            return list(self.libraries)
        return _on_inputs(self.libraries, self.inputs_per_library)

    def terms(self, names):
        lists = [part.terms(names) for part in self._parts()]
        if any(t is None for t in lists):
            return None
        out = [f"({t})" for t in lists[0]]
        for more in lists[1:]:
            out = [f"{a}*({b})" for a in out for b in more]
        return out

    def names(self, names):
        lists = [part.names(names) for part in self._parts()]
        out = lists[0]
        for more in lists[1:]:
            out = [f"{a} {b}" for a in out for b in more]
        return out

    def evaluate(self, x, names):
        columns = [part.evaluate(x, names) for part in self._parts()]
        out = columns[0]
        for more in columns[1:]:
            out = (out[:, :, None] * more[:, None, :]).reshape(len(x), -1)
        return out


class GeneralizedLibrary(Library):
    """The terms of all `libraries`, and the products of those that a row of `tensor_array` marks with 1.

    `inputs_per_library`: indices of the variables that each library sees; `exclude_libraries`: indices of those that
    appear in products only.
    """

    def __init__(self, libraries=(), tensor_array=None, inputs_per_library=None, exclude_libraries=()):
        self.libraries = libraries
        self.tensor_array = tensor_array
        self.inputs_per_library = inputs_per_library
        self.exclude_libraries = exclude_libraries

    def _whole(self):
        parts = list(self.libraries)
        if self.inputs_per_library is not None:
            parts = _on_inputs(parts, self.inputs_per_library)
        out = [part for i, part in enumerate(parts) if i not in set(self.exclude_libraries)]
        for row in [] if self.tensor_array is None else self.tensor_array:
            if len(row) != len(parts) or sum(1 for mark in row if mark) < 2:
                raise ValueError(f"tensor_array has the row {list(row)}: must mark two or more of {len(parts)} libraries with 1")
            out.append(TensoredLibrary([part for part, mark in zip(parts, row) if mark]))
        return ConcatLibrary(out)

    def terms(self, names):
        return self._whole().terms(names)

    def names(self, names):
        return self._whole().names(names)

    def evaluate(self, x, names):
        return self._whole().evaluate(x, names)


class _OnInputs(Library):
    """A library that sees some of the variables."""

    def __init__(self, library, inputs):
        self.library = library
        self.inputs = inputs

    def _some(self, names):
        if not all(0 <= i < len(names) for i in self.inputs):
            raise ValueError(f"inputs_per_library has {list(self.inputs)}: must be indices from 0 to {len(names) - 1}")
        return [names[i] for i in self.inputs]

    def terms(self, names):
        return self.library.terms(self._some(names))

    def names(self, names):
        return self.library.names(self._some(names))

    def evaluate(self, x, names):
        return self.library.evaluate(x[:, list(self.inputs)], self._some(names))


def _on_inputs(libraries, inputs):
    if len(inputs) != len(libraries):
        raise ValueError(f"inputs_per_library has {len(inputs)} entries for {len(libraries)} libraries: must be as many")
    return [_OnInputs(library, sorted(set(np.ravel(some).astype(int).tolist()))) for library, some in zip(libraries, inputs)]

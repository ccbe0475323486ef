"""Names of PySINDy 2.1 that are not here: what to use instead."""

INSTEAD = {
    "ConstrainedSR3": "whirl.identify(record, 'sindy', states=..., bounds=[...]) takes linear bounds of coefficients",
    "StableLinearSR3": "whirl.identify(record, 'sindy', states=..., least_decay=...) bounds the decay of the linear part",
    "TrappingSR3": "whirl.identify(record, 'sindy', states=..., trapping=True) finds bounded quadratic models",
    "MIOSR": "whirl.SparseRegression('best_subset', max_terms=...) is exact for each equation",
    "SBR": "whirl.SINDy() gives intervals of the coefficients in model_",
    "BINDy": "whirl.SINDy() chooses terms by evidence and gives intervals in model_",
    "SINDyPI": "whirl.identify(record, 'sindy', states=..., denominators=[...]) finds rational right-hand sides",
    "SINDyPILibrary": "whirl.identify(record, 'sindy', states=..., denominators=[...]) finds rational right-hand sides",
    "PDELibrary": "whirl identifies ordinary differential equations; partial ones are not supported",
    "WeakPDELibrary": "whirl.SINDy() uses the weak form for ordinary differential equations; partial ones are not supported",
    "AxesArray": "arrays are samples x states here; other layouts are not supported",
    "deeptime": "the interface to deeptime is not supported",
    "EvidenceGreedy": "whirl.SINDy() chooses terms by evidence",
}


def missing(module):
    """`__getattr__` of a module: an AttributeError that names what to use instead."""

    def attribute(name):
        if name in INSTEAD:
            raise AttributeError(f"{module} has no {name}: {INSTEAD[name]}")
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    return attribute

"""What scikit-learn asks of an estimator, with or without scikit-learn."""

try:  # scikit-learn is optional: with it the estimator can be cloned, searched over and put into pipelines
    from sklearn.base import BaseEstimator
except ImportError:  # pragma: no cover

    class BaseEstimator:
        """The two methods that scikit-learn asks of an estimator."""

        def get_params(self, deep=True):
            import inspect

            return {name: getattr(self, name) for name in inspect.signature(type(self).__init__).parameters if name != "self"}

        def set_params(self, **params):
            for name, value in params.items():
                setattr(self, name, value)
            return self

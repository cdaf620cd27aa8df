"""Force state maps as regressors of scikit-learn, for its pipelines, searches and cross-validation.

They take what `RKPM.fit` and `Kriging.fit` take, and give what the
maps give; the map itself is `map_`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..surrogates import RKPM, AbstractForceStateMap, Kriging

try:
    from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError as error:
    raise ImportError("scikit-learn is needed for regressors: pip install jfsm[sklearn]") from error


class _MapRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """What both regressors do alike."""

    map_: AbstractForceStateMap

    def _readings(self, X: Any, y: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        states, force = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, ensure_min_samples=2
        )
        return np.asarray(states), np.asarray(force, np.float64)

    def _asked(self, X: Any) -> NDArray[np.float64]:
        """States to predict at, once there is a map to ask."""
        check_is_fitted(self, "map_")
        return np.asarray(validate_data(self, X, dtype=np.float64, reset=False))


class RKPMRegressor(_MapRegressor):
    """`jfsm.RKPM` as a regressor; parameters as of `RKPM.fit`.

    Attributes
    ----------
    map_ : RKPM
        The map, once it is fitted.
    """

    def __init__(
        self,
        order: int = 3,
        neighbours: int | None = None,
        window: Any = None,
        dilation: Any = 1.0,
        across: Sequence[Any] = (),
        robust: bool = False,
    ):
        self.order = order
        self.neighbours = neighbours
        self.window = window
        self.dilation = dilation
        self.across = across
        self.robust = robust

    def fit(self, X: ArrayLike, y: ArrayLike) -> "RKPMRegressor":
        """Learn the map from states (n, dim) and forces (n,) or (n, outputs).

        Raises
        ------
        ValueError
            As `RKPM.fit`; and while ``jax_enable_x64`` is off, with the line to run.
        """
        self.map_ = RKPM.fit(*self._readings(X, y), **self.get_params(deep=False))
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Forces at states (q, dim)."""
        states = self._asked(X)
        return np.asarray(self.map_.evaluate(states))


class KrigingRegressor(_MapRegressor):
    """`jfsm.Kriging` as a regressor; parameters as of `Kriging.fit`.

    Attributes
    ----------
    map_ : Kriging
        The map, once it is fitted.
    """

    map_: Kriging

    def __init__(
        self,
        correlation: Any = None,
        trend: Any = "quadratic",
        nugget: Any = "estimate",
        *,
        length_scale: Any = None,
        noise_variance: Any = None,
        state_std: Any = None,
        restricted: bool = False,
        outputs: str = "separate",
        zero_at_rest: bool = False,
        points: int = 2000,
    ):
        self.correlation = correlation
        self.trend = trend
        self.nugget = nugget
        self.length_scale = length_scale
        self.noise_variance = noise_variance
        self.state_std = state_std
        self.restricted = restricted
        self.outputs = outputs
        self.zero_at_rest = zero_at_rest
        self.points = points

    def fit(self, X: ArrayLike, y: ArrayLike) -> "KrigingRegressor":
        """Learn the map from states (n, dim) and forces (n,) or (n, outputs).

        Raises
        ------
        ValueError
            As `Kriging.fit`; and while ``jax_enable_x64`` is off, with the line to run.
        """
        self.map_ = Kriging.fit(*self._readings(X, y), **self.get_params(deep=False))
        return self

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Forces at states (q, dim); with `return_std` their standard errors, too."""
        states = self._asked(X)
        force = np.asarray(self.map_.evaluate(states))
        return (force, np.asarray(self.map_.evaluate_std(states))) if return_std else force

"""Maps as regressors of scikit-learn: what they give, and that its tools work with them."""

import importlib
import pickle
import sys
from typing import Any

import jax
import numpy as np
import pytest

import jfsm

pytest.importorskip("sklearn")

from sklearn.base import clone  # noqa: E402
from sklearn.exceptions import NotFittedError  # noqa: E402
from sklearn.model_selection import GridSearchCV, cross_val_score  # noqa: E402
from sklearn.pipeline import make_pipeline  # noqa: E402
from sklearn.preprocessing import StandardScaler  # noqa: E402
from sklearn.utils.estimator_checks import check_estimator  # noqa: E402

from jfsm.adapters.sklearn import KrigingRegressor, RKPMRegressor  # noqa: E402

RNG = np.random.default_rng(5)
X = RNG.uniform(-1, 1, (60, 2))
Y = 3 * X[:, 0] + 2 * X[:, 0] ** 3 + 0.4 * X[:, 1] + 0.01 * RNG.standard_normal(60)
EITHER = [RKPMRegressor(order=3, neighbours=30), KrigingRegressor(trend="linear")]

EXPECTED = {
    "check_array_api_input": "states become arrays of NumPy, whatever they were",
}
"""Checks of scikit-learn that do not hold, each with its reason."""


def test_predictions_are_those_of_the_maps():
    rkpm, kriging = RKPMRegressor(order=2, neighbours=20).fit(X, Y), KrigingRegressor(trend="linear").fit(X, Y)
    np.testing.assert_array_equal(rkpm.predict(X[:7]), jfsm.RKPM.fit(X, Y, order=2, neighbours=20).evaluate(X[:7]))
    own = jfsm.Kriging.fit(X, Y, trend="linear")
    force, std = kriging.predict(X[:7], return_std=True)
    np.testing.assert_array_equal(force, own.evaluate(X[:7]))
    np.testing.assert_array_equal(std, own.evaluate_std(X[:7]))
    assert isinstance(kriging.map_, jfsm.Kriging)


def test_forces_of_several_outputs_keep_their_columns():
    fitted = RKPMRegressor(order=1).fit(X, np.stack([Y, -Y], axis=1))
    assert fitted.predict(X[:5]).shape == (5, 2)


def test_they_work_in_a_pipeline_a_search_and_a_cross_validation():
    scores = cross_val_score(make_pipeline(StandardScaler(), RKPMRegressor(order=3)), X, Y, cv=3)
    assert np.all(scores > 0.99)
    search = GridSearchCV(RKPMRegressor(), {"order": [1, 3]}, cv=3).fit(X, Y)
    assert search.best_params_ == {"order": 3}


@pytest.mark.parametrize("regressor", EITHER, ids=lambda one: type(one).__name__)
def test_they_are_cloned_and_kept(regressor: Any):
    again: Any = clone(regressor)
    assert again.get_params() == regressor.get_params() and not hasattr(again, "map_")
    with pytest.raises(NotFittedError):
        again.predict(X)
    fitted = again.fit(X, Y)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(fitted)).predict(X[:3]), fitted.predict(X[:3]))


def test_doubles_are_refused_while_they_would_be_narrowed():
    regressor = RKPMRegressor(order=1)
    with (
        jax.enable_x64(False),
        pytest.raises(ValueError, match=r'narrowed to float32; run `jax\.config\.update\("jax_e'),
    ):
        regressor.fit(X, Y)


def test_without_scikit_learn_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.base", None)
    monkeypatch.delitem(sys.modules, "jfsm.adapters.sklearn")
    with pytest.raises(ImportError, match=r"scikit-learn is needed for regressors: pip install jfsm\[sklearn\]"):
        importlib.import_module("jfsm.adapters.sklearn")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.parametrize(
    "regressor", [RKPMRegressor(order=1), KrigingRegressor(trend="constant")], ids=lambda one: type(one).__name__
)
def test_the_checks_of_scikit_learn_pass(regressor):
    """With few parameters, as some checks have ten columns and eleven rows."""
    found = check_estimator(regressor, on_fail=None, on_skip=None)
    failed = {each["check_name"]: each["exception"] for each in found if each["status"] != "passed"}
    assert set(failed) <= set(EXPECTED), failed
    assert len(found) > 40

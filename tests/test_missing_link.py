"""A linear spring or dashpot that a model does not have at all, also between masses that it does not tie."""

import jax
import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

import jfsm

MASS = np.array([2.0, 1.5])
SPRINGS, DASHPOTS = [900.0, 700.0], [0.9, 0.7]


def chain(between: list[float], ground: float) -> np.ndarray:
    """A matrix (2, 2) of springs or dashpots: two along the chain, one from its end to the ground."""
    first, second = between
    return np.array([[first + second, -second], [-second, second + ground]])


def record(spring: float, dashpot: float, springs: list[float] = SPRINGS) -> jfsm.Record:
    """Readings of the chain pushed at its end by a force that is straight between samples."""
    rng, dt, n = np.random.default_rng(4), 0.01, 900
    inverse = np.diag(1.0 / MASS)
    k, c = chain(springs, spring), chain(DASHPOTS, dashpot)
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ k, -inverse @ c]])
    b = np.vstack([np.zeros((2, 1)), inverse[:, 1:]])
    rows = np.vstack([a[2:], np.eye(4)[:2]]), np.vstack([inverse[:, 1:], np.zeros((2, 1))])
    system = cont2discrete((a, b, *rows), dt, method="foh")
    force = 4.0 * np.convolve(rng.standard_normal(n), np.hanning(9), "same")
    y = dlsim(system, force)[1]
    y = y + 0.005 * y.std(0) * rng.standard_normal(y.shape)
    return jfsm.Record(
        np.arange(n) * dt, force={2: force}, acceleration={1: y[:, 0], 2: y[:, 1]}, displacement={2: y[:, 3]},
        at_rest=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("spring", "dashpot", "cause", "name"),
    [pytest.param(150.0, 0.0, "missing_stiffness", "k", marks=pytest.mark.slow), (0.0, 12.0, "missing_damping", "c")],
)
def test_a_link_that_the_model_lacks_is_named_where_it_is(spring: float, dashpot: float, cause: str, name: str):
    model = jfsm.Structure.chain(MASS, SPRINGS, DASHPOTS)
    causes = ("missing_stiffness", "missing_damping", "cubic_hardening", "accel_gain")
    d = jfsm.diagnose(record(spring, dashpot), model, causes=causes, max_causes=1, key=jax.random.key(0))
    (finding,) = d.findings
    assert (finding.cause, finding.at) == (cause, (0, 2)) and finding.probability > 0.9
    assert finding.parameters[name].value == pytest.approx(spring + dashpot, rel=0.05)
    assert finding.kind == "a link that the model lacks"


def test_a_link_is_missing_where_no_spring_of_the_model_is():
    model = jfsm.Structure.chain(np.ones(4), np.ones(4), np.ones(4))
    assert model.untied(jfsm.LinearStiffness) == [(0, 2), (0, 3), (0, 4), (1, 3), (2, 4)]
    undamped = jfsm.Structure([1.0], [jfsm.LinearStiffness(1.0, at=(0, 1))])
    assert undamped.untied(jfsm.LinearDamping) == [(0, 1)]
    assert not jfsm.Structure.sdof(1.0, 1.0, 1.0).untied(jfsm.LinearDamping)


@pytest.mark.parametrize(("spring", "missing"), [(150.0, True), (0.0, False)])
def test_a_fit_says_where_springs_are_missing(spring: float, missing: bool):
    found = jfsm.fit(jfsm.Structure.chain(MASS, SPRINGS, DASHPOTS), record(spring, 0.0))
    assert bool(found.missing) is missing
    if missing:
        assert "at 0-2" in found.missing


def test_a_fit_with_every_link_misses_none():
    found = jfsm.fit(jfsm.Structure.chain(MASS, SPRINGS, DASHPOTS) + jfsm.LinearStiffness(150.0, at=(0, 2)),
                     record(150.0, 0.0))  # fmt: skip
    assert found.missing == ""


def test_a_model_without_any_spring_is_fitted_too():
    dashpots = [jfsm.LinearDamping(c, at=at) for c, at in zip(DASHPOTS, [(0, 1), (1, 2)], strict=True)]
    found = jfsm.fit(jfsm.Structure(MASS, dashpots), record(0.0, 0.0, [0.0, 0.0]))
    assert found.values["damping@1-2.c"] == pytest.approx(DASHPOTS[1], rel=0.1) and not found.missing

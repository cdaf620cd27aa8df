"""Slopes along one run beside those of whole runs."""

import jax
import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.identification import Posterior, approach, finish, prepare

jax.config.update("jax_enable_x64", True)

MODEL = jfsm.Structure.chain(mass=[1.0, 1.2, 0.8], stiffness=[206.0, 155.0, 103.0], damping=[0.6, 0.5, 0.35])
CUBIC = jfsm.CubicStiffness(100.0, at=(1, 2))


def _record(n: int = 1200) -> jfsm.Record:
    rng = np.random.default_rng(5)
    time = np.arange(n) * 0.02
    rates, phases = rng.uniform(0.5, 25.0, 20), rng.uniform(0.0, 6.28, 20)
    force = 3.0 * np.cos(np.outer(time, rates) + phases).sum(1)
    true = jfsm.Structure.chain(mass=[1.0, 1.2, 0.8], stiffness=[200.0, 150.0, 100.0], damping=[0.5, 0.4, 0.3])
    given = jfsm.Record(time, force={2: force}, displacement={1: np.zeros(n)}, at_rest=True)
    run = jfsm.simulate(true + jfsm.CubicStiffness(400.0, at=(1, 2)), given)

    def read(values: np.ndarray) -> np.ndarray:
        return values + 0.01 * values.std() * rng.standard_normal(n)

    x, a = np.asarray(run.displacement), np.asarray(run.acceleration)
    return jfsm.Record(
        time, force={2: read(force)}, displacement={1: read(x[:, 0])},
        acceleration={j + 1: read(a[:, j]) for j in range(3)}, at_rest=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    start = MODEL + CUBIC
    nuisances = prepare(_record(), MODEL).resolving([start])
    return Problem(MODEL, [nuisances], [nuisances.samples]).posterior([start])


@pytest.fixture(scope="module")
def top(posterior: Posterior) -> np.ndarray:
    return finish(posterior, approach(posterior)).theta


def _curvature(posterior: Posterior) -> np.ndarray:
    return np.diag([1 / u.width**2 for u in posterior.hypothesis.unknowns[0]])


def _step(posterior: Posterior, theta: np.ndarray, slack: float, exact: bool):
    _, (gradient,), (information,) = posterior.evaluate(theta, slack, exact=exact)
    return gradient, information, -np.linalg.solve(information, gradient)


@pytest.mark.parametrize("slack", [0.1, 0.01, 0.0])
def test_the_value_is_that_of_the_run(posterior: Posterior, slack: float):
    theta = posterior.initial()
    assert posterior.has_tangents
    assert posterior.evaluate(theta, slack, exact=False)[0] == pytest.approx(posterior.values(theta, slack), rel=1e-9)


@pytest.mark.parametrize("slack", [0.03, 0.0])
def test_a_step_gains_nearly_what_one_by_whole_runs_does(posterior: Posterior, top: np.ndarray, slack: float):
    theta = top + 0.02 * np.random.default_rng(1).standard_normal(top.shape)
    gradient, information, best = _step(posterior, theta, slack, exact=True)
    step = _step(posterior, theta, slack, exact=False)[2]

    def gain(step: np.ndarray) -> float:
        return float(-gradient @ step - 0.5 * step @ information @ step)

    assert gain(step) > 0.9 * gain(best) > 0


def test_what_moves_no_gain_and_the_noise_of_channels_have_the_slopes_of_whole_runs(posterior: Posterior, top):
    """Offsets move the readings alone; along a motion that is nearly linear noise changes the gains alone."""
    [(_, exact)] = posterior._slopes(top, 0, np.arange(1))
    [(_, along)] = posterior._slopes(top, 0, np.arange(1), exact=False)
    names = [u.path for u in posterior.hypothesis.unknowns[0]]
    moved = [k for k, name in enumerate(names) if name.startswith(("offset@acceleration", "offset@displacement"))]
    noisy = [k for k, name in enumerate(names) if name.startswith("noise@")]
    assert len(moved) >= 3 and len(noisy) == 4
    for k in moved:
        np.testing.assert_allclose(along.by_error[k], exact.by_error[k], atol=0.02 * float(np.std(exact.by_error[k])))
    for k in noisy:
        scale = np.std(exact.by_spread[k])
        assert np.std(along.by_spread[k] - exact.by_spread[k]) < 0.05 * scale
        assert np.std(along.by_error[k] - exact.by_error[k]) < 0.3 * np.std(exact.by_error[k])


def test_a_climb_along_runs_ends_at_the_top_of_whole_runs(posterior: Posterior, top: np.ndarray):
    (value,), (gradient,), (information,) = posterior.evaluate(top)
    assert 0.5 * gradient @ np.linalg.solve(information, gradient) < 0.05
    truth = posterior.structure(top[0]).values()["cubic_stiffness@1-2.k3"]
    assert truth == pytest.approx(400.0, rel=0.05)
    assert np.isfinite(value)


def test_plants_that_jump_or_remember_have_none():
    record = _record(400)
    for law in (jfsm.Coulomb(1.0, at=(1, 2)), jfsm.Maxwell(10.0, 1.0, at=(1, 2))):
        nuisances = prepare(record, MODEL).resolving([MODEL + law])
        assert not Problem(MODEL, [nuisances], [400]).posterior([MODEL + law]).has_tangents

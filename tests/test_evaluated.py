"""Simulations whose accelerations can be asked for in any state, by a program that JAX cannot trace."""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.identification import prepare
from jfsm.plant import Size, substeps_for
from tests.test_simulation import (
    DOUBLE,
    GRAVITY,
    LOWER,
    NUMBERS,
    STEP,
    UPPER,
    pushes,
    recorded,
    scipy_double,
)

TIME = STEP * np.arange(400)
RECORD = jfsm.Record(TIME, force=0.3 * pushes(TIME, 2), at_rest=True)


def double_pendulums(q, v, force, t, p):
    """Many of the double pendulums that `DOUBLE` is one of; nothing that JAX could trace."""
    assert all(type(part) is np.ndarray for part in (q, v, force, t))
    (_, l1), (_, l2) = UPPER, LOWER
    c, s, w = np.cos(q[:, 0] - q[:, 1]), np.sin(q[:, 0] - q[:, 1]), p["c2"] * (v[:, 1] - v[:, 0])
    across, total = p["m2"] * l1 * l2, p["m1"] + p["m2"]
    mass = np.empty((len(q), 2, 2))
    mass[:, 0, 0], mass[:, 1, 1], mass[:, 0, 1] = total * l1**2, p["m2"] * l2**2, across * c
    mass[:, 1, 0] = mass[:, 0, 1]
    upper = across * s * v[:, 1] ** 2 + total * GRAVITY * l1 * np.sin(q[:, 0]) + p["c1"] * v[:, 0] - w
    lower = -across * s * v[:, 0] ** 2 + p["m2"] * GRAVITY * l2 * np.sin(q[:, 1]) + w
    return np.linalg.solve(mass, (force - np.stack([upper, lower], 1))[..., None])[..., 0]


ASKED = jfsm.Simulation.from_accelerations(double_pendulums, 2, NUMBERS)


def noisy(model: jfsm.Simulation = DOUBLE) -> jfsm.Record:
    """Swings of up to a radian, with one per cent of noise."""
    time, rng = STEP / 2 * np.arange(600), np.random.default_rng(3)
    drive = 0.1 * pushes(time, 2)
    run = jfsm.simulate(model, jfsm.Record(time, force=drive, at_rest=True))
    x, v = (q + 0.01 * q.std(0) * rng.standard_normal(q.shape) for q in (run.displacement, run.velocity))
    return jfsm.Record(time, force=drive, displacement=x, velocity=v, at_rest=True)


@pytest.mark.parametrize(
    "term", [None, jfsm.Coulomb(0.1, at=(1, 2)), jfsm.Maxwell(1.0, 0.2, at=(0, 1))], ids=["alone", "sticks", "memory"]
)
def test_it_moves_as_the_traced_function_does(term):
    soon = RECORD[:200]  # later on it turns over, and one run parts from the next
    asked, traced = (
        jfsm.simulate(model if term is None else model + term, soon, solver="grid") for model in (ASKED, DOUBLE)
    )
    assert np.max(np.abs(traced.displacement)) > 0.5  # far from where it is linear
    np.testing.assert_allclose(asked.displacement, traced.displacement, atol=5e-5)
    np.testing.assert_allclose(asked.acceleration, traced.acceleration, atol=5e-3)


def test_a_motion_that_runs_away_ends_where_it_does():
    def away(q, v, force, t, p):
        return force + 4.0 * q + 50.0 * q**3

    run = jfsm.simulate(
        jfsm.Simulation.from_accelerations(away, 1), jfsm.Record(TIME, force=np.ones(TIME.size), at_rest=True)
    )
    assert "left every bound" in run.result.value and run.escape_time is not None and 0 < run.escape_time < TIME[-1]


def test_derivatives_are_those_of_the_traced_function():
    state = jnp.array([0.3, -0.4]), jnp.array([1.0, 0.5]), jnp.array([0.2, -0.1]), jnp.zeros(())
    both: list[Any] = [(model.own, model.own_numbers) for model in (ASKED, DOUBLE)]
    asked, traced = (jax.jacfwd(own, (0, 1, 2, 3))(numbers, *state) for own, numbers in both)
    for mine, other in zip(asked, traced, strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-6, atol=1e-8)
    answers = [jax.jacfwd(own.answer, 1)(numbers, *state[:2], state[3]) for own, numbers in both]
    np.testing.assert_allclose(*answers, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("term", [None, jfsm.Coulomb(0.02, at=(1, 2))], ids=["alone", "coulomb"])
def test_a_table_near_the_measured_motion_gives_the_likelihood_of_the_function(term):
    record = noisy(DOUBLE if term is None else DOUBLE + term)
    near = prepare(record, DOUBLE)
    assert near.course is not None
    values = []
    for model, nuisances in ((DOUBLE, replace(near, course=None)), (DOUBLE, near), (ASKED, prepare(record, ASKED))):
        problem = Problem(model, [nuisances], [len(record)])
        posterior = problem.posterior([model if term is None else model + term], refit=False)
        values.append(float(posterior.evaluate(posterior.initial())[0][0]))
    exact, traced, asked = values
    assert traced == pytest.approx(exact, abs=0.3)
    assert asked == pytest.approx(traced, abs=0.01)
    wrong = Problem(DOUBLE.with_values({"m2": 0.603}), [near], [len(record)])
    posterior = wrong.posterior([wrong.model if term is None else wrong.model + term], refit=False)
    assert float(posterior.evaluate(posterior.initial())[0][0]) > exact + 3.0  # what a table must not blur


def test_its_numbers_are_found():
    wrong = ASKED.with_values({name: 1.1 * value for name, value in NUMBERS.items()})
    found = jfsm.fit(wrong, noisy())
    for name, truth in NUMBERS.items():
        low, high = found.intervals[name]
        assert low - (high - low) < truth < high + (high - low) and high - low < 0.3 * truth


def asked(change):
    def accelerations(q, v, force, t, p):
        return change(force - 2.0 * q, force)

    return lambda: jfsm.Simulation.from_accelerations(accelerations, 2)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: jfsm.Simulation.from_accelerations(3.0, 1), TypeError, "`accelerations` must be a function"),  # pyright: ignore
        (asked(lambda a, f: a[0]), ValueError, r"for two states shape \(2, 2\); it gives shape \(2,\)"),
        (asked(lambda a, f: a * np.nan), ValueError, "`accelerations` must be finite"),
        (asked(lambda a, f: a + f**3), ValueError, "`accelerations` must be additive in `force`"),
        (asked(lambda a, f: a - 2 * f), ValueError, "symmetric positive definite"),
        (asked(lambda a, f: a + np.random.default_rng().normal()), ValueError, "whenever it is asked the same"),
    ],
)
def test_what_is_promised_of_it_is_tried(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_record_must_show_every_coordinate():
    record = noisy()
    velocity, first = record.velocity, {1: record.responses["displacement", 1]}
    blind = jfsm.Record(record.time, force=record.force, displacement=first, velocity=velocity)
    with pytest.raises(ValueError, match="`record` must show the displacement of every coordinate"):
        jfsm.fit(ASKED, blind)
    with pytest.raises(ValueError, match="`initial_state`"):
        jfsm.simulate(ASKED, blind)


@pytest.mark.slow
def test_friction_is_named_in_the_joint_where_it_is():
    time = 0.01 * np.arange(1500)
    y = scipy_double(lambda d, w: 0.15 * np.tanh(w / 0.01), time)
    wrong = ASKED.with_values({"m1": 1.01, "m2": 0.594, "c1": 0.025, "c2": 0.012})
    d = jfsm.diagnose(
        recorded(DOUBLE, y, 0.3 * pushes(time, 2), time),
        wrong,
        places=[(0, 1), (1, 2)],
        causes=["coulomb", "cubic_hardening", "quadratic_damping"],
        key=jax.random.key(0),
    )
    [found] = d.findings
    assert (found.cause, found.at) == ("coulomb", (1, 2)) and found.probability > 0.9
    assert found.parameters["F"].value == pytest.approx(0.15, rel=0.1)


def test_it_needs_the_steps_of_the_traced_function_beside_a_map():
    states = np.random.default_rng(0).standard_normal((300, 2)) * [0.5, 4.0]
    force_map = jfsm.RKPM.fit(states, states[:, 0] ** 3 + states[:, 1], order=2, neighbours=40)
    beside = [model + force_map.on(at=(0, 1)) for model in (DOUBLE, ASKED)]
    traced, asked = (substeps_for(model, 4 * STEP, Size(0.5, 4.0)) for model in beside)
    assert asked == traced > 1

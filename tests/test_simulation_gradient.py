"""Derivatives of a run by the numbers of the structure, the force and the start, against finite differences."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.structures import ForceGain, MapTerm, Offset

TIME = 0.1 * np.arange(300)
FORCE = np.sin(0.9 * TIME) + 0.5 * np.sin(1.7 * TIME + 1.0)
RECORD = jfsm.Record(TIME, FORCE, at_rest=True)
LINK = (0, 1)
OSCILLATOR = jfsm.Structure.sdof(1.0, 2.0, 0.1)


class Cube(eqx.Module):
    size: Any

    def __call__(self, state):
        return self.size * state[0] ** 3


def power(model: jfsm.Structure, **options):
    """Sum of squares of a run's displacement."""
    return jnp.sum(jnp.asarray(jfsm.simulate(model, RECORD, solver="grid", **options).displacement) ** 2)


BY = {
    "mass": (lambda m: power(jfsm.Structure.sdof(m, 2.0, 0.1)), 1.3),
    "stiffness": (lambda k: power(jfsm.Structure.sdof(1.0, k, 0.1)), 2.0),
    "damping": (lambda c: power(jfsm.Structure.sdof(1.0, 2.0, c)), 0.1),
    "mass matrix": (
        lambda m: power(jfsm.Structure(m * np.array([[1.0, 0.2], [0.2, 2.0]]), TWO.terms)),
        1.1,
    ),
    "smooth law": (lambda k: power(OSCILLATOR + jfsm.CubicStiffness(k, at=LINK)), 0.5),
    "kink": (lambda gap: power(OSCILLATOR + jfsm.EndStop(3.0, gap, at=LINK)), 0.5),
    "friction": (lambda limit: power(OSCILLATOR + jfsm.Coulomb(limit, at=LINK)), 0.2),
    "hidden state": (lambda slip: power(OSCILLATOR + jfsm.Jenkins(0.5, slip, at=LINK)), 0.3),
    "delay": (lambda tau: power(OSCILLATOR + jfsm.DelayedForce(0.1, tau, at=LINK)), 0.7),
    "map": (lambda k: power(OSCILLATOR + MapTerm(Cube(k), at=LINK)), 0.5),
    "force sensor": (lambda gain: power(OSCILLATOR + ForceGain(gain, at=("force", 1))), 0.1),
    "offset": (lambda shift: power(OSCILLATOR + Offset(shift, at=("displacement", 1))), 0.1),
    "start": (lambda x0: power(OSCILLATOR, initial_state=(x0, 0.2)), 0.1),
    "force": (lambda size: power(OSCILLATOR, force=size * jnp.asarray(FORCE)), 1.1),
}
TWO = jfsm.Structure.chain(mass=[1.0, 2.0], stiffness=[2.0, 3.0], damping=[0.1, 0.1])


@pytest.mark.parametrize("name", BY)
def test_the_gradient_of_a_run_is_that_of_finite_differences(name):
    function, value = BY[name]
    step = 1e-5 * value
    expected = (float(function(value + step)) - float(function(value - step))) / (2 * step)
    assert abs(expected) > 1.0, "the number must matter for the test to mean anything"
    # Instants of friction are found by iteration, and a step that one of them leaves costs the differences digits.
    np.testing.assert_allclose(jax.grad(function)(value), expected, rtol=1e-4 if name in ("friction", "kink") else 1e-6)


def test_the_gradient_by_every_sample_of_the_force_is_that_of_finite_differences():
    found = jax.grad(lambda force: power(OSCILLATOR, force=force))(jnp.asarray(FORCE))
    for sample in (0, 1, 150, 298):
        push = 1e-3 * (np.arange(TIME.size) == sample)
        expected = (power(OSCILLATOR, force=FORCE + push) - power(OSCILLATOR, force=FORCE - push)) / 2e-3
        np.testing.assert_allclose(found[sample], expected, rtol=1e-6)


@pytest.mark.parametrize("method", ["linear", "hold"])
def test_the_force_between_samples_may_be_linear_or_held(method):
    def by_size(size):
        return power(OSCILLATOR, force=size * jnp.asarray(FORCE), reconstruction=method)

    np.testing.assert_allclose(jax.grad(by_size)(1.0), 2.0 * power(OSCILLATOR, reconstruction=method), rtol=1e-10)


def test_forward_and_backward_derivatives_agree_and_the_run_is_the_one_without():
    by_stiffness, k = BY["stiffness"]
    value, slope = jax.jvp(by_stiffness, (k,), (1.0,))
    np.testing.assert_allclose(slope, jax.grad(by_stiffness)(k), rtol=1e-10)
    np.testing.assert_allclose(jax.jacfwd(by_stiffness)(k), slope, rtol=1e-10)
    np.testing.assert_allclose(value, by_stiffness(k), rtol=1e-12)


def test_a_gradient_goes_through_the_default_call_with_its_error_beside_it():
    seen = []

    def of(stiffness):
        run = jfsm.simulate(jfsm.Structure.sdof(1.0, stiffness, 0.1), RECORD)
        seen.append(run)
        return jnp.sum(run.displacement**2)

    np.testing.assert_allclose(jax.grad(of)(2.0), jax.grad(BY["stiffness"][0])(2.0), rtol=1e-12)
    (run,) = seen
    assert run.solver == "grid" and isinstance(run.error, np.ndarray) and 0 < run.error[0] < 1e-3


def test_what_hides_the_numbers_is_refused_with_the_reason():
    with pytest.raises(TypeError, match=r"must be known numbers, which `jax.jit` and `jax.vmap` hide.*Call outside"):
        jax.jit(BY["stiffness"][0])(2.0)


def test_a_start_that_would_be_fitted_is_refused_where_derivatives_are_asked_for():
    record = jfsm.Record(TIME, FORCE, displacement=np.sin(TIME))

    def of(stiffness):
        return jnp.sum(jfsm.simulate(jfsm.Structure.sdof(1.0, stiffness), record).displacement)

    with pytest.raises(ValueError, match=r"`initial_state` must be given where derivatives .* `at_rest=True`; it was"):
        jax.grad(of)(2.0)


def test_a_map_whose_numbers_are_traced_is_refused():
    states = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))

    def of(size):
        force_map = jfsm.RKPM.fit(states, size * jnp.asarray(states[:, 0] ** 3))
        return power(OSCILLATOR + force_map.on(LINK))

    with pytest.raises(TypeError, match="`model` must hold maps of known numbers"):
        jax.grad(of)(1.0)

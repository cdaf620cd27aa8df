"""A channel whose zero wanders, on data that SciPy made."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_diagnose import DAMPING, FEW, MASS, STEP, STIFFNESS, duffing, linear, made

import jfsm

RIGHT = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)


def wandered(record: jfsm.Record, channel: str, share: float) -> jfsm.Record:
    """The record with a channel that goes off by this share of its size, and comes half of the way back."""
    kinds: dict[str, Any] = {kind: samples.copy() for (kind, _), samples in record.channels.items()}
    way = np.sin(0.8 * np.pi * np.linspace(0.0, 1.0, len(record)))
    kinds[channel] += share * kinds[channel].std() * way
    return jfsm.Record(record.time, **kinds, at_rest=True)


@pytest.mark.parametrize("channel", ["displacement", pytest.param("acceleration", marks=pytest.mark.slow)])
def test_a_spring_is_named_beside_a_zero_that_wanders(channel):
    d = jfsm.diagnose(wandered(made(duffing), channel, 0.3), RIGHT, causes=FEW, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening"] and d.findings[0].probability > 0.9
    assert any(f"zero of {channel} 1 wanders" in note for note in d.notes)
    assert d.gain is not None and d.gain.closed > 0.9


def test_a_zero_that_wanders_is_no_cause_by_itself():
    d = jfsm.diagnose(wandered(made(linear), "displacement", 0.3), RIGHT, causes=FEW, key=jax.random.key(0))
    assert d.verdict == "consistent" and any("zero of displacement 1 wanders" in note for note in d.notes)


def test_what_a_law_makes_slow_is_not_taken_for_a_zero():
    def one_sided(x, v):
        return linear(x, v) + 1.5 * x**2

    d = jfsm.diagnose(made(one_sided), RIGHT, causes=FEW, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["quadratic_stiffness"] and not any("wanders" in note for note in d.notes)


@pytest.mark.slow
def test_a_rest_that_moves_with_the_amplitude_is_not_left_to_a_zero():
    """A sweep through the resonance of a softening spring under a load: its mean goes off and comes back."""
    time = np.arange(2000) * STEP

    def force(t):
        return 2.0 * np.sin((1.5 + 0.015 * t) * t)

    def slope(t, y):
        return [y[1], (force(t) - linear(*y) + 4.0 * y[0] ** 3 - 6.0) / MASS]

    rest = np.roots([-4.0, 0.0, STIFFNESS, 6.0]).real
    begin = [rest[np.argmin(np.abs(rest))], 0.0]
    x = solve_ivp(slope, (0.0, time[-1]), begin, t_eval=time, rtol=1e-10, atol=1e-12).y[0]
    rng = np.random.default_rng(0)
    g, x = (y + 0.001 * y.std() * rng.standard_normal(time.size) for y in (force(time), x))
    d = jfsm.diagnose(jfsm.Record(time, g, x), RIGHT, causes=["preload", "cubic_softening"], key=jax.random.key(0))
    assert {f.cause for f in d.findings} == {"preload", "cubic_softening"}
    assert not any("wanders" in note for note in d.notes)
    assert d.gain is not None and d.gain.closed > 0.9


@pytest.mark.slow
def test_of_few_periods_what_a_law_makes_is_not_taken_for_a_zero():
    record = made(duffing, samples=200, channels=("displacement",))
    d = jfsm.diagnose(record, RIGHT, causes=FEW, key=jax.random.key(0))
    assert not any("wanders" in note for note in d.notes)
    assert [f.cause for f in d.findings] == ["cubic_hardening"]


@pytest.mark.slow
def test_a_creep_of_three_noise_levels_in_a_decay_is_no_cause():
    t = np.arange(2700) * 0.001
    x = 0.02 * np.exp(-3.0 * t) * np.cos(np.sqrt(3000.0 - 9.0) * t) + 3.5e-6 * t
    record = jfsm.Record(t, displacement=x + 3e-6 * np.random.default_rng(14).standard_normal(t.size))
    causes = ("parametric_stiffness", "quadratic_stiffness", "bilinear_damping")
    d = jfsm.diagnose(record, jfsm.Structure.sdof(1.0, 3000.0, 6.0), causes=causes, key=jax.random.key(0))
    assert d.verdict == "consistent" and any("zero of displacement 1 wanders" in note for note in d.notes)

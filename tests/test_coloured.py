"""Channels whose noise has a memory, on data that SciPy made."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.signal import lfilter
from test_diagnose import DAMPING, FEW, MASS, STIFFNESS, duffing, linear, made

import jfsm
from jfsm.diagnosis.channels.coloured_noise import _unforeseen

RIGHT = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
MEMORY, LEVEL = 0.9, 0.02


def remembering(record: jfsm.Record) -> jfsm.Record:
    """The record with noise that remembers ten samples on its channels, in shares of their size."""
    rng, kinds = np.random.default_rng(5), dict[str, Any]()
    for (kind, _), y in record.channels.items():
        noise = lfilter([1.0], [1.0, -MEMORY], rng.standard_normal(y.size + 200))[200:] * np.sqrt(1 - MEMORY**2)
        kinds[kind] = y + LEVEL * y.std() * noise
    return jfsm.Record(record.time, **kinds, at_rest=True)


def said(d: jfsm.Diagnosis) -> list[str]:
    return [note for note in d.notes if "remembers" in note]


@pytest.mark.parametrize(
    "channels", [("displacement",), pytest.param(("displacement", "acceleration"), marks=pytest.mark.slow)]
)
def test_a_spring_is_named_amid_noise_with_a_memory(channels):
    record = remembering(made(duffing, samples=2000, channels=channels))
    d = jfsm.diagnose(record, RIGHT, causes=FEW, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening"] and d.findings[0].probability > 0.9
    memories = [float(note.split("remembers ")[1].split()[0]) for note in said(d)]
    assert len(memories) == len(channels) and all(7 < memory < 14 for memory in memories)
    assert d.gain is not None and d.gain.closed > 0.9


@pytest.mark.slow
def test_noise_with_a_memory_is_no_cause_by_itself():
    d = jfsm.diagnose(remembering(made(linear, samples=2000)), RIGHT, causes=FEW, key=jax.random.key(0))
    assert d.verdict == "consistent" and said(d)


def test_a_force_that_no_law_makes_is_not_taken_for_noise():
    """Without the cause among those that are looked for, what it leaves is as slow as the motion."""
    d = jfsm.diagnose(made(duffing, samples=2000), RIGHT, causes=["coulomb"], key=jax.random.key(0))
    assert not said(d) and d.verdict != "consistent"


def test_what_is_foretold_of_noise_with_a_memory_is_its_memory_and_of_a_motion_too_little():
    def correlated(y: np.ndarray) -> float:
        return sum(float(y[k:] @ y[:-k] / (y @ y)) ** 2 for k in range(1, 21))

    rng = np.random.default_rng(5)
    sensor = lfilter([1.0], [1.0, -0.9], rng.standard_normal(4000)) + 0.5 * rng.standard_normal(4000)
    motion = np.sin(np.multiply.outer(np.arange(4000), [0.9, 0.4, 0.2])).sum(1) + 0.3 * rng.standard_normal(4000)
    assert correlated(sensor) > 1.0 and correlated(_unforeseen(sensor, 3)) < 0.03
    assert correlated(_unforeseen(motion, 3)) > 0.5
    assert np.all(_unforeseen(np.zeros(100), 3) == 0)

"""Channels whose noise has a memory, on data that SciPy made."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.signal import lfilter
from test_diagnose import DAMPING, FEW, MASS, STIFFNESS, duffing, linear, made

import jfsm

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


@pytest.mark.parametrize("channels", [("displacement",), ("displacement", "acceleration")])
def test_a_spring_is_named_amid_noise_with_a_memory(channels):
    record = remembering(made(duffing, samples=2000, channels=channels))
    d = jfsm.diagnose(record, RIGHT, causes=FEW, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening"] and d.findings[0].probability > 0.9
    memories = [float(note.split("remembers ")[1].split()[0]) for note in said(d)]
    assert len(memories) == len(channels) and all(7 < memory < 14 for memory in memories)
    assert d.gain is not None and d.gain.closed > 0.9


def test_noise_with_a_memory_is_no_cause_by_itself():
    d = jfsm.diagnose(remembering(made(linear, samples=2000)), RIGHT, causes=FEW, key=jax.random.key(0))
    assert d.verdict == "consistent" and said(d)


def test_a_force_that_no_law_makes_is_not_taken_for_noise():
    """Without the cause among those that are looked for, what it leaves is as slow as the motion."""
    d = jfsm.diagnose(made(duffing, samples=2000), RIGHT, causes=["coulomb"], key=jax.random.key(0))
    assert not said(d) and d.verdict != "consistent"

"""A channel that is late by less than a sample, on data that SciPy made."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from test_diagnose import DAMPING, MASS, STEP, STIFFNESS, duffing, linear, made

import jfsm
from jfsm.diagnosis.channels.delays import showing_late

RIGHT = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
CHANNELS = ("displacement", "acceleration")
TRIED = ("cubic_hardening", "quadratic_damping", "force_delay", "channel_delay")


def late(restoring, channel: str, samples: float) -> jfsm.Record:
    """A noisy record, a channel of which shows what was so many samples before."""
    clean, noisy = (made(restoring, noise=noise, channels=CHANNELS) for noise in (0.0, 0.005))
    kinds: dict[str, Any] = {kind: y.copy() for (kind, _), y in noisy.channels.items()}
    y = clean.channels[channel, 1]
    kinds[channel] += CubicSpline(clean.time, y)(np.maximum(clean.time - samples * STEP, 0.0)) - y
    return jfsm.Record(noisy.time, **kinds, at_rest=True)


@pytest.mark.parametrize("channel", [pytest.param(CHANNELS[0], marks=pytest.mark.slow), CHANNELS[1]])
def test_a_channel_that_is_slightly_late_is_no_cause(channel):
    d = jfsm.diagnose(late(linear, channel, 0.5), RIGHT, causes=TRIED, key=jax.random.key(0))
    assert d.verdict == "consistent" and not d.findings
    assert any(f"{channel} 1 seems late by 0.5" in note for note in d.notes)


def test_a_spring_is_named_beside_a_channel_that_is_slightly_late():
    record = late(duffing, "displacement", 0.5)
    d = jfsm.diagnose(record, RIGHT, causes=TRIED, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening"] and d.findings[0].probability > 0.9
    assert d.gain is not None and d.gain.closed > 0.9
    (sensor,) = [s for s in d.extended.sensors if isinstance(s, jfsm.ChannelDelay)]
    assert sensor.at == ("displacement", 1) and float(sensor.tau) == pytest.approx(0.5 * STEP, rel=0.1)


def test_what_is_late_is_shown_by_sensors():
    shown = showing_late(RIGHT, {("force", 1): 0.01, ("velocity", 1): -0.02})
    assert shown.values() == RIGHT.values() | {"force_delay@force-1.tau": 0.01, "channel_delay@velocity-1.tau": -0.02}

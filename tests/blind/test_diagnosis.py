"""Effects that a generator of its own hid, found by the diagnosis; and silence where nothing is hidden.

A sample on fixed seeds; `benchmarks/blind.py` runs any number on any seed.
"""

from typing import Any

import jax
import pytest

import jfsm

from . import draw, draw_chain

LAWS = ("cubic_hardening", "cubic_softening", "quadratic_stiffness", "quadratic_damping", "coulomb")
GAINS = ("force_gain", "accel_gain")
VALUES = ("stiffness_value", "damping_value", "mass_value")

QUICK = [(14, "none")]
SLOW = [(11, "cubic_softening"), (12, "coulomb"), (13, "quadratic_damping")]
SLOW += [(20 + i, cause) for i, cause in enumerate((*LAWS, *GAINS, *VALUES, "none"))]


def diagnosed(seed: int, cause: str):
    challenge = draw(seed, causes=cause, noise=0.01, channels="xva")
    channels: dict[str, Any] = dict(challenge.channels)
    record = jfsm.Record(challenge.time, at_rest=challenge.at_rest, **channels)
    believed = challenge.model
    model = jfsm.Structure.sdof(believed.mass, believed.stiffness, believed.damping)
    return challenge, jfsm.diagnose(record, model, holdout=0.3, key=jax.random.key(seed))


@pytest.mark.parametrize(
    ("seed", "cause"), [*QUICK, *(pytest.param(seed, cause, marks=pytest.mark.slow) for seed, cause in SLOW)]
)
def test_what_was_hidden_is_said_and_nothing_else(seed, cause):
    challenge, d = diagnosed(seed, cause)
    if cause == "none":
        assert d.verdict in ("consistent", "undecided")
        assert d.findings == ()
        laws = {"coulomb", "quadratic_damping", "bouc_wen", "maxwell", "delayed_force", "end_stop", "stiffness_drift"}
        assert laws | {"force_gain", "channel_delay"} <= set(d.detectable)
        return
    assert d.verdict == ("parameters" if cause in VALUES else "cause")
    found = d.findings[0]
    assert found.cause == cause
    assert tuple(found.at) == challenge.at
    for name, truth in challenge.parameters.items():
        estimate = found.parameters[name]
        assert estimate.low - (estimate.high - estimate.low) <= truth <= estimate.high + (estimate.high - estimate.low)
    assert d.gain is not None
    if d.gain.before > 1.5 * d.gain.floor:
        assert d.gain.closed > 0.9


@pytest.mark.slow
def test_a_late_force_is_found_at_its_link_where_the_other_mass_alone_is_seen():
    challenge = draw_chain(219104)
    assert (challenge.cause, challenge.at, challenge.driven) == ("delayed_force", (0, 1), 1)
    assert list(challenge.channels) == ["force", "displacement"] and list(challenge.channels["displacement"]) == [2]
    channels: dict[str, Any] = dict(challenge.channels)
    record = jfsm.Record(challenge.time, at_rest=challenge.at_rest, **channels)
    believed = challenge.model
    springs = [jfsm.LinearStiffness(k, at=at) for at, k in believed.stiffness.items()]
    dashpots = [jfsm.LinearDamping(c, at=at) for at, c in believed.damping.items()]
    model = jfsm.Structure(list(believed.mass), [*springs, *dashpots])
    d = jfsm.diagnose(record, model, holdout=0.3, key=jax.random.key(219104))
    assert [(found.cause, tuple(found.at)) for found in d.findings] == [("delayed_force", (0, 1))]

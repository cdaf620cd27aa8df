"""A clipped channel put back."""

import numpy as np
import pytest

import jfsm
from jfsm.records import declipped


def tones(n=2000):
    t = np.arange(n) * 0.05
    return np.cos(1.3 * t) + 0.6 * np.cos(2.9 * t + 1.0) + 0.4 * np.sin(4.1 * t)


@pytest.mark.parametrize("share", [0.6, 0.75, 0.9])
def test_the_lost_arcs_of_a_band_limited_signal_come_back(share):
    y = tones()
    limit = share * np.max(np.abs(y))
    clipped = np.clip(y, -limit, limit)
    found = declipped(clipped, limit)
    lost = np.abs(y) > limit
    np.testing.assert_array_equal(found[~lost], y[~lost])
    assert np.sqrt(np.mean((found - y)[lost] ** 2)) < 0.05 * np.sqrt(np.mean((clipped - y)[lost] ** 2))


def test_what_comes_back_lies_beyond_the_limit_whatever_the_noise():
    y = tones() + 0.02 * np.random.default_rng(0).standard_normal(2000)
    found = declipped(np.clip(y, -1.2, 1.2), 1.2)
    lost = np.abs(y) >= 1.2
    assert np.all(np.abs(found[lost]) >= 1.2)
    assert np.sqrt(np.mean((found - y)[lost] ** 2)) < 0.5 * np.sqrt(np.mean((np.clip(y, -1.2, 1.2) - y)[lost] ** 2))


def test_a_signal_that_never_reaches_the_limit_is_left_alone():
    np.testing.assert_array_equal(declipped(tones(), 5.0), tones())


def test_a_channel_that_is_mostly_clipped_is_refused():
    with pytest.raises(ValueError, match=r"`limit` must leave most of the channel's samples below it; \d+% are at 0.1"):
        declipped(np.clip(tones(), -0.1, 0.1), 0.1)


def test_a_clipped_force_drives_a_run_as_if_it_had_not_been():
    t = np.arange(2000) * 0.05
    force, model = tones(), jfsm.Structure.sdof(1.0, 9.0, 0.3)
    limit = 0.7 * float(np.max(np.abs(force)))
    record = jfsm.Record(t, np.clip(force, -limit, limit), at_rest=True)
    wanted = jfsm.simulate(model, jfsm.Record(t, force, at_rest=True)).displacement
    told = jfsm.simulate(model + jfsm.Clipping(limit, at=("force", 1)), record).displacement
    untold = jfsm.simulate(model, record).displacement
    assert np.std(told - wanted) < 0.05 * np.std(untold - wanted)

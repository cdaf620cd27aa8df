"""A record that repeats itself gives its noise and its distortion away."""

import json

import numpy as np
import pytest

from jfsm.records import Record
from jfsm.records._periods import average, period_of

LENGTH, COUNT, DT = 1000, 6, 0.002
NOISE = 0.002


def multisine(lines, seed=0, count=COUNT):
    """Random phases on these lines, rms 1."""
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    turning = np.cos(2 * np.pi * np.outer(np.arange(LENGTH), lines) / LENGTH + phase)
    return np.tile(turning.sum(1) / np.sqrt(len(lines) / 2), count)


ODD = np.array([line for line in range(1, 100, 2) if line % 10 != 7])
"""Odd lines of which every fifth is left out."""


def examined(force, response, noise=NOISE):
    rng = np.random.default_rng(5)
    noisy = response + noise * rng.standard_normal(force.size)
    found = average({"force 1": force + noise * rng.standard_normal(force.size)}, {"displacement 1": noisy}, DT)
    assert found is not None
    return found, found.channels[1]


def test_period_and_noise_are_found():
    force = multisine(ODD)
    found, response = examined(force, np.roll(force, 30))
    assert (found.samples, found.count, found.transient) == (LENGTH, COUNT, 0)
    np.testing.assert_array_equal(found.excited, ODD)
    assert response.noise == pytest.approx(NOISE, abs=4 * response.noise_error)
    assert response.noise_error == pytest.approx(NOISE / np.sqrt(2 * 5000), rel=0.02)
    assert response.mean[ODD - 1] == pytest.approx(1 / np.sqrt(ODD.size / 2), rel=0.02)
    assert np.median(response.noise_lines) == pytest.approx(NOISE * np.sqrt(4 / LENGTH / COUNT), rel=0.1)


@pytest.mark.parametrize(
    ("law", "even", "odd"),
    [(lambda y: y, False, False), (lambda y: y + 0.02 * y**2, True, False), (lambda y: y + 0.02 * y**3, False, True)],
)
def test_even_and_odd_distortion_are_told_apart_from_noise_and_from_one_another(law, even, odd):
    force = multisine(ODD)
    _, response = examined(force, law(np.roll(force, 30)))
    assert response.even is not None and response.odd is not None
    assert (response.even > 0, response.odd > 0) == (even, odd)


def test_the_size_of_distortion_is_that_of_its_lines():
    force = multisine(ODD)
    _, response = examined(force, force + 0.02 * force**2)
    lines = np.abs(np.fft.rfft(0.02 * force[:LENGTH] ** 2))[:100] * 2 / LENGTH
    excited = 1 / np.sqrt(ODD.size / 2)
    assert response.even == pytest.approx(np.sqrt(np.mean(lines[2:98:2] ** 2)) / excited, rel=0.05)


def test_what_the_excitation_puts_on_free_lines_is_no_distortion():
    force = multisine(ODD) + 0.02 * multisine(np.arange(2, 98, 2), seed=1)
    found, response = examined(force, 2.0 * force, noise=1e-4)
    np.testing.assert_array_equal(found.excited, ODD)
    assert response.even == 0.0


@pytest.mark.parametrize("lines", [np.arange(1, 100), np.setdiff1d(np.arange(1, 100), np.arange(5, 100, 7))])
def test_nothing_is_said_of_distortion_where_even_lines_are_excited(lines):
    force = multisine(lines)
    _, response = examined(force, force + 0.05 * force**3)
    assert (response.even, response.odd) == (None, None)


def test_periods_that_have_not_settled_are_left_out():
    force = multisine(ODD)
    decay = np.exp(-np.arange(force.size) / 150.0) * np.cos(np.arange(force.size) * 0.2)
    found, response = examined(force, force + decay)
    assert found.transient == 1
    assert response.noise == pytest.approx(NOISE, rel=0.05)


@pytest.mark.parametrize(
    "y",
    [
        np.random.default_rng(0).standard_normal(5000),
        np.cumsum(np.random.default_rng(1).standard_normal(5000)),
        multisine(ODD, count=1),
        np.exp(-np.arange(5000) * 0.002) * np.sin(np.arange(5000) * 0.3),
        np.sin(np.arange(5000) * 0.001),
        np.zeros(5000),
        np.ones(20),
    ],
)
def test_what_does_not_repeat_has_no_period(y):
    assert period_of(y) is None


def test_a_single_tone_is_not_averaged():
    tone = np.sin(2 * np.pi * np.arange(5000) / 100)
    assert period_of(tone) == 100
    assert average({"force 1": tone}, {}, DT) is None


def test_where_the_steady_part_begins_and_what_was_computed_are_said():
    force = multisine(ODD)
    decay = np.exp(-np.arange(force.size) / 150.0) * np.cos(np.arange(force.size) * 0.2)
    noise = NOISE * np.random.default_rng(3).standard_normal(force.size)
    found = Record(DT * np.arange(force.size), force=force, displacement=force + decay + noise).inspect().findings
    messages = [(finding.channel, finding.message) for finding in found]
    steady = "5 periods of 1000 samples (2 s) agree. Before t = 2 s the motion had not settled: leave that part out."
    assert ("record", f"Periodic: {steady}") in messages
    assert ("force 1", "The same in every period to the last digit: computed, not measured.") in messages


def test_the_page_tells_of_periods():
    force = multisine(ODD)
    record = Record(DT * np.arange(force.size), force=force, displacement=force + 0.02 * force**2)
    inspection = record.inspect()
    messages = [(finding.channel, finding.message) for finding in inspection.findings]
    assert ("record", "Periodic: 6 periods of 1000 samples (2 s) agree.") in messages
    assert any("Distortion by even" in words and "dB under" in words for _, words in messages)
    assert not any("Distortion by odd" in words for _, words in messages)
    plain = json.loads(json.dumps(inspection.to_dict()))
    assert plain["periods"]["count"] == 6
    assert len(plain["periods"]["channels"][1]["mean"]) == LENGTH // 2

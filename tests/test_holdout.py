"""What is fitted and what is held out."""

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.split import split

T = np.arange(2000) * 0.01
RNG = np.random.default_rng(3)


def released(rate: float, noise: float = 0.01) -> jfsm.Record:
    x = np.exp(-rate * T) * np.cos(12.0 * T) + 0.5
    return jfsm.Record(T, displacement=x + noise * RNG.standard_normal(T.size))


@pytest.mark.parametrize("rate", [0.5, 1.0])
def test_of_a_released_structure_the_last_part_of_its_motion_is_held_out_and_run_from_the_release(rate: float):
    record = released(rate)
    ((fitted, until),), (held,) = split(record, 0.3)
    dies = np.log(1.0 / 0.01) / rate  # the envelope sinks to the noise
    assert fitted is record and until == pytest.approx(0.7 * dies / 0.01, rel=0.25)
    assert held.begin == until and len(held.record) == pytest.approx(until / 0.7, abs=2)


def test_of_a_released_structure_that_never_stops_the_last_part_is_held_out():
    ((_, until),), (held,) = split(released(0.0), 0.3)
    assert (until, held.begin, len(held.record)) == (1400, 1400, 2000)


@pytest.mark.parametrize(("lead", "begins"), [(0, 1400), (500, 900), (5000, 0)])
def test_a_driven_structure_begins_anew_where_it_was_held_out_or_is_led_there(lead: int, begins: int):
    force = np.cos(3.0 * T)
    record = jfsm.Record(T, force, np.sin(3.0 * T) + 0.01 * RNG.standard_normal(T.size))
    ((_, until),), (held,) = split(record, 0.3)
    led, begin = held.led_by(lead)
    assert (until, begins + begin, len(led)) == (1400, 1400, 2000 - begins)
    assert led.time[0] == T[begins]


GOAL = 1.0 / (1.0 + np.exp(-(T - 8.0)))  # a machine that goes to its goal and is held there
BLOW = np.exp(-0.5 * ((T - 2.0) / 0.05) ** 2)
RINGS = np.where(T < 2.0, 0.0, np.exp(-0.4 * (T - 2.0)) * np.sin(12.0 * (T - 2.0)))


@pytest.mark.parametrize(
    ("force", "motion", "by_way"),
    [
        (np.cos(9.0 * T), (1.0 - GOAL) * np.sin(5.0 * T) + 3.0 * GOAL, True),
        (np.cos(9.0 * T), np.sin(5.0 * T), False),
        (np.cos(9.0 * T), GOAL * np.sin(5.0 * T), False),
        (BLOW, RINGS, False),
    ],
    ids=["held at its goal", "steady", "grows", "a blow, after which it rings out"],
)
def test_where_a_driven_machine_hardly_moves_at_the_end_the_last_part_of_its_way_is_held_out(force, motion, by_way):
    noise = 0.002 * RNG.standard_normal((2, T.size))
    record = jfsm.Record(T, force + noise[0], motion + noise[1])
    ((fitted, until),), (held,) = split(record, 0.3)
    assert held.begin == until and len(held.record) == len(record)
    assert any("of the motion only" in note for note in fitted.notes) == by_way
    if by_way:
        gone = np.cumsum(np.abs(np.diff(motion)))
        assert gone[until] / gone[-1] == pytest.approx(0.7, abs=0.08)
    else:
        assert until == 1400


def test_the_first_part_of_the_motion_is_held_out_and_rest_is_not_fitted():
    record = released(1.0)
    _, (last,) = split(record, 0.25)
    ((fitted, until),), (held,) = split(record, 0.25, first=True)
    moving = len(last.record)
    assert moving < 1500 and len(held.record) == round(0.25 * moving)
    assert until == moving - len(held.record) < len(fitted)


def test_rest_is_neither_fitted_nor_held_out_where_nothing_is_kept_back_or_another_record_is():
    record = released(1.0)
    _, (last,) = split(record, 0.25)
    ((_, until),), held = split(record, None)
    assert (until, held) == (len(last.record), [])
    _, (other,) = split(record, record)
    assert len(other.record) == len(last.record)


def test_the_first_part_held_out_is_not_seen():
    ((fitted, until),), (held,) = split(released(0.0), 0.25, first=True)
    assert (len(fitted), until, len(held.record), held.begin) == (1500, 1500, 500, 0)
    assert "shows in the last part only" in fitted.notes[-1]

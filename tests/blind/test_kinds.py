"""The chains of `benchmarks/kinds.py` move as their equations say."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.chains import Chain, Law, move, slide
from benchmarks.kinds import KINDS, LASTING, LET_GO, SHAKEN, drawn, one_of, right, table

from .drives import draw_noise

PAIR = Chain(np.array([1.0, 0.7]), np.array([90.0, 60.0]), np.array([0.2, 0.1]))
TIME = np.linspace(0.0, 12.0, 2401)
LAWS = {
    "cubic_hardening": {"k3": 30.0},
    "quintic_stiffness": {"k5": 20.0},
    "quadratic_damping": {"c2": 0.5},
    "coulomb": {"F": 6.0},
    "bouc_wen": {"k": 30.0, "beta": 1.2, "gamma": 0.8},
    "end_stop": {"k": 80.0, "gap": 0.3},
}


@pytest.mark.parametrize(("link", "cause"), [(i % 2, cause) for i, cause in enumerate(LAWS)])
def test_a_chain_gives_up_the_energy_that_its_damping_and_its_law_take(link: int, cause: str):
    law = Law(cause, link, LAWS[cause])
    m = move(PAIR, law, TIME, (np.array([0.8, -0.4]), np.zeros(2)))
    d, w = m.x @ PAIR.links.T, m.v @ PAIR.links.T
    energy = 0.5 * np.sum(PAIR.mass * m.v**2, 1) + 0.5 * np.sum(PAIR.stiffness * d**2, 1)
    power = np.sum(PAIR.damping * w**2, 1) + m.effect * w[:, link]
    taken = np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(TIME))
    # the trapezoidal rule errs by the square of a step, a hundredth of a period
    np.testing.assert_allclose(energy[0] - energy[1:], taken, atol=2e-3 * float(energy[0]))
    moving = m.a * PAIR.mass + m.x @ (PAIR.links.T * PAIR.stiffness @ PAIR.links)
    moving += m.v @ (PAIR.links.T * PAIR.damping @ PAIR.links) + m.effect[:, None] * PAIR.links[link]
    np.testing.assert_allclose(moving, 0.0, atol=1e-9)


def test_dry_friction_in_closed_form_is_that_of_the_integration():
    one = Chain(np.array([1.3]), np.array([150.0]), np.array([0.3]))
    drive = draw_noise(np.random.default_rng(1), one.modes[0], TIME[-1])
    exact = slide(one, 8.0, TIME, drive)
    found = move(one, Law("coulomb", 0, {"F": 8.0}), TIME, (np.zeros(1), np.zeros(1)), lambda t: drive(t))
    assert 0.01 < np.mean(exact.v == 0) < 0.9  # it is held now and then
    for ours, theirs in zip(exact, found, strict=True):  # its tolerance is 1e-9 a step
        np.testing.assert_allclose(ours, theirs, atol=1e-6 * float(np.std(theirs)))


def test_a_stop_that_is_touched_for_less_than_a_step_is_left_again():
    one, law = Chain(np.array([1.3]), np.array([150.0]), np.array([0.6])), Law("end_stop", 0, {"k": 120.0, "gap": 0.3})
    time = np.linspace(0.0, 100.0, 5001)
    shake = draw_noise(np.random.default_rng(3), one.modes[0], time[-1])
    shake = shake.scaled(0.35 * one.modes[0] ** 2 * 0.3 / float(np.std(shake(time))))
    still = np.zeros(1)
    found = move(one, law, time, (still, still), base=shake, size=0.3)
    assert 100 < np.sum(np.diff(np.sign(np.abs(found.x[:, 0]) - 0.3)) != 0)

    def rates(t, y):
        stop = 120.0 * (max(y[0] - 0.3, 0.0) + min(y[0] + 0.3, 0.0))
        return [y[1], -shake(t) - (150.0 * y[0] + 0.6 * y[1] + stop) / 1.3]

    plain = solve_ivp(rates, (0.0, 100.0), [0.0, 0.0], "LSODA", time, rtol=1e-9, atol=1e-10, max_step=0.005)
    np.testing.assert_allclose(found.x[:, 0], plain.y[0], atol=0.02)


@pytest.mark.parametrize("causes", [SHAKEN, LET_GO, LASTING])
def test_as_many_seeds_as_causes_have_each_of_them_once(causes: tuple[str, ...]):
    assert sorted(one_of(causes, seed) for seed in range(len(causes), 2 * len(causes))) == sorted(causes)


@pytest.mark.slow
def test_a_seed_is_the_same_case_at_every_call():
    one, again = (drawn("decay", 1) for _ in range(2))
    assert (one.cause, one.at, one.more) == (again.cause, again.at, again.more)
    np.testing.assert_array_equal(one.channels["acceleration"], again.channels["acceleration"])


def row(**more) -> dict:
    said = {"verdict": "cause", "findings": [{"cause": "coulomb", "at": [0, 1], "probability": 0.9, "rivals": []}]}
    spent = {"seconds": 1.0, "cpu_seconds": 1.0, "megabytes": 900.0, "error": None}
    return {"kind": "base", "seed": 0, "cause": "coulomb", "at": [0, 1], **said, **spent, **more}


def test_a_name_is_right_at_its_place_only():
    assert right(row()) and not right(row(at=[1, 2])) and not right(row(cause="stribeck"))


def test_where_nothing_is_hidden_wrong_values_are_right_and_a_cause_is_not():
    assert right(row(cause="none", verdict="parameters")) and right(row(cause="none", verdict="consistent"))
    assert not right(row(cause="none")) and not right(row(cause="none", verdict="undecided"))


def test_the_table_counts_each_kind_and_lists_what_is_not_right():
    text = table([row(), row(kind="decay", at=[1, 2])])
    assert "right                  1 of 1" in text and "right                  0 of 1" in text
    assert "WRONG decay" in text and "WRONG base" not in text


def test_every_kind_is_known_by_its_name():
    assert list(KINDS) == ["base", "decay", "double_well", "long", "component"]

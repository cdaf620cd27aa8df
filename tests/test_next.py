"""What to measure next: the advised test is done on the plant itself, and tells the rivals apart."""

from types import SimpleNamespace
from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import jfsm
from jfsm._result import Result
from jfsm.diagnosis.advice import next_test
from jfsm.diagnosis.advice.next_test import Leading, _made, _tried, same_force
from jfsm.diagnosis.advice.variation import Variation, planned_record
from jfsm.identification import prepare

MASS, STIFFNESS, DAMPING = 1.0, 40.0, 0.5
BELIEVED = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
RIVALS = ("cubic_softening", "sine_stiffness")


def measured(time: np.ndarray, force: np.ndarray, seed: int) -> jfsm.Record:
    """A pendulum's spring beside the believed one, driven from rest; displacement with 1 % noise."""
    drive, rng = CubicSpline(time, force), np.random.default_rng(seed)

    def motion(t, y):
        return [y[1], (drive(t) - 20.0 * y[0] - 20.0 * np.sin(y[0]) - DAMPING * y[1]) / MASS]

    x = solve_ivp(motion, (time[0], time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-11).y[0]
    force, x = (y + 0.01 * np.std(y) * rng.standard_normal(time.size) for y in (force, x))
    return jfsm.Record(time, force, x, at_rest=True)


@pytest.fixture(scope="module")
def undecided():
    """Swings too small for the difference between a sine and its first two terms."""
    time = np.arange(1200) * 0.05
    force = 1.2 * np.cos(5.9 * time) + 0.8 * np.sin(7.1 * time + 1.0)
    return jfsm.diagnose(measured(time, force, 1), BELIEVED, causes=RIVALS, key=jax.random.key(0))


@pytest.mark.slow
def test_a_larger_force_tells_a_sine_from_a_cubic_and_does_when_it_is_tried(undecided):
    assert undecided.leading is not None
    first = {t.name: undecided.leading.rivals.index(t) for t in undecided.leading.rivals}
    assert set(first) == set(RIVALS)
    said = []
    found = undecided.next_tests(progress=lambda *step: said.append(step))
    assert [p.nats for p in found] == sorted((p.nats for p in found), reverse=True)
    assert said[0][1:] == (0, len(said)) and len(found) <= len(said)
    best = found[0]
    assert best.nats > 10.0 and best.reach > 1.5 and "times the size" in best.what
    assert best.record.force is not None
    record = measured(best.record.time, best.record.force[:, 0], 2)
    again = jfsm.diagnose(record, BELIEVED, causes=RIVALS, key=jax.random.key(1))
    assert again.findings[0].cause == "sine_stiffness" and again.findings[0].probability > 0.95


def test_the_same_key_proposes_the_same(undecided):
    leading = undecided.leading
    one, again = (Leading(leading.model, leading.rivals, leading.nuisances, 600) for _ in range(2))
    key = jax.random.key(5)
    assert _tried(one, Variation(level=2.0), "", key)[0].nats == _tried(again, Variation(level=2.0), "", key)[0].nats


def test_noise_comes_with_its_opposite(undecided):
    leading = undecided.leading
    made = _made(leading, Variation(level=2.0), leading.rivals[0], np.random.default_rng(0))
    clean, one, other = (np.column_stack(list(record.channels.values())) for record in made)
    np.testing.assert_allclose((one + other) / 2, clean, rtol=1e-9, atol=1e-9)
    assert np.all(np.std(one - clean, 0) > 0)


def test_a_test_in_which_a_rival_might_run_away_is_none(undecided):
    leading = undecided.leading
    softening = next(t for t in leading.rivals if t.name == "cubic_softening")

    def follows(level: float) -> bool:
        plan = planned_record(leading.nuisances.record[: leading.samples], Variation(level=level))
        return jfsm.simulate(softening.extended(), plan, solver="grid").result == Result.successful

    level = 1.0
    while follows(1.1 * level):
        level *= 1.1
    assert level > 2.0
    rng = np.random.default_rng(0)
    assert not _made(leading, Variation(level=level), softening, rng)
    assert _made(leading, Variation(level=level / 1.8), softening, rng)


@pytest.mark.slow
def test_where_no_test_tells_much_the_best_is_proposed_longer_and_tells_more(undecided, monkeypatch):
    monkeypatch.setattr(next_test, "variations", lambda nuisances: [Variation(speed=0.7), Variation(level=1.5)])
    found = undecided.next_tests(key=jax.random.key(3))
    lengths = [len(p.record) for p in found]
    assert len(found) == 4 and max(lengths) == lengths[0] == 16 * min(lengths)
    assert found[0].nats > found[1].nats and found[0].what.endswith(", there and back until it is 16 times as long")
    force = found[0].record.force
    assert force is not None
    np.testing.assert_array_equal(force, np.concatenate([half := force[: len(force) // 2], half]))
    np.testing.assert_array_equal(half, half[::-1])


def test_what_nothing_competes_with_needs_no_other_test(undecided):
    leading = undecided.leading
    shares = {id(t): share for t, share in zip(leading.rivals, (0.99, 0.01), strict=True)}
    args = (leading.model, leading.rivals, lambda t: shares[id(t)], leading.nuisances, leading.samples)
    assert Leading.of(*args) is None
    assert Leading.of(args[0], leading.rivals[:1], *args[2:]) is None


def explained_by(law, damping: float, cause: str, mass: float = MASS) -> Any:
    own = [jfsm.LinearStiffness(STIFFNESS, at=(0, 1)), jfsm.LinearDamping(damping, at=(0, 1))]
    structure = jfsm.Structure([mass], own) + law
    return SimpleNamespace(structure=structure, laws=(law,), effects=(cause,))


def test_a_law_that_is_another_for_its_numbers_is_no_rival_that_a_test_could_tell_from_it():
    cubic = explained_by(jfsm.CubicDamping(0.3, at=(0, 1)), DAMPING, "cubic_damping")
    power = explained_by(jfsm.PowerDamping(0.3, 3.002, at=(0, 1)), DAMPING, "power_damping")
    other = explained_by(jfsm.PowerDamping(0.3, 2.6, at=(0, 1)), DAMPING, "power_damping")
    record = jfsm.Record(np.arange(400) * 0.05, np.cos(np.arange(400)), np.sin(0.3 * np.arange(400)))
    nuisances = prepare(record, BELIEVED)
    assert same_force(cubic, power, nuisances) and not same_force(cubic, other, nuisances)
    shares = {id(cubic): 0.5, id(power): 0.3, id(other): 0.1}
    leading = Leading.of(BELIEVED, [other, power, cubic], lambda t: shares[id(t)], nuisances, 300)
    assert leading is not None and leading.rivals == (cubic, other)
    assert Leading.of(BELIEVED, [power, cubic], lambda t: shares[id(t)], nuisances, 300) is None


@pytest.mark.parametrize(("exponent", "alike"), [(3.002, True), (2.6, False)])
def test_laws_of_a_device_without_a_mass_are_compared_as_forces(exponent: float, alike: bool):
    cubic = explained_by(jfsm.CubicDamping(0.3, at=(0, 1)), DAMPING, "cubic_damping", mass=0.0)
    power = explained_by(jfsm.PowerDamping(0.3, exponent, at=(0, 1)), DAMPING, "power_damping", mass=0.0)
    record = jfsm.Record(np.arange(400) * 0.05, np.cos(np.arange(400)), np.sin(0.3 * np.arange(400)))
    assert same_force(cubic, power, prepare(record, BELIEVED)) is alike


def test_damping_that_turns_positive_is_damping_that_grows_beside_less_of_its_own():
    eps, x0 = 0.2, 0.5
    turning = explained_by(jfsm.VanDerPol(eps, x0, at=(0, 1)), DAMPING + eps, "van_der_pol")
    growing = explained_by(jfsm.PositionDamping(eps / x0**2, at=(0, 1)), DAMPING, "position_damping")
    record = jfsm.Record(np.arange(400) * 0.05, np.cos(np.arange(400)), np.sin(0.3 * np.arange(400)))
    assert same_force(turning, growing, prepare(record, BELIEVED))


@pytest.mark.parametrize(
    ("drive", "what"),
    [
        (Variation(level=2.0), "the same force at 2 times the size"),
        (Variation(speed=1.4), "the same force played 1.4 times as fast"),
        (Variation(shift=0.5), "the same force with a constant force of +1 N added"),
        (Variation(kind="velocity"), "the same test with the velocity measured as well"),
        (
            Variation(level=2.0, length=3),
            "the same force at 2 times the size, there and back until it is 3 times as long",
        ),
    ],
)
def test_a_test_is_put_in_words(drive: Variation, what: str):
    record = jfsm.Record(np.arange(4) * 0.1, np.array([2.0, -2.0, 2.0, -2.0]), np.zeros(4))
    assert drive.words(record) == what

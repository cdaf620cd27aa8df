"""Challenges with two hidden effects: which pairs there are, and that what is drawn is what was promised."""

import dataclasses
import functools

import numpy as np
import pytest

from . import PAIRS, Challenge, draw_two
from . import two as two_module
from .arrays import FloatArray, rms
from .challenge import LEAST_LEFT, can_tell
from .drives import Silence
from .exact import integrate
from .laws import LAWS, Both, NoLaw, Scene
from .plants import EscapeError, Motion, Plant, UnfairError
from .sensors import SENSORS
from .test_laws import truth_of
from .two import LARGEST_OVERLAP, SHARES, Pair, family, overlap

DRAWN: dict[Pair, tuple[str, str]] = {  # pair -> excitation, channels
    ("coulomb", "cubic_hardening"): ("noise", "x"),
    ("bilinear_damping", "jenkins"): ("sweep", "a"),
    ("quadratic_damping", "stiffness_drift"): ("multisine", "xva"),
    ("bilinear_stiffness", "force_gain"): ("sweep", "xva"),
    ("coulomb", "accel_bias"): ("free_decay", "xva"),
    ("cubic_damping", "accel_gain"): ("multisine", "xva"),
    ("coulomb", "force_delay"): ("sweep", "x"),
}
WITH_SENSOR = [pair for pair in DRAWN if pair[1] in SENSORS]


@functools.cache
def drawn(pair: Pair) -> Challenge:
    excitation, channels = DRAWN[pair]
    return draw_two(1, noise=0.01, excitation=excitation, channels=channels, pairs=(pair,))


def forces(challenge: Challenge) -> list[FloatArray]:
    """The force of each law [N], (n,) each, from the formulas; friction is what the other leaves."""
    motion, p = challenge.motion, {challenge.cause: challenge.parameters}
    if challenge.beside:
        p[challenge.beside.cause] = challenge.beside.parameters
    x, v = motion.x, motion.v
    formulas = {
        "cubic_hardening": lambda k3: k3 * x**3,
        "jenkins": lambda k, slip: k * motion.hidden[0],
        "stiffness_drift": lambda rate, t_ref: rate * motion.time * x,
        "bilinear_damping": lambda dc, side: dc * side * np.maximum(side * v, 0.0),
        "quadratic_damping": lambda c2: c2 * v * np.abs(v),
        "bilinear_stiffness": lambda k, knot, side: k * side * np.maximum(side * (x - knot), 0.0),
    }
    known = {cause: formulas[cause](**p[cause]) for cause in challenge.causes if cause in formulas}
    others = np.sum(list(known.values()), axis=0) if known else 0.0
    return [known.get(cause, motion.effect - others) for cause in challenge.causes if cause in LAWS]


# which pairs there are


def test_a_pair_is_a_law_and_another_law_or_a_sensor_of_another_family():
    assert len(PAIRS) == len({frozenset(pair) for pair in PAIRS}) > 500
    for first, second in PAIRS:
        assert first in LAWS and second in {**LAWS, **SENSORS}
        assert family(first) != family(second)
        assert not (second in LAWS and LAWS[second].dry)
        assert not {first, second} & {"clipping", "double_well", "none", "stiffness_value"}
    causes = {cause for pair in PAIRS for cause in pair}
    assert causes == {*LAWS, *SENSORS} - {"clipping", "double_well"}
    assert {family(cause) for cause in causes} == {"stiffness", "damping", "memory", "time", "input", "sensor"}


def test_a_late_channel_is_beside_no_law_that_begins_with_the_record():
    late = {first for first, second in PAIRS if second in ("force_delay", "channel_delay")}
    assert "coulomb" in late and not late & {"jenkins", "maxwell", "delayed_force", "preload"}
    assert ("jenkins", "force_gain") in PAIRS


# what is drawn


@pytest.mark.parametrize("pair", DRAWN)
def test_each_law_is_of_the_promised_size_and_neither_is_a_copy_of_the_other(pair: Pair):
    challenge = drawn(pair)
    plant, motion = challenge.truth, challenge.motion
    assert challenge.causes == pair and challenge.beside is not None
    assert all(can_tell(cause, challenge.channel_set, challenge.excitation) for cause in pair)
    link = plant.stiffness * motion.x + plant.damping * motion.v
    basis = np.stack([motion.x / rms(motion.x), motion.v / rms(motion.v)], axis=1)
    said = [(challenge.share, challenge.left), (challenge.beside.share, challenge.beside.left)]
    left = []
    for force, (share, rest) in zip(forces(challenge), said, strict=False):
        left.append(force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0])
        assert SHARES[0] <= share <= SHARES[1] and rest >= LEAST_LEFT
        assert (rms(force) / rms(link), rms(left[-1]) / rms(link)) == pytest.approx((share, rest), rel=1e-6)
    if len(left) == 2:
        without = left[0] - left[1] * (left[0] @ left[1]) / (left[1] @ left[1])
        assert rms(without) ** 2 >= (1.0 - LARGEST_OVERLAP) * rms(left[0]) ** 2
    else:
        assert said[1] == (0.0, 0.0)


@pytest.mark.parametrize("pair", DRAWN)
def test_the_motion_is_that_of_the_plant_under_all_forces(pair: Pair):
    challenge = drawn(pair)
    plant, motion, effect = challenge.truth, challenge.motion, np.sum(forces(challenge), axis=0)
    np.testing.assert_allclose(motion.effect, effect, atol=1e-7 * np.abs(effect).max())
    linear = plant.mass * motion.acceleration + plant.damping * motion.v + plant.stiffness * motion.x
    np.testing.assert_allclose(linear + effect, challenge.drive(motion.time), atol=1e-6 * np.abs(linear).max())
    if pair[0] == "coulomb":
        friction, F = forces(challenge)[0], challenge.parameters["F"]
        slides = motion.v != 0.0
        np.testing.assert_allclose(friction[slides], F * np.sign(motion.v[slides]), rtol=1e-6)
        assert np.abs(friction).max() <= F * (1.0 + 1e-6)
    once_more = integrate(plant, challenge.law, challenge.drive, challenge.start, challenge.time, rms(motion.x))
    np.testing.assert_allclose(once_more.x, motion.x, atol=1e-7 * motion.peak)


@pytest.mark.parametrize("pair", WITH_SENSOR)
def test_beside_a_law_one_channel_is_misread_and_the_others_are_the_truth(pair: Pair):
    challenge = drawn(pair)
    assert challenge.beside is not None and not isinstance(challenge.law, Both)
    (kind, _), p, truth = challenge.beside.at, challenge.beside.parameters, truth_of(challenge)
    assert challenge.beside.cause == pair[1]
    expected = {
        "force_gain": lambda: (1.0 + p["eps"]) * truth["force"],
        "accel_bias": lambda: truth["acceleration"] + p["b"],
        "accel_gain": lambda: (1.0 + p["eps"]) * truth["acceleration"],
        "force_delay": lambda: challenge.drive(challenge.time - p["tau"]),
    }[challenge.beside.cause]()
    np.testing.assert_allclose(challenge.clean[str(kind)], expected, rtol=1e-12)
    for name, y in challenge.clean.items():
        assert np.array_equal(y, truth[name]) == (name != kind)
        assert rms(challenge.channels[name] - y) == pytest.approx(0.01 * rms(y), rel=0.06)
    if challenge.beside.cause == "force_delay":
        assert not challenge.at_rest


def test_a_seed_is_a_challenge_and_the_noise_level_changes_nothing_but_the_noise():
    pairs = (("coulomb", "cubic_hardening"), ("quadratic_damping", "force_gain"))
    quiet, again, loud = (draw_two(3, noise=noise, excitation="sweep", pairs=pairs) for noise in (0.001, 0.001, 0.05))
    for other in (again, loud):
        assert quiet.causes == other.causes and quiet.parameters == other.parameters and quiet.beside == other.beside
        assert quiet.model == other.model and quiet.truth == other.truth and quiet.start == other.start
        for kind, y in quiet.clean.items():
            np.testing.assert_array_equal(y, other.clean[kind])
    for kind, y in quiet.channels.items():
        np.testing.assert_array_equal(y, again.channels[kind])
        assert rms(loud.channels[kind] - loud.clean[kind]) == pytest.approx(0.05 * rms(loud.clean[kind]), rel=0.06)


def test_a_preload_begins_with_a_plant_that_is_known_to_be_at_rest():
    challenge = draw_two(0, excitation="harmonic", channels="xva", pairs=[("preload", "accel_bias")])
    assert challenge.at_rest and challenge.start == (0.0, 0.0)


def test_two_forces_overlap_by_what_one_explains_of_the_other_beyond_k_and_c():
    time = np.linspace(0.0, 40.0 * np.pi, 4000, endpoint=False)
    x, v = np.cos(time), -np.sin(time)
    plant, motion = Plant(1.0, 1.0, 0.1), Motion(time, x, v, -x, 0.0 * x, np.empty(0))
    third, fifth = np.cos(3.0 * time), np.sin(5.0 * time)
    assert overlap(plant, motion, third + 7.0 * x, 2.0 * third - 3.0 * v) == pytest.approx(1.0)
    assert overlap(plant, motion, third + 7.0 * x, fifth + 7.0 * x) == pytest.approx(0.0, abs=1e-12)
    assert overlap(plant, motion, third, third + fifth) == pytest.approx(0.5)


def test_a_force_that_is_much_like_the_other_is_not_fair():
    time = np.linspace(0.0, 40.0 * np.pi, 4000, endpoint=False)
    x, third, fifth = np.cos(time), 0.2 * np.cos(3.0 * time), 0.2 * np.sin(5.0 * time)
    motion = Motion(time, x, -np.sin(time), -x, 0.0 * x, np.empty(0))
    scene = Scene(Plant(1.0, 1.0, 0.1), Silence(), motion)

    def judged(*each: FloatArray) -> None:
        two_module._must_be_fair(NoLaw(), [dataclasses.replace(motion, effect=force) for force in each], scene)

    judged(third, 0.75 * third + 0.6 * fifth)  # 0.61
    with pytest.raises(EscapeError, match="much like the other"):
        judged(third, 0.9 * third + 0.5 * fifth)  # 0.76
    with pytest.raises(EscapeError, match="not of the size of one of two"):
        judged(0.2 * third, fifth)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_any_pair_can_be_drawn(seed: int):
    challenge = draw_two(seed)
    assert challenge.causes in PAIRS and challenge.beside is not None
    for effect in (challenge, challenge.beside):
        assert effect.cause in SENSORS or (SHARES[0] <= effect.share <= SHARES[1] and effect.left >= LEAST_LEFT)
    assert all(np.isfinite(y).all() for y in challenge.channels.values())


# what is refused


@pytest.mark.parametrize("pair", [("coulomb", "gremlin"), ("coulomb", "stribeck"), ("force_gain", "accel_bias")])
def test_what_is_no_pair_is_refused(pair: Pair):
    with pytest.raises(
        ValueError, match=rf"`pairs` must hold two causes each, .* got \[\('{pair[0]}', '{pair[1]}'\)\]"
    ):
        draw_two(0, pairs=[pair])


def test_pairs_that_no_record_asked_for_can_tell_are_refused():
    with pytest.raises(ValueError, match=r"`pairs` must hold one that can be told from channels \('x',\)"):
        draw_two(0, pairs=[("accel_gain", "coulomb")], channels="x")


def test_a_pair_that_never_gives_a_fair_question_is_reported(monkeypatch: pytest.MonkeyPatch):
    def unfair(*arguments: object) -> None:
        raise EscapeError("too large")

    monkeypatch.setattr(two_module, "_question", unfair)
    with pytest.raises(UnfairError, match="no fair coulomb with cubic_hardening under harmonic in 50 plants"):
        draw_two(0, pairs=[("cubic_hardening", "coulomb")], excitation="harmonic")

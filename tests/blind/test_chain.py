"""Challenges with two masses: that what is drawn is what was promised, and that the motion is the chain's."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from . import CHAIN_CAUSES, CHAIN_SETS, ChainChallenge, chain_challenge, draw_chain
from .arrays import FloatArray, rms
from .chain import REST, Chain, across, integrate, responses, sketch
from .chain_challenge import HANGS, LEAST_SEEN, RATIOS, THIRD_LINKS, by_place, chain_can_tell
from .challenge import LEAST_LEFT, SAMPLES, sized
from .drives import Silence
from .laws import LAWS, NoLaw, Scene
from .laws.damping import Coulomb
from .laws.memory import DelayedForce
from .laws.stiffness import DoubleWell, EndStop
from .plants import EscapeError, UnfairError
from .sensors import SENSORS
from .test_laws import FORCES, RATES
from .two import SHARES

DRAWN = {  # cause -> excitation, channels
    "cubic_hardening": ("multisine", "xva"),
    "quadratic_damping": ("sweep", "x"),
    "end_stop": ("noise", "aa"),
    "coulomb": ("noise", "xx"),
    "maxwell": ("multisine", "xx"),
    "attached_oscillator": ("sweep", "aa"),
    "delayed_force": ("noise", "xva"),
    "stiffness_drift": ("sweep", "a"),
    "preload": ("harmonic", "xva"),
    "periodic_disturbance": ("free_decay", "xx"),
}
MISREAD = {
    "force_gain": ("noise", "xx"),
    "force_delay": ("sweep", "aa"),
    "accel_gain": ("multisine", "xva"),
    "accel_bias": ("free_decay", "aa"),
    "channel_delay": ("multisine", "xx"),
}
# What `FORCES` leaves to others; friction all but stops within a ten-thousandth of the usual speed.
MORE_FORCES = FORCES | {
    "cubic_hardening": lambda p, d, w, z, t: p["k3"] * d**3,
    "quadratic_damping": lambda p, d, w, z, t: p["c2"] * w * np.abs(w),
    "coulomb": lambda p, d, w, z, t: p["F"] * np.tanh(w / p["v_s"]),
}


@functools.cache
def drawn(cause: str) -> ChainChallenge:
    excitation, channels = (DRAWN | MISREAD)[cause]
    seed = 10 if cause == "coulomb" else 1  # with friction that sticks again and again
    return draw_chain(seed, causes=cause, noise=0.01, excitation=excitation, channels=channels)


def matrices(chain: Chain) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass, stiffness and damping from the textbook, (2, 2)."""
    k, c = (
        np.array([[v[0, 1] + v[1, 2], -v[1, 2]], [-v[1, 2], v[1, 2] + v.get((0, 2), 0.0)]])
        for v in (chain.stiffness, chain.damping)
    )
    return np.diag(chain.mass), k, c


def link_of(challenge: ChainChallenge) -> tuple[int, int]:
    i, j = challenge.at
    return int(i), int(j)


def stretch(at: Sequence[Any], y: FloatArray) -> FloatArray:
    """x_j - x_i (n,) of y (n, 2)."""
    i, j = at
    return y[:, j - 1] - (y[:, i - 1] if i else 0.0)


def on_masses(at: Sequence[Any], force: FloatArray) -> FloatArray:
    """A link's force (n,) on the left of the equation of each mass, (n, 2)."""
    i, j = at
    return np.stack([force * ((j == mass) - float(i == mass)) for mass in (1, 2)], axis=1)


def values(chain: Chain) -> dict[tuple[str | int, ...], float]:
    """All values of a chain by field and place."""
    masses = {(j,): mass for j, mass in enumerate(chain.mass, start=1)}
    fields = {"mass": masses, "stiffness": chain.stiffness, "damping": chain.damping}
    return {(field, *place): value for field, by_place in fields.items() for place, value in by_place.items()}


# what is drawn


def test_chains_have_two_modes_not_far_apart_and_samples_enough_for_both():
    plants = [chain_challenge._drawn_plant(np.random.default_rng(seed), "coulomb") for seed in range(200)]
    ratios = [chain.omega[1] / chain.omega[0] for chain, _ in plants]
    assert RATIOS[0] <= min(ratios) < 1.7 and 2.8 < max(ratios) <= RATIOS[1]
    for chain, time in plants:
        mass, k, _ = matrices(chain)
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, k)).real)
        np.testing.assert_allclose(chain.omega**2, squares, rtol=1e-9)
        assert 0.3 <= chain.omega[0] / (2.0 * np.pi) <= 100.0 and 0.1 <= chain.mass[0] <= 1000.0
        assert time.shape == (SAMPLES,) and 25.0 <= 2.0 * np.pi / (chain.omega[1] * time[1]) <= 50.0
    third = np.mean([(0, 2) in chain.links for chain, _ in plants])
    assert abs(third - THIRD_LINKS) < 0.15
    assert all(0.001 < chain.damping_ratio < 0.08 for chain, _ in plants)


def test_every_link_every_mass_and_every_channel_has_its_turn():
    challenges = [draw_chain(seed, causes=("force_gain", "accel_gain"), excitation="harmonic") for seed in range(9)]
    assert {c.at for c in challenges} == {("force", 1), ("force", 2), ("acceleration", 1), ("acceleration", 2)}
    assert {c.driven for c in challenges} == {1, 2}
    laws = [
        draw_chain(seed, causes="cubic_hardening", excitation="free_decay", channels="xx").at for seed in range(17, 23)
    ]
    assert set(laws) == {(0, 1), (1, 2), (0, 2)}
    loads = [
        draw_chain(seed, causes="periodic_disturbance", excitation="free_decay", channels="xx") for seed in range(5)
    ]
    assert {c.at for c in loads} == {(0, 1), (0, 2)}
    assert any(c.at not in c.truth.links for c in loads)


@pytest.mark.parametrize("cause", DRAWN)
def test_a_law_is_at_a_link_or_on_a_mass_and_of_the_promised_size(cause: str):
    challenge = drawn(cause)
    chain, motion, at = challenge.truth, challenge.motion, link_of(challenge)
    assert challenge.cause == cause and challenge.excitation == DRAWN[cause][0]
    assert at in (((0, 1), (0, 2)) if cause in HANGS else chain.links)
    d, w, effect = stretch(at, motion.x), stretch(at, motion.v), motion.link.effect
    _, k, c = matrices(chain)
    j = at[1] - 1
    held_by = (chain.stiffness[at], chain.damping[at]) if at in chain.links else (k[j, j], c[j, j])
    link = held_by[0] * d + held_by[1] * w
    basis = np.stack([d / rms(d), w / rms(w)], axis=1)
    left = effect - basis @ np.linalg.lstsq(basis, effect, rcond=None)[0]
    assert (rms(effect) / rms(link), rms(left) / rms(link)) == pytest.approx((challenge.share, challenge.left))
    assert SHARES[0] <= challenge.share <= SHARES[1] and challenge.left >= LEAST_LEFT
    assert challenge.seen >= LEAST_SEEN


@pytest.mark.parametrize("cause", DRAWN)
def test_the_motion_is_that_of_the_chain_under_all_forces(cause: str):
    challenge = drawn(cause)
    motion, at, p = challenge.motion, challenge.at, challenge.parameters
    mass, k, c = matrices(challenge.truth)
    d, w = stretch(at, motion.x), stretch(at, motion.v)
    np.testing.assert_allclose(motion.link.x, d, atol=1e-12 * np.abs(motion.x).max())
    drive = on_masses((0, challenge.driven), challenge.drive(motion.time))
    linear = motion.acceleration @ mass + motion.v @ c + motion.x @ k
    missing = drive - linear
    np.testing.assert_allclose(missing, on_masses(at, motion.link.effect), atol=1e-9 * np.abs(linear).max())
    if cause == "coulomb":
        sticks = motion.link.v == 0.0
        assert 30 < np.sum(sticks[:300]) < 270
        np.testing.assert_allclose(motion.link.effect[~sticks], p["F"] * np.sign(w[~sticks]), rtol=1e-9)
        assert np.abs(motion.link.effect).max() <= p["F"] * (1.0 + 1e-9)
    else:
        effect = MORE_FORCES[cause](p, d, w, motion.link.hidden, motion.time)
        np.testing.assert_allclose(motion.link.effect, effect, atol=1e-9 * np.abs(effect).max())


@pytest.mark.parametrize("cause", [cause for cause in DRAWN if cause != "delayed_force"])
def test_a_plain_integrator_finds_the_same_motion(cause: str):
    challenge = drawn(cause)
    at, time, start = challenge.at, challenge.time[:300], challenge.motion.link
    p = challenge.parameters | {"v_s": 1e-4 * rms(start.v)}
    mass, k, c = matrices(challenge.truth)
    out = np.linalg.solve(mass, on_masses(at, np.ones(1))[0])
    push = np.linalg.solve(mass, on_masses((0, challenge.driven), np.ones(1))[0])
    k, c = np.linalg.solve(mass, k), np.linalg.solve(mass, c)
    rates_of_hidden = RATES.get(cause, lambda p, d, w, z: ())

    def rates(t: float, y: FloatArray) -> FloatArray:
        x, v, z = y[:2], y[2:4], y[4:]
        d, w = stretch(at, x[None])[0], stretch(at, v[None])[0]
        force = MORE_FORCES[cause](p, d, w, z, t)
        return np.array([*v, *(push * challenge.drive(t) - k @ x - c @ v - out * force), *rates_of_hidden(p, d, w, z)])

    begin = [*challenge.motion.x[0], *challenge.motion.v[0], *(z[0] for z in start.hidden)]
    accuracy = 1e-10 * rms(challenge.motion.x)
    found = solve_ivp(rates, time[[0, -1]], begin, "LSODA", time, rtol=1e-9, atol=accuracy, max_step=float(time[1]))
    assert found.success
    # Kinks are not located; for friction that all but sticks, the share of the speed below which it does.
    atol = (3e-4 if cause == "coulomb" else 1e-6) * float(np.abs(challenge.motion.x).max())
    np.testing.assert_allclose(found.y[:2].T, challenge.motion.x[:300], atol=atol)


def test_two_masses_that_stick_together_move_as_one_and_a_third_spring_bends_with_them():
    chain = Chain((2.0, 1.0), {(0, 1): 200.0, (1, 2): 300.0, (0, 2): 50.0}, {(0, 1): 0.5, (1, 2): 0.2, (0, 2): 0.1})
    time, start = np.linspace(0.0, 10.0, 1000), ((0.02, 0.02), (0.0, 0.0))
    motion = integrate(chain, (1, 2), Coulomb(F=100.0), 1, Silence(), start, time, 0.01)
    s = -0.6 / 6.0 + 1j * np.sqrt(250.0 / 3.0 - (0.6 / 6.0) ** 2)
    expected = (0.02 * np.exp(s * time) * (1.0 + 1j * s.real / s.imag)).real
    np.testing.assert_allclose(motion.x, np.stack([expected] * 2, axis=1), atol=1e-9)
    assert np.all(motion.link.v == 0.0)
    # What holds the second mass is the friction: it bears its own spring, damper and inertia.
    bears = -(1.0 * motion.acceleration[:, 1] + 50.0 * motion.x[:, 1] + 0.1 * motion.v[:, 1])
    np.testing.assert_allclose(motion.link.effect, bears, atol=1e-9)


@pytest.mark.parametrize("cause", ["cubic_hardening", "maxwell", "delayed_force", "stiffness_drift"])
def test_a_sketch_is_near_the_motion(cause: str):
    challenge = drawn(cause)
    motion, arguments = challenge.motion, (challenge.driven, challenge.drive, challenge.start, challenge.time)
    near = sketch(challenge.truth, link_of(challenge), challenge.law, *arguments)
    assert np.abs(near.x - motion.x).max() < 0.03 * np.abs(motion.x).max()
    assert rms(near.link.effect - motion.link.effect) < 0.03 * rms(motion.link.effect)


def test_a_law_whose_start_is_elsewhere_begins_with_its_own_link_alone_stretched():
    assert not any(
        (0, 2) in chain_challenge._drawn_plant(np.random.default_rng(seed), "double_well")[0].links
        for seed in range(20)
    )
    chain = Chain((1.0, 1.0), {(0, 1): 100.0, (1, 2): 150.0}, {(0, 1): 0.3, (1, 2): 0.3})
    first, second = (chain_challenge._begun(chain, at, DoubleWell(k_neg=200.0, k3=50.0), REST) for at in chain.links)
    assert first == ((pytest.approx(np.sqrt(2.0)), pytest.approx(np.sqrt(2.0))), (0.0, 0.0))
    assert second == ((0.0, pytest.approx(1.0)), (0.0, 0.0))
    assert chain_challenge._begun(chain, (1, 2), Coulomb(F=1.0), ((0.1, 0.3), (1.0, 2.0))) == ((0.1, 0.3), (1.0, 2.0))


# what a record shows


@pytest.mark.parametrize("cause", ["cubic_hardening", "maxwell"])
def test_the_motion_is_the_linear_response_to_the_drive_and_to_the_law(cause: str):
    challenge = drawn(cause)
    motion = challenge.motion
    forces = on_masses((0, challenge.driven), challenge.drive(motion.time)) - on_masses(
        challenge.at, motion.link.effect
    )
    begin = np.array([*challenge.start[0], *challenge.start[1]])[:, None]
    found = responses(challenge.truth, forces[:, :, None], begin, float(motion.time[1]))
    # Forces are linear between samples, of which there are 25 a period at least.
    for kind, y in motion.responses.items():
        assert rms(found[kind][:, :, 0] - y) < 0.02 * rms(y)


def test_what_other_values_would_be_is_not_seen():
    challenge = drawn("cubic_hardening")
    motion, at = challenge.motion, link_of(challenge)
    kinds = [(kind, mass) for kind in motion.responses for mass in (1, 2)]
    bench = chain_challenge._Bench(
        challenge.truth, challenge.time, challenge.driven, challenge.drive, challenge.start,
        (("force", challenge.driven), *kinds),
    )  # fmt: skip

    def seen(effect: FloatArray) -> float:
        changed = dataclasses.replace(motion, link=dataclasses.replace(motion.link, effect=effect))
        return chain_challenge._seen(bench, at, changed, "cubic_hardening")

    d, w, k = motion.link.x, motion.link.v, challenge.truth.stiffness[at]
    linear = 0.2 * k * d - 0.1 * k * rms(d) / rms(w) * w
    assert seen(motion.link.effect) == pytest.approx(challenge.seen) and challenge.seen > 0.01
    assert seen(linear) < 1e-8
    assert seen(motion.link.effect + linear) == pytest.approx(challenge.seen)


def test_a_late_force_is_stable_if_both_modes_decay():
    chain = Chain((1.0, 1.0), {(0, 1): 100.0, (1, 2): 150.0}, {(0, 1): 0.3, (1, 2): 0.3})
    for at in chain.links:
        # A short delay is a damper of -k tau.
        assert not chain_challenge._is_stable(chain, at, DelayedForce(k=20.0, tau=0.03))
        assert chain_challenge._is_stable(chain, at, DelayedForce(k=-20.0, tau=0.03))
        assert chain_challenge._is_stable(chain, at, DelayedForce(k=20.0, tau=0.005))


# sensors, beliefs and noise


@pytest.mark.parametrize("cause", MISREAD)
def test_one_channel_is_misread_and_the_others_are_the_truth(cause: str):
    challenge = drawn(cause)
    motion, p, (kind, mass) = challenge.motion, challenge.parameters, challenge.at
    truth = {(name, j): y[:, j - 1] for name, y in motion.responses.items() for j in (1, 2)}
    truth["force", challenge.driven] = challenge.drive(challenge.time)
    clean = by_place(challenge.clean)
    for place, y in clean.items():
        assert np.array_equal(y, truth[place]) == (place != challenge.at)
    shown, there = clean[str(kind), int(mass)], truth[str(kind), int(mass)]
    if cause in ("force_gain", "accel_gain"):
        np.testing.assert_allclose(shown, (1.0 + p["eps"]) * there, rtol=1e-12)
    elif cause == "accel_bias":
        np.testing.assert_allclose(shown, there + p["b"], rtol=1e-12)
    elif cause == "force_delay":
        np.testing.assert_allclose(shown, challenge.drive(challenge.time - p["tau"]), rtol=1e-12)
    else:
        assert p["channel"] == challenge.at
        later = challenge.time > p["tau"]
        expected = CubicSpline(challenge.time, there)(challenge.time - p["tau"])
        np.testing.assert_allclose(shown[later], expected[later], atol=2e-3 * rms(there))  # 25 samples a period
    if cause.endswith("delay"):
        assert not challenge.at_rest and challenge.start != REST


@pytest.mark.parametrize("name", CHAIN_SETS)
def test_channels_are_those_of_the_set_with_white_noise_of_its_level_on_each(name: str):
    challenge = draw_chain(2, causes="none", noise=0.02, channels=name, excitation="multisine")
    kinds, both, _ = CHAIN_SETS[name]
    assert set(challenge.channels) == set(challenge.units) == {"force", *kinds}
    assert list(challenge.channels["force"]) == [challenge.driven]
    for kind in kinds:
        found = challenge.channels[kind]
        assert found.shape == (SAMPLES, 2) if isinstance(found, np.ndarray) else len(found) == 1
        assert isinstance(found, np.ndarray) == both
    clean = by_place(challenge.clean)
    noises = {place: y - clean[place] for place, y in by_place(challenge.channels).items()}
    for place, noise in noises.items():
        assert np.std(noise) == pytest.approx(0.02 * rms(clean[place]), rel=0.06)
        assert challenge.noise_floor[place] == pytest.approx(rms(noise))
        assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.08
    assert np.abs(np.corrcoef(list(noises.values())) - np.eye(len(noises))).max() < 0.08


def test_a_free_decay_has_no_force_channel_and_never_starts_at_rest():
    challenge = drawn("periodic_disturbance")
    assert list(challenge.channels) == ["displacement"] and challenge.driven == 0
    assert not challenge.at_rest and any(challenge.start[0])


@pytest.mark.parametrize("cause", ["stiffness_value", "damping_value", "mass_value"])
def test_a_wrong_value_is_wrong_by_itself_and_by_the_promised_amount(cause: str):
    for seed in range(2):
        challenge = draw_chain(seed, causes=cause, excitation="noise", channels="xx")
        field, at = cause.removesuffix("_value"), challenge.at
        true, believed = values(challenge.truth), values(challenge.model)
        assert [place for place in true if true[place] != believed[place]] == [(field, *at)]
        ratio = believed[field, *at] / true[field, *at]
        assert list(challenge.parameters.values()) == [true[field, *at]]
        assert 1.5 <= max(ratio, 1.0 / ratio) <= 3.0 if field == "damping" else 0.08 <= abs(ratio - 1.0) <= 0.4


def test_beside_an_effect_each_link_is_exact_or_close():
    rng, chain = np.random.default_rng(0), drawn("maxwell").truth
    beliefs = [chain_challenge._roughly_known(rng, chain) for _ in range(200)]
    for at in chain.links:
        exact = sum(belief.stiffness[at] == chain.stiffness[at] for belief in beliefs)
        off = [abs(belief.stiffness[at] / chain.stiffness[at] - 1.0) for belief in beliefs]
        assert 70 <= exact <= 130 and 0.02 < max(off) <= 0.03
        assert 0.2 < max(abs(belief.damping[at] / chain.damping[at] - 1.0) for belief in beliefs) <= 0.25
    assert {belief.mass for belief in beliefs} == {chain.mass}


def test_a_seed_is_a_challenge_and_the_noise_level_changes_nothing_but_the_noise():
    causes = ("coulomb", "cubic_hardening", "force_gain", "stiffness_value")
    quiet, again, loud = (draw_chain(3, causes, noise, excitation="sweep") for noise in (0.001, 0.001, 0.05))
    for other in (again, loud):
        for name in ("cause", "at", "parameters", "truth", "model", "start", "at_rest"):
            assert getattr(quiet, name) == getattr(other, name)
    for place, y in by_place(quiet.clean).items():
        np.testing.assert_array_equal(y, by_place(loud.clean)[place])
        np.testing.assert_array_equal(by_place(quiet.channels)[place], by_place(again.channels)[place])
        noise = (by_place(found.channels)[place] - y for found in (quiet, loud))
        np.testing.assert_allclose(50.0 * next(noise), next(noise), rtol=1e-6, atol=1e-12 * rms(y))


@pytest.mark.slow
@pytest.mark.parametrize("cause", CHAIN_CAUSES)
def test_every_cause_can_be_drawn(cause: str):
    for seed in range(4):
        challenge = draw_chain(seed, causes=cause)
        assert challenge.cause == cause and chain_can_tell(cause, challenge.channel_set, challenge.excitation)
        assert cause not in LAWS or challenge.seen >= LEAST_SEEN
        assert all(np.isfinite(y).all() for y in by_place(challenge.channels).values())


# what is refused


def test_no_cause_is_drawn_that_the_record_could_not_tell():
    assert set(CHAIN_CAUSES) >= {*LAWS, "none"} and set(SENSORS) - set(CHAIN_CAUSES) == {"clipping"}
    assert chain_can_tell("preload", "xx", "noise") and not chain_can_tell("preload", "x", "noise")
    assert chain_can_tell("mass_value", "aa", "noise") and not chain_can_tell("mass_value", "a", "noise")
    assert chain_can_tell("coulomb", "xx", "free_decay") and not chain_can_tell("coulomb", "x", "free_decay")
    assert not chain_can_tell("force_gain", "aa", "noise") and not chain_can_tell("accel_bias", "xx", "noise")


@pytest.mark.parametrize("argument", ["causes", "channels", "excitation"])
def test_an_unknown_name_is_refused_with_the_known_ones(argument: str):
    with pytest.raises(ValueError, match=rf"`{argument}` must be one or more of .* got 'gremlin'"):
        draw_chain(0, **{argument: "gremlin"})  # pyright: ignore[reportArgumentType]


def test_causes_that_no_record_asked_for_can_tell_are_refused():
    with pytest.raises(ValueError, match=r"`causes` must hold one that can be told from channels \('xx',\)"):
        draw_chain(0, causes="accel_gain", channels="xx")


def test_a_law_that_never_gives_a_fair_question_is_reported(monkeypatch: pytest.MonkeyPatch):
    def unfair(*arguments: object) -> None:
        raise EscapeError("too large")

    monkeypatch.setattr(chain_challenge, "_drawn_law", unfair)
    with pytest.raises(UnfairError, match="no fair coulomb under harmonic in 100 chains"):
        draw_chain(0, causes="coulomb", excitation="harmonic")


def test_a_law_that_the_motion_never_meets_is_not_of_its_size():
    scene = Scene(drawn("maxwell").truth.around((0, 1)), Silence(), drawn("maxwell").motion.link)
    still = dataclasses.replace(scene.motion, effect=0.0 * scene.motion.x)
    with pytest.raises(EscapeError, match="no end_stop of this size"):
        sized(np.random.default_rng(0), EndStop, scene, SHARES, lambda law: still)


def test_a_motion_beyond_the_reach_of_its_law_is_refused():
    chain = Chain((1.0, 1.0), {(0, 1): 100.0, (1, 2): 150.0}, {(0, 1): 0.3, (1, 2): 0.3})
    time, start = np.linspace(0.0, 10.0, 1000), ((0.02, 0.0), (0.0, 0.0))
    for follow in (lambda: integrate(chain, (1, 2), NoLaw(), 1, Silence(), start, time, 0.01, limit=0.015),
                   lambda: sketch(chain, (1, 2), NoLaw(), 1, Silence(), start, time, limit=0.015)):  # fmt: skip
        with pytest.raises(EscapeError, match="passes the law's reach"):
            follow()
    np.testing.assert_array_equal(across((1, 2)), [-1.0, 1.0])

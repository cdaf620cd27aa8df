"""The examination must be right before it judges: properties of the plants, their laws, sensors and noise."""

import ast
import dataclasses
import functools
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.interpolate import CubicSpline

from . import CAUSES, FIRST_CAUSES, Challenge, draw
from . import challenge as challenge_module
from .beliefs import roughly_known
from .challenge import CHANNEL_SETS, LEAST_LEFT, NOISE_LEVELS, SAMPLES
from .drives import DRIVES, Silence, SumOfSines
from .exact import integrate
from .laws import FIRST_LAWS, Law, NoLaw, Scene
from .laws.base import LARGEST_SHARE, SMALLEST_SHARE
from .laws.damping import Coulomb
from .laws.stiffness import CubicHardening, CubicSoftening
from .plants import EscapeError, Motion, Plant, UnfairError
from .sensors import FIRST_SENSORS
from .sketch import sketch

PLANT = Plant(mass=2.0, stiffness=200.0, damping=0.8)
LAW_CASES = [(cause, excitation) for cause in FIRST_LAWS for excitation in ("multisine", "free_decay")]

drawn = functools.cache(draw)


def parameters(law: Law) -> list[float]:
    return list(dataclasses.asdict(law).values())


def again(challenge: Challenge, time: np.ndarray | None = None, rtol: float = 1e-10) -> Motion:
    """The challenge's motion once more, on other times or to another tolerance."""
    scale = float(np.std(challenge.motion.x))
    times = challenge.time if time is None else time
    return integrate(challenge.truth, challenge.law, challenge.drive, challenge.start, times, scale, rtol)


def test_the_generator_imports_numpy_and_scipy_alone():
    allowed = {"numpy", "scipy", "abc", "bisect", "collections", "dataclasses", "typing"}
    for path in Path(__file__).parent.rglob("*.py"):
        if path.name.startswith("test_"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert {alias.name.split(".")[0] for alias in node.names} <= allowed, path
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                assert str(node.module).split(".")[0] in allowed, path


# the motion is the plant's


def test_a_linear_free_decay_is_the_textbooks():
    time = np.linspace(0.0, 20.0, 2000)
    motion = integrate(PLANT, NoLaw(), Silence(), (0.01, 0.0), time, scale=0.01)
    decay, omega = PLANT.damping_ratio * PLANT.omega, PLANT.omega * np.sqrt(1.0 - PLANT.damping_ratio**2)
    expected = 0.01 * np.exp(-decay * time) * (np.cos(omega * time) + decay / omega * np.sin(omega * time))
    # 30 periods of global error at a relative tolerance of 1e-10 a step.
    np.testing.assert_allclose(motion.x, expected, atol=1e-9 * 0.01)


def test_a_linear_forced_motion_started_on_its_steady_state_stays_there():
    omega, force = 7.0, 3.0
    compliance = force / (PLANT.stiffness - PLANT.mass * omega**2 + 1j * omega * PLANT.damping)
    time = np.linspace(0.0, 20.0, 2000)
    drive = SumOfSines(np.array([force]), np.array([omega]), np.zeros(1))
    start = (compliance.real, (1j * omega * compliance).real)
    motion = integrate(PLANT, NoLaw(), drive, start, time, scale=abs(compliance))
    steady = compliance * np.exp(1j * omega * time)
    # Between its steps the integrator interpolates, one order below its own.
    np.testing.assert_allclose(motion.x, steady.real, atol=1e-7 * abs(compliance))
    np.testing.assert_allclose(motion.acceleration, (-(omega**2) * steady).real, atol=1e-6 * omega**2 * abs(compliance))


def test_dry_friction_takes_the_same_step_off_every_half_swing_and_then_holds():
    plant, law = Plant(mass=2.0, stiffness=200.0, damping=0.0), Coulomb(F=1.0)
    step = law.F / plant.stiffness
    time = np.linspace(0.0, 3.0, 1000)
    motion = integrate(plant, law, Silence(), (6.6 * step, 0.0), time, scale=step)
    # Swings of amplitude 5.6, 3.6 and 1.6 steps about +-1 step; at -0.6 steps the spring is too weak to go on.
    np.testing.assert_allclose(motion.instants, np.pi / plant.omega * np.arange(1, 4), rtol=1e-9)
    turns = np.interp(np.pi / plant.omega * np.arange(4), time, motion.x)
    np.testing.assert_allclose(turns, np.array([6.6, -4.6, 2.6, -0.6]) * step, atol=1e-3 * step)  # linear interpolation
    held = time > motion.instants[-1]
    np.testing.assert_allclose(motion.x[held], -0.6 * step, rtol=1e-8)
    assert np.all(motion.v[held] == 0.0) and np.all(motion.acceleration[held] == 0.0)


@pytest.mark.parametrize(("cause", "excitation"), LAW_CASES)
def test_the_work_of_the_forces_is_the_change_of_energy(cause: str, excitation: str):
    challenge = drawn(1, causes=cause, excitation=excitation)
    plant = challenge.truth
    fine = np.linspace(challenge.time[0], challenge.time[-1], 20 * SAMPLES + 1)
    motion = again(challenge, fine)
    dissipated = simpson((plant.damping * motion.v + motion.effect) * motion.v, x=fine)
    supplied = simpson(challenge.drive(fine) * motion.v, x=fine)
    energy = 0.5 * plant.mass * motion.v**2 + 0.5 * plant.stiffness * motion.x**2
    # Simpson's rule on 600 or more points a period, with a kink at every reversal under friction.
    assert supplied - dissipated == pytest.approx(energy[-1] - energy[0], abs=2e-6 * energy.max())


@pytest.mark.parametrize(("cause", "excitation"), LAW_CASES)
def test_acceleration_and_velocity_are_derivatives_of_the_displacement(cause: str, excitation: str):
    challenge = drawn(1, causes=cause, excitation=excitation)
    fine = np.linspace(challenge.time[0], challenge.time[-1], 10 * SAMPLES + 1)
    motion = again(challenge, fine)
    jumps = np.searchsorted(fine, motion.instants)
    smooth = np.ones(fine.size, bool)
    smooth[np.clip(jumps[:, None] + np.arange(-12, 12), 0, fine.size - 1)] = False
    smooth[:12], smooth[-12:] = False, False
    assert smooth.mean() > 0.7
    for y, rate in ((motion.x, motion.v), (motion.v, motion.acceleration)):
        error = (CubicSpline(fine, y)(fine, 1) - rate)[smooth]
        # A cubic spline on 300 points a period: (2 pi / 300)^4 / 30 and a margin for the harmonics.
        assert np.abs(error).max() < 1e-6 * np.abs(rate).max()


@pytest.mark.parametrize(("cause", "excitation"), LAW_CASES)
def test_a_hundred_times_finer_tolerance_changes_neither_motion_nor_events(cause: str, excitation: str):
    challenge = drawn(2, causes=cause, excitation=excitation)
    fine = again(challenge, rtol=1e-12)
    scale = np.abs(fine.x).max()
    np.testing.assert_allclose(challenge.motion.x, fine.x, atol=1e-7 * scale)
    # Loose for the end of a decay, whose swings are small against the tolerance of the motion.
    np.testing.assert_allclose(challenge.motion.instants, fine.instants, atol=1e-4 / challenge.truth.omega)
    assert challenge.motion.instants.size == fine.instants.size
    assert (challenge.motion.instants.size > 0) == (not challenge.law.smooth)


def test_events_keep_the_order_of_the_integrator_under_friction():
    challenge = drawn(3, causes="coulomb", excitation="noise")
    reference = again(challenge, rtol=1e-12)
    errors = [np.abs(again(challenge, rtol=rtol).x - reference.x).max() for rtol in (1e-4, 1e-6, 1e-8)]
    # Unlocated reversals would leave an error that does not fall with the tolerance.
    assert errors[1] < 0.1 * errors[0] and errors[2] < 0.1 * errors[1]


def test_friction_sticks_within_its_limit_and_slips_with_all_of_it():
    challenge = drawn(4, causes="coulomb", excitation="multisine")
    motion, limit = challenge.motion, challenge.parameters["F"]
    stuck = motion.v == 0.0
    assert 1 < stuck.sum() < stuck.size
    assert np.all(np.abs(motion.effect[stuck]) <= limit * (1.0 + 1e-9))
    assert np.all(np.abs(motion.acceleration[stuck]) <= 1e-12 * np.abs(motion.acceleration).max())
    np.testing.assert_array_equal(np.diff(motion.x)[stuck[:-1] & stuck[1:]], 0.0)
    slips = np.abs(motion.v) > 1e-9 * np.abs(motion.v).max()
    np.testing.assert_array_equal(motion.effect[slips], limit * np.sign(motion.v[slips]))


@pytest.mark.parametrize("cause", FIRST_LAWS)
def test_a_sketch_is_close_to_the_exact_motion(cause: str):
    challenge = drawn(1, causes=cause, excitation="noise")
    rough = sketch(challenge.truth, challenge.law, challenge.drive, challenge.start, challenge.time)
    np.testing.assert_allclose(rough.x, challenge.motion.x, atol=0.05 * np.abs(challenge.motion.x).max())


# the laws and sensors are the catalogue's


@pytest.mark.parametrize(
    ("cause", "law"),
    [
        ("cubic_hardening", lambda p, x, v: p["k3"] * x**3),
        ("cubic_softening", lambda p, x, v: p["k3"] * x**3),
        ("quadratic_stiffness", lambda p, x, v: p["k2"] * x**2),
        ("quadratic_damping", lambda p, x, v: p["c2"] * v * np.abs(v)),
    ],
)
def test_the_effect_is_the_formula_of_the_catalogue(cause: str, law):
    challenge = drawn(5, causes=cause)
    motion, plant = challenge.motion, challenge.truth
    expected = law(challenge.parameters, motion.x, motion.v)
    np.testing.assert_allclose(motion.effect, expected, atol=1e-12 * np.abs(expected).max())
    balance = plant.mass * motion.acceleration + plant.damping * motion.v + plant.stiffness * motion.x + expected
    np.testing.assert_allclose(
        balance, challenge.drive(motion.time), atol=1e-9 * np.abs(plant.stiffness * motion.x).max()
    )
    assert challenge.at == (0, 1)


def test_parameters_have_the_signs_of_the_catalogue():
    rng = np.random.default_rng(0)
    x, v = rng.standard_normal((2, 50))
    scene = Scene(PLANT, Silence(), Motion(np.arange(50.0), x, v, x, 0.0 * x, np.empty(0)))
    signs = {cause: set() for cause in FIRST_LAWS}
    for cause, law in FIRST_LAWS.items():
        for _ in range(20):
            signs[cause].update(np.sign(parameters(law.draw(rng, scene, 1.0))))
    assert signs.pop("cubic_softening") == {-1.0}
    assert signs.pop("quadratic_stiffness") == {-1.0, 1.0}
    assert set(map(frozenset, signs.values())) == {frozenset({1.0})}


@pytest.mark.parametrize(("cause", "kind"), [("force_gain", "force"), ("accel_gain", "acceleration")])
def test_a_gain_shows_in_its_channel_alone(cause: str, kind: str):
    challenge = drawn(6, causes=cause, channels="xva", excitation="multisine")
    motion, eps = challenge.motion, challenge.parameters["eps"]
    truth = {"force": challenge.drive(motion.time), "displacement": motion.x, "acceleration": motion.acceleration}
    for name, y in truth.items():
        np.testing.assert_allclose(challenge.clean[name], y * (1.0 + eps if name == kind else 1.0), rtol=1e-12)
    assert 0.05 <= abs(eps) <= 0.4
    assert challenge.at == (kind, 1)


# effect, noise and belief have the sizes that were promised


@pytest.mark.parametrize("cause", FIRST_LAWS)
def test_effects_are_of_the_promised_size_along_the_true_motion(cause: str):
    for seed in range(5):
        challenge = drawn(seed, causes=cause)
        motion, plant = challenge.motion, challenge.truth
        link = plant.stiffness * motion.x + plant.damping * motion.v
        share = np.sqrt(np.mean(motion.effect**2) / np.mean(link**2))
        basis = np.stack([motion.x / np.std(motion.x), motion.v / np.std(motion.v)], axis=1)
        left = motion.effect - basis @ np.linalg.lstsq(basis, motion.effect, rcond=None)[0]
        assert SMALLEST_SHARE <= share <= LARGEST_SHARE
        assert np.sqrt(np.mean(left**2) / np.mean(link**2)) >= LEAST_LEFT
        assert challenge.share == pytest.approx(share)


def test_a_question_is_fair_only_if_its_effect_is_large_enough_small_enough_and_not_a_linear_one():
    time = np.linspace(0.0, 10.0, 1000)
    x, v = np.cos(PLANT.omega * time), -PLANT.omega * np.sin(PLANT.omega * time)
    law = CubicHardening(k3=1.0)

    def fair(effect: np.ndarray) -> bool:
        scene = Scene(PLANT, Silence(), Motion(time, x, v, x, effect, np.empty(0)))
        return challenge_module.is_fair(law, scene, law.shares)

    assert fair(0.2 * PLANT.stiffness * x**3)
    assert not fair(0.02 * PLANT.stiffness * x**3) and not fair(2.0 * PLANT.stiffness * x**3)
    assert not fair(0.2 * PLANT.stiffness * x + 0.01 * PLANT.stiffness * x**3)


def test_a_softening_spring_stays_well_within_the_point_where_the_stiffness_vanishes():
    for seed in range(5):
        challenge = drawn(seed, causes="cubic_softening")
        vanishes = np.sqrt(-challenge.truth.stiffness / (3.0 * challenge.parameters["k3"]))
        assert np.abs(challenge.motion.x).max() <= 0.6 * vanishes


@pytest.mark.parametrize("level", NOISE_LEVELS)
def test_every_channel_carries_white_noise_of_its_level(level: float):
    challenge = drawn(7, causes="none", noise=level, channels="xva", excitation="multisine")
    noises = {kind: y - challenge.clean[kind] for kind, y in challenge.channels.items()}
    assert set(noises) == {"force", "displacement", "velocity", "acceleration"}
    for kind, noise in noises.items():
        size = level * np.sqrt(np.mean(challenge.clean[kind] ** 2))
        assert np.std(noise) == pytest.approx(size, rel=0.06)  # 4.5 standard errors of 3000 samples
        assert challenge.noise_floor[kind] == pytest.approx(np.std(noise), rel=0.01)
        assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.08
    correlations = np.corrcoef(list(noises.values())) - np.eye(4)
    assert np.abs(correlations).max() < 0.08


def test_the_noise_level_changes_nothing_but_the_noise():
    quiet, loud = (drawn(8, causes=FIRST_CAUSES, noise=level) for level in (0.001, 0.05))
    assert quiet.cause == loud.cause and quiet.parameters == loud.parameters and quiet.model == loud.model
    for kind, y in quiet.clean.items():
        np.testing.assert_array_equal(y, loud.clean[kind])
        np.testing.assert_allclose(50.0 * (quiet.channels[kind] - y), loud.channels[kind] - y, rtol=1e-6, atol=1e-12)


def test_a_seed_is_a_challenge():
    first, second, third = (draw(seed, causes=FIRST_CAUSES) for seed in (9, 9, 10))
    assert first.cause == second.cause and first.truth == second.truth
    for kind, y in first.channels.items():
        np.testing.assert_array_equal(y, second.channels[kind])
    assert first.truth != third.truth


def test_with_nothing_wrong_the_belief_is_the_truth():
    challenge = drawn(0, causes="none", excitation="harmonic")
    assert challenge.model == challenge.truth and challenge.parameters == {} and challenge.at == ()
    assert challenge.share == 0.0


@pytest.mark.parametrize(
    ("cause", "field", "name", "at"),
    [
        ("stiffness_value", "stiffness", "k", (0, 1)),
        ("damping_value", "damping", "c", (0, 1)),
        ("mass_value", "mass", "mass", (1,)),
    ],
)
def test_a_wrong_value_is_wrong_by_itself_and_by_the_promised_amount(cause: str, field: str, name: str, at: tuple):
    for seed in range(4):
        challenge = drawn(seed, causes=cause, excitation="harmonic")
        true, believed = dataclasses.asdict(challenge.truth), dataclasses.asdict(challenge.model)
        assert challenge.parameters == {name: true[field]} and challenge.at == at
        assert [key for key in true if true[key] != believed[key]] == [field]
        ratio = believed[field] / true[field]
        if field == "damping":
            assert 1.5 <= max(ratio, 1.0 / ratio) <= 3.0
        else:
            assert 0.08 <= abs(ratio - 1.0) <= 0.4


def test_beside_an_effect_the_belief_is_exact_in_half_of_the_cases_and_close_in_the_others():
    rng = np.random.default_rng(0)
    beliefs = [roughly_known(rng, PLANT) for _ in range(200)]
    assert 70 <= sum(belief == PLANT for belief in beliefs) <= 130
    assert {belief.mass for belief in beliefs} == {PLANT.mass}
    stiffness = np.array([belief.stiffness / PLANT.stiffness - 1.0 for belief in beliefs])
    damping = np.array([belief.damping / PLANT.damping - 1.0 for belief in beliefs])
    assert 0.02 < np.abs(stiffness).max() <= 0.03 and 0.2 < np.abs(damping).max() <= 0.25


# what is drawn


def test_constants_sampling_and_starts_are_within_their_ranges():
    challenges = [drawn(seed, causes="force_gain", channels="x", excitation="sweep") for seed in range(20)]
    for challenge in challenges:
        plant, dt = challenge.truth, challenge.time[1] - challenge.time[0]
        assert challenge.time.shape == (SAMPLES,)
        assert 0.3 <= plant.omega / (2.0 * np.pi) <= 100.0 and 0.1 <= plant.mass <= 1000.0
        assert 0.005 <= plant.damping_ratio <= 0.08
        assert 30.0 <= 2.0 * np.pi / (plant.omega * dt) <= 70.0
        assert challenge.start == (0.0, 0.0) or not challenge.at_rest
    at_rest, declared = sum(c.start == (0.0, 0.0) for c in challenges), sum(c.at_rest for c in challenges)
    assert 10 <= at_rest < 20 and 2 <= declared < at_rest


def test_a_free_decay_has_no_force_channel_and_never_starts_at_rest():
    challenge = drawn(0, causes="cubic_hardening", excitation="free_decay", channels="x")
    assert list(challenge.channels) == list(challenge.units) == ["displacement"]
    assert not challenge.at_rest and challenge.start[0] != 0.0


@pytest.mark.parametrize("excitation", DRIVES)
def test_a_drive_gives_at_one_time_what_it_gives_along_many(excitation: str):
    drive = DRIVES[excitation](np.random.default_rng(0), 10.0, 60.0)
    times = np.linspace(0.0, 60.0, 7)
    np.testing.assert_allclose([drive(float(t)) for t in times], drive(times), atol=1e-12)
    np.testing.assert_allclose(drive.scaled(3.0)(times), 3.0 * drive(times), atol=1e-12)


def test_no_cause_is_drawn_that_the_record_could_not_tell():
    for seed in range(12):
        challenge = drawn(seed, causes=("none", *FIRST_SENSORS, "mass_value"), excitation=("free_decay", "harmonic"))
        decays = challenge.excitation == "free_decay"
        assert not (decays and challenge.cause in ("force_gain", "mass_value"))
        assert not (challenge.channel_set == "a" and challenge.cause in FIRST_SENSORS)
        assert not (challenge.channel_set == "x" and challenge.cause == "accel_gain")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cause", "excitation"),
    [
        (cause, excitation)
        for cause in CAUSES
        for excitation in DRIVES
        if any(challenge_module.can_tell(cause, channels, excitation) for channels in CHANNEL_SETS)
    ],
)
def test_every_cause_can_be_drawn_under_every_excitation(cause: str, excitation: str):
    for seed in range(3):
        challenge = draw(seed, causes=cause, excitation=excitation)
        assert (challenge.cause, challenge.excitation) == (cause, excitation)
        assert set(challenge.channels) - {"force"} == set(CHANNEL_SETS[challenge.channel_set])
        assert all(np.isfinite(y).all() for y in challenge.channels.values())


# what is refused


@pytest.mark.parametrize("argument", ["causes", "channels", "excitation"])
def test_an_unknown_name_is_refused_with_the_known_ones(argument: str):
    with pytest.raises(ValueError, match=rf"`{argument}` must be one or more of .* got 'gremlin'"):
        draw(0, **{argument: "gremlin"})  # pyright: ignore[reportArgumentType]


def test_causes_that_no_record_asked_for_can_tell_are_refused():
    with pytest.raises(ValueError, match=r"`causes` must hold one that can be told from channels \('x',\)"):
        draw(0, causes="accel_gain", channels="x")


def test_a_law_that_never_gives_a_fair_question_is_reported(monkeypatch: pytest.MonkeyPatch):
    class Impossible(CubicHardening):
        def reach(self, stiffness: float) -> float:
            return 0.0

    monkeypatch.setitem(challenge_module.LAWS, "cubic_hardening", Impossible)
    with pytest.raises(UnfairError, match="no fair cubic_hardening under harmonic in 50 plants"):
        draw(0, causes="cubic_hardening", excitation="harmonic")


def test_a_motion_beyond_the_reach_of_its_law_is_refused():
    law, time = CubicSoftening(k3=-1e6), np.linspace(0.0, 10.0, 1000)
    start = (0.9 * law.reach(PLANT.stiffness), 1.0)
    with pytest.raises(EscapeError, match="passes the law's reach"):
        integrate(PLANT, law, Silence(), start, time, scale=1e-3)
    with pytest.raises(EscapeError, match="passes the law's reach"):
        sketch(PLANT, law, Silence(), start, time)


def test_a_law_that_is_not_smooth_must_say_where_its_modes_end():
    class Kinked(CubicHardening):
        smooth = False

    with pytest.raises(NotImplementedError, match="Kinked is not smooth and must say where its modes end"):
        integrate(PLANT, Kinked(k3=1.0), Silence(), (0.01, 0.0), np.linspace(0.0, 1.0, 100), scale=0.01)


def test_a_law_whose_modes_never_let_the_motion_go_on_is_reported():
    class Restless(Coulomb):
        def next_mode(self, mode: int, which: int, load: float) -> int:
            return 1 if load > 0.0 else -1

    with pytest.raises(RuntimeError, match="those of Restless followed one another 101 times"):
        integrate(PLANT, Restless(F=1.0), Silence(), (0.02, 0.0), np.linspace(0.0, 3.0, 1000), scale=0.01)

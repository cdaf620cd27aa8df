"""Every law and sensor of the catalogue is drawn, and its truth is right: its formula, integrated another way."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from . import CAUSES, FIRST_CAUSES, Challenge, draw
from .arrays import FloatArray, rms
from .challenge import CHANNEL_SETS, LEAST_LEFT, can_tell
from .drives import DRIVES, Silence, SumOfSines
from .exact import integrate
from .laws import FIRST_LAWS, LAWS
from .laws.damping import PowerDamping
from .laws.stiffness import EndStop
from .plants import EscapeError, Motion, Plant
from .sensors import FIRST_SENSORS, SENSORS

NEW_LAWS = [cause for cause in LAWS if cause not in FIRST_LAWS]
NEW_SENSORS = [cause for cause in SENSORS if cause not in FIRST_SENSORS]

PARAMETERS = {
    "cubic_hardening": "k3", "cubic_softening": "k3", "quadratic_stiffness": "k2", "quintic_stiffness": "k5",
    "bilinear_stiffness": "k knot side", "dead_zone": "k gap", "end_stop": "k gap", "saturation": "k gap",
    "double_well": "k_neg k3", "sine_stiffness": "k s", "square_stiffness": "k2", "coulomb": "F",
    "coulomb_asymmetric": "F_plus F_minus", "stribeck": "F F_static v_s", "smooth_coulomb": "F v_s",
    "quadratic_damping": "c2", "cubic_damping": "c3", "power_damping": "c n", "van_der_pol": "eps x0",
    "position_damping": "c", "bilinear_damping": "dc side", "bouc_wen": "k beta gamma n", "jenkins": "k slip",
    "lugre": "F F_static v_s sigma0 sigma1", "free_play": "k gap F_plus F_minus", "maxwell": "k tau",
    "attached_oscillator": "m omega zeta", "delayed_force": "k tau", "stiffness_drift": "rate t_ref",
    "damping_drift": "rate t_ref", "stiffness_drop": "dk t_star", "parametric_stiffness": "dk omega phase",
    "preload": "F", "periodic_disturbance": "F omega phase", "force_gain": "eps", "force_delay": "tau",
    "accel_bias": "b", "accel_gain": "eps", "channel_delay": "channel tau", "clipping": "channel limit",
}  # fmt: skip

Numbers = dict[str, Any]


@functools.cache
def drawn(cause: str) -> Challenge:
    return draw(1, causes=cause, excitation="sweep")


# the formulas of the catalogue, written as they stand there


def dz(d: Any, gap: float) -> Any:
    return np.sign(d) * np.maximum(np.abs(d) - gap, 0.0)


def bent(p: Numbers, w: Any) -> Any:
    return p["F"] + (p["F_static"] - p["F"]) * np.exp(-((w / p["v_s"]) ** 2))


def bristle_rate(p: Numbers, w: Any, z: Any) -> Any:
    return w - p["sigma0"] * np.abs(w) * z / bent(p, w)


# cause -> force(parameters, d, w, z, t); z is what the law remembers
FORCES: dict[str, Callable[[Numbers, Any, Any, Any, Any], Any]] = {
    "quintic_stiffness": lambda p, d, w, z, t: p["k5"] * d**5,
    "bilinear_stiffness": lambda p, d, w, z, t: p["side"] * p["k"] * np.maximum(p["side"] * (d - p["knot"]), 0.0),
    "dead_zone": lambda p, d, w, z, t: -p["k"] * (d - dz(d, p["gap"])),
    "end_stop": lambda p, d, w, z, t: p["k"] * dz(d, p["gap"]),
    "saturation": lambda p, d, w, z, t: -p["k"] * dz(d, p["gap"]),
    "double_well": lambda p, d, w, z, t: -p["k_neg"] * d + p["k3"] * d**3,
    "sine_stiffness": lambda p, d, w, z, t: p["k"] / p["s"] * np.sin(p["s"] * d),
    "square_stiffness": lambda p, d, w, z, t: p["k2"] * d * np.abs(d),
    "coulomb_asymmetric": lambda p, d, w, z, t: np.where(w > 0.0, p["F_plus"], -p["F_minus"]),
    "stribeck": lambda p, d, w, z, t: np.sign(w) * bent(p, w),
    "smooth_coulomb": lambda p, d, w, z, t: p["F"] * np.tanh(w / p["v_s"]),
    "cubic_damping": lambda p, d, w, z, t: p["c3"] * w**3,
    "power_damping": lambda p, d, w, z, t: p["c"] * np.abs(w) ** p["n"] * np.sign(w),
    "van_der_pol": lambda p, d, w, z, t: p["eps"] * ((d / p["x0"]) ** 2 - 1.0) * w,
    "position_damping": lambda p, d, w, z, t: p["c"] * d**2 * w,
    "bilinear_damping": lambda p, d, w, z, t: np.where(p["side"] * w > 0.0, p["dc"] * w, 0.0),
    "bouc_wen": lambda p, d, w, z, t: p["k"] * z[0],
    "jenkins": lambda p, d, w, z, t: p["k"] * np.clip(z[0], -p["slip"], p["slip"]),
    "lugre": lambda p, d, w, z, t: p["sigma0"] * z[0] + p["sigma1"] * bristle_rate(p, w, z[0]),
    "free_play": lambda p, d, w, z, t: np.clip(p["k"] * dz(z[0], p["gap"]), -p["F_minus"], p["F_plus"]),
    "maxwell": lambda p, d, w, z, t: p["k"] * z[0],
    "attached_oscillator": lambda p, d, w, z, t: p["m"] * attached_rates(p, d, w, z)[1],
    "delayed_force": lambda p, d, w, z, t: p["k"] * z[0],
    "stiffness_drift": lambda p, d, w, z, t: p["rate"] * (t - p["t_ref"]) * d,
    "damping_drift": lambda p, d, w, z, t: p["rate"] * (t - p["t_ref"]) * w,
    "stiffness_drop": lambda p, d, w, z, t: np.where(t > p["t_star"], -p["dk"] * d, 0.0),
    "parametric_stiffness": lambda p, d, w, z, t: p["dk"] * np.cos(p["omega"] * t + p["phase"]) * d,
    "preload": lambda p, d, w, z, t: -p["F"] + 0.0 * d,
    "periodic_disturbance": lambda p, d, w, z, t: -p["F"] * np.cos(p["omega"] * t + p["phase"]),
}


def attached_rates(p: Numbers, d: Any, w: Any, z: Any) -> tuple[Any, Any]:
    """Velocity and acceleration of the attached mass, m a = -m omega^2 u - 2 zeta omega m u' of its own stretch u."""
    stretch, its_rate = z[0] - d, z[1] - w
    return z[1], -(p["omega"] ** 2) * stretch - 2.0 * p["zeta"] * p["omega"] * its_rate


def bouc_wen_rate(p: Numbers, w: Any, z: Any) -> Any:
    return w - p["beta"] * np.abs(w) * np.abs(z) ** (p["n"] - 1.0) * z - p["gamma"] * w * np.abs(z) ** p["n"]


# cause -> rates of the hidden states
RATES: dict[str, Callable[[Numbers, Any, Any, Any], tuple[Any, ...]]] = {
    "bouc_wen": lambda p, d, w, z: (bouc_wen_rate(p, w, z[0]),),
    "lugre": lambda p, d, w, z: (bristle_rate(p, w, z[0]),),
    "maxwell": lambda p, d, w, z: (w - z[0] / p["tau"],),
    "attached_oscillator": attached_rates,
    # A slider stands within a step; `CONFINED` moves it after the step.
    "jenkins": lambda p, d, w, z: (w,),
    "free_play": lambda p, d, w, z: (w,),
}
CONFINED: dict[str, Callable[[Numbers], tuple[float, float]]] = {
    "jenkins": lambda p: (-p["slip"], p["slip"]),
    "free_play": lambda p: (-p["gap"] - p["F_minus"] / p["k"], p["gap"] + p["F_plus"] / p["k"]),
}
# cause -> least and largest load under which the mass sticks
STICKS: dict[str, Callable[[Numbers], tuple[float, float]]] = {
    "coulomb_asymmetric": lambda p: (-p["F_minus"], p["F_plus"]),
    "stribeck": lambda p: (-p["F_static"], p["F_static"]),
}


def by_small_steps(challenge: Challenge, first: int, samples: int, steps: int) -> FloatArray:
    """x (samples,) from the formulas by so many Runge-Kutta steps a sample, kinks neither known nor located."""
    plant, p, cause, motion = challenge.truth, challenge.parameters, challenge.cause, challenge.motion
    force, rates, bounds = FORCES[cause], RATES.get(cause), CONFINED.get(cause)
    h = float(challenge.time[1]) / steps
    begin = float(challenge.time[first])
    drive = challenge.drive(begin + 0.5 * h * np.arange(2 * steps * samples + 1)).tolist()
    xs, vs = [float(motion.x[first])], [float(motion.v[first])]
    delay = p["tau"] / h if cause == "delayed_force" else 0.0

    def late(at: float) -> float:
        """x at so many steps from the start, by the cubic through two points and slopes."""
        at -= delay
        if at <= 0.0:
            return xs[0]
        i = min(int(at), len(xs) - 2)
        s = at - i
        a, b, da, db = xs[i], xs[i + 1], h * vs[i], h * vs[i + 1]
        return a + s * (da + s * (3.0 * (b - a) - 2.0 * da - db + s * (2.0 * (a - b) + da + db)))

    def slope(half: int, y: FloatArray) -> FloatArray:
        x, v, *z = y.tolist()
        if delay:
            z = [late(0.5 * half)]
        f = float(force(p, x, v, z, begin + 0.5 * h * half))
        a = (drive[half] - plant.damping * v - plant.stiffness * x - f) / plant.mass
        return np.array([v, a, *(rates(p, x, v, z) if rates else ())])

    y = np.array([xs[0], vs[0], *([] if delay else [z[first] for z in motion.hidden])])
    out = []
    for i in range(steps * samples):
        if i % steps == 0:
            out.append(float(y[0]))
        k1 = slope(2 * i, y)
        k2 = slope(2 * i + 1, y + 0.5 * h * k1)
        k3 = slope(2 * i + 1, y + 0.5 * h * k2)
        k4 = slope(2 * i + 2, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if bounds:
            y[2] = np.clip(y[2], *bounds(p))
        if delay:
            xs.append(float(y[0]))
            vs.append(float(y[1]))
    return np.array(out)


def by_steps_that_stick(challenge: Challenge, first: int, samples: int, steps: int) -> FloatArray:
    """x (samples,) of a plant with dry friction by Runge-Kutta steps under a friction of one sign.

    A step in which the velocity would change its sign, or the mass is let go, is made again in 400 semi-implicit ones,
    which stick where the sliding would turn round.
    """
    plant, p, force = challenge.truth, challenge.parameters, FORCES[challenge.cause]
    low, high = STICKS[challenge.cause](p)
    h, begin = float(challenge.time[1]) / steps, float(challenge.time[first])
    drive = challenge.drive(begin + 0.5 * h * np.arange(2 * steps * samples + 1)).tolist()
    x, v, out = float(challenge.motion.x[first]), float(challenge.motion.v[first]), []

    def pull(g: float, x: float, v: float) -> float:
        return g - plant.damping * v - plant.stiffness * x

    def slope(g: float, x: float, v: float, way: float) -> float:
        # The friction of a velocity that has turned round within the step is continued, as if it had not.
        return (pull(g, x, v) - way * abs(float(force(p, x, way * max(way * v, 1e-300), (), 0.0)))) / plant.mass

    for i in range(steps * samples):
        if i % steps == 0:
            out.append(x)
        g1, g2, g3 = drive[2 * i : 2 * i + 3]
        if v == 0.0 and all(low <= pull(g, x, 0.0) <= high for g in (g1, g2, g3)):
            continue
        way = float(np.sign(v))
        if way:
            a1 = slope(g1, x, v, way)
            a2 = slope(g2, x + 0.5 * h * v, v + 0.5 * h * a1, way)
            a3 = slope(g2, x + 0.5 * h * v + 0.25 * h * h * a1, v + 0.5 * h * a2, way)
            a4 = slope(g3, x + h * v + 0.5 * h * h * a2, v + h * a3, way)
            faster = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            if way * faster > 0.0:
                x, v = x + h * v + h * h / 6.0 * (a1 + a2 + a3), faster
                continue
        small, many = h / 400, 400
        for j in range(many):
            g = g1 + (g3 - g1) * j / many
            load = pull(g, x, v)
            if v == 0.0 and low <= load <= high:
                continue
            faster = v + small * slope(g, x, v, float(np.sign(v or load)))
            v = 0.0 if v * faster < 0.0 else faster
            x += small * v
    return np.array(out)


def again(challenge: Challenge, time: FloatArray | None = None, rtol: float = 1e-10) -> Motion:
    """The challenge's motion once more, on other times or to another tolerance."""
    scale = float(np.std(challenge.motion.x))
    times = challenge.time if time is None else time
    return integrate(challenge.truth, challenge.law, challenge.drive, challenge.start, times, scale, rtol)


def window(challenge: Challenge, samples: int) -> int:
    """First sample of a stretch about the largest displacement; a delay is followed from the start."""
    if challenge.cause == "delayed_force":
        return 0
    if challenge.cause == "stiffness_drop":
        return int(np.searchsorted(challenge.time, challenge.parameters["t_star"])) - samples // 2
    middle = int(np.abs(challenge.motion.x).argmax())
    return min(max(middle - samples // 2, 0), challenge.time.size - samples)


def brute_error(cause: str, steps: int) -> float:
    """Largest difference between the exact motion and one by small steps, as a share of the peak."""
    challenge, samples = drawn(cause), 150
    first = window(challenge, samples)
    exact = challenge.motion.x[first : first + samples]
    method = by_steps_that_stick if cause in STICKS else by_small_steps
    return float(np.abs(method(challenge, first, samples, steps) - exact).max() / np.abs(exact).max())


STEPPED_OVER = [cause for cause in NEW_LAWS if not LAWS[cause].smooth or cause == "stiffness_drop"]


@pytest.mark.parametrize("cause", NEW_LAWS)
def test_the_motion_is_that_of_the_formula_by_brute_force(cause: str):
    # 750 or more steps a period leave 1e-9 of a smooth motion. A kink that is stepped over adds its part, and a jump of
    # the force more: here a bound, and the order in which it falls in the slow test below.
    bound = (
        2e-9 if cause not in STEPPED_OVER else 1e-3 if cause == "stiffness_drop" else 1e-4 if cause in STICKS else 2e-5
    )
    assert brute_error(cause, steps=25) < bound


@pytest.mark.slow
@pytest.mark.parametrize("cause", STEPPED_OVER)
def test_brute_force_closes_in_on_the_exact_motion(cause: str):
    few, many = (brute_error(cause, steps) for steps in (25, 400))
    # A jump is stepped over within one part of a step, and leaves an error of first order.
    assert many < (5e-5 if cause == "stiffness_drop" else 5e-6 if cause in STICKS else 2e-7)
    assert many < 0.1 * few or many < 1e-9


# effect, events and parameters


@pytest.mark.parametrize("cause", NEW_LAWS)
def test_the_effect_is_the_formula_of_the_catalogue_and_balances_the_forces(cause: str):
    challenge = drawn(cause)
    motion, plant = challenge.motion, challenge.truth
    expected = FORCES[cause](challenge.parameters, motion.x, motion.v, motion.hidden, motion.time)
    moving = motion.v != 0.0 if cause in STICKS else np.ones(motion.x.size, bool)
    np.testing.assert_allclose(motion.effect[moving], expected[moving], atol=1e-7 * np.abs(expected).max())
    balance = plant.mass * motion.acceleration + plant.damping * motion.v + plant.stiffness * motion.x + motion.effect
    np.testing.assert_allclose(
        balance, challenge.drive(motion.time), atol=1e-9 * np.abs(plant.stiffness * motion.x).max()
    )


@pytest.mark.parametrize("cause", NEW_LAWS)
def test_a_hundred_times_finer_tolerance_changes_neither_motion_nor_events(cause: str):
    challenge, samples = drawn(cause), 400
    rough, fine = (again(challenge, challenge.time[:samples], rtol) for rtol in (1e-10, 1e-12))
    # What is exact to 1e-10 a step is so to 1e-7 after ten periods, also where small shifts grow.
    np.testing.assert_allclose(rough.x, fine.x, atol=1e-7 * fine.peak)
    np.testing.assert_allclose(rough.instants, fine.instants, atol=1e-4 / challenge.truth.omega)
    np.testing.assert_allclose(rough.x, challenge.motion.x[:samples], atol=1e-7 * fine.peak)


@pytest.mark.slow
@pytest.mark.parametrize("cause", NEW_LAWS)
def test_a_hundred_times_finer_tolerance_changes_no_whole_record(cause: str):
    for excitation in [e for e in DRIVES if can_tell(cause, "xva", e)]:
        challenge = draw(2, causes=cause, excitation=excitation)
        fine = again(challenge, challenge.time, 1e-12)
        # A start may be parted from its neighbour a thousandfold: see LARGEST_PARTING.
        np.testing.assert_allclose(challenge.motion.x, fine.x, atol=1e-6 * fine.peak)


@pytest.mark.parametrize("cause", NEW_LAWS)
def test_what_is_drawn_is_fair(cause: str):
    challenge = drawn(cause)
    motion, plant, law = challenge.motion, challenge.truth, LAWS[cause]
    link = plant.stiffness * motion.x + plant.damping * motion.v
    assert challenge.share == pytest.approx(rms(motion.effect) / rms(link))
    assert law.shares[0] <= challenge.share <= law.shares[1]
    assert challenge.left >= LEAST_LEFT
    assert motion.peak < 12.0 * rms(motion.x)
    assert challenge.at == (0, 1)
    assert all(np.isfinite(y).all() and y.shape == motion.time.shape for y in challenge.channels.values())


@pytest.mark.parametrize("cause", sorted(PARAMETERS))
def test_parameters_have_the_names_of_the_catalogue(cause: str):
    challenge = drawn(cause)
    assert list(challenge.parameters) == PARAMETERS[cause].split()
    for name, value in challenge.parameters.items():
        assert isinstance(value, {"side": int, "channel": tuple}.get(name, float)), name


def test_every_cause_of_the_catalogue_is_there_and_the_first_ones_come_first():
    assert set(CAUSES) == {"none", "stiffness_value", "damping_value", "mass_value", *PARAMETERS}
    assert len(CAUSES) == len(set(CAUSES)) == 44
    assert set(FIRST_CAUSES) < set(CAUSES) and len(FIRST_CAUSES) == 11


# cause -> how far from a kink [m or m/s], from the parameters, d, w, z
KINKS: dict[str, Callable[[Numbers, Any, Any, Any], Any]] = {
    "bilinear_stiffness": lambda p, d, w, z: d - p["knot"],
    "dead_zone": lambda p, d, w, z: np.abs(d) - p["gap"],
    "end_stop": lambda p, d, w, z: np.abs(d) - p["gap"],
    "saturation": lambda p, d, w, z: np.abs(d) - p["gap"],
    "square_stiffness": lambda p, d, w, z: d,
    "stribeck": lambda p, d, w, z: w,
    "coulomb_asymmetric": lambda p, d, w, z: w,
    "power_damping": lambda p, d, w, z: w,
    "bilinear_damping": lambda p, d, w, z: w,
    "lugre": lambda p, d, w, z: w,
    "bouc_wen": lambda p, d, w, z: w * z[0],
    "jenkins": lambda p, d, w, z: w * (np.abs(z[0]) - p["slip"]),
}


@pytest.mark.parametrize("cause", KINKS)
def test_the_motion_is_at_a_kink_at_every_event_and_at_no_kink_without_one(cause: str):
    challenge = drawn(cause)
    instants, p = challenge.motion.instants, challenge.parameters
    assert instants.size > 4
    motion = again(challenge, np.unique(np.concatenate([challenge.time[:1], instants])))

    def distance(m: Motion) -> FloatArray:
        return KINKS[cause](p, m.x, m.v, m.hidden)

    every = distance(challenge.motion)
    # Events of a run on other absolute tolerances.
    np.testing.assert_allclose(distance(motion)[1:], 0.0, atol=1e-7 * np.abs(every).max())
    if cause == "jenkins":  # whose reversals are kinks only while it slides
        return
    for i in np.flatnonzero(every[1:] * every[:-1] < 0.0):
        assert np.any((instants >= challenge.time[i] - 1e-12) & (instants <= challenge.time[i + 1] + 1e-12))


def test_free_play_changes_its_mode_at_the_gap_at_the_slider_and_at_reversals():
    challenge = drawn("free_play")
    p, motion = challenge.parameters, challenge.motion
    low, high = CONFINED["free_play"](p)
    z = motion.hidden[0]
    assert low * (1 + 1e-9) <= z.min() and z.max() <= high * (1 + 1e-9)
    assert np.mean(np.abs(z) < p["gap"]) > 0.05 and np.mean((z > 0.999999 * high) | (z < 0.999999 * low)) > 0.005
    assert -p["F_minus"] * (1 + 1e-9) <= motion.effect.min() and motion.effect.max() <= p["F_plus"] * (1 + 1e-9)
    at = again(challenge, np.unique(np.concatenate([challenge.time[:1], motion.instants])))
    far = [np.abs(np.abs(at.hidden[0]) - p["gap"]), np.abs(at.hidden[0] - low), np.abs(at.hidden[0] - high)]
    np.testing.assert_allclose(np.min(far, axis=0)[1:], 0.0, atol=1e-8 * high)


def test_a_drop_of_stiffness_is_one_event_at_its_instant():
    challenge = drawn("stiffness_drop")
    assert challenge.motion.instants.tolist() == [challenge.parameters["t_star"]]
    assert 0.2 <= challenge.parameters["t_star"] / challenge.time[-1] <= 0.8


@pytest.mark.parametrize("beyond", [1e-3, 1e-5, 1e-7])
def test_a_kink_that_is_passed_and_passed_back_within_one_step_is_found(beyond: float):
    plant, time = Plant(mass=1.0, stiffness=1.0, damping=0.0), np.linspace(0.0, 20.0, 500)
    law = EndStop(k=1e-3, gap=1.0 - beyond)
    motion = integrate(plant, law, Silence(), (0.0, 1.0), time, scale=1.0)
    # Peaks of 1 at every half turn; each is in and out again within the square root of 8 times `beyond`.
    assert motion.instants.size == 2 * int(20.0 / np.pi + 0.5)
    np.testing.assert_allclose(np.diff(motion.instants)[::2], np.sqrt(8.0 * beyond), rtol=0.01)


@pytest.mark.slow
def test_a_mass_that_creeps_near_rest_under_a_law_of_infinite_slope_is_refused():
    plant, time = Plant(mass=1.0, stiffness=1.0, damping=0.0), np.linspace(0.0, 10.0, 20)
    drive = SumOfSines(np.array([0.1]), np.array([1.3]), np.zeros(1))
    with pytest.raises(EscapeError, match="creeps near rest at .* s, where the law is too stiff"):
        integrate(plant, PowerDamping(c=0.5, n=0.2), drive, (0.0, 0.0), time, scale=0.1)


def test_friction_that_falls_with_speed_sticks_within_its_static_limit():
    challenge = draw(3, causes="stribeck", excitation="multisine")
    motion, p = challenge.motion, challenge.parameters
    stuck = motion.v == 0.0
    assert 1 < stuck.sum() < stuck.size
    assert np.abs(motion.effect).max() <= p["F_static"] * (1.0 + 1e-9)
    assert np.all(np.abs(motion.acceleration[stuck]) <= 1e-12 * np.abs(motion.acceleration).max())


def test_a_double_well_has_a_hill_and_the_motion_stays_bounded_about_its_wells():
    sides = set()
    for seed in range(6):
        challenge = draw(seed, causes="double_well", excitation="free_decay")
        p, stiffness = challenge.parameters, challenge.truth.stiffness
        well = np.sqrt((p["k_neg"] - stiffness) / p["k3"])
        assert p["k_neg"] > stiffness and p["k3"] > 0.0
        crossings = np.sum(challenge.motion.x[1:] * challenge.motion.x[:-1] < 0.0)
        assert challenge.motion.peak > 0.5 * well
        sides.add(bool(crossings > 10))
    assert sides == {True, False}  # some swing over the hill, some stay in their well


@pytest.mark.parametrize("cause", ["jenkins", "delayed_force", "attached_oscillator", "clipping", "channel_delay"])
def test_a_seed_is_a_challenge(cause: str):
    first, second = drawn(cause), draw(1, causes=cause, excitation="sweep")
    assert first.parameters == second.parameters and first.model == second.model and first.start == second.start
    for kind, y in first.channels.items():
        np.testing.assert_array_equal(y, second.channels[kind])


def test_the_scales_of_shapes_are_natural_to_the_motion():
    p, motion, plant = (getattr(drawn("maxwell"), name) for name in ("parameters", "motion", "truth"))
    assert 0.2 <= p["tau"] * plant.omega <= 5.0
    p, plant = drawn("attached_oscillator").parameters, drawn("attached_oscillator").truth
    assert 0.03 <= p["m"] / plant.mass <= 0.2 and 0.5 <= p["omega"] / plant.omega <= 2.0 and 0.005 <= p["zeta"] <= 0.05
    p, plant = drawn("delayed_force").parameters, drawn("delayed_force").truth
    assert 0.2 <= p["tau"] * plant.omega <= 2.0
    drift = drawn("stiffness_drift")
    assert 0.05 <= abs(drift.parameters["rate"]) * drift.time[-1] / drift.truth.stiffness <= 0.4
    line = draw(1, causes="periodic_disturbance", excitation="harmonic")
    assert abs(line.parameters["omega"] / float(line.drive.omega[0]) - 1.0) > 0.15  # pyright: ignore[reportAttributeAccessIssue]
    p, motion = drawn("bouc_wen").parameters, drawn("bouc_wen").motion
    bound = (p["beta"] + p["gamma"]) ** (-1.0 / p["n"])
    assert np.abs(motion.hidden[0]).max() <= bound * (1.0 + 1e-9) and -0.3 <= p["gamma"] / p["beta"] <= 1.0


# sensors


def truth_of(challenge: Challenge) -> dict[str, FloatArray]:
    motion = challenge.motion
    return {
        "force": challenge.drive(motion.time), "displacement": motion.x, "velocity": motion.v,
        "acceleration": motion.acceleration,
    }  # fmt: skip


@pytest.mark.parametrize("cause", NEW_SENSORS)
def test_a_sensor_misreads_its_channel_alone(cause: str):
    challenge = drawn(cause)
    kind = challenge.at[0]
    assert challenge.at == (kind, 1) and challenge.parameters.get("channel", challenge.at) == challenge.at
    for name, y in truth_of(challenge).items():
        if name in challenge.clean:
            assert np.array_equal(challenge.clean[name], y) == (name != kind)
    assert challenge.share == 0.0


def test_a_late_force_is_the_drive_of_before():
    challenge = drawn("force_delay")
    tau, step = challenge.parameters["tau"], challenge.time[1]
    np.testing.assert_array_equal(challenge.clean["force"], challenge.drive(challenge.time - tau))
    assert 0.4 <= tau / step <= 4.0 and not challenge.at_rest
    np.testing.assert_allclose(again(challenge).x, challenge.motion.x, atol=1e-7 * challenge.motion.peak)


@pytest.mark.parametrize("seed", range(4))
def test_a_late_channel_is_the_motion_of_before(seed: int):
    challenge = draw(seed, causes="channel_delay", excitation="sweep")
    kind, _ = challenge.parameters["channel"]
    tau, step = challenge.parameters["tau"], float(challenge.time[1])
    assert 0.4 <= tau / step <= 4.0
    expected = CubicSpline(challenge.time, truth_of(challenge)[kind])(challenge.time - tau)
    inner = slice(20, -20)
    # A cubic spline on 30 or more points a period.
    np.testing.assert_allclose(challenge.clean[kind][inner], expected[inner], atol=2e-4 * np.abs(expected).max())
    # Before the record began the plant moved already: the first readings go on smoothly.
    jump = np.abs(np.diff(challenge.clean[kind])).max()
    assert np.abs(np.diff(challenge.clean[kind][:10])).max() <= jump
    assert not challenge.at_rest and challenge.start == (challenge.motion.x[0], challenge.motion.v[0])


def test_a_bias_is_the_same_in_every_sample():
    challenge = drawn("accel_bias")
    np.testing.assert_allclose(
        challenge.clean["acceleration"] - challenge.motion.acceleration, challenge.parameters["b"], rtol=1e-6
    )
    assert 0.05 <= abs(challenge.parameters["b"]) / rms(challenge.motion.acceleration) <= 0.5


def test_a_clipped_channel_shows_nothing_beyond_its_limit_noise_included():
    channels = set()
    for seed in range(6):
        challenge = draw(seed, causes="clipping", excitation=("harmonic", "sweep"), noise=0.02)
        (kind, _), limit = challenge.parameters["channel"], challenge.parameters["limit"]
        channels.add(kind)
        assert np.abs(challenge.channels[kind]).max() == limit
        assert 0.009 <= np.mean(np.abs(truth_of(challenge)[kind]) > limit) <= 0.101
        np.testing.assert_array_equal(challenge.clean[kind], np.clip(truth_of(challenge)[kind], -limit, limit))
    assert "force" in channels and len(channels) > 2


# what a record can tell


@pytest.mark.parametrize(
    ("cause", "channels", "excitation", "tells"),
    [
        ("preload", "a", "multisine", False),
        ("preload", "x", "free_decay", False),
        ("preload", "x", "noise", True),
        ("force_delay", "x", "harmonic", False),
        ("force_delay", "x", "free_decay", False),
        ("channel_delay", "x", "free_decay", False),
        ("channel_delay", "xva", "free_decay", True),
        ("channel_delay", "x", "harmonic", False),
        ("accel_bias", "x", "noise", False),
        ("delayed_force", "xva", "harmonic", False),
        ("maxwell", "xva", "free_decay", False),
        ("attached_oscillator", "xva", "free_decay", True),
        ("stiffness_drift", "xva", "free_decay", False),
        ("parametric_stiffness", "x", "harmonic", True),
        ("clipping", "a", "free_decay", True),
        ("coulomb_asymmetric", "a", "noise", False),
        ("coulomb_asymmetric", "x", "free_decay", True),
    ],
)
def test_no_cause_is_asked_for_that_the_record_could_not_tell(cause: str, channels: str, excitation: str, tells: bool):
    assert can_tell(cause, channels, excitation) == tells


def test_a_preload_begins_with_a_plant_that_is_known_to_be_at_rest():
    for seed in range(3):
        challenge = draw(seed, causes="preload", excitation="sweep")
        assert challenge.at_rest and challenge.start == (0.0, 0.0) and challenge.channel_set in CHANNEL_SETS

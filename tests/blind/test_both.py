"""Two laws on one mass: the motion against others that know neither modes nor guards, and what is refused."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from .arrays import FloatArray, rms
from .drives import SumOfSines
from .exact import integrate
from .laws import Both, Law, damping, input, memory, stiffness, time
from .plants import Motion, Plant
from .sketch import sketch

PLANT = Plant(mass=1.0, stiffness=1.0, damping=0.05)
DRIVE = SumOfSines(np.array([0.6, 0.7, 0.4]), np.array([0.37, 0.9, 1.7]), np.array([0.3, 1.0, 2.0]))
TIME = np.arange(1000, dtype=float) * 0.06
START = (0.4, 0.0)

CUBIC = stiffness.CubicHardening(k3=0.2)
STOP = stiffness.EndStop(k=0.8, gap=0.9)
FRICTION = damping.Coulomb(F=0.45)
MAXWELL = memory.Maxwell(k=0.4, tau=1.3)
RIDER = memory.AttachedOscillator(m=0.15, omega=1.4, zeta=0.03)
LATE = memory.DelayedForce(k=-0.15, tau=0.5)
HUM = input.PeriodicDisturbance(F=0.4, omega=0.63, phase=0.5)
SLIDER = memory.Jenkins(k=0.5, slip=0.6)
LOOP = memory.BoucWen(k=0.5, beta=0.9, gamma=0.4, n=1.0)
ONE_WAY = damping.BilinearDamping(dc=0.2, side=-1)


def moved(law: Law, rtol: float = 1e-11) -> Motion:
    return integrate(PLANT, law, DRIVE, START, TIME, 1.0, rtol)


# force and rates of what acts beside friction, written once more: (t, x, v, z) -> N, and (x, v, z) -> rates of z

Beside = tuple[Callable[[float, float, float, Any], float], Callable[[float, float, Any], Sequence[float]], tuple]

BESIDE: dict[str, tuple[Law, Beside]] = {
    "cubic": (CUBIC, (lambda t, x, v, z: 0.2 * x**3, lambda x, v, z: (), ())),
    "disturbance": (HUM, (lambda t, x, v, z: -0.4 * np.cos(0.63 * t + 0.5), lambda x, v, z: (), ())),
    "maxwell": (MAXWELL, (lambda t, x, v, z: 0.4 * z[0], lambda x, v, z: (v - z[0] / 1.3,), (0.0,))),
    "attached": (
        RIDER,
        (
            lambda t, x, v, z: 0.15 * (1.4**2 * (x - z[0]) + 2 * 0.03 * 1.4 * (v - z[1])),
            lambda x, v, z: (z[1], 1.4**2 * (x - z[0]) + 2 * 0.03 * 1.4 * (v - z[1])),
            START,
        ),
    ),
}


def by_events(beside: Beside, limit: float) -> tuple[FloatArray, FloatArray]:
    """x and v (n,) under Coulomb friction of `limit` [N] and another force: SciPy's events end each slide and hold."""
    force, rates, hidden = beside
    drive = DRIVE

    def load(t, y):
        x, v, *z = y
        return float(drive(float(t))) - PLANT.damping * v - PLANT.stiffness * x - force(t, x, v, z)

    def way_from_rest(t, y):
        pull = load(t, y)
        return 0 if abs(pull) <= limit else 1 if pull > 0.0 else -1

    y, here = np.array([*START, *hidden]), 0.0
    way = way_from_rest(here, y)
    xs, vs = np.empty(TIME.size), np.empty(TIME.size)
    while here < TIME[-1]:
        if way == 0:  # a held mass: until the load is too much
            leaves = [lambda t, y, s=s: limit - s * load(t, y) for s in (1, -1)]
            slope = lambda t, y: [0.0, 0.0, *rates(y[0], 0.0, y[2:])]  # noqa: E731
        else:
            leaves = [lambda t, y, s=way: s * y[1]]
            slope = lambda t, y, s=way: [y[1], load(t, y) - s * limit, *rates(y[0], y[1], y[2:])]  # noqa: E731
        for leave in leaves:
            leave.terminal, leave.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
        run = solve_ivp(slope, (here, TIME[-1]), y, "DOP853", None, True, leaves, rtol=1e-11, atol=1e-12, max_step=0.05)
        now = (TIME >= here) & (TIME <= run.t[-1])
        if now.any():
            xs[now], vs[now] = run.sol(TIME[now])[:2]  # pyright: ignore[reportOptionalCall]
        here, y = float(run.t[-1]), run.y[:, -1].copy()
        way = way_from_rest(here, y) if way else 1 if load(here, y) > 0.0 else -1
        y[1] = way * 1e-11  # an event of SciPy's at the very begin of a slide would end it there
    return xs, vs


@pytest.mark.parametrize("name", BESIDE)
def test_friction_beside_another_force_slides_and_holds_as_by_other_events(name: str):
    law, beside = BESIDE[name]
    motion = moved(Both(FRICTION, law))
    x, v = by_events(beside, FRICTION.F)
    assert 10 < np.sum(motion.v == 0.0) < 700
    # A few periods of global error at 1e-11 a step, and the instants of both.
    np.testing.assert_allclose(motion.x, x, atol=1e-7)
    np.testing.assert_allclose(motion.v, v, atol=1e-7)


def test_held_mass_is_let_go_where_another_law_changes_at_a_stop():
    push = SumOfSines(np.array([1.0]), np.zeros(1), np.zeros(1))  # constant
    law = Both(damping.Coulomb(F=0.3), time.StiffnessDrop(dk=0.5, t_star=2.01))
    plant, instants = Plant(1.0, 1.0, 0.0), np.linspace(0.0, 5.0, 300)
    motion = integrate(plant, law, push, (0.8, 0.0), instants, 1.0)
    # 1 - 0.8 is held, 1 - 0.4 is not: then a swing about (1 - 0.3) / 0.5.
    assert motion.instants[0] == 2.01
    swing = 1.4 - 0.6 * np.cos(np.sqrt(0.5) * np.maximum(instants - 2.01, 0.0))
    np.testing.assert_allclose(motion.x, swing, atol=1e-9)


# smooth pairs, and pairs with kinks


def test_a_smooth_pair_moves_as_by_a_plain_integrator():
    law = Both(damping.PositionDamping(c=0.2), MAXWELL)

    def slope(t, y):
        x, v, z = y
        return [v, float(DRIVE(float(t))) - 0.05 * v - x - 0.2 * x * x * v - 0.4 * z, v - z / 1.3]

    run = solve_ivp(slope, (0.0, TIME[-1]), [*START, 0.0], "DOP853", TIME, rtol=1e-12, atol=1e-13)
    motion = moved(law)
    # Between its steps the integrator interpolates, one order below its own.
    np.testing.assert_allclose([motion.x, motion.v, motion.hidden[0]], run.y, atol=1e-7)


def dz(x: float, gap: float) -> float:
    return x - min(max(x, -gap), gap)


def slid(z: float) -> float:
    return min(max(z, -0.6), 0.6)


def loop_rate(v: float, z: float) -> float:
    return v - 0.9 * abs(v) * z - 0.4 * v * abs(z)


# pair -> force(x, v, z, late), rates of z, bounds of z
Formula = tuple[Callable[[float, float, Any, float], float], Callable[[float, float, Any], Any], list[tuple]]
KINKED: dict[str, tuple[Both, Formula]] = {
    "stop and loop": (
        Both(STOP, LOOP),
        (lambda x, v, z, late: 0.8 * dz(x, 0.9) + 0.5 * z[0], lambda x, v, z: [loop_rate(v, z[0])], [(-9.0, 9.0)]),
    ),
    "one-way damper and loop": (
        Both(ONE_WAY, LOOP),
        (lambda x, v, z, late: 0.2 * min(v, 0.0) + 0.5 * z[0], lambda x, v, z: [loop_rate(v, z[0])], [(-9.0, 9.0)]),
    ),
    "one-way damper and slider": (
        Both(ONE_WAY, SLIDER),
        (lambda x, v, z, late: 0.2 * min(v, 0.0) + 0.5 * slid(z[0]), lambda x, v, z: [v], [(-0.6, 0.6)]),
    ),
    "slider and loop": (
        Both(SLIDER, LOOP),
        (
            lambda x, v, z, late: 0.5 * slid(z[0]) + 0.5 * z[1],
            lambda x, v, z: [v, loop_rate(v, z[1])],
            [(-0.6, 0.6), (-9.0, 9.0)],
        ),
    ),
    "stop and late force": (
        Both(STOP, LATE),
        (lambda x, v, z, late: 0.8 * dz(x, 0.9) - 0.15 * late, lambda x, v, z: [], []),
    ),
    "slider and late force": (
        Both(SLIDER, LATE),
        (lambda x, v, z, late: 0.5 * slid(z[0]) - 0.15 * late, lambda x, v, z: [v], [(-0.6, 0.6)]),
    ),
}


def by_small_steps(formula: Formula, samples: int, steps: int, tau: float = 0.5) -> FloatArray:
    """x (samples,) by so many Runge-Kutta steps a sample, kinks neither known nor located."""
    force, rates, bounds = formula
    h = float(TIME[1]) / steps
    drive = DRIVE(0.5 * h * np.arange(2 * steps * samples + 1)).tolist()
    y, xs, vs = np.array([*START, *(0.0 for _ in bounds)]), [START[0]], [START[1]]

    def late(half: int) -> float:
        """The displacement tau before so many half steps, by the cubic through two points and slopes."""
        at = 0.5 * half - tau / h
        if at <= 0.0:
            return xs[0]
        i = min(int(at), len(xs) - 2)
        s, a, b, da, db = at - i, xs[i], xs[i + 1], h * vs[i], h * vs[i + 1]
        return a + s * (da + s * (3.0 * (b - a) - 2.0 * da - db + s * (2.0 * (a - b) + da + db)))

    def slope(half: int, y: FloatArray) -> FloatArray:
        x, v, *z = y.tolist()
        return np.array([v, drive[half] - 0.05 * v - x - force(x, v, z, late(half)), *rates(x, v, z)])

    for i in range(steps * samples - 1):
        k1 = slope(2 * i, y)
        k2 = slope(2 * i + 1, y + 0.5 * h * k1)
        k3 = slope(2 * i + 1, y + 0.5 * h * k2)
        k4 = slope(2 * i + 2, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        y[2:] = [min(max(z, low), high) for z, (low, high) in zip(y[2:], bounds, strict=True)]
        xs.append(float(y[0]))
        vs.append(float(y[1]))
    return np.array(xs[::steps])


@pytest.mark.parametrize("name", KINKED)
def test_a_pair_with_kinks_moves_as_by_brute_force(name: str):
    law, formula = KINKED[name]
    samples = 250
    motion = moved(law)
    assert motion.instants[motion.instants < TIME[samples]].size > 4
    # 2000 steps a period; a kink that is stepped over adds to the error of the smooth parts.
    np.testing.assert_allclose(motion.x[:samples], by_small_steps(formula, samples, 20), atol=2e-6)


@pytest.mark.parametrize("name", KINKED)
def test_a_hundred_times_finer_tolerance_changes_neither_motion_nor_events(name: str):
    law, _ = KINKED[name]
    rough, fine = moved(law), moved(law, 1e-13)
    np.testing.assert_allclose(rough.x, fine.x, atol=1e-7)
    np.testing.assert_allclose(rough.instants, fine.instants, atol=1e-5)


def test_a_late_force_looks_back_on_the_motion_also_where_friction_held_it():
    motion = moved(Both(FRICTION, LATE))
    late = np.where(TIME > LATE.tau, CubicSpline(TIME, motion.x)(TIME - LATE.tau), START[0])
    # A cubic spline on 100 points a period, with a kink of the acceleration at every reversal.
    np.testing.assert_allclose(motion.hidden[0], late, atol=2e-4)
    stuck, friction = motion.v == 0.0, motion.effect - LATE.k * motion.hidden[0]
    assert stuck.sum() > 20
    np.testing.assert_allclose(friction[~stuck], FRICTION.F * np.sign(motion.v[~stuck]), atol=1e-12)
    assert np.abs(friction[stuck]).max() <= FRICTION.F * (1.0 + 1e-9)
    # It is let go at its limit, and not before: the last reading of a hold is near to it.
    np.testing.assert_array_equal(np.diff(motion.x)[stuck[:-1] & stuck[1:]], 0.0)
    assert np.abs(moved(Both(FRICTION, LATE), 1e-12).x - motion.x).max() < 1e-7


def test_a_stop_of_one_law_changes_no_mode_of_the_other():
    drop = time.StiffnessDrop(dk=0.3, t_star=20.03)
    motion = moved(Both(drop, LATE))
    assert motion.instants.tolist() == [20.03]
    expected = np.where(TIME > 20.03, -0.3 * motion.x, 0.0) + LATE.k * motion.hidden[0]
    np.testing.assert_allclose(motion.effect, expected, atol=1e-12)


# what each of the two does


@pytest.mark.parametrize("law", [Both(FRICTION, CUBIC), Both(STOP, LOOP), Both(SLIDER, LATE), Both(FRICTION, RIDER)])
def test_the_parts_of_the_force_are_those_of_each_law(law: Both):
    motion = moved(law)
    one, other = law.parts(motion)
    np.testing.assert_array_equal(one + other, motion.effect)
    expected = {
        CUBIC: lambda: 0.2 * motion.x**3,
        LOOP: lambda: 0.5 * motion.hidden[0],
        LATE: lambda: -0.15 * motion.hidden[1],
        RIDER: lambda: BESIDE["attached"][1][0](0.0, motion.x, motion.v, motion.hidden),  # pyright: ignore[reportArgumentType]
    }[law.second]()
    np.testing.assert_allclose(other, expected, atol=1e-12)
    if law.first is FRICTION:
        slides = motion.v != 0.0
        np.testing.assert_allclose(one[slides], FRICTION.F * np.sign(motion.v[slides]), atol=1e-12)


@pytest.mark.parametrize(
    "law", [Both(FRICTION, CUBIC), Both(STOP, LOOP), Both(SLIDER, LATE), Both(FRICTION, RIDER), Both(STOP, HUM)]
)
def test_a_sketch_of_a_pair_is_close_to_the_exact_motion_and_its_parts(law: Both):
    rough, exact = sketch(PLANT, law, DRIVE, START, TIME), moved(law)
    np.testing.assert_allclose(rough.x, exact.x, atol=0.03 * exact.peak)
    for a, b in zip(law.parts(rough), law.parts(exact), strict=True):
        assert rms(a) == pytest.approx(rms(b), rel=0.05)


def test_a_pair_is_as_tame_as_its_wilder_law_and_reaches_as_far_as_its_shorter():
    pair = Both(STOP, damping.PowerDamping(c=0.1, n=0.5))
    assert pair.chaotic and pair.creeps and not pair.smooth and not pair.dry
    assert Both(CUBIC, HUM).smooth and not Both(CUBIC, HUM).chaotic
    bristle = memory.LuGre(F=0.3, F_static=0.5, v_s=0.2, sigma0=30.0, sigma1=3.0)
    assert Both(bristle, CUBIC).slack == bristle.slack and Both(bristle, CUBIC).twin == Both(bristle.twin, CUBIC)
    soft, square = stiffness.CubicSoftening(k3=-0.1), stiffness.SquareStiffness(k2=-0.1)
    for law in (Both(soft, square), Both(square, soft)):
        assert law.reach(1.0) == min(soft.reach(1.0), square.reach(1.0)) > 0.0
    assert Both(CUBIC, HUM).scaled(2.0) == Both(CUBIC.scaled(2.0), HUM.scaled(2.0))


def test_a_second_friction_and_a_second_delay_are_refused():
    with pytest.raises(ValueError, match="`second` must not be dry friction; got CubicHardening and Coulomb"):
        Both(CUBIC, FRICTION)
    with pytest.raises(ValueError, match="at most may have a delay; got DelayedForce and DelayedForce"):
        Both(LATE, dataclasses.replace(LATE, tau=0.7))

"""Orbits that close: against SciPy, and where there are none."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

import jfsm
from jfsm.dynamics import limit_cycles
from jfsm.dynamics._limit_cycles import _isolated

LINK = (0, 1)
STIFFNESS = 9.0


def van_der_pol(eps: float) -> jfsm.Structure:
    return jfsm.Structure.sdof(1.0, STIFFNESS) + jfsm.VanDerPol(eps, 1.0, at=LINK)


def reference(eps: float) -> tuple[float, float]:
    """Period and amplitude by DOP853: the map of the section v = 0 onto itself, its fixed point by root finding."""

    def slope(t, y):
        return y[1], -STIFFNESS * y[0] - eps * (y[0] ** 2 - 1.0) * y[1]

    def top(t, y):
        return y[1]

    top.terminal, top.direction = 3, -1  # the start counts where v rounds below zero

    def run(x):
        kick = 1e-3
        first = solve_ivp(slope, (0.0, kick), [x, 0.0], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        top.terminal = 1
        rest = solve_ivp(slope, (kick, 100.0), first, "DOP853", rtol=1e-13, atol=1e-14, events=top)
        return rest.t_events[0][0], rest.y_events[0][0][0]

    amplitude = root_scalar(lambda x: run(x)[1] - x, bracket=(1.5, 2.5), xtol=1e-14).root
    return run(amplitude)[0], amplitude


@pytest.mark.parametrize("eps", [pytest.param(10.0, marks=pytest.mark.slow), 0.3])
def test_a_van_der_pol_oscillator_has_one_stable_cycle_with_the_period_and_amplitude_of_scipy(eps):
    (cycle,) = limit_cycles(van_der_pol(eps))
    period, amplitude = reference(eps)
    np.testing.assert_allclose([cycle.period, cycle.amplitude[0]], [period, amplitude], rtol=1e-10)
    assert cycle.stable and cycle.residual < 1e-11
    # Liouville: the non-trivial multiplier is the exponential of the divergence along the orbit.
    divergence = np.mean(-eps * (cycle.orbit[:-1, 1] ** 2 - 1.0)) * cycle.period
    np.testing.assert_allclose(cycle.multipliers[0], 1.0)
    np.testing.assert_allclose(np.log(np.abs(cycle.multipliers[1])), divergence, rtol=1e-7)
    assert "Poincaré and Bendixson" in cycle.note


def test_the_strongly_driven_oscillator_has_the_figures_of_the_field():
    (cycle,) = limit_cycles(van_der_pol(10.0))
    assert (round(cycle.period, 10), round(cycle.amplitude[0], 10)) == (3.0992904174, 2.0234204141)


@pytest.mark.parametrize("eps", [0.3, 10.0])  # the weak one is close enough to be closed forward in time too
def test_driven_backward_the_same_orbit_repels(eps):
    (stable,), (unstable,) = limit_cycles(van_der_pol(eps)), limit_cycles(van_der_pol(-eps))
    assert stable.stable and not unstable.stable and unstable.note == ""
    np.testing.assert_allclose(unstable.period, stable.period, rtol=1e-10)
    np.testing.assert_allclose(unstable.amplitude, stable.amplitude, rtol=1e-10)
    np.testing.assert_allclose(unstable.multipliers[0] * stable.multipliers[1], 1.0, rtol=1e-8)
    time, x, v = unstable.orbit.T
    np.testing.assert_allclose(np.gradient(x, time), v, atol=0.01 * np.max(v))


def test_a_weakly_driven_oscillator_has_the_amplitude_and_period_of_perturbation_theory():
    eps = 0.03
    (cycle,) = limit_cycles(van_der_pol(eps))
    mu = eps / np.sqrt(STIFFNESS)
    # A. H. Nayfeh, Introduction to Perturbation Techniques: A = 2 + μ²/96, ω = ω0 (1 - μ²/16), to order μ⁴.
    np.testing.assert_allclose(cycle.amplitude, 2 + mu**2 / 96, rtol=mu**4)
    np.testing.assert_allclose(cycle.period, 2 * np.pi / np.sqrt(STIFFNESS) * (1 + mu**2 / 16), rtol=mu**4)


def test_the_orbit_is_one_period_from_its_highest_point_and_solves_the_equation_of_motion():
    (cycle,) = limit_cycles(van_der_pol(10.0))
    time, x, v = cycle.orbit.T
    assert cycle.orbit.shape == (1441, 3) and time[0] == 0.0 and time[-1] == cycle.period
    assert np.argmax(x) in (0, x.size - 1) and abs(v[0]) < 1e-9
    rerun = solve_ivp(
        lambda t, y: (y[1], -STIFFNESS * y[0] - 10.0 * (y[0] ** 2 - 1.0) * y[1]),
        (0.0, cycle.period),
        cycle.orbit[0, 1:],
        "DOP853",
        t_eval=time[::40],
        rtol=1e-12,
        atol=1e-12,
    )
    np.testing.assert_allclose(rerun.y.T, cycle.orbit[::40, 1:], atol=1e-7 * np.max(np.abs(v)))


def test_units_of_length_and_time_do_not_matter():
    (metre,) = limit_cycles(van_der_pol(10.0))
    length, time = 1e-6, 1e-3  # micrometres and milliseconds
    other = jfsm.Structure.sdof(1.0, STIFFNESS / time**2) + jfsm.VanDerPol(10.0 / time, length, at=LINK)
    (small,) = limit_cycles(other)
    np.testing.assert_allclose(small.period, time * metre.period, rtol=1e-9)
    np.testing.assert_allclose(small.amplitude, length * metre.amplitude, rtol=1e-9)


def test_a_constant_force_makes_the_orbit_lopsided_and_a_large_one_ends_it():
    (cycle,) = limit_cycles(van_der_pol(1.0), force=[0.5 * STIFFNESS])
    run = solve_ivp(
        lambda t, y: (y[1], STIFFNESS * (0.5 - y[0]) - (y[0] ** 2 - 1.0) * y[1]),
        (0.0, cycle.period),
        cycle.orbit[0, 1:],
        "DOP853",
        rtol=1e-12,
        atol=1e-12,
        dense_output=True,
    )
    x = run.sol(np.linspace(0.0, cycle.period, 100_001))[0]
    np.testing.assert_allclose(cycle.amplitude, np.ptp(x) / 2, rtol=1e-8)
    assert abs(np.max(x) + np.min(x)) > 0.1
    assert limit_cycles(van_der_pol(1.0), force=[1.5 * STIFFNESS]) == ()


@pytest.mark.parametrize("damping", [0.0, 0.12])
def test_orbits_that_are_not_isolated_are_no_limit_cycles(damping):
    model = jfsm.Structure.sdof(1.0, 9.0, damping) + jfsm.CubicStiffness(10.0, at=LINK)
    assert limit_cycles(model) == ()


def test_a_second_multiplier_of_one_means_a_family_of_orbits():
    assert _isolated(np.array([1.0, 0.5, 2.0])) and not _isolated(np.array([1.0, 1.0 + 1e-7, 0.5]))


def test_starts_can_be_given():
    (cycle,) = limit_cycles(van_der_pol(1.0), starts=[[0.1, 0.0]])
    assert cycle.stable
    assert limit_cycles(van_der_pol(-1.0), starts=[[0.1, 0.0]])[0].stable is False


@pytest.mark.slow
def test_two_masses_keep_up_each_mode_that_is_driven():
    model = jfsm.Structure.chain([1.0, 1.0], [9.0, 5.0]) + jfsm.VanDerPol(1.0, 1.0, at=LINK)
    cycles = limit_cycles(model)
    assert len(cycles) >= 2 and all(cycle.stable for cycle in cycles)

    def slope(t, y):
        link = 5.0 * (y[1] - y[0])
        return [*y[2:], -9.0 * y[0] - (y[0] ** 2 - 1.0) * y[2] + link, -link]

    for cycle in cycles:
        run = solve_ivp(
            slope, (0.0, cycle.period), cycle.orbit[0, 1:], "DOP853", rtol=1e-12, atol=1e-12, dense_output=True
        )
        np.testing.assert_allclose(run.y[:, -1], cycle.orbit[0, 1:], atol=1e-9)
        fine = run.sol(np.linspace(0.0, cycle.period, 20001))[:2]
        np.testing.assert_allclose(cycle.amplitude, np.ptp(fine, axis=1) / 2, rtol=1e-6)
        assert cycle.multipliers.shape == (4,) and np.min(np.abs(cycle.multipliers - 1.0)) < 1e-8


@pytest.mark.parametrize("starts", [[[0.1, 0.0, 1.0]], np.zeros((0, 2))])
def test_starts_of_another_shape_are_refused(starts):
    with pytest.raises(ValueError, match="`starts` must hold one state a row, 1 displacements, then 1 velocities"):
        limit_cycles(van_der_pol(1.0), starts)


def test_friction_that_sticks_is_refused():
    with pytest.raises(ValueError, match="must hold no friction that sticks: coulomb@0-1"):
        limit_cycles(van_der_pol(1.0) + jfsm.Coulomb(1.0, at=LINK))

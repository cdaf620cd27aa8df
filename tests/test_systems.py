"""The reference systems: each is its equation, and has the properties that its docstring states."""

import inspect
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm
from scipy.optimize import brentq, minimize_scalar
from scipy.signal import find_peaks
from scipy.special import ellipk

import jfsm
from jfsm import systems
from jfsm._result import Result
from jfsm.structures import AbstractFriction

N = 300


def pull(model: jfsm.Structure, x: Any, v: Any = 0.0, t: float = 0.0) -> np.ndarray:
    """Forces (dof,) of all terms without memory at one state; friction at rest counts as none."""
    force, x, v = np.zeros(model.dof + 1), np.append(0.0, x), np.append(0.0, np.broadcast_to(v, model.dof))
    for term in model.terms:
        i, j = term.at
        one = float(term.force(jnp.asarray(x[j] - x[i]), jnp.asarray(v[j] - v[i]), jnp.zeros(0), jnp.asarray(t)))
        force[[i, j]] += -one, one
    return force[1:]


def slopes(model: jfsm.Structure, x: Any = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and damping matrix at rest at `x`, by central differences."""
    step, x = 1e-6, np.broadcast_to(x, model.dof)
    ways = step * np.eye(model.dof)
    k = [(pull(model, x + h) - pull(model, x - h)) / (2 * step) for h in ways]
    c = [(pull(model, x, h) - pull(model, x, -h)) / (2 * step) for h in ways]
    mass = np.asarray(model.mass)
    return np.diag(mass) if mass.ndim == 1 else mass, np.array(k).T, np.array(c).T


def poles(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Eigenvalues of the state matrix by their size; of a pair the one above the axis."""
    one, zero = np.eye(len(mass)), np.zeros_like(mass)
    found = np.linalg.eigvals(
        np.block([[zero, one], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    )
    found = found[np.imag(found) >= 0]
    return found[np.argsort(np.abs(found))]


def damping_ratios(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    found = poles(mass, stiffness, damping)
    return -np.real(found) / np.abs(found)


@eqx.filter_jit
def rate(model: jfsm.Structure, y, t):
    """Rate of (x, v, hidden states) of a structure of one degree of freedom without drive."""
    x, v, z, force, rates = y[0], y[1], y[2:], jnp.zeros(()), []
    for term in model.terms:
        own, z = z[: term.states], z[term.states :]
        force += term.force(x, v, own, t)
        rates.append(term.state_rate(x, v, own, t))
    return jnp.concatenate([jnp.stack([v, -force / model.mass[0]]), *rates])


def scipy_run(model: jfsm.Structure, end: float, x0: float, v0: float, force: Callable = lambda t: 0.0) -> np.ndarray:
    """States (N + 1, 2 + hidden) of one degree of freedom by DOP853, the laws alone being jfsm's."""
    hidden = [t.initial_state(jnp.asarray(x0), jnp.asarray(v0)) for t in model.terms]
    start, drive = np.concatenate([[x0, v0], *hidden]), np.zeros(2 + sum(t.states for t in model.terms))
    drive[1] = 1 / float(model.mass[0])

    def slope(t, y):
        return np.asarray(rate(model, jnp.asarray(y), jnp.asarray(t))) + force(t) * drive

    run = solve_ivp(slope, (0, end), start, "DOP853", np.linspace(0, end, N + 1), rtol=1e-9, atol=1e-12)
    return run.y.T


def simulate(model: jfsm.Structure, end: float, x0, v0, force: Any = 0.0) -> jfsm.Response:
    """Motion from a state to an instant by jfsm, N samples after the first."""
    record = jfsm.Record(time=np.linspace(0.0, end, N + 1), force=np.broadcast_to(force, (N + 1, model.dof)))
    state = np.broadcast_to(x0, model.dof), np.broadcast_to(v0, model.dof)
    return jfsm.simulate(model, record, initial_state=state, reconstruction="linear", solver="grid")


def undamped(model: jfsm.Structure) -> jfsm.Structure:
    return model.with_values({path: 0.0 for path in model.select("damping")})


# The tables


def test_every_function_that_returns_a_structure_is_listed_once_under_its_name():
    made = {
        name: function
        for name, function in inspect.getmembers(systems, inspect.isfunction)
        if not name.startswith("_") and inspect.signature(function).return_annotation is jfsm.Structure
    }
    assert made == systems.ALL
    assert not systems.PAPER.keys() & systems.FIELD.keys()


@pytest.mark.parametrize("name", systems.ALL)
def test_a_system_reads_back_from_its_file(name, tmp_path):
    model = systems.ALL[name]()
    model.save(tmp_path / "model.toml")
    read = jfsm.Structure.load(tmp_path / "model.toml")
    assert read.values() == model.values()
    np.testing.assert_array_equal(read.mass, model.mass)


SIZES = {  # seconds, newtons
    **{name: (1.0, 5.0) for name in ("bilinear", "coulomb", "bilinear_coulomb", "end_stops", "stribeck")},
    **{name: (1.0, 5.0) for name in ("jenkins", "iwan", "zener", "tuned_mass_damper", "rotor")},
    **dict(frame=(0.5, 1.0), cubic_chain=(2.0, 10.0), cubic_coulomb_chain=(2.0, 10.0), silverbox=(0.1, 0.1)),
    **dict(emps=(1.0, 50.0), lugre=(0.1, 2.0), bouc_wen=(0.3, 120.0), wing_section=(1.0, 1.0)),
}
QUICK = "duffing", "van_der_pol", "pendulum"  # the others wait for programs of other classes
MOVING = [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in systems.ALL if n != "kinked_spring"]


@pytest.mark.parametrize("name", MOVING)
def test_a_mild_force_moves_a_system_and_does_not_drive_it_away(name):
    model = systems.ALL[name]()
    end, size = SIZES.get(name, (6.0, 0.1))
    angle = np.linspace(0.0, 2 * np.pi, N + 1)[:, None]
    force = size * (np.sin(3 * angle) + np.cos(8 * angle)) * (np.arange(model.dof) == 0)
    run = simulate(model, end, 0.0, 0.0, force)
    assert run.result == Result.successful and len(run.time) == N + 1
    assert np.all(np.isfinite(run.displacement)) and np.std(run.displacement[:, 0]) > 0


# Each is its equation, written here a second time


def frame_force(x, v, t):
    stiffness = [[19539.0, 0, 366], [0, 19539, -766], [366, -766, 792]]
    damping = [[11.3388, -0.2256, 0.0034], [-0.2256, 11.7035, -0.0072], [0.0034, -0.0072, 0.1306]]
    return np.array(stiffness) @ x + np.array(damping) @ v


def chain_force(x, v, t):
    stiffness = np.array([[360.0, -240.0], [-240.0, 240.0]])
    root = np.sqrt(np.linalg.det(stiffness))  # of two by two: √K = (K + √det K)/√(tr K + 2 √det K)
    damping = 2 * 0.02 * (stiffness + root * np.eye(2)) / np.sqrt(np.trace(stiffness) + 2 * root)
    return stiffness @ x + [1000 * x[0] ** 3, 0] + damping @ v


def with_friction(law, mu):
    return lambda x, v, t: law(x, v, t) + mu * np.sign(v) * (np.arange(v.size) == 0)


def beyond(d, gap):
    return np.sign(d) * np.maximum(np.abs(d) - gap, 0.0)


def pair_force(x, v, t):
    joint = 0.5 * (x[0] - x[1]) ** 3
    return [0.1 * v[0] + x[0] + x[0] ** 3 + joint, 0.1 * v[1] + x[1] + x[1] ** 3 - joint]


def rotor_force(x, v, t):
    return 40 * v + 4e4 * x - 10 * 1e-4 * 50**2 * np.array([np.cos(50 * t), np.sin(50 * t)])


def bilinear_force(x, v, t):
    return 2.6608269391 * v + 2500 * x + 3750 * x * (x > 0)


def plain_force(x, v, t):
    return 2.6608269391 * v + 2500 * x


EQUATIONS: dict[str, tuple[Any, Callable]] = {
    "linear": (1.0, lambda x, v, t: 0.12 * v + 9 * x),
    "duffing": (1.0, lambda x, v, t: 0.12 * v + 9 * x + 10 * x**3),
    "negative_duffing": (1.0, lambda x, v, t: 0.12 * v - 9 * x + 10 * x**3),
    "van_der_pol": (1.0, lambda x, v, t: -10 * v * (1 - x**2) + 9 * x),
    "frame": ([4.75, 4.75, 0.05032], frame_force),
    "cubic_chain": ([1.0, 1.0], chain_force),
    "bilinear": (1.77, bilinear_force),
    "coulomb": (1.77, with_friction(plain_force, 1.5)),
    "bilinear_coulomb": (1.77, with_friction(bilinear_force, 1.5)),
    "cubic_coulomb_chain": ([1.0, 1.0], with_friction(chain_force, 5.0)),
    "kinked_spring": (0.0, lambda x, v, t: 0.8 * np.abs(x - 6)),
    "softening_duffing": (1.0, lambda x, v, t: 0.12 * v + 9 * x - x**3),
    "holmes": (1.0, lambda x, v, t: 0.25 * v - x + x**3),
    "ueda": (1.0, lambda x, v, t: 0.05 * v + x**3),
    "helmholtz": (1.0, lambda x, v, t: 0.1 * v + x - x**2),
    "rayleigh": (1.0, lambda x, v, t: -v + v**3 / 3 + x),
    "silverbox": (5.3756e-6, lambda x, v, t: 2.2527e-4 * v + 0.99056 * x + 3.9272 * x**3),
    "pendulum": (1.0, lambda x, v, t: 0.02 * v + 9.80665 * np.sin(x)),
    "end_stops": (1.0, lambda x, v, t: 0.4 * v + 100 * x + 900 * beyond(x, 0.01)),
    "stribeck": (1.0, lambda x, v, t: 0.4 * v + 100 * x + np.sign(v) * (1 + 0.5 * np.exp(-((v / 0.02) ** 2)))),
    "emps": (95.109, lambda x, v, t: 203.5 * v + 20.394 * np.sign(v) - 3.165),
    "mathieu": (1.0, lambda x, v, t: 0.1 * v + (1 + 0.15 * np.cos(2 * t)) * x),
    "rotor": ([10.0, 10.0], rotor_force),
    "duffing_pair": ([1.0, 1.0], pair_force),
    "normal_modes": ([1.0, 1.0], lambda x, v, t: [2 * x[0] - x[1] + 0.5 * x[0] ** 3, 2 * x[1] - x[0]]),
    "wing_section": (
        [[2.0, 0.05], [0.05, 0.01]],
        lambda x, v, t: [0.8 * v[0] + 800 * x[0], 0.006 * v[1] + 9 * beyond(x[1], 0.02)],
    ),
}


def lugre_force(x, v, z):
    rate = v - 1e5 * np.abs(v) * z / (1 + 0.5 * np.exp(-((v / 1e-3) ** 2)))
    return 2 * x + 0.4 * v + 1e5 * z[0] + np.sqrt(1e5) * rate[0], rate


def bouc_wen_force(x, v, z):
    force = 5e4 * z  # the benchmark's z
    return 5e4 * x + 10 * v + force[0], v - (0.8 * np.abs(v) * force - 1.1 * v * np.abs(force)) * 1e3 / 5e4


def slider_force(k, slips):
    slips = np.array(slips)

    def law(x, v, z):
        held = (np.abs(z) < slips) | (z * v < 0)
        return 0.4 * v + 100 * x + k * np.mean(np.clip(z, -slips, slips)), np.where(held, v, 0.0)

    return law


def absorber_force(x, v, z):
    omega = 10 / 1.05
    pull = omega**2 * (x - z[0]) + 2 * np.sqrt(0.15 / 8.4) * omega * (v - z[1])
    return 100 * x + 0.05 * pull, [z[1], pull]


REMEMBERING: dict[str, tuple[float, Callable]] = {  # mass; force and rate of the hidden states
    "lugre": (1.0, lugre_force),
    "bouc_wen": (2.0, bouc_wen_force),
    "jenkins": (1.0, slider_force(50.0, [0.01])),
    "iwan": (1.0, slider_force(50.0, 0.01 * ((np.arange(16) + 0.5) / 16) ** 2)),  # χ = -0.5
    "zener": (1.0, lambda x, v, z: (100 * x + 50 * z[0], v - 10 * z)),
    "tuned_mass_damper": (1.0, absorber_force),
    "delayed": (1.0, lambda x, v, z: (1.5 * x - 0.25 * x, z)),  # where nothing moves
}


def test_every_system_has_its_equation_above():
    assert EQUATIONS.keys() | REMEMBERING.keys() == systems.ALL.keys() and not EQUATIONS.keys() & REMEMBERING.keys()


@pytest.mark.parametrize("name", REMEMBERING)
def test_a_system_with_a_memory_is_its_equation(name):
    mass, law = REMEMBERING[name]
    model, rng = systems.ALL[name](), np.random.default_rng(0)
    np.testing.assert_array_equal(model.mass, [mass])
    for size in (1e-4, 0.002, 0.02):
        x, v, *z = size * rng.normal(size=2 + sum(term.states for term in model.terms))
        force, rates = law(x, v, np.array(z))
        found = np.asarray(rate(model, jnp.asarray([x, v, *z]), jnp.zeros(())))
        np.testing.assert_allclose(found, [v, -force / mass, *rates], rtol=1e-9, atol=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("name", EQUATIONS)
def test_a_system_is_its_equation(name):
    mass, law = EQUATIONS[name]
    model, rng = systems.ALL[name](), np.random.default_rng(0)
    np.testing.assert_array_equal(model.mass, np.atleast_1d(mass))
    for size in (0.05, 1.0, 10.0):
        x, v, t = size * rng.normal(size=model.dof), size * rng.normal(size=model.dof), size
        np.testing.assert_allclose(pull(model, x, v, t), law(x, v, t), rtol=1e-9, atol=1e-9 * size)


# Points of rest, cycles, and small motion


REST = {  # coefficients of the force, stable points
    "duffing": ((10.0, 0.0, 9.0, 0.0), [0.0]),
    "negative_duffing": ((10.0, 0.0, -9.0, 0.0), [-np.sqrt(0.9), np.sqrt(0.9)]),
    "softening_duffing": ((-1.0, 0.0, 9.0, 0.0), [0.0]),
    "holmes": ((1.0, 0.0, -1.0, 0.0), [-1.0, 1.0]),
    "helmholtz": ((-1.0, 1.0, 0.0), [0.0]),
}


def real_roots(coefficients) -> np.ndarray:
    roots = np.roots(coefficients)
    return np.sort(np.real(roots[np.abs(np.imag(roots)) < 1e-9]))


@pytest.mark.parametrize("name", REST)
def test_a_polynomial_oscillator_rests_at_the_roots_of_its_force(name):
    coefficients, stable = REST[name]
    model, roots = systems.ALL[name](), real_roots(coefficients)
    np.testing.assert_allclose([pull(model, x)[0] for x in roots], 0.0, atol=1e-12)
    held = [x for x in roots if np.all(np.real(poles(*slopes(model, x))) < 0)]
    np.testing.assert_allclose(held, stable, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", REST)
def test_jfsm_finds_these_points_of_rest(name):
    coefficients, stable = REST[name]
    points = jfsm.fixed_points(systems.ALL[name]())
    np.testing.assert_allclose([p.state[0] for p in points], real_roots(coefficients), atol=1e-12)
    np.testing.assert_allclose([p.state[0] for p in points if p.stable], stable, atol=1e-12)


def test_the_printed_wells_of_the_negative_duffing_oscillator_are_not_those_of_its_printed_numbers():
    model, well = systems.negative_duffing(), np.sqrt(9.0 / 10.0)
    assert round(well, 4) == 0.9487 and pull(model, well)[0] == pytest.approx(0.0, abs=1e-14)
    assert pull(model, -0.88)[0] > 1.0 and pull(model, 0.89)[0] < -0.9  # no points of rest: a tenth of 9 N/m times 1 m
    np.testing.assert_allclose(poles(*slopes(model, well)), [-0.06 + 4.2422j], atol=5e-5)


def test_the_pendulum_rests_at_every_half_turn():
    model, turns = systems.pendulum(), np.pi * np.arange(-2, 3)
    np.testing.assert_allclose([pull(model, x)[0] for x in turns], 0.0, atol=1e-14)
    assert [np.all(np.real(poles(*slopes(model, x))) < 0) for x in turns] == [True, False, True, False, True]


CYCLES = {"van_der_pol": (3.0992904174, 2.0234204141), "rayleigh": (6.6632868593, 2.1727136)}


@pytest.mark.parametrize("name", CYCLES)
def test_the_limit_cycle_closes_after_the_stated_period(name):
    law, (period, amplitude) = EQUATIONS[name][1], CYCLES[name]

    def slope(t, y):
        return y[1], -law(y[0], y[1], t)

    def top(t, y):
        return y[1]

    top.terminal, top.direction = True, -1

    def back(x0):
        start = solve_ivp(slope, (0, 0.01), [x0, 0.0], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        run = solve_ivp(slope, (0.01, 20), start, "DOP853", events=top, rtol=1e-13, atol=1e-14)
        return run.t_events[0][0], run.y_events[0][0][0]

    highest = brentq(lambda x: back(x)[1] - x, 1.5, 2.5, xtol=1e-13)
    assert back(highest)[0] == pytest.approx(period, abs=1e-10)
    assert highest == pytest.approx(amplitude, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("name", CYCLES)
def test_jfsm_finds_this_limit_cycle(name):
    (cycle,) = jfsm.limit_cycles(systems.ALL[name]())
    assert cycle.stable
    np.testing.assert_allclose([cycle.period, cycle.amplitude[0]], CYCLES[name], rtol=0, atol=1e-7)


SMALL = {
    "linear": ([3.0], [0.02]),
    "cubic_chain": ([7.2535, 23.3963], [0.02, 0.02]),
    "silverbox": ([2 * np.pi * 68.3], [0.0488]),
    "normal_modes": ([1.0, np.sqrt(3.0)], [0.0, 0.0]),
    "frame": ([2 * np.pi * f for f in (9.887, 10.208, 20.13)], [0.0200, 0.0184, 0.0103]),
}


@pytest.mark.parametrize("name", SMALL)
def test_small_motion_has_the_stated_frequencies_and_damping_ratios(name):
    frequencies, ratios = SMALL[name]
    matrices = slopes(systems.ALL[name]())
    np.testing.assert_allclose(np.abs(poles(*matrices)), frequencies, rtol=1e-3)
    np.testing.assert_allclose(damping_ratios(*matrices), ratios, rtol=5e-3, atol=1e-9)


# What the paper prints


FRAME_K = np.array([[1.9539, 0, 0.0366], [0, 1.9539, -0.0766], [0.0366, -0.0766, 0.0792]]) * 1e4
FRAME_C = np.array([[11.3388, -0.2256, 0.0034], [-0.2256, 11.7035, -0.0072], [0.0034, -0.0072, 0.1306]])
CHAIN_K = np.array([[360.0, -240.0], [-240.0, 240.0]])


def modal(inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies times √m, and Φᵀ C Φ of the frame's printed matrices at a ratio I/m."""
    squares, shapes = eigh(FRAME_K, np.diag([1.0, 1.0, inertia]))
    return np.sqrt(squares), shapes.T @ FRAME_C @ shapes


def coupling(inertia: float) -> float:
    """Coupling of the modes by the damping, 0 for a modal matrix."""
    damping = modal(inertia)[1]
    scale = np.sqrt(np.diag(damping))
    return float(np.linalg.norm(damping / np.outer(scale, scale) - np.eye(3)))


def test_the_frames_printed_damping_is_modal_at_one_ratio_of_inertia_to_mass():
    found = minimize_scalar(lambda r: coupling(np.exp(r)), bounds=np.log([1e-3, 1.0]), method="bounded")
    mass = np.asarray(systems.frame().mass)
    assert mass[2] / mass[0] == pytest.approx(np.exp(found.x), rel=3e-4)  # pyright: ignore[reportAttributeAccessIssue]
    assert coupling(mass[2] / mass[0]) < 1e-3 < 0.01 < coupling(1.1 * mass[2] / mass[0])


def test_no_common_damping_ratio_makes_the_frames_printed_damping_and_three_do():
    model = systems.frame()
    mass = np.diag(np.asarray(model.mass))
    frequencies, damping = modal(mass[2, 2] / mass[0, 0])
    ratios = np.diag(damping) / (2 * frequencies)  # times √m
    np.testing.assert_allclose(ratios, [0.0436, 0.0402, 0.0224], atol=5e-5)
    np.testing.assert_allclose(frequencies / frequencies[0], [1, 1.032, 2.036], atol=5e-4)
    ratios = ratios / np.sqrt(mass[0, 0])
    rebuilt = systems.modal_damping(mass, FRAME_K, ratios)
    np.testing.assert_allclose(rebuilt, FRAME_C, atol=1e-3)  # K is printed to 0.5 N/m
    for common in np.linspace(0.005, 0.03, 26):
        assert np.max(np.abs(systems.modal_damping(mass, FRAME_K, common) - FRAME_C)) > 0.2


def dashpots(c1: float, c2: float) -> np.ndarray:
    """The form of (88)."""
    return np.array([[c1 + c2, -c2], [-c2, c2]])


def test_the_printed_damping_of_two_masses_is_modal_and_not_of_the_papers_form():
    squares, shapes = np.linalg.eigh(CHAIN_K)
    true = shapes @ np.diag(2 * 0.02 * np.sqrt(squares)) @ shapes.T
    np.testing.assert_array_equal(np.round(true, 4), [[0.6913, -0.3132], [-0.3132, 0.5347]])
    np.testing.assert_allclose(slopes(systems.cubic_chain())[2], true, rtol=1e-6)
    np.testing.assert_allclose(damping_ratios(np.eye(2), CHAIN_K, true), 0.02)
    assert abs(true[1, 1] + true[0, 1]) > 0.2  # (89) has c22 = -c12
    assert systems.cubic_chain().values()["damping@0-2.c"] == pytest.approx(0.2215, abs=5e-5)
    np.testing.assert_allclose(damping_ratios(np.eye(2), CHAIN_K, dashpots(0.74718, 0.23938)), 0.02, atol=1e-6)
    first_row = dashpots(true[0].sum(), -true[0, 1])  # read as (89) says
    assert damping_ratios(np.eye(2), CHAIN_K, first_row)[0] < 0.0106


def test_the_estimated_dashpot_of_case_5_is_an_entry_of_the_modal_matrix():
    assert round(2 * 0.02 * np.sqrt(np.linalg.eigvalsh(CHAIN_K)[1]), 4) == 0.9359
    assert all(damping_ratios(np.eye(2), CHAIN_K, dashpots(c1, 0.9359))[1] > 0.039 for c1 in np.linspace(0.0, 2.0, 21))


def test_case_4_is_damped_by_two_per_cent_of_critical():
    values = systems.coulomb().values()
    assert values["damping@0-1.c"] / (2 * np.sqrt(2500 * 1.77)) == pytest.approx(0.02)


def test_the_examples_are_the_papers_pieces():
    x = np.array([4.0, 4.5, 5.0, 5.5, 6.0, 7.0])
    pieces = [-0.5 - 0.8 * (x - 6), 0.5 - 0.8 * (x - 6), 0.5 + 0.8 * (x - 6)]  # (51)
    np.testing.assert_allclose(systems.example_3(x), np.select([x < 5, x < 6], pieces[:2], pieces[2]), atol=1e-15)
    np.testing.assert_array_equal(systems.example_1(x), [-0.5, -0.5, -0.5, -0.5, 0.5, 0.5])
    np.testing.assert_allclose(systems.example_2(x), [1.6, 1.2, 0.8, 0.4, 0.0, 0.8], atol=1e-15)
    np.testing.assert_allclose([pull(systems.kinked_spring(), d, 0.0)[0] for d in x], systems.example_2(x))
    assert list(systems.EXAMPLES.values()) == [systems.example_1, systems.example_2, systems.example_3]


def test_a_massless_component_has_no_free_motion():
    with pytest.raises(ValueError, match="`mass` must be positive for the structure to move"):
        simulate(systems.kinked_spring(), 1.0, 6.0, 0.0)


# Motions with a known course


def stops_period(amplitude: float) -> float:
    """Period between end stops, from the two pieces of a quarter: the quick way up from the stop, the way to it."""
    inside, beyond_it, gap = 10.0, np.sqrt(1000.0), 0.01
    centre = 900 * gap / 1000
    reach = amplitude - centre
    quarter = np.arccos((gap - centre) / reach)
    speed = beyond_it * reach * np.sin(quarter)
    return 4 * (quarter / beyond_it + np.arctan(inside * gap / speed) / inside)


@pytest.mark.parametrize(
    "name, amplitude, period",
    [
        ("bilinear", 0.01, 0.136460784),
        ("bilinear", 0.0003, 0.136460784),
        ("ueda", 2.0, 4 * ellipk(0.5) / 2.0),
        ("pendulum", 2.5, 4 * np.sqrt(1 / 9.80665) * ellipk(np.sin(1.25) ** 2)),
        ("pendulum", 1e-3, 2.0064),
        ("end_stops", 0.025, stops_period(0.025)),
    ],
)
def test_without_damping_a_free_motion_comes_back_after_the_stated_period(name, amplitude, period):
    end = scipy_run(undamped(systems.ALL[name]()), period, amplitude, 0.0)[-1]
    size = 2 * np.pi * amplitude / period
    np.testing.assert_allclose(end / [amplitude, size], [1.0, 0.0], atol=1e-4 if amplitude == 1e-3 else 1e-6)


def test_a_motion_leaves_helmholtzs_well_only_from_beyond_half_a_unit():
    model = undamped(systems.helmholtz())
    assert np.max(np.abs(scipy_run(model, 12.0, -0.49, 0.0)[:, 0])) < 1.0
    assert np.max(scipy_run(model, 7.0, -0.51, 0.0)[:, 0]) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name, amplitude", [("holmes", 0.3), ("ueda", 7.5)])
def test_neighbouring_motions_part_under_the_stated_force(name, amplitude):
    law = EQUATIONS[name][1]

    def slope(t, y):
        x, v, dx, dv = y
        stiffness = (law(x + 1e-6, v, t) - law(x - 1e-6, v, t)) / 2e-6
        damping = law(0.0, 1.0, t) - law(0.0, 0.0, t)
        return v, amplitude * np.cos(t) - law(x, v, t), dv, -stiffness * dx - damping * dv

    state, growth, periods = np.array([0.1, 0.0, 1.0, 0.0]), 0.0, 200
    for _ in range(periods):
        state = solve_ivp(slope, (0, 2 * np.pi), state, "DOP853", rtol=1e-8, atol=1e-8).y[:, -1]
        size = np.hypot(*state[2:])
        growth, state[2:] = growth + np.log(size), state[2:] / size
    assert growth / (2 * np.pi * periods) > 0.05  # the largest Lyapunov exponent


RESTS = {  # where a sticking system may rest, and its greatest friction
    "coulomb": (-0.6e-3, 0.6e-3, 1.5),
    "bilinear_coulomb": (-0.6e-3, 0.24e-3, 1.5),
    "stribeck": (-0.015, 0.015, 1.5),
}


@pytest.mark.parametrize("name", RESTS)
def test_friction_holds_a_system_anywhere_within_the_stated_bounds(name):
    low, high, most = RESTS[name]
    model = systems.ALL[name]()
    np.testing.assert_allclose([pull(model, low)[0], pull(model, high)[0]], [-most, most])
    (friction,) = (term for term in model.terms if isinstance(term, AbstractFriction))
    zero = jnp.zeros(())
    np.testing.assert_allclose(friction.limits(zero, zero, zero, zero), (-most, most))


@pytest.mark.slow
def test_dry_friction_takes_four_times_its_stretch_a_period():
    period = 2 * np.pi / np.sqrt(2500 / 1.77)
    run = simulate(undamped(systems.coulomb()), 3 * period, 0.02, 0.0)
    np.testing.assert_allclose(run.displacement[[100, 200, 300], 0], 0.02 - 0.0024 * np.arange(1, 4), rtol=1e-5)


def test_the_positioning_axis_sticks_and_slides_as_stated():
    model = systems.emps()
    (dry,) = (term for term in model.terms if isinstance(term, AbstractFriction))
    zero = jnp.zeros(())
    rest = pull(model, 0.0)[0]  # the offset as a restoring force
    np.testing.assert_allclose(rest + np.array(dry.limits(zero, zero, zero, zero)), [-23.559, 17.229])
    for drive, speed in ((20.0, (20 + 3.165 - 20.394) / 203.5), (-30.0, (-30 + 3.165 + 20.394) / 203.5)):
        assert pull(model, 0.0, speed)[0] == pytest.approx(drive) and np.sign(speed) == np.sign(drive)


def test_stuck_bristles_vibrate_as_stated():
    run = scipy_run(systems.lugre(), 0.05, 0.0, 1e-8)
    omega, ratio = np.sqrt(1e5 + 2), (np.sqrt(1e5) + 0.4) / (2 * np.sqrt(1e5 + 2))
    assert (round(omega), round(ratio, 2)) == (316, 0.5)
    time, beat = np.linspace(0, 0.05, N + 1), omega * np.sqrt(1 - ratio**2)
    true = 1e-8 * np.exp(-ratio * omega * time) * np.sin(beat * time) / beat
    np.testing.assert_allclose(run[:, 0], true, atol=1e-3 * np.max(true))


def test_the_hysteretic_benchmark_moves_as_its_own_equations_say():
    def drive(t):
        return 120 * np.sin(2 * np.pi * 30 * t) + 60 * np.cos(2 * np.pi * 11 * t)

    def slope(t, y):
        x, v, z = y
        return v, (drive(t) - 10 * v - 5e4 * x - z) / 2, 5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z))

    times = np.linspace(0, 0.05, N + 1)
    true = solve_ivp(slope, (0, 0.05), [0, 0, 0], "DOP853", times, rtol=1e-9, atol=1e-12).y
    run = scipy_run(systems.bouc_wen(), 0.05, 0.0, 0.0, drive)
    np.testing.assert_allclose(run[:, 0], true[0], atol=1e-6 * np.max(np.abs(true[0])))
    np.testing.assert_allclose(5e4 * run[:, 2], true[2], atol=1e-6 * np.max(np.abs(true[2])))
    free = scipy_run(systems.bouc_wen(), 1 / 35.59, 1e-7, 0.0)[:, 0]  # from a relaxed spring: about k/(k + α) of it
    middle = 0.5e-7
    np.testing.assert_allclose(free[-1] - middle, middle * np.exp(-2 * np.pi * 0.0112), rtol=1e-3)
    # stretched from rest, however slowly: z' = y' (1 + 300 z/α)
    stretch = solve_ivp(lambda y, z: 5e4 - 1e3 * (0.8 * z - 1.1 * abs(z)), (0, 2e-3), [0], rtol=1e-10, atol=1e-9)
    assert stretch.y[0, -1] == pytest.approx(5e4 * np.expm1(300 * 2e-3) / 300, rel=1e-8)


def loop(term, motion: np.ndarray) -> np.ndarray:
    """Force of a joint of sliders along an imposed motion."""
    z, found = term.initial_state(jnp.asarray(motion[0]), jnp.zeros(())), []
    for before, d in zip(motion[:-1], motion[1:], strict=True):
        z = term.settle(jnp.asarray(d), z + (d - before))
        found.append(float(term.force(jnp.asarray(d), jnp.zeros(()), z, jnp.zeros(()))))
    return np.array(found)


def test_a_slider_takes_the_stated_energy_a_cycle():
    amplitude, slip = 0.03, 0.01
    there, back = np.linspace(-amplitude, amplitude, 61), np.linspace(amplitude, -amplitude, 61)
    path = np.concatenate([np.linspace(0, -amplitude, 31), there, back])
    force = loop(systems.jenkins().terms[-1], path)
    middle = (np.concatenate([[0.0], force])[:-1] + force) / 2
    work = np.sum((middle * np.diff(path))[30:])
    assert work == pytest.approx(4 * 50 * slip * (amplitude - slip), rel=1e-9)


def test_a_stuck_slider_adds_its_stiffness():
    assert loop(systems.jenkins().terms[-1], np.array([0.0, 1e-6]))[0] == pytest.approx(50 * 1e-6)


def test_a_joint_of_sliders_has_the_stated_stiffness_and_force():
    term = systems.iwan().terms[-1]
    assert loop(term, np.array([0.0, 1e-6]))[0] == pytest.approx(50 * 1e-6)
    assert loop(term, np.array([0.0, 0.02]))[0] == pytest.approx(1 / 6, rel=2e-3)  # sixteen sliders for a continuum


def test_the_standard_solid_has_the_stated_poles():
    matrix = np.array([[0, 1, 0], [-100, 0, -50], [0, 1, -10]])
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(matrix)), np.sort_complex(np.roots([1, 10, 100 + 50, 100 * 10]))
    )
    run = scipy_run(systems.zener(), 1.0, 0.02, 0.0)
    np.testing.assert_allclose(run[-1], expm(matrix) @ [0.02, 0.0, 0.0], atol=1e-9)


def test_the_absorber_leaves_two_peaks_of_the_stated_height():
    values = systems.tuned_mass_damper().values()
    m, omega, zeta = (values[f"attached_oscillator@0-1.{name}"] for name in ("m", "omega", "zeta"))
    k, c = m * omega**2, 2 * m * zeta * omega
    mass, stiffness = np.diag([1.0, m]), np.array([[100 + k, -k], [-k, k]])
    damping = c * np.array([[1.0, -1.0], [-1.0, 1.0]])
    w = np.linspace(5, 15, 20001)[:, None, None]
    response = 100 * np.abs(np.linalg.inv(stiffness - w**2 * mass + 1j * w * damping)[:, 0, 0])
    peaks = response[find_peaks(response)[0]]
    assert len(peaks) == 2
    np.testing.assert_allclose(peaks, np.sqrt(1 + 2 / 0.05), rtol=0.01)  # the fixed points lie close to the peaks
    both = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]]
    )
    run = scipy_run(systems.tuned_mass_damper(), 2.0, 0.02, 0.3)  # the absorber begins as its host does
    np.testing.assert_allclose(run[-1, 0], (expm(2.0 * both) @ [0.02, 0.02, 0.3, 0.3])[0], atol=1e-8)


def rightmost(delta: float, b: float) -> complex:
    """Root of s² + δ = b exp(-2π s) with the largest real part."""
    s = (np.linspace(-1, 1, 21)[:, None] + 1j * np.linspace(0, 3, 31)).ravel()
    for _ in range(60):
        late = b * np.exp(-2 * np.pi * s)
        s = s - (s**2 + delta - late) / (2 * s + 2 * np.pi * late)
        s = s[np.abs(s) < 5]  # a start that ran away
    return s[np.argmax(np.real(s))]


def test_the_late_answer_damps_up_to_the_stated_share():
    values = systems.delayed().values()
    delta, b = values["stiffness@0-1.k"], -values["delayed_force@0-1.k"]
    assert (delta, b, values["delayed_force@0-1.tau"]) == (1.5, 0.25, 2 * np.pi)
    assert rightmost(delta, b).real < -0.01
    np.testing.assert_allclose(rightmost(delta, 0.5), 1j, atol=1e-9)
    assert rightmost(delta, 0.51).real > 1e-3


@pytest.mark.slow
def test_the_delayed_oscillator_answers_where_it_started_for_one_delay():
    time = np.linspace(0, 2 * np.pi, N + 1)
    run = simulate(systems.delayed(), 2 * np.pi, 1.0, 0.0)
    np.testing.assert_allclose(run.displacement[:, 0], (0.25 + 1.25 * np.cos(np.sqrt(1.5) * time)) / 1.5, atol=1e-6)


def multipliers(dk: float) -> np.ndarray:
    """Floquet multipliers over the period π by SciPy, of the equation in the docstring."""

    def slope(t, y):
        return y[1], -0.1 * y[1] - (1 + dk * np.cos(2 * t)) * y[0]

    ends = [solve_ivp(slope, (0, np.pi), y, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1] for y in np.eye(2)]
    return np.linalg.eigvals(np.array(ends).T)


def test_the_mathieu_oscillator_is_stable_up_to_about_twice_its_damping():
    model = systems.mathieu()
    own = np.array([scipy_run(model, np.pi, *start)[-1] for start in np.eye(2)]).T
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(own)), np.sort_complex(multipliers(0.15)), rtol=1e-7)
    growth = {dk: np.log(np.max(np.abs(multipliers(dk)))) / np.pi for dk in (0.15, 0.19, 0.21, 0.3)}
    assert growth[0.15] < 0 and growth[0.19] < 0 < growth[0.21]
    assert growth[0.3] == pytest.approx(0.3 / 4 - 0.1 / 2, rel=0.05)


def test_the_rotor_whirls_in_a_circle():
    model, speed, (r, zeta) = systems.rotor(), 50.0, (50 / np.sqrt(4e3), 40 / (2 * np.sqrt(10 * 4e4)))
    radius = 1e-4 * r**2 / np.hypot(1 - r**2, 2 * zeta * r)
    lag = np.arctan2(2 * zeta * r, 1 - r**2)
    for t in (0.0, 0.01, 0.05):
        angle = speed * t - lag
        x = radius * np.array([np.cos(angle), np.sin(angle)])
        v = radius * speed * np.array([-np.sin(angle), np.cos(angle)])
        np.testing.assert_allclose(10 * -(speed**2) * x + pull(model, x, v, t), 0.0, atol=1e-12)


@pytest.mark.parametrize("x", [0.3, -1.7])
def test_two_motions_of_the_duffing_pair_are_those_of_one_oscillator(x):
    np.testing.assert_allclose(pull(systems.duffing_pair(), [x, x]), x + x**3)
    np.testing.assert_allclose(pull(systems.duffing_pair(), [x, -x]), [x + 5 * x**3, -x - 5 * x**3])


def test_the_wing_rests_at_any_pitch_within_its_play():
    model = systems.wing_section()
    for pitch in (-0.0199, 0.0, 0.01):
        np.testing.assert_array_equal(pull(model, [0.0, pitch]), 0.0)
    assert np.all(eigh(slopes(model, [0.0, 0.03])[1], np.asarray(model.mass), eigvals_only=True) > 0)


@pytest.mark.slow
def test_the_silverbox_runs_as_it_was_measured(shared_data):
    path = shared_data / "silverbox" / "silverbox_multisine.npz"
    record = jfsm.read(path, force="u", displacement="y", units={"u": "V", "y": "V"})[-2000:]
    model = (
        systems.silverbox() + jfsm.Offset(8.2419e-3, at=("force", 1)) + jfsm.Offset(2.8337e-3, at=("displacement", 1))
    )
    run = jfsm.simulate(model, record)
    assert record.displacement is not None
    assert np.sqrt(np.mean((run.displacement - record.displacement)[50:] ** 2)) < 0.4e-3

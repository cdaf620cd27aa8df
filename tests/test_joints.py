"""Joints of robots: what is elastic behind a drive, named from data of another code's making."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import jfsm
from jfsm.diagnosis.hypotheses.candidates import asked_for

ROTOR, LINK, GEAR, LOSS = 0.02, 0.03, 40.0, 0.03
"""Inertias [kg m²], stiffness [N m/rad] and damping [N m s/rad] of a joint;"""
WEIGHT, DRAG = 0.6, 0.08
"""spring [N m/rad] and damping [N m s/rad] on the motor's side, or on the link's."""
UNITS = {"displacement": "rad", "force": "N m"}
TIME = np.arange(1200) / 200.0


def torque(seed: int, highest: float = 14.0, time: np.ndarray = TIME) -> np.ndarray:
    lines = 2 * np.pi * np.linspace(0.5, highest, 30)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines.size)
    return 0.2 * np.cos(np.multiply.outer(time, lines) + phases).sum(-1)


def of_two_inertias(g: np.ndarray, side: int = 0) -> np.ndarray:
    """Angle of a motor that drives a link through a spring: exact, the torque straight between samples.

    Spring and damping are on the `side` of the motor, 0, or of the link, 1.
    """
    own, gear = np.diag(np.arange(2) == side), np.array([[1, -1], [-1, 1]])
    stiffness, damping = GEAR * gear + WEIGHT * own, LOSS * gear + DRAG * own
    minv, dt = np.diag([1 / ROTOR, 1 / LINK]), TIME[1]
    rate = np.zeros((6, 6))  # the state, the torque and its slope
    rate[:2, 2:4], rate[2:4, :2], rate[2:4, 2:4] = np.eye(2), -minv @ stiffness, -minv @ damping
    rate[2, 4], rate[4, 5] = 1 / ROTOR, 1.0
    step, y, found = expm(rate * dt), np.zeros(4), []
    for now, then in zip(g, [*g[1:], g[-1]], strict=True):
        found.append(y[0])
        y = (step @ [*y, now, (then - now) / dt])[:4]
    return np.array(found)


def rigid() -> jfsm.Structure:
    return jfsm.Structure.sdof(ROTOR + LINK, WEIGHT, DRAG)


def record(x: np.ndarray, g: np.ndarray, noise: float = 0.0) -> jfsm.Record:
    rng = np.random.default_rng(0)
    x, g = (q + noise * q.std() * rng.standard_normal(q.size) for q in (x, g))
    return jfsm.Record(TIME, force=g, displacement=x, units=UNITS, at_rest=True)


def function(q, v, force, t, p):
    return (force - WEIGHT * q - DRAG * v) / (p["inertia"] + 0.0 * q)


def functions(q, v, force, t, p):
    return (force - WEIGHT * q - DRAG * v) / p["inertia"]


@pytest.mark.parametrize(
    ("model", "side"),
    [
        (rigid(), 0),
        (jfsm.Simulation(function, 1, {"inertia": ROTOR + LINK}), 1),
        (jfsm.Simulation.from_accelerations(functions, 1, {"inertia": ROTOR + LINK}), 1),
    ],
    ids=["structure", "function", "accelerations"],
)
def test_a_mass_behind_a_spring_leaves_the_plant_with_what_a_function_knows_of_it(model, side):
    g = torque(0)
    exact = of_two_inertias(g, side)
    elastic = jfsm.causes()["elastic_joint"].apply(model, at=(0, 1), k=GEAR, c=LOSS, m=LINK)
    run = jfsm.simulate(elastic, record(exact, g), reconstruction="linear").displacement
    np.testing.assert_allclose(np.asarray(run)[:, 0], exact, atol=1e-5 * np.max(np.abs(exact)))


def test_a_motion_needs_the_force_of_both_parts():
    slow = np.sin(2.0 * TIME)
    moved = jfsm.Record(
        TIME, displacement=slow, velocity=2 * np.cos(2 * TIME), acceleration=-4 * slow, drive="motion", units=UNITS
    )
    elastic, stiff = (rigid() + jfsm.ElasticJoint(k, LOSS, LINK, at=(0, 1)) for k in (GEAR, 1e4 * GEAR))
    forces = [np.asarray(jfsm.simulate(model, moved).force)[200:, 0] for model in (rigid(), stiff, elastic)]
    np.testing.assert_allclose(forces[1], forces[0], atol=2e-3 * np.max(np.abs(forces[0])))
    assert np.max(np.abs(forces[2] - forces[0])) < 0.02  # far below its natural frequency it is as stiff


def test_its_numbers_are_those_of_turning_joints():
    lines = (rigid() + jfsm.ElasticJoint(GEAR, LOSS, LINK, at=(0, 1))).describe({"force": "N m", "displacement": "rad"})
    assert lines[-3:] == [
        "elastic_joint@0-1.k = 40 N m/rad",
        "elastic_joint@0-1.c = 0.03 N m s/rad",
        "elastic_joint@0-1.m = 0.03 N m s^2/rad",
    ]


def test_joints_are_looked_for_unasked_where_something_turns_or_a_simulation_moves():
    x, g = np.sin(TIME), np.cos(TIME)
    turning, straight = record(x, g), jfsm.Record(TIME, force=g, displacement=x)
    simulated = jfsm.Simulation(function, 1, {"inertia": jnp.asarray(0.05)})

    def ids(*given):
        return {cause if isinstance(cause, str) else cause.id for cause in asked_for(*given)}  # pyright: ignore

    assert "elastic_joint" in ids(None, rigid(), [turning])
    assert "elastic_joint" in ids(None, simulated, [straight])
    assert ids(None, rigid(), [turning]) - ids(None, rigid(), [straight]) == {"elastic_joint"}
    assert ids(None, rigid(), [record(3.2 * x, g)]) - ids(None, rigid(), [turning]) == {"ripple"}
    assert ids(["elastic_joint"], rigid(), [straight]) == {"elastic_joint"}


@pytest.mark.slow
def test_an_elastic_gear_is_named_with_its_stiffness():
    g = torque(1)
    d = jfsm.diagnose(
        record(of_two_inertias(g), g, noise=0.005),
        rigid(),
        causes=["elastic_joint", "attached_oscillator", "coulomb", "force_delay", "cubic_hardening"],
        key=jax.random.key(0),
    )
    [found] = d.findings
    assert (found.cause, found.at) == ("elastic_joint", (0, 1)) and found.probability > 0.9
    for name, right, share in (("k", GEAR, 0.03), ("m", LINK, 0.03)):
        assert found.parameters[name].value == pytest.approx(right, rel=share)


RIPPLE, TEETH, PHASE = 0.12, 7.0, 0.7
"""Amplitude [N m] of a cogging torque, how often it comes back in a turn, and its phase."""


def with_teeth() -> np.ndarray:
    """Angle of a rigid joint whose motor has teeth, by SciPy."""

    def rates(t, y):
        drive = torque(2, 5.0, np.asarray(t))
        held = WEIGHT * y[0] + DRAG * y[1] + RIPPLE * np.sin(TEETH * y[0] + PHASE)
        return [y[1], (drive - held) / (ROTOR + LINK)]

    return solve_ivp(rates, (0, TIME[-1]), [0, 0], t_eval=TIME, rtol=1e-8, atol=1e-10, max_step=TIME[1]).y[0]


def test_a_ripple_is_the_force_of_teeth():
    g = torque(2, highest=5.0)
    exact = with_teeth()
    model = jfsm.causes()["ripple"].apply(rigid(), at=(0, 1), A=RIPPLE, n=TEETH, phase=PHASE)
    run = jfsm.simulate(model, record(exact, g)).displacement
    np.testing.assert_allclose(np.asarray(run)[:, 0], exact, atol=1e-3 * np.max(np.abs(exact)))


@pytest.mark.slow
def test_the_teeth_of_a_motor_are_counted():
    g = torque(2, highest=5.0)
    d = jfsm.diagnose(
        record(with_teeth(), g, noise=0.005),
        rigid(),
        causes=["ripple", "sine_stiffness", "cubic_hardening", "coulomb", "elastic_joint"],
        key=jax.random.key(0),
    )
    [found] = d.findings
    assert (found.cause, found.at) == ("ripple", (0, 1)) and found.probability > 0.9
    for name, right, share in (("A", RIPPLE, 0.05), ("n", TEETH, 0.01)):
        assert found.parameters[name].value == pytest.approx(right, rel=share)

"""Simulations that can only be run, run with what was found that they lack."""

import jax
import numpy as np
import pytest
from references import smooth_motion

import jfsm
from jfsm.diagnosis.evidence.between_samples import as_samples
from jfsm.diagnosis.evidence.box_runs import Box, NotRun

MASS, STIFFNESS, DAMPING = 1.0, 900.0, 2.0
TIME = 0.01 * np.arange(1200)
KEY = jax.random.key(0)
RNG = np.random.default_rng(8)
TONES = 2 * np.pi * RNG.uniform(0.5, 12.0, 24), RNG.uniform(0, 2 * np.pi, 24)


def force(t) -> np.ndarray:
    return 6.0 * np.cos(np.multiply.outer(np.asarray(t), TONES[0]) + TONES[1]).sum(-1)


def moved(law) -> np.ndarray:
    """Displacement (n, 1) by SciPy, under a force that is straight between samples as the box has it."""
    samples = force(TIME)
    return smooth_motion(MASS, law, lambda t: np.array([np.interp(t, TIME, samples)]), TIME, 0, 0, tolerance=1e-8)[0]


def stepped(mass, law, driven: np.ndarray) -> np.ndarray:
    """Displacement (n, dof) of a black box in NumPy, ten steps to a sample, its force straight in between."""
    if not isinstance(driven, np.ndarray):
        raise TypeError("this is a black box, and no function for JAX")
    inverse = np.linalg.inv(np.atleast_2d(mass))
    parts, h = 10, (TIME[1] - TIME[0]) / 10
    x = v = np.zeros(driven.shape[1])
    shown = [x]
    for begin, end in zip(driven[:-1], driven[1:], strict=True):
        for i in range(parts):
            g = [begin + (i + share) / parts * (end - begin) for share in (0, 0.5, 1)]

            def rate(x, v, g):
                return v, inverse @ (g - law(x, v))

            k1 = rate(x, v, g[0])
            k2 = rate(x + h / 2 * k1[0], v + h / 2 * k1[1], g[1])
            k3 = rate(x + h / 2 * k2[0], v + h / 2 * k2[1], g[1])
            k4 = rate(x + h * k3[0], v + h * k3[1], g[2])
            x = x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            v = v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        shown.append(x)
    return np.array(shown)


def linear(x, v):
    return STIFFNESS * x + DAMPING * v


def box(record: jfsm.Record) -> dict[str, np.ndarray]:
    return {"displacement": stepped(MASS, linear, np.array(record.force, float))}


RECORD = jfsm.Record(TIME, force=force(TIME), at_rest=True)
OFF = jfsm.Structure.sdof(MASS, 0.99 * STIFFNESS, 1.05 * DAMPING)


def away(run: np.ndarray, truth: np.ndarray) -> float:
    return float(np.std(run - truth) / np.std(truth))


@pytest.mark.parametrize(
    ("lacking", "law", "share"),
    [
        (jfsm.LinearStiffness(300.0, at=(0, 1)), lambda x, v: linear(x, v) + 300 * x, 0.003),  # explodes if fed back
        pytest.param(
            jfsm.CubicStiffness(6e4, at=(0, 1)),
            lambda x, v: linear(x, v) + 6e4 * x**3,
            0.003,
            marks=pytest.mark.slow,  # the spring takes the same way
        ),
        pytest.param(
            jfsm.Coulomb(8.0, at=(0, 1)),
            lambda x, v: linear(x, v) + 8 * np.tanh(v / 1e-3),
            0.015,  # it turns between samples
            marks=pytest.mark.slow,
        ),
    ],
    ids=["spring", "cubic", "friction"],
)
def test_a_box_moves_with_a_force_that_it_lacks_though_its_stand_in_is_off(lacking, law, share):
    truth = moved(law)
    alone = jfsm.simulate(OFF + lacking, RECORD, reconstruction="linear", solver="grid")
    assert away(np.asarray(alone.displacement), truth) > 2 * share
    found = Box(jfsm.Simulation.from_runs(box), OFF, "linear", [RECORD]).extended(OFF + lacking, RECORD)
    assert away(found.displacement, truth) < share and found.runs < 8


def test_a_force_between_masses_acts_at_its_place():
    mass, k, c = np.array([2.0, 1.0]), np.array([2000.0, 900.0]), np.array([8.0, 3.0])
    matrices = (np.array([[v[0] + v[1], -v[1]], [-v[1], v[1]]]) for v in (k, c))
    stiffness, damping = matrices

    def two(record, extra=None):
        pushed = np.zeros((len(record), 2))
        pushed[:, 0] = record.channels["force", 1]
        if extra is not None:
            pushed += extra[1, 2][:, None] * np.array([-1.0, 1.0])
        return {"displacement": stepped(np.diag(mass), lambda x, v: stiffness @ x + damping @ v, pushed)}

    lacking = jfsm.LinearStiffness(250.0, at=(1, 2))
    right = stiffness + 250 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    truth = stepped(np.diag(mass), lambda x, v: right @ x + damping @ v, np.stack([force(TIME), 0 * TIME], -1))
    off = jfsm.Structure.chain(mass, 0.99 * k, 1.03 * c)
    found = Box(jfsm.Simulation.from_runs(two, places=[(1, 2)]), off, "linear", [RECORD]).extended(
        off + lacking, RECORD
    )
    assert away(found.displacement, truth) < 0.003


def test_a_base_that_moves_is_no_force_that_a_box_lacks():
    shaken = jfsm.Record(TIME, base_acceleration=force(TIME), at_rest=True)

    def on_a_base(record, extra=None):
        pushed = -MASS * np.array(record.base_acceleration)[:, None]
        return {"displacement": stepped(MASS, linear, pushed if extra is None else pushed + extra[0, 1][:, None])}

    def law(x, v):
        return linear(x, v) + 300 * x

    lacking = jfsm.LinearStiffness(300.0, at=(0, 1))
    places = jfsm.Simulation.from_runs(on_a_base, places=[(0, 1)])
    found = Box(places, OFF, "linear", [shaken]).extended(OFF + lacking, shaken)
    assert away(-found.displacement, moved(law)) < 0.003


def test_what_a_box_cannot_be_run_with_is_said():
    def of(run, extended, **options):
        Box(jfsm.Simulation.from_runs(run, **options), OFF, "linear", [RECORD]).extended(extended, RECORD)

    with pytest.raises(NotRun, match="its run does not show the displacement of degree of freedom 1"):
        of(lambda record: {"acceleration": np.sin(record.time)}, OFF + jfsm.Coulomb(1.0, at=(0, 1)))
    far = jfsm.Record(TIME, force={2: force(TIME)}, at_rest=True)
    two = jfsm.Structure.chain([1.0, 1.0], [900.0, 900.0], [3.0, 3.0])

    def both(record):
        return {"displacement": stepped(np.eye(2), lambda x, v: 900 * x, np.zeros((len(record), 2)))}

    with pytest.raises(NotRun, match=r"100% of the force acts where it takes none; it takes forces at 0–2"):
        lower = two + jfsm.LinearStiffness(100.0, at=(0, 1))
        Box(jfsm.Simulation.from_runs(both), two, "linear", [far]).extended(lower, far)


def test_samples_of_a_force_carry_what_it_does_between_them():
    jump = np.repeat([[0.0], [0.0], [1.0], [1.0]], 8, axis=0)[:25]  # half-way, and a little later
    jump[:20] = 0.0
    straight = as_samples(jump, held=False)[:, 0]
    steps = np.interp(np.arange(25) / 8, np.arange(4), straight)
    assert np.trapezoid(steps, dx=1 / 8) == pytest.approx(np.trapezoid(jump[:, 0], dx=1 / 8), abs=1e-12)
    np.testing.assert_allclose(as_samples(jump, held=True)[:, 0], [0, 0, 0.5625, 0.5625])

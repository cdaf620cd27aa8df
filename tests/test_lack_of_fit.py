"""What laws of another shape would explain beside those of a model, on data that SciPy made."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.diagnosis.evidence.lack_of_fit import LackOfFit
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.search.baseline import fit_model
from jfsm.identification import prepare_all
from jfsm.structures import CubicStiffness

MASS, STIFFNESS, DAMPING, CUBIC = 2.0, 18.0, 0.5, 4.0
SAMPLES, STEP, UNTIL = 900, 0.05, 630
NOISE = 0.01


def told(law: Callable[[float, float], float], channel: str, seed: int) -> float:
    """Nats beside a refitted model with a cubic spring, where the law beside spring and dashpot is `law`."""
    rng = np.random.default_rng(seed)
    omegas, phases = rng.uniform(0.5, 7.0, 12), rng.uniform(0, 2 * np.pi, 12)

    def force(t):
        return 2.0 * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    def accelerated(t, x, v):
        return (force(t) - STIFFNESS * x - DAMPING * v - law(x, v)) / MASS

    time = np.arange(SAMPLES) * STEP
    x, v = solve_ivp(
        lambda t, y: [y[1], accelerated(t, *y)], (0, time[-1]), [0, 0], t_eval=time, rtol=1e-10, atol=1e-12
    ).y
    clean = {"force": force(time), "displacement": x, "acceleration": accelerated(time, x, v)}
    noisy = {
        kind: clean[kind] + NOISE * clean[kind].std() * rng.standard_normal(SAMPLES) for kind in ("force", channel)
    }
    record = jfsm.Record(time, **noisy, at_rest=True)
    spring = CubicStiffness(CUBIC, at=(0, 1))
    model = (jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING) + spring).uncertain(cubic_stiffness=0.5)
    problem = Problem(model, prepare_all([record], model), [UNTIL])
    _, refitted = fit_model(problem)
    return LackOfFit(problem)(refitted).nats


@pytest.mark.parametrize(("channel", "seed"), [("displacement", 1), ("acceleration", 2)])
def test_a_right_law_leaves_nothing_to_others(channel: str, seed: int):
    # Twenty shapes gain ten nats of noise, with a standard deviation of three, and the ten are taken off.
    assert -10 < told(lambda x, v: CUBIC * x**3, channel, seed) < 13


@pytest.mark.parametrize(
    "law",
    [
        lambda x, v: 1.5 * x * abs(v),
        lambda x, v: 1.2 * np.tanh(4 * v) * np.exp(-(v**2)),
        lambda x, v: 4.0 * np.sin(3 * x),
    ],
    ids=["speed-dependent spring", "friction that fades", "wavy spring"],
)
def test_a_law_that_is_near_leaves_much_to_others(law):
    assert told(law, "displacement", 3) > 50

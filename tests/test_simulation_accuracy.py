"""Free runs at default settings against the exact motion, a law of each kind; `benchmarks/simulation.py` has all."""

import dataclasses

import numpy as np
import pytest
from blind.drives import Drive, Silence, SumOfSines
from blind.exact import integrate
from blind.laws import Law
from blind.laws.damping import Coulomb
from blind.laws.memory import DelayedForce, Jenkins
from blind.laws.stiffness import CubicHardening, EndStop
from blind.laws.time import StiffnessDrop
from blind.plants import Plant

import jfsm

OMEGA, MASS = 40.0, 1.3
PLANT = Plant(MASS, MASS * OMEGA**2, 2 * 0.02 * MASS * OMEGA)
K = PLANT.stiffness
SIZE = 5e-3  # m, of the motion
TIME = 2 * np.pi / OMEGA / 50 * np.arange(20 * 50 + 1, dtype=np.float64)
LAST = 40  # samples at the end, where the force between the samples is guessed

DECAY = Silence()
# Sines vanish at the start, so that a reconstruction which reflects the record there is right.
SINES = SumOfSines(np.array([15.0, 6.0, 9.0]), OMEGA * np.array([0.55, 0.97, 1.6]), np.full(3, -np.pi / 2))
SMOOTH, OTHER = 1e-6, 1e-4


@pytest.mark.parametrize(
    ("law", "drive", "bound", "events"),
    [
        pytest.param(CubicHardening(0.2 * K / SIZE**2), DECAY, SMOOTH, 0, id="smooth"),
        pytest.param(DelayedForce(-0.1 * K, 1.2 / OMEGA), DECAY, SMOOTH, 0, id="delayed"),
        pytest.param(DelayedForce(-0.1 * K, 0.06 / OMEGA), DECAY, SMOOTH, 0, id="delayed by less than a sample"),
        pytest.param(EndStop(0.5 * K, 0.4 * SIZE), SINES, OTHER, 20, id="kinked"),
        pytest.param(Coulomb(0.1 * K * SIZE), SINES, OTHER, 20, id="sticking"),
        pytest.param(Jenkins(0.3 * K, 0.4 * SIZE), SINES, OTHER, 20, id="hysteretic"),
        pytest.param(StiffnessDrop(0.2 * K, 1.234), SINES, OTHER, 1, id="dropping"),
    ],
)
def test_a_run_comes_close_to_the_exact_motion(law: Law, drive: Drive, bound: float, events: int):
    start = (SIZE, 0.0) if drive is DECAY else (0.0, 0.0)
    truth = integrate(PLANT, law, drive, start, TIME, SIZE)
    assert truth.instants.size >= events, "the law must show for the test to mean anything"
    model = jfsm.causes()[law.cause].apply(
        jfsm.Structure.sdof(PLANT.mass, K, PLANT.damping), at=(0, 1), **dataclasses.asdict(law)
    )
    run = jfsm.simulate(model, jfsm.Record(TIME, drive(TIME)), start)
    error = np.abs(run.displacement[:-LAST, 0] - truth.x[:-LAST])
    assert np.max(error) < bound * np.sqrt(np.mean(truth.x**2))

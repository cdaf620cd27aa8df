"""A pendulum that swings widely, as measured: it softens, as no law of the catalogue does to the last digit."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from benchmarks.rig_records import pendulum_large_angle

CAUSES = ("sine_stiffness", "cubic_softening", "quadratic_damping", "stiffness_drift")


@pytest.mark.parametrize(
    ("inertia", "gravity", "rate", "release"),
    [pytest.param(1.0, 9.81, 1.0, 1.3, marks=pytest.mark.slow), (3.0, 50.0, 2.0, 0.7)],
)
def test_the_sine_takes_the_place_of_the_linear_spring(inertia: float, gravity: float, rate: float, release: float):
    def motion(t, y):
        return y[1], -(gravity / rate * np.sin(rate * y[0]) + 0.1 * y[1]) / inertia

    t = np.linspace(0.0, 10.0, 400)
    y = solve_ivp(motion, (0.0, 10.0), [release, 0.0], t_eval=t, rtol=1e-9, atol=1e-11).y
    noise = 1e-4 * np.random.default_rng(3).standard_normal(y.shape)
    record = jfsm.Record(t, displacement=y[0] + noise[0], velocity=y[1] + noise[1], units={"displacement": "rad"})
    believed = jfsm.Structure.sdof(inertia, gravity, 0.1)
    causes = ("sine_stiffness", "cubic_softening", "square_stiffness")
    d = jfsm.diagnose(record, believed, causes=causes, max_causes=1, key=jax.random.key(0))
    (finding,) = d.findings
    assert finding.cause == "sine_stiffness" and finding.probability > 0.9 and not finding.law_open
    assert finding.parameters["s"].value == pytest.approx(rate, rel=0.02)
    whole = finding.parameters["k"].value + d.refitted["stiffness@0-1.k"].value
    assert whole == pytest.approx(gravity, rel=0.01) and d.refitted["stiffness@0-1.k"].value < 0.01 * gravity


@pytest.mark.slow
def test_softening_is_said_of_the_measured_pendulum_and_its_law_left_open(shared_data):
    record = pendulum_large_angle(shared_data / "pendulum_large_angle").resample(50.0)
    begin = record.time[0]
    fitted, held = record.until(begin + 36.0), record.since(begin + 36.0).until(begin + 72.0)
    small_angles = jfsm.fit(jfsm.Structure.sdof(1.0, 6.0**2, 0.05), fitted).structure
    d = jfsm.diagnose(fitted, small_angles, holdout=held, causes=CAUSES, max_causes=1, key=jax.random.key(0))
    assert d.verdict == "cause"
    (finding,) = d.findings
    assert finding.cause == "sine_stiffness" and finding.kind == "a softening spring" and finding.law_open
    assert finding.probability < 0.6 and "not quite" in d.sentence
    assert d.gain is not None and d.gain.closed > 0.95
    assert d.gain.channels["displacement 1"].after == pytest.approx(0.017, abs=0.01)  # rad, of swings of 0.5 rad

"""A pendulum that swings widely, as measured: it softens, as no law of the catalogue does to the last digit."""

import jax
import pytest

import jfsm
from benchmarks.rig_records import pendulum_large_angle

CAUSES = ("sine_stiffness", "cubic_softening", "quadratic_damping", "stiffness_drift")


def test_softening_is_said_of_the_measured_pendulum_and_its_law_left_open(shared_data):
    record = pendulum_large_angle(shared_data / "pendulum_large_angle").resample(50.0)
    begin = record.time[0]
    fitted, held = record.until(begin + 36.0), record.since(begin + 36.0).until(begin + 72.0)
    small_angles = jfsm.fit(jfsm.Structure.sdof(1.0, 6.0**2, 0.05), fitted).structure
    d = jfsm.diagnose(fitted, small_angles, holdout=held, causes=CAUSES, max_causes=1, key=jax.random.key(0))
    assert d.verdict == "cause"
    (finding,) = d.findings
    assert finding.cause == "sine_stiffness" and finding.kind == "softening stiffness"
    assert finding.probability < 0.6 and "not quite" in d.sentence
    assert d.gain is not None and d.gain.closed > 0.95
    assert d.gain.channels["displacement 1"].after == pytest.approx(0.017, abs=0.01)  # rad, of swings of 0.5 rad

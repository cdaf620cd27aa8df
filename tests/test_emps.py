"""The electromechanical positioning system, as measured: an axis that no spring holds, with dry friction."""

import jax
import pytest

import jfsm

CAUSES = ("coulomb", "quadratic_damping", "position_damping", "periodic_disturbance", "force_gain")


@pytest.mark.slow
def test_dry_friction_is_named_on_the_measured_axis(shared_data):
    units, drive = {"displacement": "m"}, {"vir": "0.0284490 V/N"}  # the drive's voltage for a newton
    path = shared_data / "emps" / "DATA_EMPS.mat"
    record = jfsm.read(path, force="vir", displacement="qm", units=units, sensitivity=drive).resample(100.0)
    axis = jfsm.Structure([95.0], [jfsm.LinearDamping(200.0, at=(0, 1)), jfsm.Preload(1.0, at=(0, 1))])
    d = jfsm.diagnose(record, axis, holdout=0.4, causes=CAUSES, max_causes=1, key=jax.random.key(0))
    assert d.verdict == "cause"
    (finding,) = d.findings
    assert finding.cause == "coulomb"
    assert finding.parameters["F"].value == pytest.approx(20.4, rel=0.06)  # published: 20.39 N
    assert d.extended.values()["mass@1"] == pytest.approx(95.1, rel=0.02)  # published: 95.11 kg
    assert d.gain is not None and d.gain.after < 0.5 * d.gain.before

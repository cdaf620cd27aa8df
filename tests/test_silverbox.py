"""The electronic Duffing oscillator, as measured: a small part of what `benchmarks/silverbox.py` does in full."""

import jax
import numpy as np
import pytest

import jfsm

CAUSES = ("cubic_hardening", "cubic_softening", "quadratic_stiffness", "quadratic_damping", "coulomb", "force_gain")


def test_a_cubic_spring_is_named_on_the_measured_circuit(shared_data):
    record = jfsm.read(
        shared_data / "silverbox" / "silverbox_multisine.npz",
        force="u",
        displacement="y",
        units={"u": "V", "y": "V"},
    )
    # Constants of the linear circuit as published for its smallest level: 68.6 Hz, damping ratio 4.7 %, unit stiffness.
    omega = 2 * np.pi * 68.6
    model = jfsm.Structure.sdof(mass=1 / omega**2, stiffness=1.0, damping=2 * 0.047 / omega)
    test = record[66_000:69_000]
    d = jfsm.diagnose(record[:3000], model, holdout=test, causes=CAUSES, key=jax.random.key(0))
    assert d.verdict == "cause"
    (finding,) = d.findings
    assert finding.cause == "cubic_hardening"
    ratio = finding.parameters["k3"].value / d.extended.values()["stiffness@0-1.k"]
    assert ratio == pytest.approx(3.95, rel=0.03)  # published, 1/V²
    assert finding.parameters["k3"].unit == "V/V^3"
    assert d.gain is not None
    gain = d.gain.channels["displacement 1"]
    assert gain.after < 0.1 * gain.before
    assert gain.after < 0.0004  # V; so short a start leaves 0.2 mV by itself

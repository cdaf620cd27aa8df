"""Double precision: asked for by the user, checked at every door, never switched on behind their back."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jfsm._types import X64_MESSAGE

PREPARE = """
import jax, numpy as np
import jfsm
assert jax.config.jax_enable_x64 is False, "importing jfsm changed the precision"
jax.config.update("jax_enable_x64", True)
model = jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.12)
jax.config.update("jax_enable_x64", False)
time = 0.05 * np.arange(100)
record = jfsm.Record(time=time, force=np.sin(time), displacement=np.cos(3 * time))
calls = {
    "a structure": lambda: jfsm.Structure.sdof(mass=1.0, stiffness=9.0),
    "a term": lambda: jfsm.Coulomb(1.0, at=(0, 1)),
    "a mass": lambda: jfsm.Structure([1.0]),
    "simulate": lambda: jfsm.simulate(model, record),
    "fixed points": lambda: jfsm.fixed_points(model),
    "linearise": lambda: jfsm.linearise(model),
    "limit cycles": lambda: jfsm.limit_cycles(model),
    "forced response": lambda: jfsm.forced_response(model, 1.0),
    "backbone": lambda: jfsm.backbone(model, [1.0]),
    "fit": lambda: jfsm.fit(model, record),
    "diagnose": lambda: jfsm.diagnose(record, model),
    "a map": lambda: jfsm.RKPM.fit(np.random.default_rng(0).uniform(size=(100, 2)), np.ones(100)),
}
for name, call in calls.items():
    try:
        call()
        print(f"{name}: no error")
    except Exception as error:
        print(f"{name}: {type(error).__name__}: {error}")
assert jax.config.jax_enable_x64 is False, "a call changed the precision"
"""

DOORS = (
    *("a structure", "a term", "a mass", "simulate", "fit", "diagnose", "a map"),
    *("fixed points", "linearise", "limit cycles", "forced response", "backbone"),
)


@pytest.fixture(scope="module")
def answers() -> dict[str, str]:
    """What each public call says in a fresh process with single precision."""
    environment = {name: value for name, value in os.environ.items() if name != "JAX_ENABLE_X64"}
    run = subprocess.run(
        [sys.executable, "-c", PREPARE],
        capture_output=True,
        text=True,
        cwd=Path(__file__).resolve().parents[1],
        env=environment,
        timeout=600,
    )
    assert run.returncode == 0, run.stderr
    return dict(line.split(": ", 1) for line in run.stdout.splitlines())


@pytest.mark.parametrize("door", DOORS)
def test_in_single_precision_every_call_says_what_to_run_first(answers, door):
    assert answers[door] == f"ValueError: {X64_MESSAGE}"


def test_the_message_is_a_line_to_run():
    assert 'jax.config.update("jax_enable_x64", True)' in X64_MESSAGE

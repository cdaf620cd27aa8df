"""Whose masses the noise of a force acts through."""

from types import SimpleNamespace
from typing import Any

import jax
import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.search.baseline import _outweighed
from jfsm.identification import Unknown

jax.config.update("jax_enable_x64", True)

MODEL = jfsm.Structure.sdof(2.0, 100.0, 1.0)


def _refitted(factor: float, stiffness: float):
    """A refit of the mass by a factor, the logarithm of the stiffness at a place within [-1.6, 1.6]."""
    unknowns = [
        Unknown(f"{name}", 0.0, 1.0, True, 0.0, 0.02, degrees=1.5, low=-1.6, high=1.6)
        for name in ("mass@1", "stiffness@0-1.k")
    ]
    theta = np.array([np.log(factor), stiffness])
    return SimpleNamespace(
        structure=jfsm.Structure.sdof(2.0 * factor, 100.0, 1.0), unknowns=unknowns, theta=theta, effects=()
    )


@pytest.mark.parametrize(
    ("factor", "stiffness", "weighed"),
    [(1.01, 0.0, False), (1.3, 0.0, True), (1.3, 1.6, False), (1.3, -1.6, False)],
    ids=["as stated", "heavier", "a spring at its upper bound", "a spring at its lower bound"],
)
def test_masses_of_a_refit_are_believed_unless_it_went_to_its_bounds(factor: float, stiffness: float, weighed: bool):
    refitted: Any = _refitted(factor, stiffness)
    assert _outweighed(MODEL, refitted) == weighed

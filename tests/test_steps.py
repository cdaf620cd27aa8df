"""Steps per sample that a structure needs in a motion."""

import jax
import numpy as np
import pytest

import jfsm
from jfsm.plant import Swing, substeps_for
from jfsm.plant._excitation import Size, probes_along

jax.config.update("jax_enable_x64", True)

CHAIN = jfsm.Structure.chain(mass=[1.0, 1.0], stiffness=[100.0, 100.0], damping=[0.1, 0.1])
STEEP = CHAIN + jfsm.CubicStiffness(1e6, at=(1, 2))
TIME = np.linspace(0.0, 60.0, 4001)
TOGETHER = np.outer(np.sin(TIME), [1.0, 1.01])
"""Both masses move by one, the link between them by a hundredth."""


def test_a_link_that_hardly_moves_needs_no_short_steps():
    swing = Swing(TOGETHER, np.outer(np.cos(TIME), [1.0, 1.01]))
    assert substeps_for(STEEP, 0.01, swing) < substeps_for(STEEP, 0.01, Size(1.0, 1.0))


def test_a_link_that_moves_needs_them_as_before():
    against = TOGETHER * [1.0, -1.0]
    assert substeps_for(STEEP, 0.01, Swing(against, against)) >= substeps_for(STEEP, 0.01, Size(1.0, 1.0))


def test_a_law_is_asked_where_its_link_is_stretched_twice_as_usual_or_as_far_as_it_goes():
    found = [float(x[1] - x[0]) for x, _, _ in probes_along(Swing(TOGETHER, TOGETHER), STEEP)]
    assert max(found) == pytest.approx(0.01, rel=1e-3) and min(found) == pytest.approx(-0.01, rel=1e-3)
    speeds = [float(v[1] - v[0]) for _, v, _ in probes_along(Swing(TOGETHER, TOGETHER), STEEP)]
    assert min(map(abs, speeds)) == 0.0
    assert sorted({round(abs(w), 4) for w in speeds}) == [0.0, 0.0071, 0.01]


def test_a_linear_structure_has_no_law_to_ask():
    assert list(probes_along(Swing(TOGETHER, TOGETHER), CHAIN)) == []
    assert substeps_for(CHAIN, 0.01, Swing(TOGETHER, TOGETHER)) == substeps_for(CHAIN, 0.01)

"""Runs of linear plants that share laws and gains, against the filter that knows nothing of either."""

from dataclasses import replace

import numpy as np
import pytest

import jfsm
from jfsm.identification._fit import _beginning, free_paths
from jfsm.identification._likelihood import Runs, innovations_of
from jfsm.identification._linear_lanes import is_linear, linear_innovations
from jfsm.identification._nuisances import prepare_all
from jfsm.identification._posterior import Hypothesis, Posterior

N = 300


@pytest.fixture(scope="module")
def scene_and_runs():
    """A chain of three that sways, every lane with another of its numbers nudged, and some driven by more."""
    rng, t = np.random.default_rng(0), np.arange(N) * 0.01
    force = 10 * np.convolve(rng.standard_normal(N), np.full(3, 1 / 3), "same")
    model = jfsm.Structure.chain(mass=np.ones(3), stiffness=np.full(3, 400.0), damping=np.full(3, 1.0))
    still = jfsm.Record(t, force={3: force}, displacement={3: 0 * force}, at_rest=True)
    motion = jfsm.simulate(model, still)
    shown = {"acceleration": {1: motion.acceleration[:, 0], 3: motion.acceleration[:, 2]}}
    shown["displacement"] = {2: motion.displacement[:, 1] + 1e-4 * rng.standard_normal(N)}
    record = jfsm.Record(t, force={3: force}, acceleration=shown["acceleration"], displacement=shown["displacement"])
    prepared = prepare_all([record], model, "band-limited")
    structure, unknowns = _beginning(model, free_paths(model, prepared, ()), prepared, {})
    posterior = Posterior(Hypothesis((structure,), (unknowns,)), prepared)
    theta, taken = posterior.initial()[0], []
    lanes = theta + 1e-2 * np.eye(theta.size)
    with pytest.MonkeyPatch.context() as patch:
        asked = lambda scene, runs, count: taken.append((scene, runs)) or linear_innovations(scene, runs, count)  # noqa: E731
        patch.setattr("jfsm.identification._posterior.linear_innovations", asked)
        posterior.many_innovations(lanes)
    return taken[0]


@pytest.mark.parametrize("gaps", ["none", "scattered", "one channel, then all"])
@pytest.mark.parametrize("pushed", [False, True])
@pytest.mark.parametrize("process_noise", [0.0, 1e-3])  # so that the covariance settles within the record
def test_runs_that_share_gains_tell_what_each_would_tell_by_itself(scene_and_runs, gaps, pushed, process_noise):
    scene, runs = scene_and_runs
    assert is_linear(scene)
    use = np.array(scene.readings.use)
    rng = np.random.default_rng(1)
    if gaps == "scattered":
        use = use * (rng.random(use.shape) < 0.9)
    elif gaps != "none":
        use[50:120, 1], use[200:230] = 0.0, 0.0
    push = 0.1 * rng.standard_normal((len(runs.numbers), N, 3)) if pushed else None
    asked = Runs(runs.numbers, runs.velocity + process_noise * np.eye(3), use, push)
    found, known = linear_innovations(scene, asked, N), innovations_of(scene, asked, N)
    spread = np.sqrt(known.variance)
    np.testing.assert_allclose(found.error / spread, known.error / spread, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.variance, known.variance, rtol=1e-8)


def test_a_plant_with_a_law_is_not_linear(scene_and_runs):
    scene = scene_and_runs[0]
    smooth = replace(scene.plant.smooth, direction=np.ones_like(scene.plant.smooth.direction))
    assert not is_linear(replace(scene, plant=replace(scene.plant, smooth=smooth)))

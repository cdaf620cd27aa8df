"""Force state maps of a record: the force of a link from the motion, and how far the map is to be trusted."""

import math

import numpy as np
import pytest

import jfsm
from jfsm.surrogates import tabulate

RATE, SAMPLES = 50.0, 800
TIME = np.arange(SAMPLES) / RATE


def drive(t):
    return 4.0 * (np.cos(1.1 * t) + np.sin(2.3 * t + 1.0) + np.cos(3.7 * t + 2.0))


def measured(model: jfsm.Structure, seed: int = 0, noise: float = 0.005) -> jfsm.Record:
    """Force on the last mass, and all motion, of a model that is driven from rest."""
    zero = np.zeros(SAMPLES)
    force = {j: drive(TIME) if j == model.dof else zero for j in range(1, model.dof + 1)}
    response = jfsm.simulate(model, jfsm.Record(TIME, force, zero, at_rest=True))
    rng = np.random.default_rng(seed)

    def noisy(y):
        return y + noise * np.std(y, axis=0) * rng.standard_normal(y.shape)

    return jfsm.Record(
        TIME,
        {model.dof: noisy(drive(TIME))},
        noisy(response.displacement),
        noisy(response.velocity),
        noisy(response.acceleration),
        at_rest=True,
    )


OSCILLATOR = jfsm.Structure.sdof(1.0, 9.0, 0.3) + jfsm.CubicStiffness(2.0, at=(0, 1))


@pytest.fixture(scope="module")
def record() -> jfsm.Record:
    return measured(OSCILLATOR)


def within(cut, axis: str, truth) -> float:
    """Share of the visited points of a cut at which the band holds the truth."""
    force, half = (np.array(cut[f"{name}_of_{axis}"], dtype=float) for name in ("force", "error"))
    there = np.isfinite(force)
    return float(np.mean(np.abs(force - truth(np.array(cut[axis])))[there] <= half[there]))


@pytest.mark.parametrize(
    "method", [pytest.param("rkpm", marks=pytest.mark.slow), "kriging", pytest.param("joint", marks=pytest.mark.slow)]
)
def test_all_of_the_force_is_mapped_with_an_honest_band(record, method):
    found = jfsm.map_force(record, mass=1.0, method=method)
    cuts = found.data["curves"]["cuts"]
    assert np.array_equal(found.centre, [0.0, 0.0]) and found.discontinuities == ()
    assert within(cuts, "displacement", lambda x: 9.0 * x + 2.0 * x**3) > 0.6
    assert within(cuts, "velocity", lambda v: 0.3 * v) > 0.6
    for name, truth in (("stiffness", 9.0), ("damping", 0.3), ("cubic stiffness", 2.0)):
        estimate = found.coefficients[name]
        assert abs(estimate.value - truth) < 2.0 * (estimate.high - estimate.low)
        assert (estimate.high - estimate.low) / 2 < 0.5 * truth
    assert [found.coefficients[name].unit for name in ("stiffness", "damping", "cubic stiffness")] == [
        "N/m", "N s/m", "N/m^3"
    ]  # fmt: skip
    assert 0.4 < found.visited < 1.0


def test_what_a_model_lacks_is_mapped_and_mends_the_model(record):
    linear = jfsm.Structure.sdof(1.0, 9.0, 0.3)
    found = jfsm.map_force(record, linear)
    assert found.readings.lacking
    truth = 2.0 * found.readings.states[:, 0] ** 3
    error = np.asarray(found.force_map.evaluate(found.readings.states)) - truth
    assert np.std(error) < 0.03 * np.std(truth)
    response = jfsm.simulate(linear + tabulate(found.force_map, nodes=24).on(found.at), record)
    assert record.displacement is not None
    before = jfsm.simulate(linear, record).displacement - record.displacement
    assert np.std(response.displacement - record.displacement) < 0.05 * np.std(before)


@pytest.mark.slow
def test_a_jump_is_found_and_not_smoothed():
    record = measured(jfsm.Structure.sdof(1.0, 9.0, 0.3) + jfsm.Coulomb(1.5, at=(0, 1)))
    found = jfsm.map_force(record, mass=1.0)
    (jump,) = found.discontinuities
    assert jump.kind == "jump" and np.array_equal(jump.normal, [0.0, 1.0])
    assert jump.low <= 0.0 <= jump.high and jump.size == pytest.approx(3.0, rel=0.05)
    above, below = (float(found.force_map(np.array([0.0, v]))) for v in (0.1, -0.1))
    assert above - below == pytest.approx(3.0 + 0.06, rel=0.05)
    assert any("on either side of a jump are left out" in note for note in found.notes)


@pytest.mark.slow
def test_one_link_of_several_is_mapped_by_its_own_motion():
    chain = jfsm.Structure.chain([1.0, 1.0], [12.0, 24.0], [0.4, 0.3])
    record = measured(chain + jfsm.CubicStiffness(30.0, at=(1, 2)))
    found = jfsm.map_force(record, chain, at=(1, 2))
    d = np.quantile(found.readings.states[:, 0], [0.1, 0.9])
    np.testing.assert_allclose(found.force_map.evaluate(np.column_stack([d, 0 * d])), 30.0 * d**3, rtol=0.15)
    with pytest.raises(ValueError, match=r"`at` must name a link where the model has several .*\(0, 1\), \(1, 2\)"):
        jfsm.map_force(record, chain)
    with pytest.raises(ValueError, match="`model` must be given for the link of several degrees of freedom"):
        jfsm.map_force(record, mass=1.0)


def test_readings_that_share_their_errors_count_as_fewer():
    from jfsm.mapping.learned_map import _widening

    states = np.random.default_rng(0).uniform(-1, 1, (2000, 2))
    flat = jfsm.RKPM.fit(states, states[:, 0], order=1)
    noise = np.random.default_rng(1).standard_normal(2000 + 9)
    means = np.convolve(noise, np.ones(10), "valid")  # ten in a row share their errors
    assert _widening(flat, states, states[:, 0] + noise[:2000]) == pytest.approx(1.0, abs=0.15)
    assert _widening(flat, states, states[:, 0] + means) == pytest.approx(math.sqrt(10.0), rel=0.2)


@pytest.mark.slow
def test_a_record_of_one_orbit_is_told_to_say_little_of_the_plane():
    wave = 2.0 * math.pi * 0.5 * TIME[:500]
    found = jfsm.map_force(jfsm.Record(TIME[:500], force=np.sin(wave), displacement=np.sin(wave - 1.0)), mass=1.0)
    assert found.visited < 0.25 and np.linalg.norm(found.centre) > 0.5
    assert any("Record a motion whose amplitude changes" in note for note in found.notes)

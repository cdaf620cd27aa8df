"""What noise leaves of a hypothesis, told by records that are simulated from it."""

from dataclasses import replace

import jax
import numpy as np
import pytest

import jfsm
from jfsm.demo import DAMPING, FRICTION, MASS, STIFFNESS, hidden_friction
from jfsm.diagnosis.evidence.course import BASE, remeasured
from jfsm.diagnosis.evidence.excess import is_noise_only
from jfsm.diagnosis.evidence.fitted import Trial
from jfsm.diagnosis.evidence.noise_draws import beside_chance, noise_beyond
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.search.baseline import fit_model
from jfsm.diagnosis.thresholds import THRESHOLDS
from jfsm.identification import prepare_all
from jfsm.structures import Coulomb

SAMPLES = 1200
UNTIL = [800]


@pytest.fixture(scope="module")
def record() -> jfsm.Record:
    return hidden_friction(3, samples=SAMPLES).record


def judged(record: jfsm.Record, stiffness: float) -> tuple[Trial, Trial]:
    """A model that rubs, as the record does, before and after what noise leaves of it is drawn."""
    model = jfsm.Structure.sdof(MASS, stiffness, DAMPING) + Coulomb(FRICTION, at=(0, 1))
    problem = Problem(model, prepare_all([record], model), UNTIL)
    given, _ = fit_model(problem)
    # A model whose values are off is told by its innovations too; here what it leaves has to tell alone.
    given = replace(given, whiteness=0.0, noise=np.where(given.trusted, 0.0, given.noise))
    (drawn,) = beside_chance([given], problem, jax.random.key(1))
    return given, drawn


def test_noise_that_a_filter_underestimates_is_not_something_left(record):
    # Velocity and acceleration fill their bands, so that no smooth curve tells their noise.
    first, drawn = judged(record, STIFFNESS)
    assert first.prediction.left() > 0 and not drawn.prediction.left()
    assert np.all(drawn.prediction.expected > 1.2 * first.prediction.expected)
    assert np.all(np.abs(drawn.prediction.error - drawn.prediction.expected) < 4 * drawn.prediction.scatter)


def test_noise_is_no_excuse_for_a_value_that_is_off(record):
    first, drawn = judged(record, 1.05 * STIFFNESS)
    assert drawn is not first, "nothing was drawn"
    assert drawn.prediction.left() > 0.8 * first.prediction.left() > THRESHOLDS.negligible
    assert not is_noise_only(drawn)


@pytest.mark.slow
def test_noise_is_no_excuse_for_an_offset_that_is_a_bias(record):
    channels = {kind: y for (kind, _), y in record.channels.items()}
    channels["acceleration"] = channels["acceleration"] + 0.1 * np.std(channels["acceleration"])
    first, drawn = judged(jfsm.Record(record.time, **channels), STIFFNESS)
    assert drawn is not first, "nothing was drawn"
    assert drawn.prediction.left() > 0.8 * first.prediction.left() > THRESHOLDS.negligible


def test_what_is_measured_anew_has_the_noise_of_the_base():
    time = 0.01 * np.arange(2000)
    truth = {("displacement", 1): np.sin(time), BASE: np.cos(time)}
    record = jfsm.Record(time, displacement=np.sin(time), base_acceleration=np.sin(3 * time))
    levels = {("displacement", 1): 0.01, BASE: 0.05}
    again = remeasured(record, truth, levels, np.random.default_rng(0))
    assert again.base_acceleration is not None and again.displacement is not None
    assert np.std(again.base_acceleration - np.cos(time)) == pytest.approx(0.05, rel=0.1)
    assert np.std(again.displacement[:, 0] - np.sin(time)) == pytest.approx(0.01, rel=0.1)
    as_it_was = remeasured(record, {("displacement", 1): np.sin(time)}, {}, np.random.default_rng(0))
    np.testing.assert_array_equal(as_it_was.base_acceleration, record.base_acceleration)


def test_white_innovations_tell_the_noise_of_a_channel_that_gave_but_a_guess(record):
    model = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING) + Coulomb(FRICTION, at=(0, 1))
    records = prepare_all([record], model)
    given, refitted = fit_model(Problem(model, records, UNTIL))
    louder = 2 * np.log(3.0)  # three times the noise
    theta = np.array([louder if u.path == "noise@1" else t for u, t in zip(given.unknowns, given.theta, strict=True)])
    guessed = np.array([True, False, True])
    best = replace(
        given, theta=theta, evidence=refitted.evidence + 1, whiteness=0.0, trusted=guessed, noise=np.zeros(3)
    )
    untrusting = Problem(model, [replace(records[0], trusted=guessed)], UNTIL)
    more = 8 * float(records[0].floor[1] / records[0].spread[1]) ** 2
    np.testing.assert_allclose(noise_beyond([best, refitted], untrusting), more, rtol=1e-6)
    np.testing.assert_allclose(
        refitted.amid(np.full(2, more)).prediction.expected - refitted.prediction.expected, more, rtol=1e-6
    )
    assert not np.any(noise_beyond([replace(best, whiteness=0.2), refitted], untrusting))

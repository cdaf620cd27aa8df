"""The likelihood: its derivatives against finite differences, its lanes against each other, its programs counted."""

import itertools
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.estimation._filter import Innovations
from jfsm.identification import (
    Hypothesis,
    Nuisances,
    Posterior,
    _likelihood,
    _posterior,
    beginnings,
    effect_unknown,
    interval,
    nuisance_unknowns,
    own_unknown,
    prepare,
    with_offsets,
)
from jfsm.identification._drive import forces_before, undelayed_force
from jfsm.identification._posterior import prior
from jfsm.plant import InterpolatedInput, drive_before, lower, undelayed
from jfsm.structures import AbstractTerm

N, DT = 200, 0.05
TIME = DT * np.arange(N)
MODEL = jfsm.Structure.chain(mass=[1.3, 0.8], stiffness=[9.0, 12.0], damping=[0.3, 0.2])
SINGLE = jfsm.Structure.sdof(mass=1.3, stiffness=9.0, damping=0.3)


def noisy_record(model: jfsm.Structure, n: int = N, seed: int = 0) -> jfsm.Record:
    """A run of `model` read with 1 % noise; a force at every degree of freedom."""
    rng, time = np.random.default_rng(seed), DT * np.arange(n)
    force = np.column_stack([5 * np.sin(1.3 * time + j) + 3 * np.sin((2.9 + j) * time) for j in range(model.dof)])
    run = jfsm.simulate(model, jfsm.Record(time, force, at_rest=True), solver="grid")
    channels = {kind: getattr(run, kind) for kind in ("displacement", "acceleration")}
    noisy = {kind: y + 0.01 * np.std(y, 0) * rng.standard_normal(y.shape) for kind, y in channels.items()}
    return jfsm.Record(time, force, **noisy)


@pytest.fixture(scope="module")
def chain_nuisances() -> Nuisances:
    return prepare(noisy_record(MODEL + jfsm.CubicStiffness(2.0, at=(1, 2))), MODEL)


@pytest.fixture(scope="module")
def single_nuisances() -> Nuisances:
    return prepare(noisy_record(SINGLE + jfsm.Coulomb(1.0, at=(0, 1))), SINGLE)


def hypothesis(model: jfsm.Structure, term: AbstractTerm | None, nuisances: Nuisances) -> Hypothesis:
    """`model` with one more term, all its numbers and the nuisances unknown."""
    own = list(model.values())
    structure = with_offsets(model if term is None else model + term, [nuisances])
    unknowns = [own_unknown(structure, path, {}) for path in own]
    if term is not None:
        unknowns.append(effect_unknown(structure, f"{term.kind}@{term.place}.{term.parameters[0].name}", nuisances))
    return Hypothesis((structure,), ((*unknowns, *nuisance_unknowns(structure, nuisances, 0)),))


def together(*single: Hypothesis) -> Hypothesis:
    return Hypothesis(tuple(h.structures[0] for h in single), tuple(h.unknowns[0] for h in single))


CUBIC = jfsm.CubicStiffness(1.5, at=(1, 2))
FRICTION = jfsm.Coulomb(0.8, at=(0, 1))


@pytest.fixture(scope="module")
def smooth(chain_nuisances) -> Posterior:
    return Posterior(hypothesis(MODEL, CUBIC, chain_nuisances), [chain_nuisances])


@pytest.fixture(scope="module")
def friction(single_nuisances) -> Posterior:
    return Posterior(hypothesis(SINGLE, FRICTION, single_nuisances), [single_nuisances])


def somewhere(posterior: Posterior) -> np.ndarray:
    """Values off the start, so that nothing is zero by chance."""
    start = posterior.initial()
    return start + 0.02 * np.random.default_rng(3).standard_normal(start.shape)


@pytest.fixture(scope="module")
def late(single_nuisances) -> Posterior:
    """Of a force sensor and a channel that are late: what comes with every sample depends on the delays."""
    structure = SINGLE + jfsm.ForceDelay(0.013, at=("force", 1)) + jfsm.ChannelDelay(0.021, at=("acceleration", 1))
    paths = ("force_delay@force-1.tau", "channel_delay@acceleration-1.tau")
    unknowns = tuple(effect_unknown(structure, path, single_nuisances) for path in paths)
    own = tuple(own_unknown(structure, path, {}) for path in SINGLE.values())
    return Posterior(Hypothesis((structure,), ((*own, *unknowns),)), [single_nuisances])


@pytest.mark.parametrize("kind", ["smooth", "friction", "power", "late"])
def test_the_gradient_is_that_of_the_value(kind, request):
    posterior: Posterior = request.getfixturevalue(kind)
    theta = somewhere(posterior)
    gradient = posterior.evaluate(theta)[1][0]
    step = 1e-6
    for k in range(theta.shape[1]):
        up, down = theta.copy(), theta.copy()
        up[0, k] += step
        down[0, k] -= step
        difference = (posterior.evaluate(up)[0][0] - posterior.evaluate(down)[0][0]) / (2 * step)
        # Values of some thousand nats hold a difference to 1e-12 of themselves, divided by the step.
        assert difference == pytest.approx(gradient[k], rel=1e-4, abs=1e-5 * np.max(np.abs(gradient)) + 1e-2)


@pytest.mark.parametrize("kind", ["smooth", "friction", "late"])
def test_the_information_is_made_of_the_slopes_of_the_innovations(kind, request):
    posterior: Posterior = request.getfixturevalue(kind)
    theta, step = somewhere(posterior)[0], 1e-6
    use = np.asarray(posterior.records[0].readings.use)[:N]
    variance = np.asarray(posterior.innovations(theta).variance)
    by_error, by_variance = [], []
    for k in range(theta.size):
        found = [posterior.innovations(theta + sign * step * np.eye(theta.size)[k]) for sign in (1, -1)]
        by_error.append((np.asarray(found[0].error) - found[1].error) / (2 * step) * np.sqrt(use / variance))
        ratio = np.log(np.asarray(found[0].variance) / found[1].variance)
        by_variance.append(ratio / (2 * step) * np.sqrt(use / 2))
    slopes = np.array([*np.reshape(by_error, (theta.size, -1)).T, *np.reshape(by_variance, (theta.size, -1)).T])
    known = np.array([1 / u.width**2 for u in posterior.hypothesis.unknowns[0]])
    found = posterior.evaluate(theta[None])[2][0]
    likelihood = slopes.T @ slopes
    weak = np.array(
        [np.isfinite(u.degrees) for u in posterior.hypothesis.unknowns[0]]
    )  # their prior's curvature depends on theta
    scale = np.sqrt(np.outer(np.diag(likelihood), np.diag(likelihood))) + np.diag(known) + 1e-9
    off = (found - likelihood - np.diag(np.where(weak, np.diag(found - likelihood), known))) / scale
    # An instant of reversal that changes its step between the two differences costs friction some accuracy.
    np.testing.assert_allclose(off, 0.0, atol=1e-4 if kind == "smooth" else 1e-3)
    assert np.all(np.diag(found) >= np.diag(likelihood) * (1 - 1e-4)), "a prior law adds information"


@pytest.mark.parametrize("names", [("stiffness", "stiffness@0-1"), ("stiffness@0-1", "stiffness")])
def test_the_most_particular_statement_of_trust_counts_in_whatever_order_it_came(names):
    trust = {name: {"stiffness": 0.05, "stiffness@0-1": 0.5}[name] for name in names}
    widths = [own_unknown(MODEL, path, trust).width for path in MODEL.select("stiffness")]
    assert widths == pytest.approx(np.log1p([0.5, 0.05]))
    assert own_unknown(MODEL, "mass@1", trust).width == own_unknown(MODEL, "mass@1", {}).width


def test_an_own_value_may_be_as_far_off_as_its_owner_says_it_may():
    stated, vague = (own_unknown(MODEL, "mass@1", trust) for trust in ({}, {"mass": 1.0}))
    assert stated.high == pytest.approx(np.log(5.0))
    assert vague.high == -vague.low == pytest.approx(5 * np.log(2.0))


def test_a_value_of_zero_cannot_be_refitted_as_a_share_of_itself():
    with pytest.raises(ValueError, match="damping@0-1.c is 0 and cannot be refitted as a share of itself; state a"):
        own_unknown(jfsm.Structure.sdof(1.0, 9.0), "damping@0-1.c", {})


@pytest.mark.parametrize("at", [(0, 1), (1, 2)])
def test_two_lanes_are_what_each_of_them_is_alone(chain_nuisances, smooth, at):
    """Wherever the law of the second is: at one place they share runs."""
    other = hypothesis(MODEL, jfsm.CubicStiffness(-0.7, at=at), chain_nuisances)
    both = Posterior(together(smooth.hypothesis, other), [chain_nuisances])
    theta = somewhere(both)
    found = both.evaluate(theta)
    np.testing.assert_allclose(both.values(theta), found[0], rtol=1e-12)
    for lane, alone in enumerate((smooth, Posterior(other, [chain_nuisances]))):
        for part, expected in zip(found, alone.evaluate(theta[lane][None]), strict=True):
            np.testing.assert_allclose(part[lane], expected[0], rtol=1e-9, atol=1e-9 * np.max(np.abs(expected)))


def test_delays_that_begin_far_apart_run_side_by_side(single_nuisances):
    short, long = (
        hypothesis(SINGLE, jfsm.DelayedForce(1.0, tau, at=(0, 1)), single_nuisances) for tau in (0.3, 100 * DT)
    )
    both = Posterior(together(short, long), [single_nuisances])
    values = both.evaluate(both.initial())[0]
    for lane, one in enumerate((short, long)):
        alone = Posterior(one, [single_nuisances])
        assert values[lane] == pytest.approx(alone.evaluate(alone.initial())[0][0], rel=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.3, -1.7])
def test_what_drives_a_late_sensor_is_the_same_on_the_host_as_in_a_run(single_nuisances, delay):
    inputs, plant = single_nuisances.inputs, lower(SINGLE + jfsm.structures.ForceDelay(delay * DT, at=("force", 1)))
    there = undelayed(plant, inputs).force
    np.testing.assert_allclose(undelayed_force(np.asarray(inputs.force), np.array([delay])), there, atol=1e-12)
    force, base = drive_before(inputs, jnp.asarray(delay * DT))
    here = forces_before(inputs, delay * DT)
    np.testing.assert_allclose(here, np.concatenate([force, np.asarray(base)[..., None]], 2), atol=1e-12)


def test_more_starts_than_lanes_are_refused(chain_nuisances, smooth):
    with pytest.raises(ValueError, match=r"At most 2 starts fit into one call; got 5\."):
        Posterior(together(*[smooth.hypothesis] * 5), [chain_nuisances])


def test_the_likelihoods_of_two_records_add_up(chain_nuisances, smooth):
    one = smooth.hypothesis
    shared = tuple(u for u in one.unknowns[0] if u.record is None)
    own = tuple(u for u in one.unknowns[0] if u.record is not None)
    second = tuple(replace(u, record=1) for u in own)
    both = Posterior(Hypothesis(one.structures, ((*shared, *own, *second),)), [chain_nuisances, chain_nuisances])
    theta = somewhere(smooth)
    twice = np.concatenate([theta, theta[:, len(shared) :]], axis=1)
    alone = smooth.evaluate(theta)[0][0]
    counted_twice = prior(shared, theta[0, : len(shared)])[0]
    assert both.evaluate(twice)[0][0] == pytest.approx(2 * alone - counted_twice, rel=1e-12)


def test_samples_after_the_end_that_counts_have_no_part(chain_nuisances, smooth):
    until = 195
    torn = np.array(chain_nuisances.readings.values)
    torn[until:] += 0.5
    spoiled = replace(chain_nuisances, readings=eqx.tree_at(lambda r: r.values, chain_nuisances.readings, torn))
    values = [
        Posterior(smooth.hypothesis, [nuisances], ends).evaluate(somewhere(smooth))[0][0]
        for nuisances, ends in ((chain_nuisances, [until]), (spoiled, [until]), (spoiled, None))
    ]
    assert values[0] == values[1]
    assert values[2] > values[0] + 100


def test_torn_readings_have_no_part_in_the_sizes_that_priors_go_by():
    record = noisy_record(MODEL)
    kinds = ("force", "displacement", "acceleration")
    force, x, a = (np.column_stack([record.channels[kind, j] for j in (1, 2)]) for kind in kinds)
    x[[0, 70, 140], [0, 1, 1]] += 20 * x.std()
    clean = prepare(record, MODEL)
    torn = prepare(jfsm.Record(record.time, force, displacement=x, acceleration=a), MODEL)
    assert np.sum(np.asarray(torn.readings.use)[:N] == 0) == 3
    for name in ("spread", "length", "crest"):
        np.testing.assert_allclose(getattr(torn, name), getattr(clean, name), rtol=0.02, err_msg=name)
    np.testing.assert_allclose(torn.x0, clean.x0, atol=0.5 * clean.length)
    structure = with_offsets(MODEL, [clean])
    unknowns = [{u.path: u.unit for u in nuisance_unknowns(structure, nuisances, 0)} for nuisances in (clean, torn)]
    assert unknowns[1] == pytest.approx(unknowns[0], rel=0.02)


def test_noise_in_the_motion_of_the_base_drives_all_masses():
    rng, time = np.random.default_rng(4), 0.2 * DT * np.arange(3000)
    shaken = sum(
        np.sin(omega * time + omega) for omega in (0.9, 1.7, 2.3, 3.1, 4.4, 5.2, 6.1, 7.3, 8.2, 9.1, 10.7, 11.9)
    )
    run = jfsm.simulate(MODEL, jfsm.Record(time, base_acceleration=shaken, at_rest=True), solver="grid")
    noise, x = 0.05 * np.std(shaken), run.displacement
    record = jfsm.Record(
        time,
        displacement=x + 0.001 * np.std(x, 0) * rng.standard_normal(x.shape),
        base_acceleration=shaken + noise * rng.standard_normal(time.size),
        at_rest=True,
    )
    nuisances = prepare(record, MODEL)
    assert nuisances.base_floor == pytest.approx(noise, rel=0.1)
    assert isinstance(nuisances.inputs, InterpolatedInput)
    left = float(np.std(np.asarray(nuisances.inputs.base)[: time.size, 0] - shaken))
    assert left < 0.5 * noise, "the noise is smoothed away as far as the band of the motion lets it be"
    inertia = np.array([1.3, 0.8])
    density = nuisances.force_covariance / np.outer(inertia, inertia)
    np.testing.assert_allclose(density, density[0, 0])
    assert 0 < density[0, 0] < 1.3 * noise**2
    one = hypothesis(MODEL, None, nuisances)
    posterior = Posterior(one, (nuisances,), (time.size,))
    found = posterior.innovations(posterior.initial()[0], 0)
    r = (found.error / np.sqrt(found.variance))[100 : time.size]
    np.testing.assert_allclose(np.std(r, 0), 1.0, atol=0.15)
    assert np.all(np.abs(np.sum(r[1:] * r[:-1], 0) / np.sum(r * r, 0)) < 0.1)


def test_the_first_readings_lead_unless_the_record_begins_quietly():
    record = noisy_record(SINGLE, n=12_000)
    channels = {name: getattr(record, name) for name in ("force", "displacement", "acceleration")}
    quiet = np.where(record.time < record.time[7000], 0.01, 1.0)[:, None]
    steady, begun_late = (
        prepare(jfsm.Record(record.time, **{name: size * y for name, y in channels.items()}), SINGLE)
        for size in (1.0, quiet)
    )
    assert steady.leading == 1024
    assert begun_late.leading == 8192


@pytest.fixture
def traces(monkeypatch) -> list[None]:
    """One entry for each time that the likelihood is traced into a program."""
    found, tail = [], _likelihood.tail_of
    monkeypatch.setattr(_likelihood, "tail_of", lambda *args: found.append(None) or tail(*args))
    return found


def test_one_program_serves_every_smooth_law_at_every_place_with_either_sign(chain_nuisances, smooth, traces):
    smooth.evaluate(smooth.initial())
    traces.clear()
    laws = (jfsm.CubicStiffness, jfsm.QuadraticStiffness, jfsm.QuadraticDamping)
    for law, size, at in itertools.product(laws, (0.3, -0.3), ((0, 1), (1, 2), (0, 2))):
        posterior = Posterior(hypothesis(MODEL, law(size, at=at), chain_nuisances), [chain_nuisances])
        value, gradient, _ = posterior.evaluate(posterior.initial())
        assert np.isfinite(value[0]) and np.all(np.isfinite(gradient))
    assert not traces


def test_friction_has_one_program_for_every_place(single_nuisances, friction, traces):
    friction.evaluate(friction.initial())
    traces.clear()
    for at in ((0, 1), (1, 0)):
        posterior = Posterior(hypothesis(SINGLE, jfsm.Coulomb(0.5, at=at), single_nuisances), [single_nuisances])
        assert np.isfinite(posterior.evaluate(posterior.initial())[0][0])
    assert not traces


def test_records_of_any_length_share_a_program_wherever_they_end(chain_nuisances, smooth, traces):
    smooth.evaluate(smooth.initial())
    traces.clear()
    Posterior(smooth.hypothesis, [chain_nuisances], [194]).evaluate(smooth.initial())
    for n in (N // 2, N + 5, 7 * N):
        other = prepare(noisy_record(MODEL, n=n), MODEL)
        Posterior(hypothesis(MODEL, CUBIC, other), [other]).evaluate(smooth.initial())
    assert not traces


def test_a_run_is_the_same_in_one_stretch_and_in_several(chain_nuisances, smooth, monkeypatch):
    """Also where runs differ in what drives them, and of a lane more than run at once."""
    theta = np.repeat(smooth.initial(), _likelihood.RUNS + 1, 0) * np.linspace(1.0, 1.01, _likelihood.RUNS + 1)[:, None]
    push = 0.1 * np.sin(np.arange(N) / 5.0)[None, :, None] * np.linspace(0, 1, len(theta))[:, None, None] * np.ones(2)
    whole = smooth.many_innovations(theta, push=push)
    monkeypatch.setattr(_likelihood, "SAMPLES", 64)
    chain_nuisances.stretches.clear()
    pieces = smooth.many_innovations(theta, push=push)
    chain_nuisances.stretches.clear()
    for one, other in zip(whole, pieces, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(one)))
    assert not np.allclose(whole.error[0], whole.error[-1], rtol=1e-3)


def test_steps_are_short_enough_for_the_stiffest_structure_asked_for_and_the_drive_stays_the_same(chain_nuisances):
    stiff = MODEL + jfsm.LuGre(1.0, 1.0, 0.1, 2000.0, 20.0, at=(0, 1))
    assert chain_nuisances.resolving([MODEL, MODEL + jfsm.CubicStiffness(2.0, at=(0, 1))]) is chain_nuisances
    finer = chain_nuisances.resolving([MODEL, stiff])
    assert finer.inputs.substeps >= 4 * chain_nuisances.inputs.substeps
    coarse, fine = (np.asarray(n.inputs.force) for n in (chain_nuisances, finer))
    every = (fine.shape[1] - 1) // (coarse.shape[1] - 1)
    np.testing.assert_allclose(fine[: N - 1, ::every], coarse[: N - 1], atol=1e-9 * np.max(np.abs(coarse)))
    assert finer.readings is chain_nuisances.readings


@pytest.mark.parametrize("at", [(0, 1), (1, 2)])
def test_steps_follow_a_spring_that_hardens_wherever_it_is(at, chain_nuisances):
    stiff = MODEL + jfsm.CubicStiffness(1e6, at=at)
    assert chain_nuisances.resolving([stiff]).inputs.substeps >= 4 * chain_nuisances.inputs.substeps


def test_the_start_is_first_guessed_from_what_is_measured(chain_nuisances):
    first = np.asarray(chain_nuisances.readings.values)[0]
    shown = [first[i] for i, (kind, _) in enumerate(chain_nuisances.channels) if kind == "displacement"]
    np.testing.assert_array_equal(chain_nuisances.x0, shown)


POWER = ("power_damping@0-1.c", "power_damping@0-1.n")


@pytest.fixture(scope="module")
def power(single_nuisances) -> Posterior:
    structure = SINGLE + jfsm.PowerDamping(0.4, 1.5, at=(0, 1))
    unknowns = tuple(effect_unknown(structure, path, single_nuisances) for path in POWER)
    return Posterior(Hypothesis((structure,), (unknowns,)), [single_nuisances])


def test_a_coefficient_follows_its_exponent_so_that_the_force_at_a_typical_speed_stays(power, single_nuisances):
    speed, theta = single_nuisances.length * single_nuisances.omega, power.initial()[0]
    for n in (0.7, 1.5, 3.0):
        law = power.structure(np.array([theta[0], np.log(n / 1.5)])).terms[-1]
        assert float(law.n) == pytest.approx(n)
        assert float(law.c * speed**law.n) == pytest.approx(0.4 * speed**1.5)


def test_a_law_whose_coefficient_follows_its_exponent_is_as_likely_as_with_the_same_numbers_by_themselves(
    power, single_nuisances
):
    theta = power.initial()[0] + np.array([0.3, -0.2])
    structure = power.structure(theta)
    known = Hypothesis((structure,), ((own_unknown(structure, "mass@1", {}),),))
    alone = Posterior(known, [single_nuisances])
    here, there = theta[None], alone.initial()
    values = [
        float(posterior.evaluate(at)[0][0]) - prior(posterior.hypothesis.unknowns[0], at[0])[0]
        for posterior, at in ((power, here), (alone, there))
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-9)


def test_the_interval_of_a_coefficient_holds_what_is_not_known_of_its_exponent(power):
    unknowns, theta = power.hypothesis.unknowns[0], power.initial()[0]
    covariance = np.array([[0.01, 0.004], [0.004, 0.0025]])
    drawn = np.random.default_rng(0).multivariate_normal(theta, covariance, 100_000)
    exponent = unknowns[1].unit * np.exp(drawn[:, 1])
    coefficient = unknowns[0].unit * np.exp(drawn[:, 0] + unknowns[0].tie[1] * exponent)
    value, low, high = interval(unknowns, theta, covariance, POWER[0])
    assert value == pytest.approx(0.4)
    np.testing.assert_allclose(np.log([low, high]), np.log(np.quantile(coefficient, [0.025, 0.975])), atol=0.03)


def test_the_noise_of_the_force_moves_the_masses_that_a_record_is_weighed_with(single_nuisances):
    known, mass = single_nuisances, float(SINGLE.mass[0])
    heavier = jfsm.Structure([2.0 * mass], SINGLE.terms)
    seen, anew = known.weighed(heavier), prepare(known.record, heavier)
    np.testing.assert_allclose(seen.readings.variance, anew.readings.variance, rtol=1e-12)
    assert np.sum(seen.readings.variance < known.readings.variance) == 1  # that of the acceleration
    less = known.noise.velocity - seen.noise.velocity
    np.testing.assert_allclose(less, 0.75 * known.force_covariance * (DT / mass) ** 2, rtol=1e-9)


def test_starts_of_a_law_that_sticks_begin_together_as_each_begins_alone():
    time = np.arange(300) * 0.05
    force, model = np.sin(1.3 * time), jfsm.Structure.sdof(1.0, 9.0, 0.3)
    record = jfsm.Record(time, force, displacement=0.1 * np.sin(1.3 * time - 0.2), acceleration=-0.17 * np.sin(time))
    laws = [jfsm.Coulomb(size, at=(0, 1)) for size in (0.05, 0.1, 0.2)]
    problem = Problem(model, [prepare(record, model), prepare(record[:200], model)], [250, 200])
    posteriors = [problem.posterior([model + law]) for law in laws]
    alone = [[float(p.values(p.initial(), slack)[0]) for p in posteriors] for slack in (0.1, 0.01)]
    np.testing.assert_allclose(beginnings(posteriors, (0.1, 0.01)), alone, rtol=1e-12)
    assert len(np.unique(alone)) == 6


def test_lanes_are_asked_the_other_way_round_only_where_laws_may_jump(smooth, friction, chain_nuisances, monkeypatch):
    """The first reading alone shows the first unknown, as where a lane has jumped."""
    asked = []

    def run(lanes, values):
        asked.append(len(values))
        error: Any = np.zeros((len(values), 40, 1))
        error[:, 0, 0] = values[:, 0]
        return Innovations(error, 1.0 + 0 * error, 0 * error)

    for jumps in (False, True):
        [found] = _likelihood.values_and_slopes(run, np.zeros((1, 1)), np.ones((40, 1)), jumps)
        assert found.by_error[0, 0] == pytest.approx(1.0)
    assert asked == [2, 2, 1]
    told = []
    monkeypatch.setattr(_posterior, "values_and_slopes", lambda *given: told.append(given[-1]) or 1 / 0)
    linear = Posterior(hypothesis(MODEL, None, chain_nuisances), [chain_nuisances])
    for posterior in (linear, smooth, friction):
        with pytest.raises(ZeroDivisionError):
            posterior.evaluate(posterior.initial())
    assert told == [False, True, True]

"""Forces that act later than they were recorded, or otherwise between their samples, on data that SciPy made."""

import json
from collections.abc import Callable
from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_verdict import evidence_of, given, refit

import jfsm
from jfsm._limit import UNLIMITED
from jfsm.diagnosis import Evidence, judge
from jfsm.diagnosis.channels.clock import WAYS, in_its_time, lateness
from jfsm.diagnosis.evidence.as_recorded import change_by_times
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.search.baseline import fit_model
from jfsm.diagnosis.search.steps import Steps
from jfsm.diagnosis.search.study import Study
from jfsm.identification import Posterior, prepare_all

N, STEP, NOISE = 1200, 0.04, 0.002
MASS, DAMPING, STIFFNESS = np.array([2.0, 1.0]), np.array([0.5, 0.3]), np.array([60.0, 45.0])
TIME = np.arange(N) * STEP
TRIED = ("cubic_hardening", "quadratic_damping", "force_gain", "force_delay", "channel_delay")


def force_at(t: Any) -> Any:
    """A sum of tones over both resonances."""
    rng = np.random.default_rng(5)
    omegas, phases = rng.uniform(1.0, 14.0, 20), rng.uniform(0.0, 2 * np.pi, 20)
    return 3.0 * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)


def single_line(t: Any) -> Any:
    return 5.0 * np.cos(4.0 * t + 1.0)


def recorded(
    acting: Callable[[float], float],
    masses: int = 1,
    kinds: tuple[str, ...] = ("displacement",),
    cubic: float = 0.0,
    quadratic: float = 0.0,
    told: Callable[[Any], Any] = force_at,
) -> jfsm.Record:
    """A noisy record of a chain at rest under a force on its last mass that acts so, recorded as it is `told`."""
    m, c, k = MASS[:masses], DAMPING[:masses], STIFFNESS[:masses]

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:masses], y[masses:]
        d = np.diff(x, prepend=0.0)
        w = np.diff(v, prepend=0.0)
        link = k * d + c * w + cubic * d**3
        link[-1] += quadratic * w[-1] * abs(w[-1])
        net = np.append(link[1:], acting(t)) - link
        return np.concatenate([v, net / m])

    rows, y = [np.zeros(2 * masses)], np.zeros(2 * masses)
    for begin in TIME[:-1]:  # a force that is held jumps at the samples
        leg = solve_ivp(rates, (begin, begin + STEP * (1 - 1e-12)), y, method="DOP853", rtol=1e-9, atol=1e-11)
        y = leg.y[:, -1]
        rows.append(y)
    states = np.array(rows)
    accelerations = np.array([rates(t, y)[masses:] for t, y in zip(TIME, states, strict=True)])
    clean = {"displacement": states[:, :masses], "acceleration": accelerations}
    rng = np.random.default_rng(1)
    noisy: dict[str, Any] = {
        kind: {j + 1: y + NOISE * y.std() * rng.standard_normal(N) for j, y in enumerate(clean[kind].T)}
        for kind in kinds
    }
    return jfsm.Record(TIME, force={masses: told(TIME)}, at_rest=True, **noisy)


def late(samples: float) -> Callable[[float], float]:
    return lambda t: float(force_at(t - samples * STEP))


def held(t: float) -> float:
    return float(force_at(np.floor(t / STEP + 1e-9) * STEP))


def straight(t: float) -> float:
    return float(np.interp(t, TIME, force_at(TIME)))


def chain(masses: int = 1) -> jfsm.Structure:
    return jfsm.Structure.chain(mass=MASS[:masses], stiffness=STIFFNESS[:masses], damping=DAMPING[:masses])


def problem_of(record: jfsm.Record, model: jfsm.Structure) -> Problem:
    return Problem(model, prepare_all([record], model), [N], ways=WAYS)


@pytest.mark.parametrize(
    ("samples", "masses"),
    [(0.3, 1), (0.7, 2), pytest.param(0.7, 1, marks=pytest.mark.slow), pytest.param(0.3, 2, marks=pytest.mark.slow)],
)
def test_a_force_that_acts_late_is_so_by_the_baseline(samples: float, masses: int):
    problem = problem_of(recorded(late(samples), masses), chain(masses))
    _, refitted = fit_model(problem)
    found = in_its_time(refitted, problem, to_noise=True)
    assert found is not None and found.first.reconstruction == "band-limited"
    ((channel, (tau, low, high)),) = lateness(fit_model(found)[1], found).items()
    assert channel == ("force", masses) and low < -samples * STEP < high
    assert tau == pytest.approx(-samples * STEP, rel=0.02) and high - low < 0.05 * STEP


@pytest.mark.parametrize(
    ("way", "acting"),
    [pytest.param("hold", held, marks=pytest.mark.slow), pytest.param("linear", straight, marks=pytest.mark.slow)],
)
def test_how_a_force_goes_between_its_samples_is_seen_by_the_baseline(way: str, acting: Callable[[float], float]):
    problem = problem_of(recorded(acting), chain())
    found = in_its_time(fit_model(problem)[1], problem, to_noise=True)
    assert found is not None and found.first.reconstruction == way and not found.first.late
    fitted = fit_model(found)[1].structure.values()
    assert fitted["stiffness@0-1.k"] == pytest.approx(STIFFNESS[0], rel=2e-3)
    assert fitted["mass@1"] == pytest.approx(MASS[0], rel=2e-3)


def test_a_force_in_time_stays_as_it_was_recorded():
    problem = problem_of(recorded(late(0.0)), chain())
    given, refitted = fit_model(problem)
    assert in_its_time(refitted, problem, to_noise=True) is None and lateness(refitted, problem) == {}
    assert change_by_times(given.structure, problem.first, "band-limited") == 0.0


@pytest.mark.slow
def test_a_late_force_beside_a_law_has_to_be_likelier_than_all_that_is_known():
    problem = problem_of(recorded(held), chain())
    _, refitted = fit_model(problem)
    found = in_its_time(refitted, problem, to_noise=True, likeliest=refitted.evidence + 100.0)
    assert found is not None and found.first.reconstruction == "hold"
    assert in_its_time(refitted, problem, to_noise=True, likeliest=refitted.evidence + 1e6) is None


@pytest.mark.slow
def test_a_way_of_the_force_in_which_a_law_runs_away_promises_nothing(monkeypatch):
    problem = problem_of(recorded(held), chain())
    _, refitted = fit_model(problem)
    nowhere = np.full((1, 9), np.nan)
    monkeypatch.setattr(Posterior, "evaluate", lambda *_: (nowhere[0], nowhere, np.full((1, 9, 9), np.nan)))
    assert in_its_time(refitted, problem, to_noise=True) is None


def test_a_single_line_shows_no_late_force():
    record = recorded(lambda t: float(single_line(t - 0.5 * STEP)), told=single_line)
    problem = problem_of(record, chain())
    assert in_its_time(fit_model(problem)[1], problem, to_noise=False) is None


@pytest.mark.slow
def test_a_response_that_is_late_among_others_is_not_the_force():
    record = recorded(late(0.0), kinds=("displacement", "acceleration"))
    earlier = np.asarray(recorded(late(0.5)).displacement)[:, 0]  # that of half a sample ago, but for the noise
    soiled = jfsm.Record(TIME, record.force, displacement=earlier, acceleration=record.acceleration, at_rest=True)
    problem = problem_of(soiled, chain())
    assert in_its_time(fit_model(problem)[1], problem, to_noise=False) is None


def test_a_law_that_lags_is_no_late_force():
    model, lagging = chain(), jfsm.AttachedOscillator(m=0.4, omega=9.0, zeta=0.03, at=(0, 1))
    rng, driven = np.random.default_rng(2), jfsm.Record(TIME, force_at(TIME), displacement=0 * TIME, at_rest=True)
    x = np.asarray(jfsm.simulate(model + lagging, driven).displacement)[:, 0]
    record = jfsm.Record(TIME, force_at(TIME), displacement=x + NOISE * x.std() * rng.standard_normal(N), at_rest=True)
    problem = problem_of(record, model)
    assert in_its_time(fit_model(problem)[1], problem, to_noise=True) is None


def test_a_late_force_is_a_cause_though_nothing_else_is_wrong():
    record, model = recorded(late(0.7)), chain()
    d = jfsm.diagnose(record, model, causes=TRIED, key=jax.random.key(0))
    (finding,) = d.findings
    assert d.verdict == "cause" and (finding.cause, finding.at) == ("force_delay", ("force", 1))
    tau = finding.parameters["tau"]
    assert tau.value == pytest.approx(-0.7 * STEP, rel=0.01) and 0 < tau.high - tau.low < 0.01 * STEP
    assert "later than it was recorded" in d.sentence
    assert [(r.cause, r.at) for r in finding.rivals] == [("channel_delay", ("displacement", 1))]
    assert d.gain is not None and d.gain.after < 1.2 * d.gain.floor
    later = record[840:]
    x, y = (np.asarray(one.displacement)[80:, 0] for one in (jfsm.simulate(model, later, window=80), later))
    assert d.gain.before == pytest.approx(np.std(x - y) / np.std(y), rel=0.1)  # nothing is forgiven
    again = np.asarray(jfsm.simulate(d.extended, record).displacement)[:, 0]
    assert np.std(again - np.asarray(record.displacement)[:, 0]) < 0.1 * d.gain.before * np.std(y)
    (row,) = [check for check in d.decision.checks if check.name == "acts_in_time"]
    assert not row.passed and row.of == "force_delay@force:1"
    assert "acts_in_time" in d.why("force_delay") and "acts_in_time" in d.why()
    assert judge(Evidence.of_plain(json.loads(json.dumps(d.data["evidence"])))).verdict == "cause"


def test_a_late_force_is_found_where_nothing_else_is_looked_for():
    d = jfsm.diagnose(recorded(late(0.7)), chain(), causes=("force_delay",), key=jax.random.key(0))
    assert d.verdict == "cause" and [f.cause for f in d.findings] == ["force_delay"]


@pytest.mark.slow
def test_a_force_that_is_hardly_late_is_said_and_no_cause():
    d = jfsm.diagnose(recorded(late(0.02)), chain(), causes=TRIED, key=jax.random.key(0))
    assert d.verdict == "consistent" and not d.findings
    assert any("later than it was recorded" in note for note in d.notes)


def test_a_delay_that_was_no_candidate_is_tried_where_the_force_turns_out_to_be_in_time():
    record, model = recorded(late(0.0)), chain()
    chosen = {name: jfsm.structures.causes()[name] for name in TRIED}
    study = Study(model, chosen, None, None, jax.random.key(0), Steps(None, 4), UNLIMITED, False)
    problem, channel = problem_of(record, model), ("force", 1)
    timed = problem.timed("band-limited", {channel: 0.01})
    tried = [[(c.effects[0].cause.id, c.effects[0].at) for c in study._candidates(p)] for p in (problem, timed)]
    assert ("force_delay", channel) in tried[0] and ("force_delay", channel) not in tried[1]
    (untried,) = study._delays(problem, timed)
    assert (untried.effects[0].cause.id, untried.effects[0].at) == ("force_delay", channel)
    assert study._delays(problem, problem) == study._delays(timed, timed) == []


@pytest.mark.slow
@pytest.mark.parametrize("acting", [late(0.3), held], ids=["late", "held"])
def test_a_law_is_named_beside_a_late_force(acting: Callable[[float], float]):
    d = jfsm.diagnose(recorded(acting, cubic=40.0), chain(), causes=TRIED, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening", "force_delay"]
    k3 = d.findings[0].parameters["k3"]
    assert k3.low < 40.0 < k3.high
    assert d.gain is not None and d.gain.after < 1.5 * d.gain.floor


@pytest.mark.slow
def test_what_makes_up_for_a_force_that_is_held_is_not_named_instead_of_a_law():
    record = recorded(held, masses=2, quadratic=4.0)
    causes = (*TRIED, "lugre", "stribeck")
    d = jfsm.diagnose(record, chain(2), causes=causes, max_causes=1, key=jax.random.key(0))
    assert [(f.cause, f.at) for f in d.findings] == [("quadratic_damping", (1, 2)), ("force_delay", ("force", 2))]
    assert d.findings[0].parameters["c2"].value == pytest.approx(4.0, rel=0.05)


@pytest.mark.slow
def test_a_force_that_is_late_by_some_samples_is_a_cause():
    d = jfsm.diagnose(recorded(late(2.5)), chain(), causes=TRIED, key=jax.random.key(0))
    (finding,) = d.findings
    assert finding.cause in ("force_delay", "channel_delay")
    assert abs(finding.parameters["tau"].value) == pytest.approx(2.5 * STEP, rel=0.02)
    (rival,) = finding.rivals
    assert {finding.at, rival.at} == {("force", 1), ("displacement", 1)} and "is the same" in d.sentence


def test_the_verdict_on_a_late_force_follows_from_what_it_changes():
    for change, verdict in ((0.3, "cause"), (0.01, "consistent")):
        cards = given(0.0, 0.0), refit(-3.0, 0.0)
        found = judge(evidence_of(*cards, late=(("force", 1),), late_changes=change))
        assert found.verdict == verdict and found.checks[0].name == "acts_in_time"

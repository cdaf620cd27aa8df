"""From a record and a model to a verdict, on data that SciPy made."""

import json

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm import _traced
from jfsm._format import FORMAT
from jfsm.diagnosis import _conduct
from jfsm.diagnosis.evidence import measured
from jfsm.diagnosis.evidence.free_runs import Gain
from jfsm.diagnosis.hypotheses.candidate import Candidate, as_promising, promising
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.identification import _likelihood

MASS, STIFFNESS, DAMPING, CUBIC = 2.0, 18.0, 0.5, 4.0
SAMPLES, STEP = 900, 0.05
FEW = ("cubic_hardening", "quadratic_stiffness", "coulomb", "quadratic_damping", "force_gain", "accel_gain")
FEW_OR_ALL = [pytest.param(FEW, id="few"), pytest.param(None, id="all", marks=pytest.mark.slow)]


def made(
    restoring, noise=0.005, samples=SAMPLES, channels=("displacement", "velocity", "acceleration"), gain=1.0, seed=3
):
    """A noisy record from rest of MASS a + restoring(x, v) = g."""
    rng = np.random.default_rng(seed)
    omegas, phases = rng.uniform(0.5, 7.0, 12), rng.uniform(0, 2 * np.pi, 12)

    def force(t):
        return 2.0 * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    time = np.arange(samples) * STEP
    x, v = solve_ivp(
        lambda t, y: [y[1], (force(t) - restoring(*y)) / MASS],
        (0, time[-1]),
        [0, 0],
        t_eval=time,
        rtol=1e-10,
        atol=1e-12,
    ).y
    clean = {"displacement": x, "velocity": v, "acceleration": gain * (force(time) - restoring(x, v)) / MASS}
    kept = {"force": force(time)} | {kind: clean[kind] for kind in channels}
    noisy = {kind: y + noise * y.std() * rng.standard_normal(samples) for kind, y in kept.items()}
    return jfsm.Record(time, **noisy, at_rest=True)


def linear(x, v):
    return STIFFNESS * x + DAMPING * v


def duffing(x, v):
    return linear(x, v) + CUBIC * x**3


@pytest.fixture(scope="module")
def believed():
    return jfsm.Structure.sdof(MASS, 1.01 * STIFFNESS, 0.9 * DAMPING)


@pytest.fixture(scope="module")
def hidden_cubic(believed):
    return jfsm.diagnose(made(duffing), believed, key=jax.random.key(0))


@pytest.fixture(scope="module")
def searched(believed):
    """What a search for few causes makes of a hidden cubic spring, before it is decided."""
    kept, search = [], _conduct._looked_into
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_conduct, "_looked_into", lambda *arguments: kept.append(search(*arguments)) or kept[0])
        jfsm.diagnose(made(duffing), believed, causes=FEW, key=jax.random.key(0))
    return kept[0]


@pytest.fixture
def decided(searched, believed, monkeypatch):
    """The verdict on that search where held-out readings tell a given gain."""

    def of(gain: Gain) -> jfsm.Diagnosis:
        monkeypatch.setattr(_conduct, "_looked_into", lambda *arguments: searched)
        monkeypatch.setattr(measured, "measure_gain", lambda *arguments, **how: (gain, []))
        return jfsm.diagnose(made(duffing), believed, causes=FEW, key=jax.random.key(0))

    return of


def test_a_hidden_cubic_spring_is_named_with_its_place_and_value(hidden_cubic):
    assert hidden_cubic.verdict == "cause"
    (finding,) = hidden_cubic.findings
    assert (finding.cause, finding.family, finding.at) == ("cubic_hardening", "stiffness", (0, 1))
    estimate = finding.parameters["k3"]
    # One record in twenty lies outside; four standard errors are beyond chance.
    assert abs(estimate.value - CUBIC) < 4 * (estimate.high - estimate.low) / 3.92
    assert estimate.value == pytest.approx(CUBIC, rel=0.03)
    assert estimate.unit == "N/m^3"
    assert finding.probability > 0.95


def test_the_extended_model_closes_what_can_be_closed_on_held_out_readings(hidden_cubic):
    gain = hidden_cubic.gain
    assert gain.closed > 0.95
    assert gain.after < gain.refitted < gain.before
    assert 0.95 < gain.interval[0] <= gain.closed <= gain.interval[1] <= 1 and gain.significant
    assert hidden_cubic.extended.values()["cubic_stiffness@0-1.k3"] == pytest.approx(CUBIC, rel=0.03)


@pytest.mark.slow
def test_a_cubic_spring_is_named_where_white_noise_drives(believed):
    rng = np.random.default_rng(5)
    time = np.arange(SAMPLES) * STEP
    force = 8.0 * rng.standard_normal(SAMPLES)

    def rate(t, y):
        return [y[1], (np.interp(t, time, force) - duffing(*y)) / MASS]

    x, _ = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=STEP / 2).y
    measured = force + 0.04 * rng.standard_normal(SAMPLES)
    record = jfsm.Record(time, measured, x + 0.005 * x.std() * rng.standard_normal(SAMPLES), at_rest=True)
    report = jfsm.diagnose(record, believed, causes=FEW, key=jax.random.key(0))
    assert [finding.cause for finding in report.findings] == ["cubic_hardening"]
    assert report.findings[0].parameters["k3"].value == pytest.approx(CUBIC, rel=0.1)


def test_own_values_are_refitted_beside_the_finding(hidden_cubic):
    assert hidden_cubic.refitted["stiffness@0-1.k"].value == pytest.approx(STIFFNESS, rel=0.01)
    assert hidden_cubic.refitted["mass@1"].value == pytest.approx(MASS, rel=0.01)


def test_every_candidate_but_the_named_one_says_why_it_lost(hidden_cubic):
    tried = {c.cause for c in hidden_cubic.candidates}
    catalogue = {name for name, cause in jfsm.causes().items() if not cause.is_value}
    # Nothing is clipped, turns or is commanded, and the model has a spring and a dashpot wherever there could be one.
    missing = {"missing_stiffness", "missing_damping"}
    assert tried == catalogue - missing - {"clipping", "elastic_joint", "ripple", "command_delay"}
    for candidate in hidden_cubic.candidates:
        assert candidate.why
        assert (candidate.why == "named") == (candidate.cause == "cubic_hardening")


def test_a_notebook_shows_the_verdict_in_a_line(hidden_cubic):
    assert repr(hidden_cubic) == f"<Diagnosis, cause: {hidden_cubic.sentence}>"


def test_the_force_that_was_found_is_a_table_and_a_program(hidden_cubic):
    table = hidden_cubic.table(velocity=[0.0])
    assert table.terms == ("cubic_stiffness@0-1",) and table.displacement.min() < 0 < table.displacement.max()
    k3 = hidden_cubic.findings[0].parameters["k3"].value
    np.testing.assert_allclose(table.force[:, 0], k3 * table.displacement**3, rtol=1e-9)
    assert f"cubic_stiffness_0_1_k3 = {k3!r}" in hidden_cubic.extended.to_python()


def test_a_diagnosis_is_read_back_from_its_json(hidden_cubic, tmp_path):
    hidden_cubic.to_json(tmp_path / "d.json")
    again = jfsm.Diagnosis.load(tmp_path / "d.json")
    for name in ("verdict", "findings", "refitted", "detectable", "noise", "notes", "sentence", "modes", "finished"):
        assert getattr(again, name) == getattr(hidden_cubic, name), name
    assert [(c.cause, c.at, c.why) for c in again.candidates] == [
        (c.cause, c.at, c.why) for c in hidden_cubic.candidates
    ]
    assert again.gain is not None and hidden_cubic.gain is not None
    assert again.gain.closed == hidden_cubic.gain.closed and again.gain.channels == hidden_cubic.gain.channels
    assert again.extended.values() == pytest.approx(hidden_cubic.extended.values(), rel=1e-12)
    assert again.why() == hidden_cubic.why() and repr(again) == repr(hidden_cubic)
    again.report(tmp_path / "again.html")
    hidden_cubic.report(tmp_path / "first.html")
    assert (tmp_path / "again.html").read_text() == (tmp_path / "first.html").read_text()
    assert again.next_tests() == []


def test_the_verdict_is_written_as_json_and_as_a_page(hidden_cubic, tmp_path):
    hidden_cubic.to_json(tmp_path / "d.json")
    hidden_cubic.report(tmp_path / "d.html")
    data = json.loads((tmp_path / "d.json").read_text())
    assert data["verdict"] == "cause"
    assert data["findings"][0]["parameters"]["k3"]["value"] == hidden_cubic.findings[0].parameters["k3"].value
    assert set(data["curves"]) == {"holdout", "residual", "course", "map", "law"}
    assert data["curves"]["map"] is not None
    page = (tmp_path / "d.html").read_text()
    assert "cubic" in page
    assert "http" not in page.replace("http://www.w3.org", "")


@pytest.mark.slow
def test_a_buckled_spring_is_told_from_a_quadratic_one_by_accelerations_alone():
    well = np.sqrt(2 * STIFFNESS / CUBIC)

    def buckled(x, v):  # about one of its wells
        return DAMPING * v - 2 * STIFFNESS * (x + well) + CUBIC * (x + well) ** 3

    rest = made(buckled, channels=("acceleration",), noise=0.01)
    record = jfsm.Record(rest.time, rest.force, acceleration=rest.acceleration)
    model = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    d = jfsm.diagnose(record, model, causes=("quadratic_stiffness", "double_well"), max_causes=1, key=jax.random.key(1))
    assert [f.cause for f in d.findings] == ["double_well"]
    assert d.findings[0].parameters["k_neg"].value == pytest.approx(3 * STIFFNESS, rel=0.1)
    assert d.findings[0].parameters["k3"].value == pytest.approx(CUBIC, rel=0.1)


@pytest.mark.parametrize("damping", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_what_shows_only_in_the_part_that_was_kept_back_is_named_from_there(damping):
    def damped(x, v):
        return linear(x, v) + damping * v * np.abs(v)

    whole = made(damped, samples=1000, seed=5)
    assert whole.displacement is not None
    gap = 1.05 * np.max(np.abs(whole.displacement[:700]))

    def stopped(x, v):
        return damped(x, v) + 200.0 * np.sign(x) * np.maximum(np.abs(x) - gap, 0.0)

    record = made(stopped, samples=1000, seed=5)
    few = ("end_stop", "quadratic_damping")
    d = jfsm.diagnose(record, jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING), causes=few, key=jax.random.key(0))
    assert {f.cause for f in d.findings} == {"end_stop", *(("quadratic_damping",) if damping else ())}
    [stop] = [f for f in d.findings if f.cause == "end_stop"]
    assert stop.parameters["gap"].value == pytest.approx(gap, rel=0.05)
    assert any("last part" in note for note in d.notes) and d.gain is not None


@pytest.mark.slow
def test_a_cause_that_makes_held_out_runs_worse_is_not_named(decided):
    worse = Gain(before=0.1, refitted=0.1, after=0.2, floor=0.01, channels={}, interval=(-2.0, -0.5))
    d = decided(worse)
    assert d.verdict == "undecided"
    assert d.findings == ()
    assert "cubic_stiffness@0-1.k3" not in d.extended.values()
    refused = next(c for c in d.candidates if c.cause == "cubic_hardening")
    assert refused.why == "runs worse on held-out readings than the model as given"


def test_held_out_runs_whose_start_noise_hides_say_nothing_against_a_cause(decided):
    hidden = Gain(before=0.1, refitted=0.1, after=0.2, floor=0.19, channels={}, interval=(-2.0, -0.5))
    d = decided(hidden)
    assert d.verdict == "cause" and "Do not change the model" in d.advice


def test_a_cause_that_gains_no_more_than_chance_comes_with_the_advice_to_leave_the_model(decided):
    hardly = Gain(before=0.1, refitted=0.1, after=0.099, floor=0.01, channels={}, interval=(-0.1, 0.2))
    d = decided(hardly)
    assert d.verdict == "cause"
    assert "Do not change the model" in d.advice and d.data["gain"]["significant"] is False


@pytest.mark.slow
def test_the_same_key_gives_the_same_answer_of_the_whole_catalogue(hidden_cubic, believed):
    again = jfsm.diagnose(made(duffing), believed, key=jax.random.key(0))
    assert again.data == hidden_cubic.data


def test_a_right_model_is_left_as_it_is():
    right = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    laws = ("coulomb", "quadratic_damping", "bouc_wen", "stiffness_drift", "force_gain", "channel_delay")
    d = jfsm.diagnose(made(linear, samples=630), right, holdout=None, causes=laws)
    assert d.verdict == "consistent"
    assert d.findings == ()
    assert d.gain is None
    assert d.extended.values() == right.values()
    assert set(d.detectable) == set(laws)
    assert 0 < d.detectable["coulomb"].value < 0.1 and d.detectable["coulomb"].unit == "N"


@pytest.mark.slow
def test_a_right_model_with_a_law_of_its_own_is_left_as_it_is():
    right = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING) + jfsm.CubicStiffness(CUBIC, at=(0, 1))
    d = jfsm.diagnose(made(duffing, samples=630), right, causes=FEW[1:4])
    assert d.verdict == "consistent"
    assert d.extended.values() == right.values()


@pytest.mark.parametrize("causes", FEW_OR_ALL)
def test_a_wrong_stiffness_is_a_parameter_and_no_cause(causes):
    model = jfsm.Structure.sdof(MASS, 1.2 * STIFFNESS, DAMPING)
    d = jfsm.diagnose(made(linear), model, causes=causes, key=jax.random.key(0))
    assert d.verdict == "parameters"
    assert [f.cause for f in d.findings] == ["stiffness_value"]
    assert d.findings[0].at == (0, 1)
    assert d.findings[0].parameters["k"].value == pytest.approx(STIFFNESS, rel=0.01)


@pytest.mark.parametrize("causes", FEW_OR_ALL)
def test_a_gain_error_of_the_accelerometer_is_found_where_it_sits(causes):
    right = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    d = jfsm.diagnose(made(linear, gain=1.1), right, causes=causes, key=jax.random.key(0))
    assert d.verdict == "cause"
    assert (d.findings[0].cause, d.findings[0].at) == ("accel_gain", ("acceleration", 1))
    assert d.findings[0].parameters["eps"].value == pytest.approx(0.1, abs=0.01)


FAULTS = ("accel_bias", "preload", "clipping", "channel_delay", "force_delay", "quadratic_stiffness")


@pytest.mark.parametrize(("cause", "at", "name", "truth"), [
    ("accel_bias", ("acceleration", 1), "b", 0.5),
    ("preload", (0, 1), "F", 1.0),
    pytest.param("clipping", ("displacement", 1), "limit", 1.8, marks=pytest.mark.slow),
    ("clipping", ("force", 1), "limit", 8.0),
    ("channel_delay", ("displacement", 1), "tau", 3 * STEP),
])  # fmt: skip
def test_faults_of_the_measuring_chain_and_a_constant_force_are_named(cause, at, name, truth):
    right = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    record = made(lambda x, v: linear(x, v) - truth if cause == "preload" else linear(x, v))
    read = {kind: y.copy() for (kind, _), y in record.channels.items()}
    if cause == "accel_bias":
        read["acceleration"] += truth
    elif cause == "clipping":
        read[at[0]] = np.clip(read[at[0]], -truth, truth)
        assert 0.01 < np.mean(np.abs(read[at[0]]) == truth) < 0.2
    elif cause == "channel_delay":
        read["displacement"] = np.concatenate([np.zeros(3), read["displacement"][:-3]])
    again = jfsm.Record(record.time, **read, at_rest=True)  # pyright: ignore[reportArgumentType]
    d = jfsm.diagnose(again, right, causes=FAULTS, key=jax.random.key(0))
    assert (d.verdict, d.findings[0].cause, d.findings[0].at) == ("cause", cause, at)
    assert d.findings[0].parameters[name].value == pytest.approx(truth, rel=0.1)
    assert d.gain is not None and d.gain.after < d.gain.before


@pytest.mark.parametrize("late", [pytest.param("force", marks=pytest.mark.slow), "displacement"])
def test_of_two_channels_that_are_apart_in_time_the_late_one_is_named(believed, late):
    punctual, samples = made(linear, channels=("displacement",)), 3
    channels = {kind: punctual.channels[kind, 1] for kind in ("force", "displacement")}
    shifted = {kind: y[:-samples] if kind == late else y[samples:] for kind, y in channels.items()}
    r = jfsm.Record(punctual.time[samples:], shifted["force"], displacement=shifted["displacement"])
    d = jfsm.diagnose(r, believed, causes=("force_delay", "channel_delay"), key=jax.random.key(0))
    (finding,) = d.findings
    assert finding.cause == {"force": "force_delay", "displacement": "channel_delay"}[late]
    assert finding.parameters["tau"].value == pytest.approx(samples * STEP, rel=0.05)
    (rival,) = finding.rivals
    assert 0.02 < rival.probability < 0.2 < finding.probability, "the other may be early, though hardly any is"


def two_laws(x, v):
    return duffing(x, v) + 0.5 * v * np.abs(v)


@pytest.fixture(scope="module")
def two_hidden(believed):
    return jfsm.diagnose(made(two_laws), believed, causes=FEW, key=jax.random.key(0))


def test_two_effects_are_both_named_without_their_number_being_told(two_hidden):
    assert two_hidden.verdict == "cause"
    found = {f.cause: f for f in two_hidden.findings}
    assert set(found) == {"cubic_hardening", "quadratic_damping"}
    for cause, name, truth in (("cubic_hardening", "k3", CUBIC), ("quadratic_damping", "c2", 0.5)):
        [(only, estimate)] = found[cause].parameters.items()
        assert only == name
        assert abs(estimate.value - truth) < 4 * (estimate.high - estimate.low) / 3.92
        assert found[cause].probability > 0.9
    assert {"cubic_stiffness@0-1.k3", "quadratic_damping@0-1.c2"} <= set(two_hidden.extended.values())
    assert two_hidden.gain.closed > 0.95


def test_the_same_key_gives_the_same_answer(two_hidden, believed):
    again = jfsm.diagnose(made(two_laws), believed, causes=FEW, key=jax.random.key(0))
    assert again.data == two_hidden.data


def test_a_pair_shows_on_the_page_and_among_the_candidates(two_hidden, tmp_path):
    named = [c for c in two_hidden.candidates if c.why == "named"]
    assert [(c.cause, c.at) for c in named] == [("quadratic_damping + cubic_hardening", ((0, 1), (0, 1)))]
    assert set(named[0].parameters) == {"quadratic_damping.c2", "cubic_hardening.k3"}
    two_hidden.report(tmp_path / "d.html")
    page = (tmp_path / "d.html").read_text()
    assert "Cubic hardening + quadratic damping" in page or "Quadratic damping + cubic hardening" in page


@pytest.mark.slow
def test_a_spring_is_told_beside_a_gain_error_of_the_force(believed):
    record = made(duffing)
    read = {kind: y * (1.15 if kind == "force" else 1.0) for (kind, _), y in record.channels.items()}
    again = jfsm.Record(record.time, **read, at_rest=True)  # pyright: ignore[reportArgumentType]
    d = jfsm.diagnose(again, believed, causes=FEW, key=jax.random.key(0))
    assert {f.cause for f in d.findings} == {"cubic_hardening", "force_gain"}
    gain = next(f for f in d.findings if f.cause == "force_gain")
    assert gain.at == ("force", 1)
    assert gain.parameters["eps"].value == pytest.approx(0.15, abs=0.03)


@pytest.mark.parametrize(
    ("fault", "load", "bias"), [("accel_bias", 0.0, 0.5), pytest.param("preload", 0.5, 0.0, marks=pytest.mark.slow)]
)
def test_a_spring_is_told_beside_an_offset_that_is_not_slight(believed, fault: str, load: float, bias: float):
    record = made(lambda x, v: duffing(x, v) - load, channels=("displacement", "acceleration"))
    read = {kind: y + (bias if kind == "acceleration" else 0.0) for (kind, _), y in record.channels.items()}
    again = jfsm.Record(record.time, **read, at_rest=True)  # pyright: ignore[reportArgumentType]
    d = jfsm.diagnose(again, believed, causes=["cubic_hardening", fault], key=jax.random.key(0))
    assert {f.cause for f in d.findings} == {"cubic_hardening", fault}
    [offset] = next(f for f in d.findings if f.cause == fault).parameters.values()
    assert offset.value == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
def test_no_second_effect_is_looked_for_where_one_is_asked_for_and_what_is_left_is_said(believed, two_hidden):
    d = jfsm.diagnose(made(two_laws), believed, causes=FEW, max_causes=1, key=jax.random.key(0))
    assert len(d.findings) < 2
    assert d.verdict != "cause" or "Something is left" in d.sentence
    assert "left" not in two_hidden.sentence
    assert not any("+" in c.cause for c in d.candidates)


@pytest.mark.slow
def test_a_law_that_is_not_looked_for_gets_no_name_and_a_map_that_runs():
    def stop(x, v):
        return linear(x, v) + 60.0 * np.maximum(x - 0.4, 0.0)

    model = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    d = jfsm.diagnose(made(stop), model, causes=FEW, key=jax.random.key(0))
    assert d.verdict in ("unnamed", "undecided")
    assert d.findings == ()
    if d.verdict == "unnamed":
        assert d.gain is not None
        assert d.gain.after < 0.7 * d.gain.before


def test_laws_of_a_class_share_one_program(believed, monkeypatch):
    traced = []
    monkeypatch.setattr(_traced, "_read", lambda path: None)  # none is there from an earlier run
    original = _likelihood.tail_of
    monkeypatch.setattr(_likelihood, "tail_of", lambda *a: traced.append(1) or original(*a))
    _traced.clear_programs()
    jfsm.diagnose(made(duffing), believed, causes=FEW, key=jax.random.key(0))
    assert traced
    jfsm.diagnose(made(duffing, samples=899, seed=5), believed, causes=FEW, key=jax.random.key(0))
    # One program with derivatives and one without, for smooth laws and for friction: for no other record, place, sign
    # or law. One without derivatives is made only once such a law is pursued.
    assert len(traced) <= 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"holdout": 1.5}, "`holdout` as a share must lie between 0 and 1"),
        ({"causes": ["rust"]}, "`causes` must name causes of the catalogue"),
        ({"max_causes": 0}, "`max_causes` must be at least 1, a whole number; got 0"),
    ],
)
def test_arguments_out_of_range_are_refused_by_name(believed, arguments, message):
    with pytest.raises(ValueError, match=message):
        jfsm.diagnose(made(linear, samples=100), believed, **arguments)


def test_records_without_response_or_too_short_are_refused(believed):
    record = made(linear, samples=100)
    with pytest.raises(ValueError, match="`record` must hold a response"):
        jfsm.diagnose(jfsm.Record(record.time, record.force), believed)
    with pytest.raises(ValueError, match="at least 32 samples"):
        jfsm.diagnose(record[:20], believed)
    with pytest.raises(ValueError, match="sequence is empty"):
        jfsm.diagnose([], believed)
    with pytest.raises(TypeError, match="must be a jfsm.Record"):
        jfsm.diagnose([record.time], believed)  # pyright: ignore[reportArgumentType]


def test_the_most_promising_laws_are_fitted_and_whatever_no_missing_force_tells_of():
    known, start = jfsm.causes(), jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    laws = [Candidate((Effect(known["coulomb"], (0, j)),), (start,), 0.01 * j) for j in range(12)]
    nowhere = Candidate((Effect(known["jenkins"], (0, 1)),), (), 0.0)
    places = {"force_gain": ("force", 1), "preload": (0, 1)}
    untold = [Candidate((Effect(known[name], at),), (start,)) for name, at in places.items()]
    followed, left_out = promising([*laws, nowhere, *untold])
    assert followed == [*laws[4:], *untold]
    assert left_out == [*laws[:4], nowhere]


def test_laws_that_explain_hardly_less_than_the_one_that_was_found_are_fitted_too():
    known, start = jfsm.causes(), jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    laws = [Candidate((Effect(known["coulomb"], (0, j)),), (start,), 0.01 * j) for j in range(12)]
    nowhere = Candidate((Effect(known["jenkins"], (0, 1)),), (), 0.1)
    assert as_promising(laws[11].effects, laws, [*laws[:11], nowhere]) == laws[9:11]
    assert as_promising((Effect(known["force_gain"], ("force", 1)),), laws, laws) == []


def test_a_buckled_spring_that_leaves_one_well_is_another_law():
    law = jfsm.causes()["double_well"].effect
    assert "one well" in law(8.0, 1.0, at=(0, 1)).otherwise(9.0)
    assert law(10.0, 1.0, at=(0, 1)).otherwise(9.0) == ""


def test_a_loop_without_width_is_no_memory():
    law = jfsm.causes()["bouc_wen"].effect
    assert "width" in law(9.0, 0.01, -2.0, 2.0, at=(0, 1)).otherwise(9.0)
    assert law(9.0, 0.1, -2.0, 2.0, at=(0, 1)).otherwise(9.0) == ""


def test_where_no_law_fits_those_are_fitted_too_that_explain_less_of_the_missing_force(monkeypatch, believed):
    def last(tried):
        left_out = [c for c in tried if c.effects[0].cause.id == "cubic_hardening"]
        return [c for c in tried if c not in left_out], left_out

    monkeypatch.setattr("jfsm.diagnosis.search.rounds.promising", last)
    causes = ("cubic_hardening", "quadratic_damping", "coulomb")
    d = jfsm.diagnose(made(duffing), believed, causes=causes, max_causes=1, key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["cubic_hardening"]


def test_friction_that_is_smaller_at_rest_does_not_fall_with_speed():
    law = jfsm.causes()["stribeck"].effect
    assert "does not fall" in law(3.0, 2.7, 0.1, at=(0, 1)).otherwise(9.0)
    assert law(3.0, 3.1, 0.1, at=(0, 1)).otherwise(9.0) == ""


@pytest.mark.parametrize("cause", ["stribeck", "lugre"])
def test_friction_that_is_gone_at_speed_is_another_law(cause):
    numbers = {p.name: 1.0 for p in jfsm.causes()[cause].effect.parameters}
    for share, gone in ((0.1, True), (0.4, False)):
        law = jfsm.causes()[cause].term(at=(0, 1), **(numbers | {"F": share}))
        assert ("all but gone" in law.otherwise(9.0)) == gone


def test_what_is_written_says_in_which_format(hidden_cubic):
    assert hidden_cubic.data["format"] == FORMAT

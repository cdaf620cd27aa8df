"""What a record shows beside the model as given, before anything is fitted."""

import json
from functools import cache

import jax
import numpy as np
import pytest
from scipy.signal import butter, lsim, sosfilt

import jfsm
from jfsm.diagnosis import Evidence, judge
from jfsm.diagnosis.look.looked import looked_at
from tests.blind import draw, draw_chain
from tests.blind.chain import Chain
from tests.blind.plants import Plant

T = np.arange(3000) * 0.005
SUB = 10


def noisy(y, seed, level=0.005):
    return y + level * np.std(y) * np.random.default_rng(seed).standard_normal(y.shape)


def drive(kind="noise"):
    if kind == "sine":
        return np.sin(8.0 * T) * np.minimum(1.0, T)
    return sosfilt(butter(2, 0.1, output="sos"), np.random.default_rng(5).standard_normal(T.size))


@cache
def run(plant="one mass", law="linear", kind="noise"):
    """Displacement and acceleration (n, dof) of a chain on ground under a force on its first mass, by small steps."""
    m, c, k = (np.asarray(q, float) for q in PLANTS[plant])
    fine, law = np.interp(np.arange(T.size * SUB) / SUB, np.arange(T.size), drive(kind)), LAWS[law]
    x, v, h, rows = np.zeros(m.size), np.zeros(m.size), T[1] / SUB, []
    for i, push in enumerate(fine):
        d, w = np.diff(x, prepend=0.0), np.diff(v, prepend=0.0)
        links = k * d + c * w + np.r_[law(d[:1], w[:1]), np.zeros(m.size - 1)]
        net = -links + np.r_[links[1:], 0.0]
        net[0] += push
        a = net / m
        if i % SUB == 0:
            rows.append((x.copy(), a.copy()))
        v = v + a * h
        x = x + v * h
    return np.array([x for x, _ in rows]), np.array([a for _, a in rows])


ONE = ([1.0], [1.0], [100.0])
TWO = ([1.0, 0.8], [0.8, 0.6], [150.0, 100.0])
PLANTS = {"one mass": ONE, "two masses": TWO}
LAWS = {
    "linear": lambda d, v: 0.0 * d,
    "friction": lambda d, v: 0.15 * np.tanh(v / 1e-3),
    "hardening": lambda d, v: 4e5 * d**3,
}


def model_of(m, c, k, stiffer=1.0) -> jfsm.Structure:
    return jfsm.Structure.chain(mass=m, stiffness=[stiffer * q for q in k], damping=c)


def measured(plant="one mass", law="linear", scale=1.0, force=1.0, on="displacement", kind="noise") -> jfsm.Record:
    g, (x, a) = drive(kind), run(plant, law, kind)
    return jfsm.Record(T, force={1: force * noisy(g, 1)}, **{on: noisy(scale * {"displacement": x}.get(on, a), 2)})


def said(record: jfsm.Record, model: jfsm.Structure) -> dict[str, str]:
    return {check.name: check.says for check in looked_at([record], model).checks if not check.passed}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("scale", "force", "words"), [(1000.0, 1.0, "about 1000: mm"), (1.0, 1e-3, "kN for N")])
def test_a_motion_a_thousand_times_too_large_stops_with_the_likely_unit(law, plant, scale, force, words):
    model = model_of(*PLANTS[plant], stiffer=1.15)
    assert said(measured(plant, law), model) == {}
    with pytest.raises(ValueError, match="times what the model makes of the measured drive") as error:
        looked_at([measured(plant, law, scale, force)], model)
    assert words in str(error.value) and "No unit was stated of force, displacement: N, m assumed" in str(error.value)


@pytest.mark.parametrize(
    ("scale", "on", "words"),
    [
        (180 / np.pi, "displacement", "degrees for radians"),
        (1 / 9.80665, "acceleration", "g for m/s²"),
        (9.80665, "acceleration", "g for m/s²"),
        (25.4, "displacement", "inches for mm"),
        (1e6, "displacement", "µm for m"),
    ],
)
def test_a_size_that_is_off_by_a_factor_between_units_stops_where_the_shape_is_the_models(scale, on, words):
    with pytest.raises(ValueError, match=words):
        looked_at([measured(scale=scale, on=on)], model_of(*ONE))


def test_a_unit_that_was_stated_is_not_said_to_be_assumed():
    g, (x, _) = drive(), run()
    record = jfsm.Record(T, force=noisy(g, 1), displacement=noisy(1e6 * x, 2), units={"displacement": "mm"})
    with pytest.raises(ValueError, match="No unit was stated of force: N assumed"):
        looked_at([record], model_of(*ONE))


@pytest.mark.parametrize("stiffer", [0.03, 0.3, 0.8, 1.3, 3.0, 30.0])
@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("kind", ["noise", "sine"])
def test_a_model_that_is_wrong_is_no_wrong_unit_and_no_wrong_sign(stiffer, plant, kind):
    assert said(measured(plant, kind=kind), model_of(*PLANTS[plant], stiffer=stiffer)) == {}


@pytest.mark.parametrize("scale", [0.05, 0.5, 2.0, 7.0, 15.0])
def test_a_size_that_is_no_factor_between_units_is_left_to_the_fit(scale):
    assert said(measured(scale=scale), model_of(*ONE)) == {}


def test_two_channels_in_each_others_place_stop():
    g, (x, _) = drive(), run("two masses")
    swapped = jfsm.Record(T, force={1: noisy(g, 1)}, displacement=noisy(x[:, ::-1], 2))
    with pytest.raises(ValueError, match="displacement 1 and displacement 2 leave .* the two channels are swapped"):
        looked_at([swapped], model_of(*TWO))


@pytest.mark.parametrize(("law", "kind"), [*((law, "noise") for law in LAWS), ("linear", "sine")])
def test_a_force_of_the_wrong_sign_is_turned(law, kind):
    record = measured("two masses", law, kind=kind)
    assert looked_at([record], model_of(*TWO)).inverted == ()
    found = looked_at([record.turned(("force", 1))], model_of(*TWO))
    assert found.inverted == (("force", 1),)
    np.testing.assert_allclose(found.records[0].channels["force", 1], record.channels["force", 1])


@pytest.mark.parametrize("times", [0.2, 5.0, 1000.0])
def test_of_an_imposed_motion_a_force_a_thousand_times_too_large_stops(times):
    x = 0.01 * (np.sin(7.0 * T) + 0.5 * np.sin(16.0 * T))
    force = times * (3000.0 * x + 80.0 * np.gradient(x, T))
    record = jfsm.Record(T, force=noisy(force, 1), displacement=noisy(x, 2, 1e-3), drive="motion")
    parts = [jfsm.LinearStiffness(3100.0, at=(0, 1)), jfsm.LinearDamping(75.0, at=(0, 1))]
    model = jfsm.Structure(mass=[0.0], terms=parts)
    if times < 1000.0:
        assert said(record, model) == {}
        return
    with pytest.raises(ValueError, match="force 1 is 9.* times what the model needs along the measured motion"):
        looked_at([record], model)


def test_a_displacement_of_the_wrong_sign_stops_and_says_what_to_turn():
    x, a = run()
    record = jfsm.Record(T, force=noisy(drive(), 1), displacement=-noisy(x, 2), acceleration=noisy(a, 3))
    with pytest.raises(ValueError, match=r"record\.turned\(\('displacement', 1\)\)"):
        looked_at([record], model_of(*ONE))


def believed(model: Plant | Chain) -> jfsm.Structure:
    if isinstance(model, Plant):
        return jfsm.Structure.sdof(mass=model.mass, stiffness=model.stiffness, damping=model.damping)
    springs = [jfsm.LinearStiffness(k, at=at) for at, k in model.stiffness.items()]
    dashpots = [jfsm.LinearDamping(c, at=at) for at, c in model.damping.items()]
    return jfsm.Structure(mass=list(model.mass), terms=[*springs, *dashpots])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("drawn", [draw, draw_chain])
def test_of_records_whose_sensors_are_right_nothing_is_said(seed, drawn):
    challenge = drawn(700 + seed)
    record = jfsm.Record(challenge.time, **challenge.channels, units=challenge.units, at_rest=challenge.at_rest)
    assert set(said(record, believed(challenge.model))) <= {"moves_throughout"}


def crank(sign=1.0, torn=False) -> jfsm.Record:
    """A spring and a dashpot on a crank; a force that may count the other way, and a sample that a recorder marked."""
    x = 0.02 * np.sin(9.0 * T[:900] + 0.1 * np.sin(9.0 * T[:900]))
    force = sign * (700.0 * x + 90.0 * np.gradient(x, T[1])) + 5.0
    force = force + 0.02 * np.random.default_rng(1).standard_normal(900)
    if torn:
        force[333] = -9999.0
    return jfsm.Record(T[:900], force=force, displacement=noisy(x, 2, 1e-4), drive="motion")


def test_a_diagnosis_names_the_wrong_sign_and_goes_on_with_the_right_one(tmp_path):
    parts = [jfsm.LinearStiffness(1000.0, at=(0, 1)), jfsm.LinearDamping(120.0, at=(0, 1))]
    model = jfsm.Structure(mass=[0.0], terms=parts)
    key = jax.random.key(0)
    record = crank(-1.0, torn=True)
    d = jfsm.diagnose(record, model, causes=["cubic_hardening"], max_causes=1, key=key, since=0.1)
    assert d.verdict == "cause" and d.decision.verdict == "cause"
    assert (d.findings[0].cause, d.findings[0].at, d.findings[0].family) == ("force_gain", ("force", 1), "sensor")
    assert d.findings[0].parameters["eps"].value == -2.0
    assert "channel has the wrong sign (force 1: mean power -" in d.sentence and "values are off" in d.sentence
    assert d.refitted["stiffness@0-1.k"].value == pytest.approx(700.0, rel=0.02)
    assert d.refitted["damping@0-1.c"].value == pytest.approx(90.0, rel=0.02)
    assert any("1 sample is torn" in note and "-9999 N" in note for note in d.notes)
    failed = {row.name for row in d.decision.checks if row.stage == "sensors" and not row.passed}
    assert failed == {"takes_energy", "no_torn_samples"}
    assert judge(Evidence.of_plain(json.loads(json.dumps(d.data["evidence"])))) == d.decision
    readings = jfsm.simulate(d.extended, record).readings(record)["force", 1]
    left = (readings - np.asarray(record.force)[:, 0])[np.arange(900) != 333]
    assert np.std(left) < 0.1  # the extended model shows what the sensor did, sign and all
    assert "takes_energy" in str(d.why())
    page = tmp_path / "page.html"
    d.report(page)
    assert "a passive part takes energy" in page.read_text()


def test_a_diagnosis_refuses_a_dead_channel_by_name():
    record = jfsm.Record(T, force=drive(), displacement=np.full(T.size, 1e-3))
    with pytest.raises(ValueError, match=r"displacement 1 is constant \(0.001 m\): nothing was measured there"):
        jfsm.diagnose(record, model_of(*ONE))


@pytest.mark.parametrize(
    ("rate", "upto", "factor", "words"), [(500.0, 20.0, 1 / 9.80665, "g for m/s²"), (50.0, 7.5, 180 / np.pi, "degrees")]
)
def test_a_factor_is_told_by_few_periods_whose_lines_lie_close_to_the_mode(rate, upto, factor, words):
    rng, t = np.random.default_rng(18), np.arange(2000) / rate
    force = 20.0 * np.asarray(sosfilt(butter(4, upto, fs=rate, output="sos"), rng.standard_normal(t.size)))
    k = 900.0 if rate > 100 else 250.0
    system = [[0.0, 1.0], [-k, -1.0]], [[0.0], [1.0]], [[1.0, 0.0], [-k, -1.0]], [[0.0], [1.0]]
    y = np.asarray(lsim(system, force, t)[1])
    shown = {"acceleration": factor * y[:, 1]} if factor < 1 else {"displacement": factor * y[:, 0]}
    record = jfsm.Record(t, force=force, **{kind: noisy(each, 3) for kind, each in shown.items()})
    with pytest.raises(ValueError, match=words):
        looked_at([record], jfsm.Structure.sdof(mass=1.0, stiffness=k, damping=1.0))

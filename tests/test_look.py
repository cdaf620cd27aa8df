"""What a record shows before anything is fitted, without a model."""

import re

import numpy as np
import pytest
from scipy.signal import butter, lsim, sosfilt

from jfsm.records import Record, look, mended, span_of_motion

T = np.arange(2000) * 0.005
RNG = np.random.default_rng(7)
WAVE = np.sin(6.0 * T) + 0.4 * np.sin(17.0 * T)


def noisy(y, level=1e-3):
    return y + level * np.std(y) * np.random.default_rng(1).standard_normal(y.size)


def failed(record: Record) -> dict[str, str]:
    return {check.name: check.says for check in look(record).failed}


@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration", "force"])
@pytest.mark.parametrize("code", [1e30, -9999.0, 9.96921e36, 3.4028235e38])
def test_a_sample_that_a_recorder_marked_is_left_out_and_named(kind: str, code: float):
    y = noisy(WAVE)
    y[[700, 1200]] = code
    record = Record(T, **{kind: y})
    sound = mended(record)
    assert np.flatnonzero(sound.lost[kind, 1]).tolist() == [700, 1200]
    assert np.max(np.abs(sound.channels[kind, 1])) < 2.0
    assert f"{kind} 1: 2 samples are torn" in sound.notes[-1] and "t = 3.5, 6 s" in sound.notes[-1]
    assert mended(sound) is sound
    assert "2 samples are torn" in failed(record)["no_torn_samples"]
    assert any("2 samples are torn" in finding.message.lower() for finding in record.inspect().findings)


def blow(width: int) -> np.ndarray:
    y = 1e-3 * RNG.standard_normal(T.size)
    y[700 : 700 + width] += 1000.0 * np.hanning(width + 2)[1:-1]
    return y


@pytest.mark.parametrize(
    "channels",
    [
        {"force": blow(1)},
        {"force": blow(8)},
        {"acceleration": noisy(WAVE) + 40.0 * (np.arange(2000) == 900)},
        {"displacement": noisy(WAVE) + 9.0 * (np.arange(2000) == 900)},
        {"force": np.where(T > 3.0, 100.0, 0.0)},
    ],
)
def test_a_blow_a_shock_a_step_and_a_mere_spike_are_no_marks(channels):
    assert not mended(Record(T, **channels)).lost


def test_a_stretch_in_which_a_sensor_hung_is_left_out_also_where_the_record_is_cut():
    y = noisy(WAVE)
    y[1000:1030] = y[1000]
    y[1900:] = y[1900]
    sound = mended(Record(T, force=noisy(WAVE), displacement=y))
    lost = np.flatnonzero(sound.lost["displacement", 1])
    assert lost.tolist() == [*range(1001, 1030), *range(1901, 2000)]
    assert np.flatnonzero(sound[1010:1500].lost["displacement", 1]).tolist() == list(range(20))
    assert not sound[1200:1500].lost
    assert "the sensor hung" in failed(Record(T, displacement=y))["no_hung_samples"]


def test_of_a_channel_that_is_constant_its_name_and_value_are_said():
    says = failed(Record(T, force=noisy(WAVE), displacement=np.full(T.size, 1e-3)))["channel_moves"]
    assert says.startswith("displacement 1 is constant (0.001 m): nothing was measured there")


def decay(until: float, creep: float) -> np.ndarray:
    """Friction stops a swing at an instant; then the sensor creeps."""
    shrinking = np.maximum(1.0 - T / until, 0.0) * np.cos(30.0 * T)
    return shrinking + creep * T / T[-1] + 1e-4 * RNG.standard_normal(T.size)


@pytest.mark.parametrize(("pushed", "dead"), [(9.0, {"channel_moves", "drive_measured"}), (0.0, set())])
def test_a_constant_force_is_dead_where_the_motion_goes_on_and_a_load_where_it_decays(pushed: float, dead: set[str]):
    push = pushed * (np.sin(15.0 * T) + np.sin(20.0 * T))
    system = ([[0.0, 1.0], [-300.0, -1.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    x = lsim(system, push, T, [0.0 if pushed else 0.1, 0.0])[1]
    assert set(failed(Record(T, force=np.full(T.size, 0.3), displacement=noisy(x)))) == dead


@pytest.mark.parametrize("creep", [0.0, 0.004, -0.01])
def test_a_structure_that_came_to_rest_is_known_to_though_its_sensor_creeps(creep: float):
    record = Record(T, displacement=decay(3.0, creep))
    assert span_of_motion(record).end == pytest.approx(3.0 / 0.005, abs=2000 / 50)
    assert re.match(r"at rest from t = (3|2\.[89]|3\.[12])\d* s on, left out", failed(record)["moves_throughout"])


def test_what_was_held_before_its_release_is_left_out():
    x = np.where(T < 2.5, 1.0, np.exp(-0.3 * (T - 2.5)) * np.cos(12.0 * (T - 2.5))) + 1e-3 * RNG.standard_normal(T.size)
    span = span_of_motion(Record(T, displacement=x))
    assert span.begin == pytest.approx(500, abs=12) and span.end == T.size


def test_a_driven_structure_rests_only_while_nothing_pushes_it():
    pushed = np.where(T < 4.0, noisy(WAVE), 0.0) + 1e-3 * RNG.standard_normal(T.size)
    moved = np.where(T < 4.0, 1.0, np.exp(-2.0 * (T - 4.0))) * np.sin(9.0 * T) + 1e-3 * RNG.standard_normal(T.size)
    assert span_of_motion(Record(T, force=pushed, displacement=moved)).end == pytest.approx(1500, abs=120)
    held = pushed + np.where(T < 4.0, 0.0, 0.8)  # a load that stays: where it holds the structure tells the stiffness
    assert span_of_motion(Record(T, force=held, displacement=moved)) == (0, T.size)
    assert span_of_motion(Record(T, force=noisy(WAVE), displacement=moved)) == (0, T.size)


def imposed(law, x=0.02 * WAVE, rate=200.0) -> Record:
    v = np.gradient(x, 1 / rate)
    return Record(T, force=noisy(law(x, v), 0.01), displacement=noisy(x), drive="motion")


LAWS = {
    "dashpot": lambda x, v: 1150 * v,
    "spring and dashpot": lambda x, v: 900 * x + 1150 * v,
    "little loss": lambda x, v: 5000 * x + 2 * v,
    "friction": lambda x, v: 300 * np.tanh(v / 0.01),
    "cubic spring and friction": lambda x, v: 3e6 * x**3 + 40 * np.sign(v),
    "mass": lambda x, v: 40 * np.gradient(v, 0.005) + 50 * v,
}


@pytest.mark.parametrize("law", LAWS)
def test_a_part_that_gives_energy_has_a_force_of_the_wrong_sign(law: str):
    right = imposed(LAWS[law])
    wrong = right.turned(("force", 1))
    assert not look(right).inverted and "takes_energy" not in failed(right)
    found = look(wrong)
    if law in ("little loss", "mass"):  # 0.4 % of the force; what looks like a spring with the right sign
        return
    assert found.inverted == (("force", 1),)
    assert "wrong sign (force 1: mean power -" in failed(wrong)["takes_energy"]
    assert "a passive part takes energy" in failed(wrong)["takes_energy"]
    assert any("wrong sign" in finding.message for finding in wrong.inspect().findings)


def test_an_active_part_whose_spring_has_the_right_sign_is_not_accused():
    assert not look(imposed(lambda x, v: 4000 * x - 100 * v)).inverted


def driven(sign=1.0, turn=(), scale=(), kinds=("displacement", "velocity", "acceleration"), k3=0.0) -> Record:
    """A mass on a spring under band-limited noise, by explicit steps; channels turned or scaled by kind."""
    rng, sub, dt = np.random.default_rng(3), 8, 0.005
    g = sosfilt(butter(2, 0.2, output="sos"), rng.standard_normal(T.size))
    fine = np.interp(np.arange(T.size * sub) / sub, np.arange(T.size), g)
    x = v = 0.0
    rows = []
    for i, push in enumerate(fine):
        a = push - 1.0 * v - 100.0 * x - k3 * x**3
        if i % sub == 0:
            rows.append((x, v, a))
        v += a * dt / sub
        x += v * dt / sub
    motion = dict(zip(("displacement", "velocity", "acceleration"), np.array(rows).T, strict=True))
    shown = {k: noisy(motion[k] * (-1.0 if k in turn else 1.0) * dict(scale).get(k, 1.0), 0.002) for k in kinds}
    return Record(T, force=sign * noisy(g, 0.002), **shown)


@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration"])
def test_of_three_channels_the_one_of_the_wrong_sign_is_named(kind: str):
    assert look(driven()).inverted == ()
    assert look(driven(turn=(kind,))).inverted == ((kind, 1),)


@pytest.mark.parametrize(("turn", "wrong"), [(("acceleration",), "acceleration"), (("displacement",), "displacement")])
def test_of_two_channels_the_force_tells_which_has_the_wrong_sign(turn, wrong):
    record = driven(turn=turn, kinds=("displacement", "acceleration"))
    assert look(record).inverted == ((wrong, 1),)


def test_a_force_of_the_wrong_sign_moves_its_point_as_a_negative_mass_and_stiffness_would():
    assert look(driven(sign=-1.0)).inverted == (("force", 1),)
    assert "as if mass and stiffness were negative" in failed(driven(sign=-1.0))["pushes_forward"]


@pytest.mark.parametrize(
    ("kind", "factor", "words"),
    [
        ("acceleration", 1 / 9.80665, "about 0.102: g for m/s²"),
        ("displacement", 1000.0, "about 0.001: mm for m"),
        ("velocity", 180 / np.pi, "about 57.3: degrees for radians"),
    ],
)
def test_channels_of_a_point_that_are_apart_by_a_unit_are_named_with_it(kind: str, factor: float, words: str):
    assert "scales_agree" not in failed(driven())
    record = driven(scale=((kind, factor),))
    said = [check.says for check in look(record).failed if check.name == "scales_agree"]
    assert any(words in says for says in said)


@pytest.mark.parametrize("factor", [1.2, 3.0, 12.0])
def test_a_calibration_that_is_off_is_no_unit(factor: float):
    assert "scales_agree" not in failed(driven(scale=(("acceleration", factor),)))


@pytest.mark.parametrize(("rate", "outcome"), [(0.3, True), (0.0, False), (-0.1, False), (0.008, None)])
def test_a_motion_without_a_force_decays_or_something_drives_it(rate: float, outcome: bool | None):
    record = Record(T, displacement=noisy(np.exp(-rate * T) * np.sin(12.0 * T)))
    told = [check.passed for check in look(record).checks if check.name == "drive_measured"]
    assert told == ([] if outcome is None else [outcome])
    words = " ".join(finding.message for finding in record.inspect().findings)
    assert ("free decay" in words) == (outcome is True)
    assert ("A force that nobody measured drives it" in words) == (outcome is False)


def test_every_look_of_an_inspection_has_its_number_and_its_limit():
    inspection = driven().inspect()
    assert {"channel_moves", "no_torn_samples", "pushes_forward"} <= {check.name for check in inspection.checks}
    assert all(check.passed and np.isfinite(check.measured) for check in inspection.checks)
    assert inspection.to_dict()["checks"][0]["says"]


def test_parts_of_a_record_are_named_by_their_instants():
    record = Record(T, displacement=noisy(WAVE))
    part = record.between(2.0, 4.0)
    assert (part.time[0], part.time[-1]) == (2.0, 4.0)
    assert record.between() is record
    with pytest.raises(ValueError, match="must keep at least 2 samples of a record from 0 to 9.995 s"):
        record.between(20.0)


def test_the_sign_of_a_channel_is_turned_with_a_note():
    record = Record(T, displacement=noisy(WAVE))
    turned = record.turned(("displacement", 1))
    assert turned.displacement is not None and record.displacement is not None
    np.testing.assert_array_equal(turned.displacement, -record.displacement)
    assert turned.notes == ("The sign of displacement 1 was turned.",)
    with pytest.raises(ValueError, match="the record has \\('displacement', 1\\)"):
        record.turned(("force", 1))

"""Lists of channels after the SDyPy enhancement proposal 5, in and out."""

import numpy as np
import pytest

from jfsm.records import Record

T = np.arange(100) * 0.02
U = np.cos(3.0 * T)
Y = np.sin(3.0 * T)


def _channel(name, data, **others):
    return {"name": name, "data": data, "unit_str": "", "fs": 50, **others}


def test_channels_are_chosen_by_name_and_brought_to_coherent_units():
    begun = "2023-06-29T15:00:00+00:00"
    channels = [
        _channel("F1", U, unit_str="kN", start_timestamp=begun),
        _channel("A1", 100 * Y, unit_str="mV", start_timestamp=begun),
        _channel("temperature", U, unit_str="K"),
    ]
    sensitivity = {"A1": "100 mV/g"}
    record = Record.from_sep005(channels, force="F1", acceleration={2: "A1"}, sensitivity=sensitivity, at_rest=True)
    np.testing.assert_allclose(record.time, T, atol=1e-14)
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * U, rtol=1e-14)
    np.testing.assert_allclose(record.channels["acceleration", 2], 9.80665 * Y, rtol=1e-14)
    assert (record.at_rest, record.notes) == (
        True,
        ("The clock reads zero at 2023-06-29 15:00:00.000000000.",),
    )


def test_without_names_the_quantity_says_what_a_channel_is():
    channels = [_channel(name, U, quantity=name[0]) for name in ("acc tip", "acc root", "force", "strain")]
    record = Record.from_sep005([{**channel, "name": channel["name"].upper()} for channel in channels])
    assert list(record.channels) == [("force", 1), ("acceleration", 1), ("acceleration", 2)]


def test_a_single_channel_may_come_without_a_list():
    record = Record.from_sep005({"name": "d", "data": Y, "unit_str": None, "time": T**1.1}, displacement="d")
    np.testing.assert_array_equal(record.time, T**1.1)


@pytest.mark.parametrize("time", [T, T + 3.0, T**1.1])
def test_channels_given_out_are_taken_back(time):
    record = Record(time, {3: U}, np.stack([Y, U], 1), base_acceleration=U, units={"displacement": "mm"})
    channels = record.to_sep005()
    assert [channel["name"] for channel in channels] == [
        "force_3",
        "displacement_1",
        "displacement_2",
        "base_acceleration",
    ]
    assert [channel["quantity"] for channel in channels] == ["f", "d", "d", "a"]
    assert [channel["unit_str"] for channel in channels] == ["N", "m", "m", "m/s²"]
    again = Record.from_sep005(channels)
    np.testing.assert_allclose(again.time, time, rtol=1e-13)
    assert dict(again.units) == dict(record.units)
    for key, samples in record.channels.items():
        np.testing.assert_array_equal(again.channels[key], samples)
    np.testing.assert_array_equal(again.base_acceleration, U)


def test_a_rate_stands_for_a_uniform_clock_and_instants_for_any_other():
    keys = [{"fs", "time"} & set(Record(time, U).to_sep005()[0]) for time in (T, T + 3.0, T**1.1)]
    assert keys == [{"fs"}, {"fs", "time"}, {"time"}]
    assert Record(T, U).to_sep005()[0]["fs"] == pytest.approx(50.0)


def test_channels_given_out_pass_the_validator_of_the_proposal():
    validator = pytest.importorskip("sdypy_sep005.sep005")
    for time in (T, T + 3.0, T**1.1):
        validator.assert_sep005(Record(time, U, Y).to_sep005())


@pytest.mark.parametrize(
    ("channels", "error", "message"),
    [
        ([U], TypeError, "`channels` must hold dictionaries; number 0 is ndarray"),
        ([{"name": "u", "data": U}], ValueError, r"number 0 \('u'\) lacks unit_str, time or fs\. Add it"),
        ([_channel("u", U), _channel("u", Y)], ValueError, r"must have names of their own; \['u'\] occur"),
        ([_channel("u", U), _channel("y", Y, fs=25)], ValueError, "must have channels of one clock .*'y' has 100"),
        ([_channel("u", U), _channel("z", Y)], ValueError, "`displacement` must name a channel of `channels`, .* 'y'"),
    ],
)  # fmt: skip
def test_channels_that_make_no_record_are_refused(channels, error, message):
    with pytest.raises(error, match=message):
        Record.from_sep005(channels, force="u", displacement="y")


def test_channels_that_began_apart_are_not_put_side_by_side():
    early = _channel("F1", U, start_timestamp="2023-06-29T15:00:00+00:00")
    late = _channel("A1", Y, start_timestamp="2023-06-29T17:00:03.5+02:00")
    with pytest.raises(ValueError, match=r"from 0 to 1\.98 s, 'A1' has 100 samples from 3\.5 to 5\.48 s.*3\.5 s apart"):
        Record.from_sep005([early, late], force="F1", acceleration="A1")
    record = Record.from_sep005([early, late], acceleration="A1")
    assert record.time[0] == 3.5 and record.begins == np.datetime64("2023-06-29T15:00:00")

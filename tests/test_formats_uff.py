"""Universal files, written here by pyuff and read by the library, and the other way round."""

import numpy as np
import pytest
import pyuff

from jfsm.records import Record, align, read

N = 100
T = 0.5 + np.arange(N) * 0.02
U = np.cos(3.0 * T)
Y = np.sin(3.0 * T)

FORCE, ACCELERATION, DISPLACEMENT = 13, 12, 8


def _function(data, node=1, direction=3, kind=0, unit="NONE", **others):
    return {
        "type": 58,
        "binary": 0,
        "func_type": 1,
        "rsp_node": node,
        "rsp_dir": direction,
        "ref_node": 0,
        "ref_dir": 0,
        "data": np.array(data),
        "x": T,
        "abscissa_spacing": 1,
        "abscissa_inc": 0.02,
        "abscissa_spec_data_type": 17,
        "ordinate_spec_data_type": kind,
        "ordinate_axis_units_lab": unit,
        "orddenom_spec_data_type": 0,
        **others,
    }


HEADER = {"type": 151, "model_name": "beam", "description": "NONE", "db_app": "Lab", "program": "Lab"}


def _system(length, force):
    factors = {"length": length, "force": force, "temp": 1.0, "temp_offset": 0.0}
    return {"type": 164, "units_code": 9, "units_description": "own", "temp_mode": 1, **factors}


def _save(path, *sets):
    file = pyuff.UFF(str(path))
    file.write_sets([dict(HEADER)], "overwrite")  # the first must not be binary: pyuff would write over its header
    file.write_sets(list(sets), "add")
    return path


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves binary files open
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_time_responses_are_named_by_node_and_direction(tmp_path, binary, spacing):
    form = {"binary": binary, "abscissa_spacing": spacing}
    path = _save(
        tmp_path / "a.uff",
        _function(U, node=1, kind=FORCE, unit="kN", **form),
        _function(Y, node=1, kind=ACCELERATION, unit="g", **form),
        _function(Y**2, node=12, direction=-1, kind=ACCELERATION, unit="g", **form),
    )
    record = read(path, force="1:+Z", acceleration={1: "1:+Z", 2: "12:-X", 4: "12:+X"})
    near = 1e-14 if binary else 1e-5  # the ASCII form has six digits of an abscissa
    np.testing.assert_allclose(record.time, T, rtol=near)
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * U, rtol=near)
    np.testing.assert_allclose(record.channels["acceleration", 1], 9.80665 * Y, rtol=near)
    np.testing.assert_allclose(record.channels["acceleration", 2], 9.80665 * Y**2, rtol=near)
    np.testing.assert_array_equal(record.channels["acceleration", 4], -record.channels["acceleration", 2])
    assert record.notes == ("The file calls itself 'beam', 'Lab'.",)


def test_without_names_what_is_measured_goes_by_the_file_and_dofs_by_node(tmp_path):
    path = _save(
        tmp_path / "a.unv",
        _function(Y**2, node=7, direction=-3, kind=ACCELERATION),
        _function(Y, node=2, kind=ACCELERATION),
        _function(U, node=7, kind=FORCE),
        _function(U, node=9, func_type=4, abscissa_spec_data_type=18),  # a frequency response is no channel
    )
    record = read(path)
    assert list(record.channels) == [("force", 2), ("acceleration", 1), ("acceleration", 2)]
    np.testing.assert_allclose(record.channels["acceleration", 2], -(Y**2), atol=1e-11)
    assert record.notes[-1] == "Degrees of freedom by node and direction: 1 is 2:+Z, 2 is 7:+Z."


def test_two_channels_of_one_kind_at_one_place_must_be_told_apart(tmp_path):
    path = _save(tmp_path / "a.uff", *(_function(data, kind=ACCELERATION) for data in (U, Y)))
    with pytest.raises(
        ValueError, match=r"told which channel is what.*'1:\+Z acceleration', '1:\+Z acceleration \(2\)'"
    ):
        read(path)
    np.testing.assert_allclose(read(path, acceleration="1:+Z").channels["acceleration", 1], U, atol=1e-11)
    twin = read(path, acceleration="1:+Z acceleration (2)")
    np.testing.assert_allclose(twin.channels["acceleration", 1], Y, atol=1e-11)


def test_a_channel_without_a_node_has_the_name_of_its_description(tmp_path):
    path = _save(tmp_path / "a.uff", _function(U, node=0, direction=0, id1="Load cell"), _function(Y, 3, 0))
    record = read(path, force="Load cell", displacement="3")
    np.testing.assert_allclose(record.channels["force", 1], U, atol=1e-11)


def test_without_labels_units_are_those_of_the_system_that_the_file_states(tmp_path):
    functions = (
        _function(U, 1, 3, FORCE),
        _function(Y, 2, 3, DISPLACEMENT),
        _function(Y, 3, 3, DISPLACEMENT, unit="mm"),
        _function(U, 4, 6, FORCE),
    )
    path = _save(tmp_path / "a.uff", _system(1.0 / 0.0254, 1.0 / 4.4482216152605), *functions)
    record = read(path, force="1:+Z", displacement="2:+Z")
    np.testing.assert_allclose(record.channels["force", 1], 4.4482216152605 * U, atol=1e-10)
    np.testing.assert_allclose(record.channels["displacement", 1], 0.0254 * Y, atol=1e-10)
    labelled = read(path, displacement="3:+Z")  # a label is about this channel, and comes first
    np.testing.assert_allclose(labelled.channels["displacement", 1], 1e-3 * Y, atol=1e-10)
    moment = read(path, force="4:+RZ")
    np.testing.assert_allclose(moment.channels["force", 1], 4.4482216152605 * 0.0254 * U, atol=1e-10)
    assert moment.units["force"] == "N m"


def test_an_abscissa_in_milliseconds_is_brought_to_seconds(tmp_path):
    path = _save(tmp_path / "a.uff", _function(U, x=1e3 * T, abscissa_axis_units_lab="ms"))
    np.testing.assert_allclose(read(path, force="1:+Z").time, T, rtol=1e-5)


def test_channels_of_different_clocks_are_refused_by_name(tmp_path):
    slow = {"x": np.array([0.5, 0.54]), "data": U[:50]}
    path = _save(tmp_path / "a.uff", _function(Y, 1), _function(Y, 2), _function(U, 3) | slow)
    message = (
        r"a\.uff must have channels of one clock .*'3:\+Z' has 50 samples from 0.5 to 2.46 s, '1:\+Z' has 100 .*2.48 s"
    )
    with pytest.raises(ValueError, match=message + r".*bring these to one clock by jfsm\.align\(records\)"):
        read(path, displacement=["1:+Z", "2:+Z"], force="3:+Z")
    fast, slow = read(path, displacement=["1:+Z", "2:+Z"]), read(path, force="3:+Z")
    assert (len(fast), len(slow)) == (100, 50)
    together = align([fast, slow])
    assert (together.sample_rate, together.time[0]) == (pytest.approx(fast.sample_rate), 0.5)
    np.testing.assert_allclose(together.channels["force", 1][::2], U[:50][: len(together.time[::2])], atol=1e-3)


def test_a_file_without_time_responses_says_what_it_holds(tmp_path):
    spectrum = _function(U, func_type=4, abscissa_spec_data_type=18)
    with pytest.raises(
        ValueError, match=r"a\.uff must hold time responses .*datasets \[58, 151\], with functions of type \[4\]"
    ):
        read(_save(tmp_path / "a.uff", spectrum), force="1:+Z")
    with pytest.raises(ValueError, match=r"it holds datasets \[151, 164\]\. Export"):
        read(_save(tmp_path / "b.uff", _system(1.0, 1.0)), force="1:+Z")


def test_a_dataset_that_holds_less_than_it_announces_is_refused(tmp_path):
    path = _save(tmp_path / "a.uff", _function(U))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-3] + lines[-1:]))
    with pytest.raises(
        ValueError, match=r"a\.uff must hold the 100 samples that its dataset number 2 announces; it holds 92"
    ):
        read(path, force="1:+Z")


def test_a_header_that_makes_no_sense_is_refused(tmp_path):
    path = _save(tmp_path / "a.uff", _function(U))
    path.write_bytes(path.read_bytes().replace(b"         4       100", b"      four       100"))
    with pytest.raises(ValueError, match=r"a\.uff must be a universal file; its dataset number 2 cannot be read"):
        read(path, force="1:+Z")


@pytest.mark.parametrize("uneven", [False, True])
def test_a_written_record_is_a_universal_file_to_others(tmp_path, uneven):
    time = T**1.3 if uneven else T
    record = Record(time, force={3: U}, acceleration={1: Y}, units={"acceleration": "g"}, name="run 7")
    record.write(tmp_path / "a.uff")
    file = pyuff.UFF(str(tmp_path / "a.uff"))
    title, system, clock, force, acceleration, _ = file.read_sets()
    assert (title["model_name"], title["program"]) == ("run 7", "jfsm")
    assert (system["units_code"], system["length"], system["force"]) == (1, 1.0, 1.0)
    np.testing.assert_array_equal(clock["data"], time)
    assert (force["rsp_node"], force["ordinate_spec_data_type"], force["ordinate_axis_units_lab"]) == (3, FORCE, "N")
    assert (acceleration["rsp_node"], acceleration["ordinate_axis_units_lab"]) == (1, "m/s^2")
    np.testing.assert_array_equal(force["data"], U)
    np.testing.assert_allclose(force["x"], time, rtol=1e-5)
    assert force["n_bytes"] == 8 * N * (2 if uneven else 1)

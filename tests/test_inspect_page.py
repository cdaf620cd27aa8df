"""The page of an inspection shows what there is to see of a record, and nothing else."""

import json
import re
from typing import Any

import numpy as np
import pytest
from test_reporting import Page

from jfsm.records import Record
from jfsm.reporting import inspection_pictures, inspection_text, render_inspection
from jfsm.reporting._inspection_tables import consistency_table, inspected_channels_table, periods_table
from jfsm.reporting._motion_pictures import planes_of

DT, LENGTH, COUNT = 0.002, 1000, 4
T = DT * np.arange(LENGTH * COUNT)
LINES = np.array([line for line in range(1, 100, 2) if line % 10 != 7])
OMEGA = 2 * np.pi * LINES / (LENGTH * DT)
TURNING = np.exp(1j * (np.outer(T, OMEGA) + 2.0 * LINES**2))
RECEPTANCE = 1.0 / (70.0**2 - OMEGA**2 + 5j * OMEGA)


def channels(seed: int = 0) -> dict[str, Any]:
    """Steady motion of an oscillator under an odd multisine, with noise."""
    rng = np.random.default_rng(seed)
    lines = {"force": np.ones(OMEGA.size)}
    lines |= {
        kind: (1j * OMEGA) ** order * RECEPTANCE
        for order, kind in enumerate(("displacement", "velocity", "acceleration"))
    }
    clean = {kind: np.real(TURNING @ line) for kind, line in lines.items()}
    return {kind: y + 0.002 * y.std() * rng.standard_normal(y.size) for kind, y in clean.items()}


def faulty() -> dict[str, Any]:
    """The same with spikes in the displacement, a velocity of wrong gain, and a clipped acceleration."""
    found = channels()
    found["displacement"][[1500, 2500]] += 5.0 * found["displacement"].std()
    found["velocity"] *= 1.05
    found["acceleration"] = np.clip(found["acceleration"], *(np.array([-2.0, 2.0]) * found["acceleration"].std()))
    return found


def shown(record: Record) -> dict[str, Any]:
    """What the page is made of."""
    inspection = record.inspect()
    curves = {"time": inspection.time, "channels": {trace.channel: vars(trace) for trace in inspection.traces}}
    return {**inspection.to_dict(), "curves": curves}


def drawn(record: Record) -> dict[str, str]:
    """Pictures by name, in words."""
    return {picture.name: picture.alt for picture in inspection_pictures(shown(record))}


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Page:
    path = tmp_path_factory.mktemp("page") / "run.html"
    Record(T, **faulty(), name="run 7 <b>").inspect().report(path)
    assert [file.name for file in path.parent.iterdir()] == ["run.html"]
    return Page(path.read_text(encoding="utf-8"))


def test_the_page_stands_alone(page):
    assert all(reference.startswith("#") for reference in page.references)
    assert "script" not in page.tags and "link" not in page.tags and "b" in page.tags
    assert len(page.ids) == len(set(page.ids))
    assert "run 7 <b>" in page.text


def test_the_page_says_first_where_the_warnings_are_and_what_the_record_is(page):
    first_screen = page.text[: page.text.index("What was found")].replace("\N{NO-BREAK SPACE}", " ")
    for words in ("3 warnings", "Warnings on displacement 1, velocity 1 and acceleration 1", "4000 samples · 7.998 s"):
        assert words in first_screen
    for question in ("Driven by", "Strongest at", "Noise", "Follows the drive"):
        assert question in first_screen
    assert "4 periods of 2.00 s" in first_screen


def test_warnings_stand_before_remarks_each_with_its_channel(page):
    findings = page.text[page.text.index("What was found") : page.text.index("The channels")]
    flat = " ".join(findings.split())
    assert flat.index("Warnings") < flat.index("2 of 4000 samples are spikes") < flat.index("Remarks")
    assert "displacement 1 2 of 4000 samples are spikes" in flat
    assert re.search(r"velocity 1 Reads [45]\.\d% more than", flat)
    assert flat.index("Remarks") < flat.index("Periodic: 4 periods")


def test_every_part_of_a_full_record_has_its_picture_in_words():
    pictures = drawn(Record(T, **faulty()))
    assert list(pictures) == ["channels", "spectra", "coherence", "consistency", "planes", "lines"]
    assert "2 samples marked as spikes" in pictures["channels"]
    assert re.search(r"acceleration 1, up to [\d.]+ \w*m/s², \d+ samples marked as clipped", pictures["channels"])
    assert "velocity 1 against displacement 1: gain 1.0" in pictures["consistency"]
    assert "displacement 1 100 %" in pictures["planes"] or "displacement 1 9" in pictures["planes"]
    assert "4 periods, 40 of them excited from 0.500 to 49.5 Hz" in pictures["lines"]


@pytest.mark.parametrize(
    ("record", "names"),
    [
        (
            Record(T, displacement=np.exp(-T) * np.sin(70 * T) + 1e-3 * np.cos(40.0 * T)),
            {"channels", "spectra", "planes"},
        ),
        (Record(T, displacement=np.zeros(T.size)), {"channels"}),
        (Record(T[:10], displacement=np.sin(70.0 * T[:10])), {"channels"}),
        (Record(T), set()),
    ],
)
def test_pictures_are_made_only_of_what_there_is_to_show(record, names):
    assert set(drawn(record)) == names
    page = Page(render_inspection(shown(record)))
    assert ("From period to period" in page.text) == ("lines" in names)
    assert "Do the channels of a point" not in page.text
    assert len(page.labels) == len(names)


def test_gaps_are_drawn_and_break_the_line():
    kept = np.delete(np.arange(T.size), np.arange(1000, 1500))
    y = np.sin(70.0 * T) + 0.5 * np.sin(31.0 * T)
    d = shown(Record(T[kept], displacement=y[kept]))
    assert d["gaps"] == [[pytest.approx(T[999]), pytest.approx(T[1500])]]
    (picture, *_) = inspection_pictures(d)
    assert "1 gap in time" in picture.alt
    whole = picture.figure.axes[0]
    assert [np.asarray(line.get_xdata())[[0, -1]].tolist() for line in whole.lines] == [
        [T[0], pytest.approx(T[999])],
        [pytest.approx(T[1500]), pytest.approx(T[-1])],
    ]
    assert whole.get_legend_handles_labels()[1] == ["gap"]


def test_defects_are_marked_where_they_are():
    picture = inspection_pictures(shown(Record(T, **faulty())))[0]
    marked = {}
    for axes in picture.figure.axes:
        for line in axes.lines:
            marked[axes.get_title(loc="left"), line.get_label()] = np.asarray(line.get_xdata())
    np.testing.assert_allclose(marked["displacement 1", "spikes"], T[[1500, 2500]])
    np.testing.assert_allclose(marked["around the first spike", "spikes"], T[[1500]])
    clipped = Record(T, **faulty()).inspect().traces[-1].clipped
    assert set(marked["acceleration 1", "clipped"]) <= set(T[clipped])
    assert len(marked["acceleration 1", "clipped"]) > 20


def test_the_same_record_gives_the_same_page_and_leaves_the_dictionary_alone():
    d = shown(Record(T, **channels()))
    plain = json.dumps({key: part for key, part in d.items() if key != "curves"})
    assert render_inspection(d) == render_inspection(d)
    assert json.dumps({key: part for key, part in d.items() if key != "curves"}) == plain


def test_a_page_can_be_made_of_json_alone():
    d = json.loads(json.dumps(Record(T, **channels()).inspect().to_dict()))
    assert "traces" not in d and "time" not in d
    page = Page(render_inspection(d))
    assert "No warnings" in page.text and "The record shows no fault by itself" in page.text
    assert len(page.labels) == 5
    assert "Nothing odd was found." not in page.text
    Page(render_inspection({}))


def test_a_long_record_gives_a_page_that_can_be_sent():
    rng = np.random.default_rng(1)
    t = DT * np.arange(60_000)
    y = np.sin(70 * t) + 0.01 * rng.standard_normal(t.size)
    assert len(render_inspection(shown(Record(t, force=rng.standard_normal(t.size), displacement=y)))) < 300_000


def test_many_channels_are_shown_in_part_and_it_is_said():
    y = {dof: np.sin((60.0 + dof) * T) for dof in range(1, 9)}
    (picture, *_) = inspection_pictures(shown(Record(T, displacement=y)))
    assert "6 of 8 channels are shown." in picture.caption


def test_the_phase_plane_is_that_of_the_least_derivative_of_each_point():
    plane = {"coverage": 1.0}
    names = ("force 1", "velocity 1", "displacement 1", "acceleration 2", "base_acceleration")
    found = planes_of([{"channel": name, "phase_plane": plane} for name in names])
    assert [channel["channel"] for channel in found] == ["displacement 1", "acceleration 2"]


def test_tables_say_noise_with_its_error_and_agreement_with_its_interval():
    row = {"channel": "displacement 1", "unit": "m", "minimum": -0.2, "maximum": 0.3, "mean": 1e-17, "std": 0.1}
    table = inspected_channels_table([{**row, "noise": 0.00101, "noise_error": 0.0002, "frequency": 6.5}])
    assert table.rows == (("displacement 1", "m", "−0.200", "0.300", "0", "0.100", "1.0 ± 0.2 mm", "1 %", "6.50 Hz"),)
    pair = {"lower": "displacement 1", "upper": "velocity 1", "gain": 1.05, "gain_error": 0.001, "inverted": True}
    pair |= {"delay": 1e-3, "delay_error": 2e-5, "offset": 1e-12, "offset_error": 1e-13, "agreement": 0.999}
    (cells,) = consistency_table([pair], [{**row, "channel": "velocity 1", "unit": "m/s"}], 500.0).rows
    assert cells[2:5] == ("−1.0500 [−1.0520, −1.0480]", "0.500 [0.480, 0.520]", "0 [0, 0] m/s")


def test_distortion_is_told_where_the_excitation_leaves_room_to_see_it():
    one = {"channel": "displacement 1", "noise": 1e-3, "noise_error": 2e-5, "even": 0.0, "odd": 0.01}
    told = periods_table({"channels": [one]}, [{"channel": "displacement 1", "unit": "m"}])
    assert told.rows == (("displacement 1", "1.00 ± 0.02 mm", "none beyond noise", "−40 dB"),)
    hidden = periods_table({"channels": [{**one, "even": None, "odd": None}]}, [])
    assert hidden.headings == ("channel", "noise from period to period")


@pytest.mark.parametrize("width", [80, 100, 140])
def test_the_terminal_shows_what_the_page_tables_show_as_far_as_there_is_room(width):
    text = inspection_text(Record(T, **faulty()).inspect().to_dict(), width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    for words in ("noise", "gain", "from period to period", "velocity 1: Reads"):
        assert words in text
    assert ("mean" in text.split("Channels")[1].split("against")[0]) == (width >= 115)
    assert all(f"{kind} 1" in text for kind in ("displacement", "acceleration"))

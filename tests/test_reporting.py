"""What is shown of a diagnosis: text, pictures and page, whatever the verdict and whatever is missing."""

import copy
import json
import os
import re
import stat
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from jfsm.reporting import (
    diagnosis_text,
    inspection_text,
    pictures,
    plot_diagnosis,
    plot_force,
    print_diagnosis,
    print_inspection,
    render_page,
    write_text_atomically,
)
from jfsm.reporting._curves import envelope, loudest_stretch
from jfsm.reporting._quantities import (
    interval,
    number,
    percent,
    power_of_ten,
    probability,
    quantity,
    rate_unit,
    with_error,
)
from jfsm.reporting._tables import candidates_table
from jfsm.reporting._wording import listed, place_name

VERDICTS = ("consistent", "parameters", "cause", "unnamed", "undecided")
PARTS = ("record", "model", "extended", "findings", "candidates", "refitted", "gain", "notes", "detectable", "timing")


def estimate(value: float, unit: str, spread: float = 0.02) -> dict[str, Any]:
    return {"value": value, "low": value * (1 - spread), "high": value * (1 + spread), "unit": unit}


def curves(n: int = 900) -> dict[str, Any]:
    """A hardening oscillator's motion, made up: sums of sines, and the force that a linear model lacks."""
    rng = np.random.default_rng(3)
    t = np.linspace(70.0, 115.0, n)
    x = 2e-2 * np.sin(3.1 * t) * (0.6 + 0.4 * np.sin(0.21 * t)) + 6e-3 * np.sin(9.6 * t + 0.4)
    v = np.gradient(x, t)
    before = 2e-2 * np.sin(3.02 * t + 0.2) * (0.6 + 0.4 * np.sin(0.21 * t)) + 6e-3 * np.sin(9.6 * t + 0.3)
    after = x + 1.5e-4 * np.sin(5.3 * t)
    measured = x + 1e-4 * rng.standard_normal(n)
    force = 4e5 * x**3 + 0.06 * rng.standard_normal(n)
    grid_x, grid_v = np.linspace(-0.028, 0.028, 33), np.linspace(-0.12, 0.12, 31)
    surface = 4e5 * grid_x[:, None] ** 3 + 1.0 * grid_v[None, :]
    visited = (grid_x[:, None] / 0.026) ** 2 + (grid_v[None, :] / 0.11) ** 2 < 1
    return {
        "holdout": {
            "time": t.tolist(),
            "channels": {
                "displacement 1": {
                    "unit": "m",
                    "measured": measured.tolist(),
                    "before": before.tolist(),
                    "after": after.tolist(),
                }
            },
        },
        "residual": {
            "at": [0, 1],
            "displacement": x.tolist(),
            "velocity": v.tolist(),
            "force": force.tolist(),
            "unit": {"displacement": "m", "velocity": "m/s", "force": "N"},
        },
        "course": {
            "time": t.tolist(),
            "force": force.tolist(),
            "error": np.full(n, 0.06).tolist(),
            "frequency": np.linspace(0.1, 10.0, 40).tolist(),
            "density": (1.0 / np.linspace(0.1, 10.0, 40)).tolist(),
            "lag": np.linspace(0.05, 4.0, 50).tolist(),
            "correlation": (0.1 * np.cos(np.linspace(0.05, 20.0, 50))).tolist(),
            "chance": 0.065,
        },
        "map": {
            "displacement": grid_x.tolist(),
            "velocity": grid_v.tolist(),
            "force": surface.tolist(),
            "visited": visited.tolist(),
        },
        "law": {
            "displacement": grid_x.tolist(),
            "force_of_displacement": (4e5 * grid_x**3).tolist(),
            "velocity": grid_v.tolist(),
            "force_of_velocity": (0 * grid_v).tolist(),
        },
    }


def candidate(cause: str, evidence: float, kappa: float, chance: float, why: str) -> dict[str, Any]:
    return {
        "cause": cause,
        "at": [0, 1],
        "evidence": evidence,
        "error": {"training": 0.12 * (1 - kappa), "holdout": 0.13 * (1 - kappa)},
        "kappa": kappa,
        "probability": chance,
        "parameters": {"k3": estimate(4e5, "N/m³")},
        "why": why,
    }


def diagnosis(verdict: str) -> dict[str, Any]:
    """A made-up diagnosis with every part filled in, as its verdict has it."""
    cubic = {
        "cause": "cubic_hardening",
        "family": "stiffness",
        "at": [0, 1],
        "probability": 0.96,
        "sentence": "The spring stiffens with the cube of its stretch.",
        "parameters": {"k3": estimate(4.02e5, "N/m³", 0.012)},
        "rivals": [
            {"cause": "quintic_stiffness", "at": [0, 1], "probability": 0.02},
            {"cause": "end_stop", "at": [0, 1], "probability": 0.01},
        ],
    }
    value = {
        "cause": "stiffness_value",
        "family": "parameters",
        "at": [0, 1],
        "probability": 0.99,
        "sentence": "The stiffness is 12 % higher than stated.",
        "parameters": {"k": estimate(1008.0, "N/m", 0.003)},
        "rivals": [],
    }
    sentences = {
        "consistent": "The record shows nothing beyond noise that the simulation lacks.",
        "parameters": "The form of the simulation is right; its stiffness is 12 % too low.",
        "cause": "The simulation lacks a hardening spring between ground and mass 1. "
        "The free-run error on held-out readings goes from 41 % to 1.8 % of the signal.",
        "unnamed": "A real effect is there that no catalogue entry explains; a map stands in.",
        "undecided": "Something is wrong beyond noise, and this record cannot tell what.",
    }
    others = ["quintic_stiffness", "end_stop", "sine_stiffness", "coulomb", "bouc_wen", "preload", "force_gain"]
    others += ["quadratic_damping", "van_der_pol", "attached_oscillator", "delayed_force"]
    channels = {
        "displacement 1": {
            "unit": "m",
            "before": 6.83e-3,
            "refitted": 4.1e-3,
            "after": 2.98e-4,
            "floor": 2.8e-4,
            "before_nrmse": 0.41,
            "refitted_nrmse": 0.246,
            "after_nrmse": 0.0179,
            "floor_nrmse": 0.0168,
            "closed": 0.997,
        },
        "acceleration 1": {
            "unit": "m/s²",
            "before": 0.61,
            "refitted": 0.44,
            "after": 0.052,
            "floor": 0.05,
            "before_nrmse": 0.38,
            "refitted_nrmse": 0.27,
            "after_nrmse": 0.033,
            "floor_nrmse": 0.031,
            "closed": 0.996,
        },
    }
    shapes, share, closed = curves(), 1.0, 0.997
    if verdict != "cause":
        shapes["law"] = None
    if verdict in ("consistent", "undecided"):  # nothing was added, so nothing was gained
        shapes["map"], closed, share = None, None if verdict == "consistent" else 0.31, 0.1
        for channel in channels.values():
            channel["after"], channel["after_nrmse"] = channel["refitted"], channel["refitted_nrmse"]
            channel["closed"] = closed
    return {
        "jfsm": "0.1.0",
        "verdict": verdict,
        "sentence": sentences[verdict],
        "advice": "Record a second run with another amplitude." if verdict in ("unnamed", "undecided") else "",
        "record": {
            "name": "Engine mount, run 7",
            "samples": 10000,
            "sample_rate": 100.0,
            "duration": 99.99,
            "channels": [
                {"name": "force 1", "unit": "N", "rms": 14.2, "noise": 0.02},
                {"name": "displacement 1", "unit": "m", "rms": 0.0167, "noise": 1e-4},
                {"name": "acceleration 1", "unit": "m/s²", "rms": 1.6, "noise": 0.05},
            ],
        },
        "model": ["mass@1  m = 1.00 kg", "stiffness@0-1  k = 900 N/m", "damping@0-1  c = 1.2 N s/m"],
        "extended": [
            "mass@1  m = 1.00 kg",
            "stiffness@0-1  k = 903 N/m",
            "damping@0-1  c = 1.2 N s/m",
            "cubic_hardening@0-1  k3 = 4.02e5 N/m³",
        ],
        "findings": {"cause": [cubic], "parameters": [value]}.get(verdict, []),
        "candidates": [
            candidate(
                "cubic_hardening", 812.4, 0.99, 0.96 * share, "named" if verdict == "cause" else "fails held out"
            ),
            *(
                candidate(
                    cause,
                    640.0 / (rank + 1) ** 1.5 - 20.0,
                    0.9 / (rank + 1),
                    0.02 / (rank + 1) ** 2,
                    "explains too little",
                )
                for rank, cause in enumerate(others)
            ),
        ],
        "refitted": {
            "stiffness@0-1.k": {"given": 900.0, **estimate(903.1, "N/m", 0.003)},
            "damping@0-1.c": {"given": 1.2, **estimate(1.21, "N s/m", 0.04)},
        },
        "gain": {"closed": closed, "interval": closed and [closed - 0.07, closed + 0.01], "channels": channels},
        "notes": ["Steps of time differ by 1.2 %; they are treated as uniform."],
        "detectable": {
            "coulomb": {"parameter": "F", "value": 0.031, "unit": "N"},
            "quadratic_damping": {"parameter": "c2", "value": 0.8, "unit": "N s²/m²"},
        },
        "timing": {"seconds": 8.4, "programs": 7},
        "curves": shapes,
    }


def inspection() -> dict[str, Any]:
    return {
        "name": "run 7",
        "samples": 2000,
        "duration": 19.99,
        "sample_rate": 100.0,
        "channels": [
            {
                "channel": "displacement 1",
                "unit": "m",
                "minimum": -0.02,
                "maximum": 0.021,
                "mean": 1e-4,
                "std": 0.011,
                "noise": None,
                "frequency": 1.52,
            }
        ],
        "findings": [
            {"severity": "warning", "channel": "displacement 1", "message": "12 samples are clipped [at 0.021 m]."}
        ],
    }


class Page(HTMLParser):
    """What a reader's program finds in a page: tags that match, ids, references, visible text."""

    VOID = ("meta", "br", "img", "link", "input", "hr")

    def __init__(self, text: str):
        super().__init__()
        self.ids: list[str] = []
        self.references: list[str] = []
        self.labels: list[str] = []
        self.tags: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(text)
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        found = dict(attrs)
        self.ids += [found["id"] or ""] if "id" in found else []
        self.references += [found[name] or "" for name in ("href", "src", "action", "srcset") if name in found]
        self.labels += [found["aria-label"] or ""] if found.get("role") == "img" else []
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self._open.pop()

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if self._open and self._open[-1] not in ("style", "script"):
            self.text += data


@pytest.mark.parametrize("verdict", VERDICTS)
def test_text_says_verdict_sentence_and_gain(verdict):
    d = diagnosis(verdict)
    text = re.sub(r"[\s│]+", " ", diagnosis_text(d))
    assert d["sentence"] in text
    assert d["advice"] in text
    assert "displacement 1" in text
    assert "6.83 (41 %)" in text


def test_text_of_a_cause_says_where_how_sure_how_large_and_what_else_it_may_be():
    text = diagnosis_text(diagnosis("cause"), width=120)
    for words in (
        "cubic hardening",
        "link ground–1",
        "96 %",
        "402.0 kN/m³",
        "quintic stiffness",
        "99.7 %",
    ):
        assert words in text


def test_what_predicts_worse_than_without_explains_nothing():
    """A law that sticks may run far off; by how much is no share of anything."""
    why = "explains 0% of what the refitted model leaves"
    [row] = candidates_table([candidate("jenkins", 54000.0, -2.4e9, 0.0, why)]).rows
    assert "0 %" in row and not any("−" in cell for cell in row)


def test_a_narrow_terminal_shows_whole_words_and_leaves_errors_and_reasons_to_the_page():
    narrow, wide = (diagnosis_text(diagnosis("cause"), width=width) for width in (80, 120))
    assert "explains too" in wide and "explains too" not in narrow
    rows = narrow[narrow.index("Candidates") :]
    assert all(word in rows for word in ("hardening", "Coulomb friction", "link ground–1", "probability", "96 %"))
    assert "fitted" in wide[wide.index("Candidates") :] and "fitted" not in rows
    assert max(map(len, narrow.splitlines())) <= 80


def test_text_keeps_to_its_width():
    assert max(map(len, diagnosis_text(diagnosis("cause"), width=110).splitlines())) <= 110


def test_text_of_an_inspection_shows_channels_and_remarks_as_they_are():
    text = inspection_text(inspection())
    assert "run 7  2000 samples, 19.99 s, 100 Hz" in text
    assert "displacement 1: 12 samples are clipped [at 0.021 m]." in text
    assert "Nothing odd was found." in inspection_text({"name": None, "channels": [], "findings": []})


def test_printing_shows_the_text(capsys):
    print_diagnosis(diagnosis("undecided"))
    print_inspection(inspection())
    shown = capsys.readouterr().out
    assert "this record cannot tell what" in shown
    assert "are clipped" in shown


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_page_stands_alone_and_answers_first(verdict):
    d = diagnosis(verdict)
    text = render_page(d)
    page = Page(text)
    assert "http" not in text
    assert all(reference.startswith("#") for reference in page.references)
    assert "script" not in page.tags and "link" not in page.tags
    assert len(page.ids) == len(set(page.ids))
    assert all(part in page.text for part in d["sentence"].split(". "))
    first_screen = page.text[: page.text.index("Does it predict what it has not seen?")]
    for question in ("Cause", "Gain"):
        assert question in first_screen
    if verdict in ("cause", "parameters"):
        assert "How sure" in first_screen and "How large" in first_screen


def test_the_first_screen_of_a_cause_names_it_with_its_probability_value_and_gain():
    page = Page(render_page(diagnosis("cause")))
    first_screen = page.text[: page.text.index("Does it predict what it has not seen?")]
    for words in ("Cubic hardening", "96 %", "k3 = 402.0 kN/m³", "displacement 1: 6.83 → 0.298 mm"):
        assert words in first_screen.replace("\N{NO-BREAK SPACE}", " ")


def test_the_gain_is_shown_with_its_interval():
    text = diagnosis_text(diagnosis("cause")).replace("\N{NO-BREAK SPACE}", " ")
    closed = diagnosis("cause")["gain"]["closed"]
    assert f"95 % interval {100 * closed - 7:.0f} % to" in text


def test_every_picture_says_in_words_what_it_shows():
    labels = Page(render_page(diagnosis("cause"))).labels
    assert len(labels) == 6
    assert any("rms error" in label and "as given" in label and "mm" in label for label in labels)
    assert any("Map of the residual force" in label for label in labels)


def test_colours_of_pictures_follow_the_theme_of_the_reader():
    page = render_page(diagnosis("cause"))
    assert "prefers-color-scheme: dark" in page and "@media print" in page
    drawn = page[page.index("<svg") :]
    for variable in ("ink", "grid", "measured", "before", "after", "floor"):
        assert f"var(--{variable})" in drawn


def test_the_same_diagnosis_gives_the_same_page():
    assert render_page(diagnosis("cause")) == render_page(diagnosis("cause"))


def test_what_was_written_as_json_is_shown_the_same():
    d = diagnosis("cause")
    assert render_page(json.loads(json.dumps(d))) == render_page(d)


@pytest.mark.parametrize("absent", PARTS)
def test_a_part_that_is_absent_is_left_out(absent):
    d = {**diagnosis("cause"), "curves": None, absent: None}
    empty = Page(render_page(d))
    text = diagnosis_text(d)
    del d[absent]
    assert Page(render_page(d)).text == empty.text
    assert diagnosis_text(d) == text


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_verdict_alone_makes_a_page(verdict):
    page = Page(render_page({"verdict": verdict}))
    assert page.labels == []
    assert diagnosis_text({"verdict": verdict})
    assert isinstance(plot_diagnosis({"verdict": verdict}), Figure)


@pytest.mark.parametrize("absent", ["holdout", "residual", "course", "map", "law"])
def test_curves_that_are_absent_are_not_drawn(absent):
    d = diagnosis("cause")
    d["curves"][absent] = None
    drawn = {picture.name for picture in pictures(d)}
    picture = {"holdout": "record", "law": "law"}.get(absent, absent)
    assert drawn == {"record", "residual", "course", "map", "gain", "ranking"} - {picture}


def nulled(value: Any) -> Any:
    """The same with every number of a channel, estimate or candidate unknown."""
    if isinstance(value, dict):
        return {key: nulled(inner) for key, inner in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [nulled(inner) for inner in value]
    return None if isinstance(value, float) else value


@pytest.mark.parametrize("verdict", ["consistent", "cause"])
def test_unknown_numbers_are_shown_as_absent(verdict):
    d = diagnosis(verdict)
    unknown = {**nulled({key: part for key, part in d.items() if key != "curves"}), "curves": d["curves"]}
    page = Page(render_page(unknown))
    assert "None" not in page.text.replace("None claimed", "").replace("None", "", 1 if verdict == "consistent" else 0)
    assert "nan" not in page.text.split("How to read")[0].lower().replace("unnamed", "")
    diagnosis_text(unknown)


def test_gaps_in_curves_are_bridged_by_nothing():
    d = diagnosis("cause")
    channel = d["curves"]["holdout"]["channels"]["displacement 1"]
    channel["after"][100:200] = [None] * 100
    channel["before"] = None
    Page(render_page(d))


@pytest.mark.parametrize("text", ["<script>alert(1)</script>", "a & b", "$x^{2$", "[bold]x[/bold]", '"quoted"'])
def test_texts_of_a_diagnosis_are_shown_and_never_interpreted(text):
    d = diagnosis("cause")
    d["sentence"] = d["advice"] = d["record"]["name"] = text
    d["notes"], d["model"], d["extended"] = [text], [text], [text, "x"]
    d["candidates"][0]["why"] = d["candidates"][0]["cause"] = text
    d["findings"][0]["sentence"] = text
    for part in (d["gain"]["channels"], d["curves"]["holdout"]["channels"]):
        part[text] = part.pop("displacement 1")
    page = Page(render_page(d))
    assert "script" not in page.tags
    assert page.text.count(text) >= 8
    assert text in diagnosis_text(d, width=200)


def test_a_dictionary_that_is_no_diagnosis_is_refused_with_the_way_to_load_one():
    message = (
        r"`d` must be the dictionary that `Diagnosis.to_json` writes, .* its 'verdict' was 'fine'\. .*`json\.load`"
    )
    for show in (render_page, diagnosis_text, pictures, plot_diagnosis, print_diagnosis):
        with pytest.raises(ValueError, match=message):
            show({"verdict": "fine"})


def settings() -> dict[str, Any]:
    """All of matplotlib's, but for the backend: asking for that one loads pyplot."""
    return {name: mpl.rcParams[name] for name in mpl.rcParams if name != "backend"}


def test_drawing_leaves_the_callers_matplotlib_alone():
    with mpl.rc_context({"lines.linewidth": 7.0, "axes.facecolor": "black", "svg.fonttype": "path"}):
        before = settings()
        page = render_page(diagnosis("cause"))
        assert settings() == before
    assert page == render_page(diagnosis("cause"))


def test_drawing_needs_no_pyplot():
    program = (
        "import sys; from test_reporting import diagnosis, render_page; render_page(diagnosis('cause'));"
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    folder = Path(__file__).resolve().parent
    path = os.pathsep.join([str(folder), str(folder.parent)])
    subprocess.run([sys.executable, "-c", program], check=True, env={**os.environ, "PYTHONPATH": path})


def test_one_sheet_holds_all_pictures(tmp_path):
    figure = plot_diagnosis(diagnosis("cause"))
    assert len(figure.subfigs) == 6
    figure.savefig(tmp_path / "sheet.png", dpi=40)
    assert (tmp_path / "sheet.png").stat().st_size > 5000


def test_a_long_record_gives_a_page_that_can_be_sent():
    d = diagnosis("cause")
    d["curves"] = curves(60_000)
    assert len(render_page(d)) < 3_000_000


def test_an_envelope_keeps_the_extremes():
    x, y = np.arange(100_000.0), np.random.default_rng(0).standard_normal(100_000)
    y[31_415] = 99.0
    thin_x, thin_y = envelope(x, y, columns=500)
    assert thin_x.size <= 1000 and np.all(np.diff(thin_x) > 0)
    assert (thin_y.max(), thin_y.min()) == (99.0, y.min())


def test_an_envelope_for_a_logarithmic_axis_is_fine_where_the_axis_is_wide():
    x = np.arange(1.0, 100_001.0)
    thin, _ = envelope(x, np.sin(x), columns=500, log=True)
    assert thin.size <= 1000
    decades = np.histogram(thin, 10.0 ** np.arange(6))[0]
    assert decades[0] == 9 and decades[-1] < 0.3 * thin.size
    assert thin[0] == 1.0 and thin[-1] > 0.95 * x[-1]


def test_the_loudest_stretch_holds_the_largest_value_and_a_few_periods():
    t = np.linspace(0, 100, 10_001)
    stretch = loudest_stretch(np.sin(2 * np.pi * t) * np.exp(-((t - 60) ** 2) / 400))
    assert stretch is not None
    assert stretch.start <= 6000 < stretch.stop
    assert 5 <= t[stretch][-1] - t[stretch][0] <= 15
    assert loudest_stretch(np.sin(t[:1000])) is None
    assert loudest_stretch(np.zeros(100)) is None


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.98e-5, "m", "29.8 µm"),
        (0.0167, "m", "16.7 mm"),
        (4.02e5, "N/m³", "402 kN/m³"),
        (0.0069, "m/s", "6.90 mm/s"),
        (1500.0, "s", "1500 s"),
        (0.5, "m", "0.500 m"),
        (1.2e-7, "kg", "1.20 × 10⁻⁷ kg"),
        (0.002, "m²", "0.00200 m²"),
        (-0.002, "V", "−2.00 mV"),
        (0.0, "m", "0 m"),
        (3.0, None, "3.00"),
        (None, "m", "–"),
    ],
)
def test_quantities_read_as_an_engineer_writes_them(value, unit, text):
    assert quantity(value, unit) == text


def test_intervals_share_the_prefix_of_their_value_and_show_their_width():
    assert interval(9.998e-3, 10.012e-3, "m", 10.003e-3) == "[9.998, 10.012]"
    assert interval(0.8, 1.2, "N", 1.0) == "[0.80, 1.20]"
    assert interval(None, 1.0, "N", 1.0) == ""


@pytest.mark.parametrize(
    ("value", "error", "unit", "text"),
    [
        (0.00507, 9e-4, "V", "5.1 ± 0.9 mV"),
        (2.374e-8, 1.1e-9, "m", "24 ± 1 nm"),
        (-1.4, 0.06, "N", "−1.40 ± 0.06 N"),
        (812.0, 31.0, "m", "812 ± 31 m"),
        (1.2e-7, 1e-9, "kg", "1.20 × 10⁻⁷ ± 1 × 10⁻⁹ kg"),
        (0.2, None, "m", "0.200 m"),
        (0.0, 0.0, "m", "0 m"),
        (None, 0.1, "m", "–"),
    ],
)
def test_an_error_says_where_its_value_ends(value, error, unit, text):
    assert with_error(value, error, unit) == text


def test_powers_of_ten_label_an_axis_and_nothing_else_does():
    labels = [power_of_ten(value) for value in (0.01, 1.0, 1000.0, 1e-5, 1e4, 2.0, 0.0)]
    assert labels == ["0.01", "1", "1000", "10⁻⁵", "10⁴", "", ""]


def test_a_rate_of_change_has_its_unit():
    assert [rate_unit(unit) for unit in ("m", "m/s", "V", None)] == ["m/s", "m/s²", "V/s", "1/s"]


def test_names_are_listed_as_one_says_them():
    assert [listed(names) for names in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]


def test_no_probability_is_certain():
    assert [probability(p) for p in (1.0, 0.96, 0.001, None)] == ["> 99 %", "96 %", "< 1 %", "–"]


def test_shares_and_numbers_keep_their_sign_and_size():
    assert [percent(s) for s in (293.08, 100.0, 1e-9, -1e-9, -200.0)] == [
        "> 10000 %",
        "10000 %",
        "< 0.001 %",
        "> −0.001 %",
        "< −10000 %",
    ]
    assert [percent(s) for s in (0.997, 0.99999, 1.0, 0.0179, -0.3, 0.0, 1e-5, None)] == [
        "99.7 %",
        "99.9 %",
        "100 %",
        "1.8 %",
        "−30 %",
        "0 %",
        "0.001 %",
        "–",
    ]
    assert [number(x) for x in (12345.0, 1e9, -0.5, float("nan"), float("inf"))] == [
        "12345",
        "1.00 × 10⁹",
        "−0.500",
        "–",
        "∞",
    ]


@pytest.mark.parametrize(
    ("at", "text"),
    [
        ([0, 1], "link ground–1"),
        ((1, 2), "link 1–2"),
        ([2], "mass 2"),
        (["force", 1], "force channel 1"),
        ([], ""),
        (None, ""),
    ],
)
def test_places_read_as_words(at, text):
    assert place_name(at) == text


def test_a_file_is_replaced_whole_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "page.html"
    write_text_atomically(path, "old")
    path.chmod(0o640)
    write_text_atomically(str(path), "µ new\n")
    assert path.read_bytes() == "µ new\n".encode()
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_may_be_read_by_whom_other_new_files_may(tmp_path):
    write_text_atomically(tmp_path / "ours", "")
    (tmp_path / "plain").write_text("")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_file_that_cannot_be_written_is_named_and_the_old_one_stays(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match=r"`path` must be a file in a folder that can be written to.*missing"):
        write_text_atomically(tmp_path / "missing" / "page.html", "text")
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(OSError, match=r"`path` must be a file .*folder"):
        write_text_atomically(folder, "text")

    path = tmp_path / "page.html"
    path.write_text("old")

    def full_disk(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(OSError, match=r"No space left on device; got.*page\.html"):
        write_text_atomically(path, "new")
    assert path.read_text() == "old"
    assert sorted(Path(entry).name for entry in tmp_path.iterdir()) == ["folder", "page.html"]


def test_showing_changes_nothing_in_the_dictionary():
    d = diagnosis("cause")
    before = copy.deepcopy(d)
    for show in (render_page, diagnosis_text, plot_diagnosis):
        show(d)
    assert d == before


def test_the_force_is_drawn_on_axes_of_ones_own_with_units_and_the_law():
    both = Figure().subplots(1, 2)
    assert plot_force(diagnosis("cause"), both) is not None
    assert both[0].get_xlabel().startswith("displacement [") and both[1].get_xlabel().startswith("velocity [")
    assert both[0].lines and both[0].get_ylabel().startswith("residual force [")
    with pytest.raises(ValueError, match="`ax` must be 2 axes, as plt.subplots"):
        plot_force(diagnosis("cause"), both[0])
    with pytest.raises(ValueError, match="`ax` must be left out: this diagnosis holds no force"):
        plot_force({**diagnosis("cause"), "curves": None}, both)

"""Results in the units that are asked for, or that came in."""

import re

import numpy as np
import pytest
from test_reporting import diagnosis, inspection

from jfsm.records import Record, out_units
from jfsm.reporting import diagnosis_text, in_shown_unit, inspection_text, render_page, shown_in
from jfsm.reporting._quantities import quantity
from jfsm.reporting._shown_units import in_shown_words

INCH, POUND = 0.0254, 4.4482216152605
IMPERIAL = "in,lbf,deg"


@pytest.mark.parametrize(
    "unit, factor, word",
    [
        ("m", INCH, "in"),
        ("N/m", POUND / INCH, "lbf/in"),
        ("N s/m", POUND / INCH, "lbf s/in"),
        ("N/m^3", POUND / INCH**3, "lbf/in^3"),
        ("N/m³", POUND / INCH**3, "lbf/in³"),
        ("N s²/m²", POUND / INCH**2, "lbf s²/in²"),
        ("N s^2/m^2", POUND / INCH**2, "lbf s^2/in^2"),
        ("N*s/m", POUND / INCH, "lbf*s/in"),
        ("1/(m s)", 1 / INCH, "1/(in s)"),
        ("m/s²", INCH, "in/s²"),
        ("kg", POUND / INCH, "lbf s²/in"),
        ("N m/rad", POUND * INCH / np.radians(1.0), "lbf in/deg"),
        ("rad/s", np.radians(1.0), "deg/s"),
        ("V", 1.0, "V"),
        ("Hz", 1.0, "Hz"),
        ("N (s/m)^n", 1.0, "N (s/m)^n"),  # n is not known here
    ],
)
def test_units_are_made_of_those_that_are_asked_for(unit, factor, word):
    with shown_in(out_units(IMPERIAL)):
        shown = in_shown_unit(unit)
    assert shown[1] == word and shown[0] == pytest.approx(factor, rel=1e-12)
    assert in_shown_unit(unit) == (1.0, unit)  # afterwards as before


def test_a_unit_of_a_channel_stands_for_that_alone_and_slugs_go_with_feet():
    with shown_in(out_units(["g", "lbf", "ft"])):
        assert in_shown_unit("m/s²") == (9.80665, "g")
        assert in_shown_unit("m/s")[1] == "ft/s"
        assert in_shown_unit("kg") == (pytest.approx(14.59390294, rel=1e-9), "slug")
        assert in_shown_unit("kg m") == (pytest.approx(14.59390294 * 0.3048), "slug ft")
    with shown_in(out_units("mm,kN")):
        assert in_shown_unit("kg") == (1.0, "kg")
        assert quantity(2500.0, "N/m") == "0.00250 kN/mm"


@pytest.mark.parametrize(
    "told, shown",
    [
        ("about 1000 N/m [900, 1100] at ground", "about 5.71 lbf/in [5.14, 6.281] at ground"),
        ("stiffness@0-1.k = 9.12345 N/m", "stiffness@0-1.k = 0.0520962 lbf/in"),
        ("up to 2.54e-05 m, and 4 s", "up to 0.001 in, and 4 s"),
        ("sampled at 200 Hz, run 3 m", "sampled at 200 Hz, run 118 in"),
        ("5 meters, 3 Nodes, 2 m/min", "5 meters, 3 Nodes, 2 m/min"),
        ("offset 0.5 m/s² of acceleration 1", "offset 19.7 in/s² of acceleration 1"),
    ],
)
def test_numbers_in_sentences_are_translated(told, shown):
    with shown_in(out_units(IMPERIAL)):
        assert in_shown_words({"notes": [told], "unit": "m"}) == {"notes": [shown], "unit": "m"}
    assert in_shown_words(told) == told


def test_everything_that_is_shown_of_a_diagnosis_is_in_the_units_that_are_asked_for():
    told = diagnosis("cause")
    told["modes"] = [
        {
            "frequency": {"given": 4.7, "value": 4.78, "low": 4.77, "high": 4.79, "unit": "Hz"},
            "damping_ratio": {"given": None, "value": 0.0201, "low": 0.0191, "high": 0.0211, "unit": "1"},
        }
    ]
    si = diagnosis_text(told, 140)
    assert "903.1 N/m" in si and re.search(r"mode 1, damping ratio +– +2.01 % +\[1.91, 2.11\]", si)
    with shown_in(out_units(IMPERIAL)):
        text, page = diagnosis_text(told, 140), render_page(told)
    for shown in (text, re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)):
        assert "5.157 lbf/in" in shown  # 903.1 N/m
        assert not re.search(r"\d [kmµ]?(N|m|kg)\b(?!in)", shown), re.findall(r".*\d [kmµ]?(?:N|m|kg)\b.*", shown)
    assert diagnosis_text(told, 140) == si


def test_an_inspection_is_shown_in_the_units_that_are_asked_for():
    with shown_in(out_units("mm")):
        text = inspection_text(inspection(), 140)
    assert re.search(r"displacement 1 +mm +−20.0 +21.0", text)


def test_a_record_knows_the_units_that_it_came_in():
    record = Record([0, 1, 2], [1, 2, 3], [1, 2, 4], units={"force": "lbf", "displacement": "in"})
    assert record[:2].written == {"force": "lbf", "displacement": "in"}
    with shown_in(out_units(record.written)):
        assert quantity(record.channels["force", 1][2], "N") == "3.00 lbf"
    mixed = {"displacement": "in", "acceleration": "g", "base_acceleration": "in/s²", "velocity": "in/s"}
    assert out_units(mixed) == {"m": (INCH, "in"), "m/s²": (9.80665, "g"), "m/s": (INCH, "in/s")}


@pytest.mark.parametrize("asked, match", [("in,mm", "in and mm both"), ("furlong", "'furlong'"), ("ms", "'ms'")])
def test_what_is_no_unit_to_show_is_refused(asked, match):
    with pytest.raises(ValueError, match=f"`units` to show results in .*{match}"):
        out_units(asked)

"""Spellings of units, and what they are worth. The factors are those of handbooks, written out here."""

from typing import Any

import numpy as np
import pytest

from jfsm.records import Record

T = np.arange(4) * 0.1
ONE: Any = np.ones(4)


@pytest.mark.parametrize(
    ("kind", "factor", "unit", "spellings"),
    [
        ("force", 1.0, "N", "N;Newton;Newtons;newton;N.;[N];(N);newton(s)"),
        ("force", 1e3, "N", "kN;KN;kilonewton"),
        ("force", 10.0, "N", "daN"),
        ("force", 4.4482216152605, "N", "lbf;lb;lbs;Lbs;LBF;pounds;Pound;pound-force"),
        ("force", 4448.2216152605, "N", "kip;kips;klbf"),
        ("force", 9.80665, "N", "kgf;kp;kilopond"),
        ("force", 1.0, "N m", "N m;N-m;N*m;N·m;Nm;N.m;Newton-meters;N⋅m"),
        ("force", 1e-3, "N m", "mNm;N mm;Nmm;N-mm"),
        ("force", 0.1129848290276167, "N m", "lb-in;lbf-in;lbf in;lbfin;in-lb;in.-lbf"),
        ("force", 1.3558179483314004, "N m", "lbf-ft;ft-lb;ft.lbs;lbfft"),
        ("force", 1.0, "V", "V;Volt;Volts;volts"),
        ("force", 1e-3, "V", "mV;millivolts"),
        ("displacement", 1e-3, "m", "mm;MM;millimeter;millimetres"),
        ("displacement", 1e-6, "m", "µm;μm;um;micron;microns;micrometer"),
        ("displacement", 0.0254, "m", 'in;in.;inch;inches;Inches;"'),
        ("displacement", 2.54e-5, "m", "mil;mils;thou"),
        ("displacement", np.pi / 180, "rad", "deg;Deg;degrees;degree;°;deg."),
        ("velocity", 1e-3, "m/s", "mm/s;mm/sec;mm s-1;mm/second"),
        ("velocity", 1.0, "m/s", "m/s;m.s-1;m·s⁻¹;m s^-1;m*s**-1;meters per second;m s⁻¹"),
        ("velocity", 0.0254, "m/s", "in/s;in/sec;ips;inches/sec"),
        ("velocity", np.pi / 30, "rad/s", "rpm;RPM;1/min;rev/min;r/min;U/min;min-1"),
        ("velocity", np.pi / 180, "rad/s", "deg/s;dps;°/s;degrees/sec"),
        ("acceleration", 9.80665, "m/s²", "g;G;g's;gn;gs"),
        ("acceleration", 9.80665e-3, "m/s²", "mg"),
        ("acceleration", 1e-2, "m/s²", "gal;Gal;cm/s/s;cm/sec/sec;cm/s^2"),
        (
            "acceleration",
            1.0,
            "m/s²",
            "m/s²;m/s2;m/s^2;m/s**2;m/s/s;m/sec^2;m.s-2;m·s⁻²;m/(s·s);m s^(-2);M/S^2;ms-2;ms⁻²;$m/s^{2}$"
            ";meters per second squared",
        ),
        ("velocity", 0.44704, "m/s", "mph"),
        ("displacement", np.pi / 10800, "rad", "arcmin"),
        ("acceleration", 1e-3, "m/s²", "mm/s^2;mm/s²;mm/sec2"),
        ("acceleration", np.pi / 180, "rad/s²", "deg/s^2;°/s²;deg/s/s"),
    ],
)
def test_usual_spellings_of_a_unit_are_read(kind, factor, unit, spellings):
    for spelling in spellings.split(";"):
        record = Record(T, **{kind: ONE}, units={kind: spelling})
        assert record.units[kind] == unit, spelling
        np.testing.assert_allclose(record.channels[kind, 1], factor, rtol=1e-12, err_msg=spelling)


@pytest.mark.parametrize(
    ("spelling", "factor"), [("sec", 1.0), ("Seconds", 1.0), ("msec", 1e-3), ("min", 60.0), ("h", 3600)]
)
def test_usual_spellings_of_time_are_read(spelling, factor):
    np.testing.assert_allclose(Record(T, units={"time": spelling}).time, factor * T, rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "spelling"),
    [
        ("force", "kg"),  # a mass
        ("force", "mn"),  # milli or mega
        ("force", "MPa"),
        ("displacement", "m/s"),
        ("displacement", "m^"),
        ("displacement", "mm mm"),
        ("acceleration", "m/s^2 peak"),
        ("acceleration", "g0"),  # no power of nought
        ("force", "N m^0"),
        ("acceleration", "m/s^2)"),
        ("velocity", ""),
        ("velocity", "m//s"),
    ],
)
def test_a_spelling_that_could_be_something_else_is_refused(kind, spelling):
    with pytest.raises(ValueError, match=f"`units` of {kind} must be a unit of .*; it was "):
        Record(T, **{kind: ONE}, units={kind: spelling})

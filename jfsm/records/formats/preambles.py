"""What the lines above a table say of its sampling rate."""

import re
from collections.abc import Iterable, Iterator

from jfsm.records._units import find_unit
from jfsm.records.formats.base import StatedRate
from jfsm.records.formats.numbers import number

_RATE_KEYS = (
    r"sampl\w*[ _-]?(?:rate|freq[a-z]*)|(?:data|scan|acquisition)[ _-]?rate|fs|f_s|sps|odr|samples?\s*/\s*s\w*"
    r"|samples per sec(?:ond)?|abtast(?:rate|frequenz)|mess(?:rate|frequenz)|frecuencia de muestreo"
    r"|(?:fr[ée]quence|taux) d['’][ée]chantillonnage|frequenza di campionamento|rate|sampling"
)
_STEP_KEYS = (
    r"sampl\w*[ _-]?(?:interval|period|time|step)|delta[ _-]?[xt]|dt|d_t|ts|time[ _-]?(?:step|increment|interval)"
    r"|x[ _-]?(?:increment|interval)|increment|abtast(?:intervall|zeit|periode)|interval"
    r"|p[ée]riode d['’][ée]chantillonnage|periodo de muestreo"
)
_RATE_UNITS = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "sps": 1.0, "sa/s": 1.0, "ks/s": 1e3, "1/s": 1.0, "": 1.0}
_RATE_UNITS |= dict.fromkeys(
    ("scans/s", "scans/sec", "samples/s", "samples/sec", "samples/second", "samples per second", "per second"), 1.0
)
_RATE_NAME = re.compile(r"fs|sampl(?:e|es|ing)?(?:rate|freq|frequency)|(?:data|scan)rate|abtast(?:rate|frequenz)")  # Hz
_STEP_NAME = re.compile(r"dt|ts|delta[tx]|sampl(?:e|ing)(?:interval|period|time)|timestep|tsample|wfincrement")  # s
_VALUE = r"""(?:_(?P<joined>hz|khz|s|ms|us))?["']?\s*(?:[\[(](?P<before>[^\])]*)[\])])?\s*["']?
             (?:\s*[:=;,\t ])+\s*["']?\s*(?P<value>[-+]?\d[\d.,]*(?:[eE][-+]?\d+)?)\s*["']?
             (?P<apart>[;,\t\ ]*)\s*["']?[\[(]?(?P<after>(?:1/)?[A-Za-zµ/]+(?:\ per\ second)?)?"""
_KEYED = {
    kind: re.compile(rf"(?:^|[^A-Za-z_]) (?:{keys.replace(' ', chr(92) + ' ')}) {_VALUE}", re.VERBOSE | re.IGNORECASE)
    for kind, keys in (("rate", _RATE_KEYS), ("step", _STEP_KEYS))
}


def stated_rate(lines: Iterable[str]) -> StatedRate | None:
    """The sampling rate in lines such as ``Sample rate;200 Hz``, ``# fs = 1.2 kHz`` or ``Delta_X<tab>0,005``."""
    for line in _joined(lines):
        for kind, pattern in _KEYED.items():
            match = pattern.search(line)
            if match is None:
                continue
            unit = (match["before"] or match["joined"] or match["after"] or "").strip()
            value = _value(match["value"])
            size = _RATE_UNITS.get(unit.lower()) if kind == "rate" else _seconds(unit)
            if size is None and (match["apart"].strip() or match["value"].endswith(",")):
                size = 1.0  # what stands in the next field is no unit
            if value is None or not value > 0 or size is None:
                continue
            words = " ".join(match.group().strip(" ;,\t#%\"'([:=").split())
            return StatedRate(value * size if kind == "rate" else 1.0 / (value * size), words)
    return None


def names_rate(name: str) -> bool:
    """Whether a variable, field or attribute is called as sampling rates or steps are: ``run.Fs``, ``Sample_Rate``."""
    word = _letters(name)
    return bool(_RATE_NAME.fullmatch(word) or _STEP_NAME.fullmatch(word))


def rate_by_name(name: str, value: float) -> float | None:
    """The rate [Hz] that a number gives which is so called; None if it is not positive."""
    if not value > 0:
        return None
    return 1.0 / value if _STEP_NAME.fullmatch(_letters(name)) else value


def _letters(name: str) -> str:
    return re.sub(r"[^a-z]", "", re.split(r"[./]", name)[-1].lower())


def _joined(lines: Iterable[str]) -> Iterator[str]:
    """Lines, each that ends in a colon also with the one behind it, where its value stands."""
    before = ""
    for line in lines:
        yield line
        if before.rstrip(" \t,;").endswith(":"):
            yield f"{before.rstrip()} {line.strip()}"
        before = line


def _value(text: str) -> float | None:
    text = text.rstrip(".,")
    try:
        return number(text, "," if "," in text and "." not in text else ".")
    except ValueError:
        return None


def _seconds(unit: str) -> float | None:
    try:
        return find_unit(unit or "s", "time").factor
    except ValueError:
        return None

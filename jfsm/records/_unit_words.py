"""Unit words as recorders spell them, and the products, quotients and powers that they are put together to."""

import re
from typing import NamedTuple

INCH, FOOT, POUND, GRAVITY, DEGREE = 0.0254, 0.3048, 4.4482216152605, 9.80665, 0.017453292519943295


class Dimension(NamedTuple):
    """Powers of what a unit is made of, in the order of the coherent unit's words: ``N m``, ``V/s²``."""

    force: int = 0
    length: int = 0
    angle: int = 0
    voltage: int = 0
    current: int = 0
    pixels: int = 0
    time: int = 0

    def times(self, other: "Dimension", power: int) -> "Dimension":
        """This dimension multiplied by a power of another."""
        return Dimension(*(a + power * b for a, b in zip(self, other, strict=True)))


_TIME, _LENGTH, _FORCE = Dimension(time=1), Dimension(length=1), Dimension(force=1)
_ANGLE, _VOLTAGE, _CURRENT, _PIXELS = (
    Dimension(angle=1),
    Dimension(voltage=1),
    Dimension(current=1),
    Dimension(pixels=1),
)
_ACCELERATION, _SPEED, _TURN = Dimension(length=1, time=-2), Dimension(length=1, time=-1), Dimension(angle=1, time=-1)

Word = tuple[Dimension, float]

_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "da": 10.0, "k": 1e3, "M": 1e6}
_LONG_PREFIXES = {"nano": 1e-9, "micro": 1e-6, "milli": 1e-3, "centi": 1e-2, "kilo": 1e3, "mega": 1e6}

# Symbol, its dimension and size in the coherent unit, and the prefixes that are in use with it.
_SYMBOLS: tuple[tuple[str, Dimension, float, str], ...] = (
    ("s", _TIME, 1.0, "n u µ m"),
    ("m", _LENGTH, 1.0, "n u µ m c d k"),
    ("N", _FORCE, 1.0, "u µ m c da k M"),
    ("rad", _ANGLE, 1.0, "u µ m"),
    ("V", _VOLTAGE, 1.0, "n u µ m k"),
    ("A", _CURRENT, 1.0, "n u µ m k"),
    ("g", _ACCELERATION, GRAVITY, "u µ m"),  # of the earth; a gram weighs nothing on its own
    ("gn", _ACCELERATION, GRAVITY, ""),
)

_WORDS: dict[str, Word] = {symbol: (dimension, size) for symbol, dimension, size, _ in _SYMBOLS} | {
    prefix + symbol: (dimension, _PREFIXES[prefix] * size)
    for symbol, dimension, size, prefixes in _SYMBOLS
    for prefix in prefixes.split()
}

_WORDS |= {  # torques that are commonly written in one word
    force + arm: (_WORDS[force][0].times(_WORDS[arm][0], 1), _WORDS[force][1] * _WORDS[arm][1])
    for force in ("N", "mN", "kN", "MN", "cN", "daN")
    for arm in ("m", "mm", "cm")
} | {"lbfin": (Dimension(force=1, length=1), POUND * INCH), "lbfft": (Dimension(force=1, length=1), POUND * FOOT)}

# Words that have no capital letter of their own: read in any case of letters.
_LOWER: dict[str, Word] = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sekunde", "sekunden", "seconde", "secondes"), (_TIME, 1.0)),
    **dict.fromkeys(("msec", "msecs"), (_TIME, 1e-3)),
    **dict.fromkeys(("usec", "µsec"), (_TIME, 1e-6)),
    "nsec": (_TIME, 1e-9),
    **dict.fromkeys(("min", "minute", "minutes", "minuten"), (_TIME, 60.0)),
    **dict.fromkeys(("h", "hr", "hour", "hours"), (_TIME, 3600.0)),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), (_LENGTH, 1.0)),
    **dict.fromkeys(("micron", "microns"), (_LENGTH, 1e-6)),
    **dict.fromkeys(("in", "inch", "inches", "zoll", "pouce", "pouces", '"'), (_LENGTH, INCH)),
    **dict.fromkeys(("mil", "mils", "thou"), (_LENGTH, 1e-3 * INCH)),
    **dict.fromkeys(("ft", "foot", "feet"), (_LENGTH, FOOT)),
    **dict.fromkeys(("newton", "newtons"), (_FORCE, 1.0)),
    **dict.fromkeys(
        ("lb", "lbs", "lbf", "lbsf", "pound", "pounds", "pound-force", "pounds-force", "poundforce"), (_FORCE, POUND)
    ),
    **dict.fromkeys(("kip", "kips", "klb", "klbf"), (_FORCE, 1e3 * POUND)),
    **dict.fromkeys(("oz", "ozf"), (_FORCE, POUND / 16)),
    **dict.fromkeys(("kgf", "kp", "kilopond"), (_FORCE, GRAVITY)),
    "gf": (_FORCE, 1e-3 * GRAVITY),
    **dict.fromkeys(("tf", "tonf"), (_FORCE, 1e3 * GRAVITY)),
    **dict.fromkeys(("dyn", "dyne", "dynes"), (_FORCE, 1e-5)),
    **dict.fromkeys(("radian", "radians"), (_ANGLE, 1.0)),
    **dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), (_ANGLE, DEGREE)),
    **dict.fromkeys(("arcmin", "arcminute", "arcminutes"), (_ANGLE, DEGREE / 60)),
    **dict.fromkeys(("arcsec", "arcsecond", "arcseconds"), (_ANGLE, DEGREE / 3600)),
    **dict.fromkeys(("gon", "grad", "grads"), (_ANGLE, 0.9 * DEGREE)),
    **dict.fromkeys(("rev", "revs", "revolution", "revolutions", "turn", "turns"), (_ANGLE, 360 * DEGREE)),
    **dict.fromkeys(("rpm", "1/min", "min-1", "min^-1", "r/min", "u/min", "tr/min"), (_TURN, 6 * DEGREE)),
    "dps": (_TURN, DEGREE),
    "ips": (_SPEED, INCH),
    "fps": (_SPEED, FOOT),
    **dict.fromkeys(("kph", "kmh"), (_SPEED, 1 / 3.6)),
    "mph": (_SPEED, 5280 * FOOT / 3600),
    **dict.fromkeys(("ms-1", "ms^-1"), (_SPEED, 1.0)),
    **dict.fromkeys(("ms-2", "ms^-2"), (_ACCELERATION, 1.0)),  # as physicists write m s⁻²
    **dict.fromkeys(("g's", "gs", "gee", "gees", "g_n", "g-force", "gforce"), (_ACCELERATION, GRAVITY)),
    "%g": (_ACCELERATION, 1e-2 * GRAVITY),
    **dict.fromkeys(("gal", "gals"), (_ACCELERATION, 1e-2)),
    "mgal": (_ACCELERATION, 1e-5),
    **dict.fromkeys(("volt", "volts"), (_VOLTAGE, 1.0)),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), (_CURRENT, 1.0)),
    **dict.fromkeys(("px", "pixel", "pixels"), (_PIXELS, 1.0)),
}
_LOWER |= {
    long + word: (_LOWER[word][0], size * _LOWER[word][1])
    for long, size in _LONG_PREFIXES.items()
    for word in ("meter", "meters", "metre", "metres", "newton", "newtons", "volt", "volts", "second", "seconds", "amp")
    if long + word not in _LOWER
}

_SUPERSCRIPTS = str.maketrans({"⁰": "0", "¹": "1", "²": "2", "³": "3", "⁴": "4", "⁻": "-", "−": "-", "μ": "µ"})
_MATHEMATICS = str.maketrans("", "", "${}\\")  # as in $m/s^{2}$
_PLURAL = re.compile(r"(?<=[a-z])\(s\)$")  # newton(s)
_SQUARED = re.compile(r"\s+squared\b", re.IGNORECASE)
_FACTOR = re.compile(
    r"""(?P<sign>[*·⋅×.\s-]|/|per\b)?\s*
        (?P<word>[A-Za-zµ°]+(?:'s)?|")(?:\.(?![A-Za-zµ]))?
        (?:(?:\^|\*\*)?(?:(?P<power>[-+]?\d)|\((?P<closed>[-+]?\d)\)))?\s*""",
    re.VERBOSE,
)  # fmt: skip

_GROUPED = re.compile(r"(?P<over>[^()]*/\s*)\((?P<under>[^()]*[A-Za-z][^()]*)\)")


def dimension_and_size(text: str) -> Word | None:
    """What a unit is made of and its size in coherent units: ``mm/sec^2``, ``m s⁻²``, ``lb-in``; None if unknown.

    In what follows a slash everything divides, as recorders mean by ``m/s*s`` and by ``m/(s s)``.
    """
    plain = _PLURAL.sub("s", text.translate(_SUPERSCRIPTS).translate(_MATHEMATICS)).strip()
    plain = _SQUARED.sub("^2", plain)
    if (known := _word(plain)) is not None:
        return known
    if grouped := _GROUPED.fullmatch(plain):
        plain = grouped["over"] + grouped["under"]
    dimension, size, place, below = Dimension(), 1.0, 0, False
    while place < len(plain):
        match = _FACTOR.match(plain, place)
        if match is None or bool(place) != bool(match["sign"] or plain[place - 1 : place].isspace()):
            return None
        word = _word(match["word"])
        if word is None:
            return None
        below = below or match["sign"] in ("/", "per")
        power = int(match["power"] or match["closed"] or 1) * (-1 if below else 1)
        if not power:  # g0 is a name
            return None
        dimension, size, place = dimension.times(word[0], power), size * word[1] ** power, match.end()
    return (dimension, size) if place else None


def _word(text: str) -> Word | None:
    """A single word: as written; else, where no other case of letters could be meant, in lower case."""
    if text in _WORDS:
        return _WORDS[text]
    lower = text.lower().removesuffix(".")
    if lower in _LOWER:
        return _LOWER[lower]
    meant = {_WORDS[word] for word in _WORDS if word.lower() == lower}  # not MN for mN, but KN for kN and G for g
    return meant.pop() if len(meant) == 1 else None

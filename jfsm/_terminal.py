"""Signs that a terminal cannot show, such as − and ², spelt in those that it can."""

import codecs
import sys
import unicodedata
from typing import Any, TextIO

SPELT = "jfsm.spelt"
"""The name of the way to encode (``errors=``) that spells what an encoding lacks."""

_SPELLINGS = {
    "−": "-", "–": "-", "—": "-", "‑": "-", "·": "*", "×": "x", "±": "+-", "≈": "~", "≤": "<=", "≥": ">=", "≠": "!=",
    "°": "deg", "µ": "u", "μ": "u", "²": "^2", "³": "^3", "⁴": "^4", "⁵": "^5", "⁻": "^-", "√": "sqrt", "→": "->",
    "…": "...", "‘": "'", "’": "'", "“": '"', "”": '"', "∞": "inf", "σ": "sigma", "ω": "omega", "ζ": "zeta",
    "τ": "tau", "Δ": "Delta", "•": "*", "█": "#", "━": "-", "─": "-",
}  # fmt: skip


def spelt(text: str, encoding: str) -> str:
    """The text in signs that an encoding has."""
    return text.encode(encoding, SPELT).decode(encoding)


def spell_streams() -> None:
    """From here on standard output and error of this process spell what they cannot show."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # not one that something else took the place of
            stream.reconfigure(errors=SPELT)  # pyright: ignore[reportAttributeAccessIssue]


class Spelling:
    """A stream of text that spells what it cannot show, otherwise the one that it is made of."""

    def __init__(self, stream: TextIO):
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        return self._stream.write(spelt(text, self._stream.encoding or "utf-8"))


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    return "".join(map(_spelling, signs)), error.end


def _spelling(sign: str) -> str:
    """A sign in ASCII: by the table, without its accent, or a question mark."""
    bare = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return _SPELLINGS.get(sign) or bare or "?"


codecs.register_error(SPELT, _spell)

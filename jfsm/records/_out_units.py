"""Units in which results are to be shown."""

from collections.abc import Mapping, Sequence

from jfsm.records._unit_words import FOOT, POUND, Dimension, dimension_and_size
from jfsm.records._units import coherent_unit

OutUnits = str | Sequence[str] | Mapping[str, str] | None
_SLUG = POUND / FOOT


def out_units(asked: OutUnits) -> Mapping[str, tuple[float, str]]:
    """What takes the place of coherent units, or of the symbols that they are made of: a size in SI, and a word.

    Parameters
    ----------
    asked : str, sequence of str or mapping of kind to unit, optional
        As ``"in,lbf,deg"``, ``("mm", "kN", "g")`` or `Record.written`, of which the first of each quantity counts. One
        of length stands for the metre in all units that have it, as of a stiffness; so do those of force and angle. One
        of an acceleration (g) stands for that alone. Masses go with a force that is none of SI: slugs with lbf and ft.

    Raises
    ------
    ValueError
        If one is no unit, is raw, or two are of one quantity.
    """
    given = isinstance(asked, Mapping)
    words = asked.split(",") if isinstance(asked, str) else asked.values() if isinstance(asked, Mapping) else asked
    found: dict[str, tuple[float, str]] = {}
    for word in (word.strip() for word in words or ()):
        coherent, size = _of_quantity(word)
        if given and coherent in found:
            continue
        if coherent in found:
            raise ValueError(
                f"`units` to show results in must be one of each quantity; {found[coherent][1]} and {word} both stand "
                f"for {coherent}. Leave one out."
            )
        found[coherent] = size, word
    force, length = found.get("N", (1.0, "N")), found.get("m", (1.0, "m"))
    if force[1].removesuffix("N") not in ("", "k", "M", "m", "u", "µ", "c", "da"):
        mass = force[0] / length[0]
        found["kg"] = (mass, "slug" if abs(mass / _SLUG - 1) < 1e-9 else f"{force[1]} s²/{length[1]}")
    return found


def _of_quantity(word: str) -> tuple[str, float]:
    """The coherent unit that a unit takes the place of, and its size."""
    known = dimension_and_size(word)
    coherent = None if known is None else coherent_unit(known[0])
    if known is None or coherent is None or known[0] == Dimension(time=1):
        raise ValueError(
            f"`units` to show results in must be units of length, force, angle, or of a channel (in, ft, mm, lbf, kN, "
            f"deg, in/s, g, lbf ft); one was {word!r}. Time is in seconds, and frequencies in Hz."
        )
    return coherent, known[1]

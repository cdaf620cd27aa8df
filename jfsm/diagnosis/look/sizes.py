"""The size of every channel that a model has to predict beside what its linear part makes of the measured drive."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ..._result import Check
from ...plant import Channel
from ...records import Record, UnitFactor, likely_unit, miss
from ...structures import Structure
from ..thresholds import THRESHOLDS
from ..verdict.checks import checked
from .signs import force_signs
from .spectra import PIECES, Ratio, Spectra, lowest_mode, made, pieces_of, ratio_of


def beside_model(record: Record, model: Structure) -> Iterator[Check]:
    """Every look that asks the model: how many times what it makes every channel shows, whether a force has the other
    sign, and whether two channels stand in each other's place.

    The lines of the spectrum are compared that the drive and the channel share; their median does not mind a resonance
    that is a little elsewhere. A record that nothing drives tells none of it, and neither does a linear part that runs
    away.
    """
    if not record.driven or not record.answers or len(record) < 32 * PIECES:
        return
    pieces = pieces_of(record)
    spectra = made(record, model, pieces)
    mode = lowest_mode(model)
    found = {channel: ratio_of(*pair, pieces.omega, mode) for channel, pair in spectra.items()}
    ratios = {channel: ratio for channel, ratio in found.items() if ratio is not None}
    for channel, ratio in ratios.items():
        check = _size_check(record, channel, ratio)
        if check is not None:
            yield check
    if record.drive == "force":
        yield from force_signs(record, ratios, pieces)
        yield from _places(spectra)


def tolerance(ratio: Ratio, known: UnitFactor, *, imposed: bool) -> float | None:
    """How far a ratio may be from a factor between units, as a logarithm, and be that factor; None where its shape says
    that the model is wrong instead, or says nothing."""
    limits = THRESHOLDS
    if known.size >= limits.unit_large:
        return _of_a_large_factor(ratio, known.size >= limits.unit_thousand, imposed=imposed)
    # A value may be off by as much: stiffness and mass have to show it alike.
    return limits.unit_near if ratio.wide and _is_even(ratio, limits.unit_near) else None


def _of_a_large_factor(ratio: Ratio, thousands: bool, *, imposed: bool) -> float | None:
    """The tolerance of a factor of thirty or more."""
    limits = THRESHOLDS
    if thousands and ratio.times > 1.0 and ratio.wide:
        # Nothing but a unit makes a motion so much larger than a model has it, whatever its shape.
        return limits.unit_about if abs(ratio.cosine) > limits.unit_follows else None
    told = ratio.wide or imposed or thousands
    return limits.unit_alike if told and _is_even(ratio, limits.unit_alike) else None


def _is_even(ratio: Ratio, blur: float) -> bool:
    """Whether a ratio is the same at all frequencies, in size and phase."""
    return ratio.spread < blur and abs(ratio.cosine) > 1.0 - blur


def _size_check(record: Record, channel: Channel, ratio: Ratio) -> Check | None:
    known = likely_unit(ratio.times)
    limit = tolerance(ratio, known, imposed=record.drive == "motion")
    if limit is None:
        return None
    what = "needs along the measured motion" if record.drive == "motion" else "makes of the measured drive"
    off, name = miss(ratio.times, known), f"{channel[0]} {channel[1]}"
    says = f"{name} is {ratio.times:.3g} times what the model {what}"
    if off <= limit:
        says += f" (about {known.size if ratio.times > 1 else 1 / known.size:.4g}: {known.words}?)"
    return checked("right_size", name, off, limit, says)


def _places(made: Spectra) -> Iterator[Check]:
    """Pairs of responses of one kind, where they fit the model in each other's place."""
    limits = THRESHOLDS
    for (one, (y, y_model)), (other, (z, z_model)) in combinations(made.items(), 2):
        both = (np.abs(y) > 0) & (np.abs(z) > 0)
        if one[0] != other[0] or not np.any(both):
            continue
        here = max(_left(y, y_model, both), _left(z, z_model, both))
        there = max(_left(y, z_model, both), _left(z, y_model, both))
        if there > limits.in_place:
            continue
        name = f"{one[0]} {one[1]} and {one[0]} {other[1]}"
        says = f"{name} leave {here:.2g} of their power where they stand, {there:.2g} in each other's place"
        ratio = there / max(here, 1e-300)
        if ratio < limits.swapped:
            says += ": the two channels are swapped"
        yield checked("channels_in_place", name, ratio, limits.swapped, says)


def _left(seen: np.ndarray, expected: np.ndarray, used: np.ndarray) -> float:
    """Share of a channel's power that a model leaves."""
    return float(np.sum(np.abs(seen - expected)[used] ** 2) / np.sum(np.abs(seen)[used] ** 2))

"""The size of every channel that a model has to predict beside what its linear part makes of the measured drive."""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..._result import Check
from ...plant import Channel, numbers_of
from ...records import Pieces, Record, UnitFactor, likely_unit, miss, rough_noise, strongest_frequency
from ...structures import Structure
from ..thresholds import THRESHOLDS
from ..verdict.checks import checked
from .linear_run import driven_run

_PIECES = 8
_LEAST_LINES = 3
_AWAY = 3
"""Lines next to zero that a constant reaches through the taper."""
_CLEAR = 50.0
"""Power over noise from which a line takes part."""
_COHERENT = 0.5
"""Coherence over the pieces from which a line tells a ratio."""
_MOST_LINES = 2000
_PERIODS = 4


class Ratio(NamedTuple):
    """A channel over what the model makes of it: by how many times, the spread of that over the lines of the spectrum
    as a logarithm, and the cosine of the phase between them."""

    times: float
    spread: float
    cosine: float


def sizes(record: Record, model: Structure) -> Iterator[Check]:
    """How many times what the model makes every channel shows, and whether two channels stand in each other's place.

    The lines of the spectrum are compared that the drive and the channel share; their median does not mind a resonance
    that is a little elsewhere. A record that nothing drives tells no size, and neither does a linear part that runs
    away.
    """
    if not record.driven or not record.answers or len(record) < 2 * _PIECES * 16:
        return
    made = _made(record, model)
    for channel, (seen, expected) in made.items():
        ratio = ratio_of(seen, expected)
        check = None if ratio is None else _size_check(record, channel, ratio)
        if check is not None:
            yield check
    if record.drive == "force":
        yield from _places(made)


Spectra = Mapping[Channel, tuple[np.ndarray, np.ndarray]]
"""Spectra (pieces, lines) of channels where they are clear of noise, 0 elsewhere, and of what the model makes."""


def _made(record: Record, model: Structure) -> Spectra:
    pieces = _pieces_of(record)
    if record.drive == "motion":
        expected = _needed(record, model, pieces)
    else:
        run = driven_run(model, record)
        expected = {channel: pieces.spectra(y - y.mean()) for channel, y in run.items()}
    found = {}
    for channel, y_model in expected.items():
        y = record.channels[channel]
        seen = pieces.spectra(y - y.mean())
        clear = np.abs(seen) ** 2 > _CLEAR * pieces.noise(rough_noise(y))
        clear[:, :_AWAY] = False
        found[channel] = seen * clear, y_model * clear
    return found


def _pieces_of(record: Record) -> Pieces:
    """Pieces of the later three quarters of a record, in which a start from rest is forgotten."""
    n = len(record)
    begin = 0 if record.drive == "motion" else n // 4
    first = next(iter(record.answers.values()))
    period = 1.0 / (strongest_frequency(first, record.dt) * record.dt)
    length = int(np.clip(round(_PERIODS * period), 32, 2 * (n - begin) // (_PIECES + 1)))
    pieces = Pieces.of(n - begin, min(length, _MOST_LINES), record.dt)
    return Pieces(pieces.starts + begin, pieces.length, record.dt)


def _needed(record: Record, model: Structure, pieces: Pieces) -> dict[Channel, np.ndarray]:
    """Spectra of the forces that the linear part of a model needs along an imposed motion."""
    plant, motion, channels = numbers_of(model), [], record.channels
    for j in range(1, model.dof + 1):
        if ("displacement", j) in channels:
            x = channels["displacement", j]
        elif ("velocity", j) in channels:
            v = channels["velocity", j]
            x = np.cumsum(v - v.mean()) * record.dt
        else:
            return {}
        motion.append(x - x.mean())
    orders = [np.stack([pieces.spectra(x, order) for x in motion]) for order in range(3)]
    matrices = plant.stiffness, plant.damping, plant.mass
    needed = sum(np.einsum("ij,jpl->ipl", np.asarray(m), q) for m, q in zip(matrices, orders, strict=True))
    return {(kind, j): np.asarray(needed)[j - 1] for kind, j in record.channels if kind == "force"}


def ratio_of(seen: np.ndarray, expected: np.ndarray) -> Ratio | None:
    """The ratio of spectra (pieces, lines) over lines that are coherent; None where too few are."""
    power, own = np.sum(np.abs(expected) ** 2, 0), np.sum(np.abs(seen) ** 2, 0)
    many = np.sum(np.abs(seen) > 0, 0) >= _PIECES // 2
    used = (power > 0) & (own > 0) & many
    if np.count_nonzero(used) < _LEAST_LINES:
        return None
    cross = np.sum(seen * expected.conj(), 0)[used]
    coherence = np.abs(cross) ** 2 / (power * own)[used]
    told = coherence > _COHERENT
    if np.count_nonzero(told) < _LEAST_LINES:
        return None
    ratio = cross[told] / power[used][told]
    size = np.log(np.abs(ratio))
    low, middle, high = np.quantile(size, [0.25, 0.5, 0.75])
    return Ratio(float(np.exp(middle)), float(high - low) / 1.35, float(np.median(ratio.real / np.abs(ratio))))


def tolerance(ratio: Ratio, known: UnitFactor, *, imposed: bool) -> float | None:
    """How far a ratio may be from a factor between units, as a logarithm, and be that factor; None where its shape says
    that the model is wrong instead, or says nothing."""
    limits, cosine = THRESHOLDS, abs(ratio.cosine)
    thousands = known.size >= limits.unit_thousand and ratio.times > 1.0 and cosine > limits.unit_follows
    if thousands and not imposed:  # nothing but a unit makes a motion so much larger than a model has it
        return limits.unit_about
    if known.size >= limits.unit_large:
        same = ratio.spread < limits.unit_alike and cosine > 1.0 - limits.unit_alike
        return limits.unit_alike if same else None
    return limits.unit_near if ratio.spread < limits.unit_near and cosine > 1.0 - limits.unit_near else None


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

"""Spectra of measured channels beside those that the linear part of a model makes of what drives it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...plant import Channel, numbers_of
from ...records import Pieces, Record, rough_noise, strongest_frequency
from ...structures import Structure
from .linear_run import driven_run

PIECES = 6
_LEAST_LINES = 3
_AWAY = 3
"""Lines next to zero that a constant reaches through the taper."""
_CLEAR = 50.0
"""Power over noise from which a line takes part."""
_COHERENT = 0.5
"""Coherence over the pieces from which a line tells a ratio."""
_LONGEST = 2000
"""Samples of a piece, at most,"""
_PERIODS = 8
"""and periods of the strongest frequency in it."""


class Ratio(NamedTuple):
    """A channel over what the model makes of it: by how many times, the spread of that over the lines of the spectrum
    as a logarithm, the cosine of the phase between them, and whether the lines lie on both sides of the model's
    lowest mode, so that stiffness and mass both show."""

    times: float
    spread: float
    cosine: float
    wide: bool


Spectra = Mapping[Channel, tuple[np.ndarray, np.ndarray]]
"""Spectra (pieces, lines) of channels where they are clear of noise, 0 elsewhere, and of what the model makes."""


def made(record: Record, model: Structure, pieces: Pieces) -> Spectra:
    """Every channel that the model has to predict, and what its linear part makes of it."""
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


def pieces_of(record: Record) -> Pieces:
    """Pieces of the later three quarters of a record, in which a start from rest is forgotten."""
    n = len(record)
    begin = 0 if record.drive == "motion" else n // 4
    first = next(iter(record.answers.values()))
    period = 1.0 / (strongest_frequency(first, record.dt) * record.dt)
    length = int(np.clip(round(_PERIODS * period), 32, 2 * (n - begin) // (PIECES + 1)))
    pieces = Pieces.of(n - begin, min(length, _LONGEST), record.dt)
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


def ratio_of(seen: np.ndarray, expected: np.ndarray, omega: np.ndarray, mode: float) -> Ratio | None:
    """The ratio of spectra (pieces, lines) over lines `omega` [rad/s] that are coherent; None where too few are.

    `mode` is the lowest natural frequency of the model [rad/s].
    """
    power, own = np.sum(np.abs(expected) ** 2, 0), np.sum(np.abs(seen) ** 2, 0)
    many = np.sum(np.abs(seen) > 0, 0) >= PIECES // 2
    used = (power > 0) & (own > 0) & many
    if np.count_nonzero(used) < _LEAST_LINES:
        return None
    cross = np.sum(seen * expected.conj(), 0)[used]
    coherence = np.abs(cross) ** 2 / (power * own)[used]
    coherent = coherence > _COHERENT
    if np.count_nonzero(coherent) < _LEAST_LINES:
        return None
    ratio = cross[coherent] / power[used][coherent]
    size = np.log(np.abs(ratio))
    low, middle, high = np.quantile(size, [0.25, 0.5, 0.75])
    lines = omega[used][coherent]
    wide = bool(lines.min() < mode < lines.max())
    return Ratio(float(np.exp(middle)), float(high - low) / 1.35, float(np.median(ratio.real / np.abs(ratio))), wide)


def lowest_mode(model: Structure) -> float:
    """The lowest natural frequency of the linear part [rad/s]; 0 without one."""
    plant = numbers_of(model)
    mass, stiffness = np.asarray(plant.mass), np.asarray(plant.stiffness)
    if np.linalg.matrix_rank(mass) < len(mass):
        return 0.0
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    return float(np.sqrt(max(np.min(squares), 0.0)))

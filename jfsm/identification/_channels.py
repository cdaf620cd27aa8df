"""What channels tell before anything is fitted: their noise, which of their samples are readings, and what drives."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..plant import Channel, force_limits, measured_force
from ..records import (
    NoiseFloor,
    Record,
    bridged,
    clipped,
    declipped,
    defects,
    is_constant,
    noise_floor,
    spikes,
    tones,
)
from ..structures import Structure

LEAST_NOISE = 1e-4
"""Noise of a channel as a share of its size, at least: below it the integration error would be taken for physics."""
_BAND_LIMITED = 1e-3
"""Noise of a channel whose signal fills its band, as a share of its size: nothing in it tells."""
_OVERSAMPLED = 3
"""Samples per knot from which a spline's curve may stand for the force: the band above holds noise only."""
_MOSTLY = 0.5
_SAME = 1e-9
"""Rounding, relative."""
_STRETCH = 0.25
"""Share of a channel's samples, one after the other, that are enough to read its noise from."""


Lost = Mapping[tuple[str, int], np.ndarray]
"""Samples (n,) that are no readings, by channel."""


class ChannelReadings(NamedTuple):
    """Readings (n, channels) without spikes, which of them take part, the standard deviation of each channel's noise,
    whether it is trusted, and notes."""

    values: Float[np.ndarray, "n channels"]
    use: Float[np.ndarray, "n channels"]
    floor: Float[np.ndarray, " channels"]
    trusted: Bool[np.ndarray, " channels"]
    notes: list[str]


class Driving(NamedTuple):
    """Samples (n,) of a channel that drives, to run with, and their noise.

    `floor` is the standard deviation with which they were measured; `by_sample` the variance that smoothing leaves in a
    sample, and `in_motion` that of white noise as strong as what it leaves where the structure moves.
    """

    samples: Float[np.ndarray, " n"]
    floor: float
    by_sample: float
    in_motion: float


class Forces(NamedTuple):
    """Force samples (n, dof) to run with, and their noise as in `Driving`, each (dof,)."""

    samples: Float[np.ndarray, "n dof"]
    floor: Float[np.ndarray, " dof"]
    by_sample: Float[np.ndarray, " dof"]
    in_motion: Float[np.ndarray, " dof"]


def readings_of(
    channels: tuple[Channel, ...], values: Float[np.ndarray, "n channels"], dt: float, bridged_at: Lost
) -> ChannelReadings:
    """Readings (n, channels) as a likelihood sees them; those that were bridged take no part."""
    use, floor, trusted = np.ones_like(values), np.zeros(len(channels)), np.zeros(len(channels), dtype=bool)
    values, spread, notes = values.copy(), spread_of(channels, values), []
    for i, (kind, j) in enumerate(channels):
        cut, torn = defects(values[:, i], dt)
        found = _noise_floor(bridged(values[:, i], torn), cut, dt)
        trusted[i] = not found.fills_band
        std = found.std if trusted[i] else min(found.std, _BAND_LIMITED * spread[i])
        floor[i] = max(std, LEAST_NOISE * spread[i])
        torn = spikes(values[:, i], floor[i])
        lost = cut | torn
        use[bridged_at.get((kind, j), ~np.ones_like(lost)), i] = 0.0  # noted when they were bridged
        values[:, i] = bridged(values[:, i], torn)
        if np.any(lost):
            use[lost, i] = 0.0
            notes.append(f"{kind} {j}: {int(lost.sum())} clipped or torn samples take no part.")
    return ChannelReadings(values, use, floor, trusted, notes)


def _noise_floor(samples: np.ndarray, cut: np.ndarray, dt: float) -> NoiseFloor:
    """Noise of a channel, some of whose samples were cut off: the corners that they leave are none.

    It is read from the longest stretch without them; where each is short, from the curve with its arcs put back.
    """
    edges = np.flatnonzero(np.concatenate([[True], cut, [True]]))
    longest = int(np.argmax(np.diff(edges)))
    begin, end = edges[longest], edges[longest + 1] - 1
    if end - begin >= _STRETCH * len(samples):
        return noise_floor(samples[begin:end], dt)
    limit = float(np.max(np.abs(samples[cut])))
    alike = np.mean(cut) < _MOSTLY and np.all(np.abs(samples[cut]) >= limit * (1 - _SAME))
    found = noise_floor(declipped(samples, limit) if alike else samples, dt)
    return replace(found, std=found.std / math.sqrt(1.0 - np.mean(cut)))  # arcs that are put back hold none


def spread_of(channels: tuple[Channel, ...], values: Float[np.ndarray, "n channels"]) -> Float[np.ndarray, " channels"]:
    """Standard deviation of each channel; a dead one is refused."""
    spread = np.std(values, axis=0)
    for (kind, j), y in zip(channels, values.T, strict=True):
        if is_constant(y):
            raise ValueError(
                f"`{kind}` {j} is constant ({y[0]:.4g}): nothing was measured there. Leave a dead channel out of the "
                f"record."
            )
    return spread


def forces(record: Record, model: Structure) -> tuple[Forces, list[str]]:
    """Force samples (n, dof) to run with, and notes."""
    restored, dof, notes = force_limits(model), model.dof, []
    force = measured_force(record, dof, restored)
    std, by_sample, in_motion = np.zeros((3, dof))
    for (kind, j), samples in record.channels.items():
        if kind != "force":
            continue
        if not np.any(force[:, j - 1]):
            if np.any(samples):
                notes.append(f"force {j} holds nothing but noise and counts as zero.")
            continue
        if (kind, j) not in restored and np.any(clipped(samples)):
            notes.append(
                f"force {j} looks clipped; its true peaks are not known, which shows as an unexplained effect."
            )
        force[:, j - 1], std[j - 1], by_sample[j - 1], in_motion[j - 1] = driving(force[:, j - 1], record.dt)
    return Forces(force, std, by_sample, in_motion), notes


def driving(samples: Float[np.ndarray, " n"], dt: float) -> Driving:
    """What drives, as a channel tells it.

    Where it is smooth on its own grid, its noise is smoothed away. A spline leaves all of it in the band of the motion,
    a sum of tones next to nothing. A signal that reaches farther up stays as it was measured; if it fills the band,
    nothing tells its noise, which is taken as a thousandth of it.
    """
    floor = noise_floor(samples, dt)
    full = floor.fills_band or floor.silent
    if full or floor.spacing < _OVERSAMPLED:
        size = float(np.std(samples))
        std = _BAND_LIMITED * size if full else max(floor.std, LEAST_NOISE * size)
        return Driving(samples, std, std**2, std**2)
    few = tones(samples, floor)
    parameters = floor.effective_parameters if few is None else few.parameters
    by_sample = floor.std**2 * parameters / samples.size
    curve, in_motion = (floor.smooth, floor.std**2) if few is None else (few.curve, by_sample)
    return Driving(curve, floor.std, by_sample, in_motion)

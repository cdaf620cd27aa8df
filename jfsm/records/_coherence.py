"""How much of a response follows what drives it, by frequency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._tapers import SHORTEST_PIECE, Pieces, Samples

PIECES = 16  # at least, and so many for each driving channel


@dataclass(frozen=True)
class Coherence:
    """Multiple coherence of a response with all driving channels.

    Attributes
    ----------
    channel : str
    frequency : (m,) float array
        In Hz, where the response stands clear of its noise.
    coherence : (m,) float array
        Share of the response's power that follows linearly, 0 to 1, corrected for the number of pieces.
    mean : float
        The same over all these frequencies, weighted with the power of the response.
    resolution : float
        In Hz; a resonance narrower than this counts as incoherent.
    """

    channel: str
    frequency: NDArray[np.float64]
    coherence: NDArray[np.float64]
    mean: float
    resolution: float


def coherence(channel: str, response: Samples, drives: list[Samples], noise: float, dt: float) -> Coherence | None:
    """Multiple coherence of `response` (n,) with `drives` (n,) each; None if the record is too short for it.

    Parameters
    ----------
    channel : str
        What the response is called.
    response : (n,) float array
    drives : list of (n,) float arrays
    noise : float
        Noise of the response, in its unit.
    dt : float
        Sampling interval [s].
    """
    count = PIECES * len(drives)
    length = 2 * response.size // (count + 1)
    if length < SHORTEST_PIECE:
        return None
    pieces = Pieces.of(response.size, length, dt)
    y = pieces.spectra(response - response.mean())
    u = np.stack([pieces.spectra(drive - drive.mean()) for drive in drives], axis=-1)
    power = np.mean(np.abs(y) ** 2, axis=0)
    clear = power > 10.0 * pieces.noise(noise)
    clear[:3] = False
    if not clear.any():
        return None
    u, y = u[:, clear].transpose(1, 0, 2), y[:, clear].T[..., None]
    left = y - u @ np.linalg.pinv(u) @ y
    freedom = y.shape[1] / (y.shape[1] - len(drives))
    share = np.clip(1.0 - freedom * np.sum(np.abs(left) ** 2, axis=(1, 2)) / np.sum(np.abs(y) ** 2, axis=(1, 2)), 0, 1)
    weight = power[clear]
    return Coherence(
        channel,
        pieces.omega[clear] / (2.0 * np.pi),
        share,
        float(weight @ share / weight.sum()),
        3.0 / (length * dt),  # half the main lobe of the taper
    )

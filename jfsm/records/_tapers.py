"""Spectra of pieces of a channel and of its derivatives, without differentiating a sample and without leakage."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]
Spectra = NDArray[np.complex128]

SHORTEST_PIECE = 32  # samples; the taper leaves few lines of a shorter one


@dataclass(frozen=True)
class Pieces:
    """Overlapping pieces of a record, each under the taper sin⁴.

    Attributes
    ----------
    starts : (pieces,) int array
        First sample of each piece.
    length : int
        Samples in a piece.
    dt : float
        Sampling interval [s].
    late : float
        Samples, less than one, by which the taper stands later than the piece.

    Notes
    -----
    The taper w and its first three derivatives vanish at the ends of a piece. Hence, by parts,
    ∫ w e^(−iωt) y' dt = −∫ (w e^(−iωt))' y dt, exactly and at every ω: derivatives move from the channel to the taper,
    and neither the ends of the piece nor leakage stand between a displacement and its acceleration.
    """

    starts: NDArray[np.int64]
    length: int
    dt: float
    late: float = 0.0

    @classmethod
    def of(cls, n: int, length: int, dt: float) -> "Pieces":
        """Pieces of `length` of `n` samples, half of each in the next."""
        count = max(1, 1 + 2 * (n - length) // length)
        return cls(np.linspace(0, n - length, count).astype(int), length, dt)

    def only(self, chosen: NDArray[np.bool_]) -> "Pieces":
        """Those of the pieces that are chosen (pieces,)."""
        return replace(self, starts=self.starts[chosen])

    @property
    def omega(self) -> Samples:
        """(frequencies,) from 0 to the band limit [rad/s]."""
        return np.asarray(2.0 * np.pi * np.fft.rfftfreq(self.length, self.dt), dtype=np.float64)

    @property
    def taper(self) -> tuple[Samples, Samples, Samples]:
        """sin⁴ and its first and second derivative by time, (length,) each."""
        turn = 2.0 * np.pi / self.length
        angle, rate = turn * (np.arange(self.length) - self.late), turn / self.dt
        return (
            0.375 - 0.5 * np.cos(angle) + 0.125 * np.cos(2 * angle),
            rate * (0.5 * np.sin(angle) - 0.25 * np.sin(2 * angle)),
            rate**2 * (0.5 * np.cos(angle) - 0.5 * np.cos(2 * angle)),
        )

    def cut(self, y: NDArray) -> NDArray:
        """(pieces, length) of a channel (n,)."""
        return y[self.starts[:, None] + np.arange(self.length)]

    def spectra(self, y: Samples, order: int = 0) -> Spectra:
        """(pieces, frequencies) tapered spectra of the derivative of `y` of this order, 0 to 2, unit s^(1 − order)."""
        pieces, omega = self.cut(y), self.omega
        w, w1, w2 = (self.dt * np.fft.rfft(taper * pieces) for taper in self.taper)
        match order:
            case 0:
                return w
            case 1:
                return 1j * omega * w - w1
            case _:
                return w2 - 2j * omega * w1 - omega**2 * w

    def noise(self, std: float, order: int = 0) -> Samples:
        """(frequencies,) expected squared modulus of those spectra for white noise of this standard deviation."""
        (w, w1, w2), omega2 = self.taper, self.omega**2
        match order:
            case 0:
                gain = np.full(omega2.size, w @ w)
            case 1:
                gain = omega2 * (w @ w) + w1 @ w1
            case _:
                gain = w2 @ w2 + omega2 * (4 * (w1 @ w1) - 2 * (w2 @ w)) + omega2**2 * (w @ w)
        return (std * self.dt) ** 2 * gain

    def density(self, power: Samples) -> Samples:
        """(frequencies,) one-sided power spectral density [unit²/Hz] of a channel whose spectra have this power."""
        return 2.0 * self.dt * power / self.noise(1.0)

"""Free vibration of the undamped structure, followed along its curve of amplitude."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._programs import programs_kept
from .._result import Result
from .._types import as_array, require_x64
from ..structures import Structure, as_model
from ._field import Field, autonomous_field
from ._harmonic_balance import FreeBalance, check_positive, displacement, solve
from ._linearise import linearise_field
from ._simulate import with_tables


@dataclass(frozen=True, repr=False)
class Backbone:
    """Free periodic motion of the undamped structure in one of its modes.

    Attributes
    ----------
    frequency : (points,) array
        ω [rad/s].
    amplitude : (points,) array
        Half the distance between the turning points of the degree of freedom asked for [m].
    coefficients : (points, harmonics + 1, dof) array
        Mean, then cosines [m]: the motion begins at a turning point.
    result : Result
        Whether all amplitudes were reached.
    """

    frequency: Float[np.ndarray, " points"]
    amplitude: Float[np.ndarray, " points"]
    coefficients: Float[np.ndarray, "points harmonics dof"]
    result: Result

    def __repr__(self) -> str:
        first, last = (self.frequency[[0, -1]] / (2 * np.pi)).tolist() if self.frequency.size else (np.nan, np.nan)
        return f"<Backbone, {self.frequency.size} points from {first:.4g} to {last:.4g} Hz>"

    def plot(self, ax: Any = None) -> Any:
        """Amplitude [m] over frequency [Hz].

        Parameters
        ----------
        ax : matplotlib axes, optional
            A new figure without them.

        Returns
        -------
        matplotlib axes
        """
        from ..reporting import Line, PanelOf, draw_panels

        line = Line("", self.frequency / (2 * np.pi), self.amplitude)
        return draw_panels([PanelOf("frequency [Hz]", "amplitude [m]", [line])], ax)

    def to_dataframe(self) -> Any:
        """The curve as a DataFrame of pandas, which must be installed: frequency [Hz] and amplitude [m]."""
        import pandas as pd

        return pd.DataFrame({"frequency_hz": self.frequency / (2 * np.pi), "amplitude": self.amplitude})


@programs_kept()
def backbone(
    model: Structure, amplitudes: Any, at: int = 1, mode: int = 1, harmonics: int = 7, *, around: Any = None
) -> Backbone:
    """Frequency of free vibration in one mode against its amplitude (a nonlinear normal mode).

    Parameters
    ----------
    model : Structure
        Smooth and independent of time. Its forces at rest count, f(x, 0): what depends on velocity is left out.
    amplitudes : (points,) array
        Ascending and positive: half the distance between the turning points of degree of freedom `at` [m].
    at : int
        Degree of freedom whose amplitude is meant, counted from 1.
    mode : int
        Mode that the curve begins in at small amplitude, counted from 1 by frequency.
    harmonics : int
        Number of harmonics beside the mean.
    around : (dof,) array, optional
        Stable displacement about which to vibrate [m]; the origin when None.

    Returns
    -------
    Backbone
        Up to the amplitude where the curve could not be followed further, which `result` tells: there it may turn back
        in amplitude, as at an internal resonance.

    Raises
    ------
    ValueError
        If a term sticks or depends on time, a mass is zero, an argument is out of its range, or the mode does not
        oscillate.
    """
    require_x64()
    as_model(model)
    check_positive(harmonics=harmonics)
    sizes = as_array(amplitudes, "amplitudes", 1)
    if not sizes.size or np.any(np.diff(sizes) <= 0) or sizes[0] <= 0:
        raise ValueError(f"`amplitudes` must be positive and ascend; got {sizes.tolist()}.")
    for name, number in (("at", at), ("mode", mode)):
        if not 1 <= number <= model.dof:
            raise ValueError(f"`{name}` must be a degree of freedom from 1 to {model.dof}; got {number}.")
    system = autonomous_field(with_tables(model))
    rest = displacement(around, model.dof)
    omega, shape = _mode(system, rest, mode)
    if abs(shape[at - 1]) < 1e-9 * np.max(np.abs(shape)):
        raise ValueError(f"`at` must move in the mode; degree of freedom {at} stands still in mode {mode}.")
    length = float(sizes[0])
    balance = FreeBalance(
        system, harmonics, jnp.asarray(length), jnp.asarray(omega), jnp.max(jnp.abs(system.mass)) * omega**2 * length
    )
    begin = np.zeros((harmonics + 1, model.dof))
    begin[0], begin[1] = rest / length, shape / shape[at - 1]
    row = np.zeros_like(begin)
    row[1::2, at - 1] = 1.0
    row = np.append(row, 0.0)
    points: list[np.ndarray] = []
    for point in _rising(balance, np.append(begin, 1.0), row, sizes / length):
        points.append(point)
    found = np.array(points).reshape(-1, row.size)
    return Backbone(
        frequency=omega * found[:, -1],
        amplitude=sizes[: len(found)],
        coefficients=length * found[:, :-1].reshape(len(found), -1, model.dof),
        result=Result.successful if len(found) == len(sizes) else Result.unfinished,
    )


def _mode(system: Field, rest: np.ndarray, mode: int) -> tuple[float, np.ndarray]:
    """Frequency and shape of a mode of the undamped structure for small motion."""
    linear = linearise_field(system, np.append(rest, 0.0 * rest))
    squares, shapes = np.linalg.eig(np.linalg.solve(linear.mass, linear.stiffness))
    place = np.argsort(np.real(squares))[mode - 1]
    square = complex(squares[place])
    if abs(square.imag) > 1e-9 * abs(square) or square.real <= 0:
        raise ValueError(
            f"`mode` must oscillate for small motion; mode {mode} has ω² = {square.real:.6g}. "
            "Say by `around` about which stable point of rest to vibrate."
        )
    return math.sqrt(square.real), np.real(shapes[:, place])


def _rising(balance: FreeBalance, guess: np.ndarray, row: np.ndarray, sizes: np.ndarray) -> Iterator[np.ndarray]:
    """The motion at each amplitude, reached from a small one in steps as long as Newton's method allows."""
    rest = guess.copy()
    rest[balance.system.dof : -1] = 0.0
    amplitude = 1e-3 * float(sizes[0])
    here = solve(balance, rest + amplitude * (guess - rest), row, amplitude)
    ratio = 2.0
    for size in sizes:
        while here.ok and amplitude < size:
            ahead = min(size, amplitude * ratio)
            there = solve(balance, here.q + (ahead - amplitude) * here.tangent, row, ahead)
            if there.easy:
                here, amplitude, ratio = there, ahead, min(2.0, ratio * 1.2)
            elif ratio < 1.0 + 1e-4:
                return
            else:
                ratio = math.sqrt(ratio)
        if not here.ok:
            return
        yield here.q

"""Masses, springs and dashpots that answer a run roughly as it did: where a fit may begin of which nothing is known."""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.optimize import nnls
from scipy.signal import get_window

from ..plant import direction
from ..records import Record
from ..structures import LinearDamping, LinearStiffness, Structure

_BLANK = 1e-4
"""Share of a channel's largest power below which a frequency says nothing of it."""
_LEAST_DAMPING = 1e-3
"""Dashpot beside every spring, at least, as a share of its force: a window hides the decay of a free motion."""
_SLIGHT = 1e-3
"""Share of the forces in all links below which one is left out."""
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


class _Lines(NamedTuple):
    """Spectral lines of a run: circular frequencies, motion and forces of every degree of freedom, and the base's
    acceleration; `middle` is the circular frequency of most of the motion."""

    omega: Float[np.ndarray, " lines"]
    motion: Complex[np.ndarray, "lines dof"]
    force: Complex[np.ndarray, "lines dof"]
    base: Complex[np.ndarray, " lines"]
    middle: float


def rough_model(runs: Sequence[Record]) -> Structure:
    """Masses, and springs and dashpots between all of them and to the ground, none negative, by least squares over the
    spectra of runs in which every degree of freedom is seen.

    Where the motion is imposed there are no masses; where no force was recorded the first mass is 1.

    Raises
    ------
    ValueError
        If a degree of freedom is seen by no channel.
    """
    lines = [_lines_of(run) for run in runs]
    dof, imposed = lines[0].motion.shape[1], runs[0].drive == "motion"
    pairs = list(combinations(range(dof + 1), 2))
    columns = np.concatenate([_columns(one, pairs).reshape(dof + 2 * len(pairs), -1) for one in lines], 1).T
    wanted = np.concatenate([one.force.ravel() for one in lines])
    fixed = np.zeros(dof)
    if imposed:
        columns[:, :dof] = 0.0
    elif not np.any(wanted):
        fixed[0], wanted = 1.0, -columns[:, 0]
        columns = np.concatenate([np.zeros_like(columns[:, :1]), columns[:, 1:]], 1)
    sizes = _positive(columns, wanted)
    springs, dashpots = np.split(sizes[dof:], 2)
    dashpots = np.maximum(dashpots, _LEAST_DAMPING * springs / lines[0].middle)
    force = np.sqrt(np.mean(np.abs(columns[:, dof:]) ** 2, 0)) * np.concatenate([springs, dashpots])
    linked = [k for k in range(len(pairs)) if max(force[k], force[k + len(pairs)]) > _SLIGHT * np.max(force)]
    terms = [LinearStiffness(springs[k], at=pairs[k]) for k in linked if springs[k] > 0]
    terms += [LinearDamping(dashpots[k], at=pairs[k]) for k in linked if dashpots[k] > 0]
    masses = sizes[:dof] + fixed
    if not imposed:
        masses = np.maximum(masses, _SLIGHT * np.max(masses))
    return Structure(masses, terms)


def _positive(columns: Complex[np.ndarray, "lines off"], wanted: Complex[np.ndarray, " lines"]) -> np.ndarray:
    """Sizes, none negative, with which columns make what is wanted."""
    both, right = (np.concatenate([np.real(y), np.imag(y)]) for y in (columns, wanted))
    scale = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    return nnls(both / scale, right)[0] / scale


def _columns(lines: _Lines, pairs: Sequence[tuple[int, int]]) -> Complex[np.ndarray, "off lines dof"]:
    """Forces of unit masses, springs and dashpots on every degree of freedom.

    In the size of displacements, so that frequencies far above the motion's own count for no more than they move.
    """
    omega, motion = lines.omega[:, None], lines.motion
    dof = motion.shape[1]
    inertia = lines.base[:, None] - omega**2 * motion
    masses = [inertia * (np.arange(dof) == j) for j in range(dof)]
    springs = [(motion @ row)[:, None] * row for row in (direction(at, dof) for at in pairs)]
    return np.array([*masses, *springs, *(1j * omega * spring for spring in springs)])


def _lines_of(run: Record) -> _Lines:
    window, dof = get_window("hann", len(run)), run.dofs
    omega = 2 * np.pi * np.fft.rfftfreq(len(run), run.dt)[1:]

    def spectrum(samples) -> np.ndarray:
        samples = np.asarray(samples)
        return np.fft.rfft(window * (samples - np.mean(samples)))[1:]

    base = np.zeros_like(omega) + 0j if run.base_acceleration is None else spectrum(run.base_acceleration)
    force = np.zeros((omega.size, dof), complex)
    for (kind, j), samples in run.channels.items():
        if kind == "force":
            force[:, j - 1] = spectrum(samples)
    motion, heard = np.zeros_like(force), np.zeros(omega.size, bool)
    for j in range(1, dof + 1):
        order, kind = _lowest(run, j)
        seen = spectrum(run.channels[kind, j])
        heard |= np.abs(seen) ** 2 > _BLANK * np.max(np.abs(seen) ** 2)
        motion[:, j - 1] = (seen - base if order == 2 else seen) / (1j * omega) ** order
    omega, motion, force, base = omega[heard], motion[heard], force[heard], base[heard]
    power = np.sum(np.abs(motion) ** 2, 1)
    middle = np.sum(power * omega**2) / np.sum(power)
    weight = 1.0 / (middle + omega**2)
    return _Lines(omega, motion * weight[:, None], force * weight[:, None], base * weight, math.sqrt(middle))


def _lowest(run: Record, j: int) -> tuple[int, str]:
    """The kind of channel of the lowest derivative that sees a degree of freedom, and its order."""
    seen = sorted((_ORDER[kind], kind) for kind, number in run.responses if number == j)
    if not seen:
        raise ValueError(
            f"`simulated` shows nothing of degree of freedom {j}. Give `model` too, with the masses and the links that "
            "the simulation has; their values need not be right."
        )
    return seen[0]

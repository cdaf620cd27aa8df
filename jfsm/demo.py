"""What the demonstration shows: a record that hides dry friction, or a measured one, each with a linear belief.

The made-up record owes nothing to jfsm's own dynamics: SciPy integrates it, from one instant of sticking or slipping to
the next.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.integrate import solve_ivp
from scipy.signal import csd, welch

from .identification import fit
from .records import Record
from .structures import Structure

MASS, STIFFNESS, DAMPING, FRICTION = 1.5, 2400.0, 2.4, 8.0  # kg, N/m, N s/m, N
FORCE = 20.0  # N, root mean square
RATE, SAMPLES = 200.0, 3000  # Hz; 31 samples per natural period
NOISE = 0.01  # of each channel's standard deviation
BELIEVED_STIFFNESS, BELIEVED_DAMPING = 1.02, 0.85  # as shares of the truth

_TOLERANCE = 1e-10
_HELD_OUT = 0.25
_PERIODS = 20
"""Periods in a segment of the averaged frequency response, at least: a resonance of 5 % is three lines wide then."""


@dataclass(frozen=True)
class Demonstration:
    """A record, the model that is believed, what is held out, and both in words; `hidden` is told after the verdict."""

    record: Record
    model: Structure
    holdout: float | Record
    introduction: str
    hidden: str | None = None


@dataclass(frozen=True)
class Multisine:
    """Force g(t) = Σ amplitude·cos(omega t + phase) [N]; `omega` (lines,) [rad/s], `phase` (lines,) [rad]."""

    amplitude: float
    omega: Float[np.ndarray, " lines"]
    phase: Float[np.ndarray, " lines"]

    def __call__(self, t: float) -> float:
        return self.amplitude * float(np.sum(np.cos(self.omega * t + self.phase)))


def hidden_friction(seed: int = 0, samples: int = SAMPLES) -> Demonstration:
    """A mass on a spring that also rubs, measured with noise on every channel, and the model without the rubbing.

    Parameters
    ----------
    seed : int
        Source of the force's phases and of the noise.
    samples : int

    Returns
    -------
    Demonstration
        Force, displacement, velocity and acceleration of one degree of freedom; the last 30 % are held out.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / RATE
    lines = 2 * math.pi * np.linspace(1.5, 15.0, 40)
    drive = Multisine(FORCE * math.sqrt(2 / lines.size), lines, rng.uniform(0.0, 2 * math.pi, lines.size))
    noisy: dict[str, Any] = {
        kind: y + NOISE * np.std(y) * rng.standard_normal(samples) for kind, y in _rub(drive, time).items()
    }
    return Demonstration(
        record=Record(time, **noisy, at_rest=True, name="Demonstration"),
        model=Structure.sdof(MASS, BELIEVED_STIFFNESS * STIFFNESS, BELIEVED_DAMPING * DAMPING),
        holdout=0.3,
        introduction=(
            f"A made-up record: one mass under a random force, {samples} samples at {RATE:g} Hz, {NOISE:.0%} noise on "
            f"force, displacement, velocity and acceleration. Its owner believes in a linear spring and dashpot, whose "
            f"values are not quite right either. Something else was hidden in it."
        ),
        hidden=(
            f"What had been hidden: Coulomb friction of {FRICTION:g} N, stiffness believed "
            f"{BELIEVED_STIFFNESS - 1:+.0%} and damping {BELIEVED_DAMPING - 1:+.0%} off."
        ),
    )


def _rub(drive: Multisine, time: Float[np.ndarray, " n"]) -> dict[str, Float[np.ndarray, " n"]]:
    """Force, and motion from rest, on `time`.

    One smooth piece follows another: the mass is held (0), or slips forward (1) or backward (-1).
    """
    slack = _TOLERANCE * FORCE / math.sqrt(STIFFNESS * MASS)  # m/s: a slip is not over at the instant it begins

    def load(t: float, x: float) -> float:
        return drive(t) - STIFFNESS * x

    def piece(t: float, x: float, way: int):
        def rate(t, state):
            return [state[1], way and (load(t, state[0]) - DAMPING * state[1] - way * FRICTION) / MASS]

        def end(t, state):
            return way * state[1] + slack if way else FRICTION - abs(load(t, state[0]))

        end.terminal, end.direction = True, -1
        # No step is longer than a sample: two changes of the load within one would go unseen.
        return solve_ivp(
            rate, (t, time[-1]), [x, 0.0], "DOP853", dense_output=True, events=end,
            rtol=_TOLERANCE, atol=_TOLERANCE * FORCE / STIFFNESS, max_step=1 / RATE,
        )  # fmt: skip

    force = np.array([drive(t) for t in time])
    state, acceleration = np.zeros((2, time.size)), np.zeros(time.size)
    t, x, released = float(time[0]), 0.0, False
    while t < time[-1]:
        # At rest the load decides: the mass is held where it is, or goes the way that it is pushed.
        pushed = load(t, x)
        way = int(np.sign(pushed)) if released or abs(pushed) > FRICTION else 0
        found = piece(t, x, way)
        inside = (time >= t) & (time <= found.t[-1])
        if np.any(inside):
            state[:, inside] = found.sol(time[inside])
            x_now, v_now = state[:, inside]
            pull = force[inside] - STIFFNESS * x_now - DAMPING * v_now - way * FRICTION
            acceleration[inside] = abs(way) * pull / MASS
        t, x, released = float(found.t[-1]), float(found.y[0, -1]), way == 0
    return {"force": force, "displacement": state[0], "velocity": state[1], "acceleration": acceleration}


def measured(record: Record, *, most: int = 20_000) -> Demonstration:
    """The first samples of a measured record, its last quarter held out, and the linear model that fits them best.

    Parameters
    ----------
    record : Record
        One force and one displacement.
    most : int
        Samples to be diagnosed, at most.

    Returns
    -------
    Demonstration

    Raises
    ------
    ValueError
        If the record shows no resonance.
    """
    held = math.ceil(_HELD_OUT * len(record))
    seen, unseen = record[: min(most, len(record) - held)], record[len(record) - held :]
    linear = fit(first_guess(seen), seen).structure
    return Demonstration(
        record=seen,
        model=linear,
        holdout=unseen,
        introduction=(
            f"A measured record: {record.name}, force in {record.units['force']}, displacement in "
            f"{record.units['displacement']}. Its first {len(seen)} samples are diagnosed, its last {len(unseen)} held "
            f"out. The model that is believed is the best linear one: mass, stiffness and damping fitted to the same "
            f"{len(seen)} samples, from a first guess off their frequency response."
        ),
    )


def first_guess(record: Record) -> Structure:
    """Mass, spring and dashpot from the frequency response of displacement 1 to force 1, about its peak.

    Least squares of :math:`H(\\omega)(k - m\\omega^2 + i c\\omega) = 1` from half to twice the frequency of the peak,
    H by averaged spectra (the H1 estimate: the response's cross spectrum over the force's power).

    Raises
    ------
    ValueError
        If the record has no force 1 or displacement 1, or its response has no peak that a mass on a spring would make.
    """
    channels = record.channels
    for channel in (("force", 1), ("displacement", 1)):
        if channel not in channels:
            held = ", ".join(f"{kind} {dof}" for kind, dof in channels) or "nothing"
            raise ValueError(f"`record` must hold {channel[0]} {channel[1]}; it holds {held}.")
    g, x = channels["force", 1], channels["displacement", 1]
    length = len(record) // 4  # seven segments that overlap by half: as fine as a first look can be averaged
    for _ in range(2):
        frequency, power = welch(g, record.sample_rate, nperseg=length)
        _, cross = csd(g, x, record.sample_rate, nperseg=length)
        driven = (power > 1e-3 * np.max(power)) & (frequency > 0)
        response = np.where(driven, cross / np.where(driven, power, 1.0), 0.0)
        peak = frequency[int(np.argmax(np.abs(response)))]
        length = min(length, math.ceil(_PERIODS * record.sample_rate / peak)) if peak > 0 else length
    band = driven & (frequency > peak / 2) & (frequency < 2 * peak)
    h, omega = response[band], 2 * math.pi * frequency[band]
    columns = np.column_stack([-(omega**2) * h, h, 1j * omega * h])
    size = np.linalg.norm(columns, axis=0)
    mass, stiffness, damping = (
        np.linalg.lstsq(
            np.concatenate([columns.real, columns.imag]) / size,
            np.concatenate([np.ones(h.size), np.zeros(h.size)]),
            rcond=None,
        )[0]
        / size
    )
    if h.size < 3 or min(mass, stiffness, damping) <= 0:
        raise ValueError(
            f"`record` must show a resonance of one mass on a spring between force 1 and displacement 1; about the "
            f"peak of its frequency response at {peak:.4g} Hz a fit gives mass {mass:.4g}, stiffness {stiffness:.4g}, "
            f"damping {damping:.4g}. Check which channel is which."
        )
    return Structure.sdof(mass, stiffness, damping)

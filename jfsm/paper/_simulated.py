"""The paper's records: structures of `jfsm.systems` under its drives, at its sample rates, from rest.

The force state map is made of x, v and g - M a (2), (80). The simulated acceleration obeys the equation of motion at
every sample, so these readings lie on the true map to rounding, however well the motion itself is integrated.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.linalg import eigh

from ..dynamics import simulate
from ..estimation import Motion, estimate_motion
from ..plant import lower
from ..records import Record
from ..structures import Structure
from ..surrogates import AbstractForceStateMap
from ..systems import ALL

FORCE, HARMONICS = 10.0, 15
"""P [N] and the number of harmonics of (78)."""
LANES = 1024
"""States that are evaluated together, at least."""
MOTION = "displacement", "velocity", "acceleration"


@dataclass(frozen=True)
class Run:
    """A structure and a record of all its channels.

    Attributes
    ----------
    structure : Structure
    record : Record
        Force, displacement, velocity and acceleration of every degree of freedom.
    """

    structure: Structure
    record: Record

    @cached_property
    def states(self) -> Float[np.ndarray, "n dim"]:
        """Columns x1…xd [m], v1…vd [m/s]."""
        return np.concatenate([_samples(self.record, kind) for kind in MOTION[:2]], axis=1)

    @cached_property
    def force(self) -> Float[np.ndarray, "n dof"]:
        """Restoring force g - M a [N], (2) and (80)."""
        mass = np.asarray(lower(self.structure).mass)
        return _samples(self.record, "force") - _samples(self.record, "acceleration") @ mass.T

    @cached_property
    def moving(self) -> np.ndarray:
        """(n,) whether the first mass moves: where dry friction holds it, its force is any."""
        return self.states[:, self.structure.dof] != 0.0

    @cached_property
    def motion(self) -> Motion:
        """The motion as it is estimated from all channels."""
        return estimate_motion(self.record)

    def noisy(self, level: float, rng: np.random.Generator) -> "Run":
        """The same run with white noise on every channel, `level` of its largest value each, as in section 5."""
        noisy: dict[str, Any] = {}
        for kind in ("force", *MOTION):
            y = _samples(self.record, kind)
            noisy[kind] = y + level * np.max(np.abs(y), axis=0) * rng.standard_normal(y.shape)
        return replace(self, record=Record(self.record.time, **noisy))

    def true_force(self, states: Float[np.ndarray, "q 2"]) -> Float[np.ndarray, " q"]:
        """Restoring force [N] of a structure of one degree of freedom without memory, at any states."""
        return np.asarray(_forces(self.structure, jnp.asarray(states)))

    def visited_cells(self, cells: int = 30) -> Float[np.ndarray, "q 2"]:
        """Centres of those of `cells` × `cells` equal cells over the box that hold a state."""
        low, high = self.states.min(axis=0), self.states.max(axis=0)
        place = np.minimum(((self.states - low) / (high - low) * cells).astype(int), cells - 1)
        return low + (np.unique(place, axis=0) + 0.5) / cells * (high - low)

    def error_of(self, force_map: AbstractForceStateMap, states: Float[np.ndarray, "q 2"]) -> float:
        """Root mean square error of a map at `states`, relative to the standard deviation of the true force there."""
        count = len(states)
        states = np.resize(states, (max(LANES, 1 << (count - 1).bit_length()), 2))  # repeated: few compiled programs
        truth = self.true_force(states)[:count]
        return float(np.sqrt(np.mean((np.asarray(force_map.evaluate(states))[:count] - truth) ** 2)) / np.std(truth))


def oscillator(structure: Structure | str, seed: int = 0, duration: float = 15.0) -> Run:
    """A case of section 4.0: drive (78) with ω₀ = 2.4 rad/s, steps 2π/(80·3 rad/s).

    The length is not printed; 15 s are those of sections 4.1 and 4.2. a_s and b_s are drawn anew for every `seed`.
    """
    time = _clock(duration, 80, 3.0)
    return _run(structure, time, multisine(time, 2.4, np.random.default_rng(seed))[:, None])


@cache
def noisy_oscillator(name: str, seed: int, level: float) -> Run:
    """An oscillator of `jfsm.systems` with noise on every channel, the same in every section that asks for it."""
    return oscillator(name, seed).noisy(level, np.random.default_rng([seed, round(1e6 * level)]))


def driven_frame() -> Run:
    """Section 4.1: base motion 1 mm·cos λt in z, λ = 2π·5.86 Hz, steps 2π/(80 ω₃), 15 s."""
    omega = 2 * np.pi * 5.86
    time = _clock(15.0, 80, natural_frequencies(ALL["frame"]())[-1])
    force = np.zeros((time.size, 3))
    force[:, 0] = np.asarray(lower(ALL["frame"]()).mass)[0, 0] * 1e-3 * omega**2 * np.cos(omega * time)  # -m ẍ_s
    return _run("frame", time, force)


def chain(structure: Structure | str, seed: int = 0) -> Run:
    """Sections 4.2 and 4.4: drives (78) on both masses, ω₀ = 0.1 ω₁, steps 2π/(80 ω₂), 15 s."""
    first, second = natural_frequencies(ALL["cubic_chain"]())
    time, rng = _clock(15.0, 80, second), np.random.default_rng(seed)
    return _run(structure, time, np.stack([multisine(time, 0.1 * first, rng) for _ in range(2)], axis=1))


def rough_oscillator(name: str) -> Run:
    """Section 4.3: drive 10 N·cos λt, λ = 2π·5.86 Hz, steps 2π/(200 ω) with ω = √(k/m), 10 s."""
    time = _clock(10.0, 200, np.sqrt(2500.0 / 1.77))
    return _run(name, time, 10.0 * np.cos(2 * np.pi * 5.86 * time)[:, None])


def multisine(time: Float[np.ndarray, " n"], omega: float, rng: np.random.Generator) -> Float[np.ndarray, " n"]:
    """Drive [N] of (78) with standard normal a_s, b_s; the paper's own draws are not printed."""
    angle = np.outer(time, omega * np.arange(1, HARMONICS + 1))
    a, b = rng.standard_normal((2, HARMONICS))
    return FORCE * (np.cos(angle) @ a + np.sin(angle) @ b)


def natural_frequencies(structure: Structure) -> Float[np.ndarray, " dof"]:
    """Of the linear part [rad/s], rising."""
    plant = lower(structure)
    return np.sqrt(eigh(np.asarray(plant.stiffness), np.asarray(plant.mass), eigvals_only=True))


@eqx.filter_jit
def _forces(structure: Structure, states: Float[Array, "q 2"]) -> Float[Array, " q"]:
    def one(x, v):
        return sum((term.force(x, v, None, jnp.zeros(())) for term in structure.terms), jnp.zeros(()))

    return jax.vmap(one)(*states.T)


def _clock(duration: float, per_period: int, omega: float) -> np.ndarray:
    step = 2 * np.pi / (per_period * omega)
    return step * np.arange(int(duration / step) + 1)


def _run(structure: Structure | str, time: np.ndarray, force: Float[np.ndarray, "n dof"]) -> Run:
    structure = ALL[structure]() if isinstance(structure, str) else structure
    found = simulate(structure, Record(time, force=force, at_rest=True))
    motion: dict[str, Any] = {kind: getattr(found, kind) for kind in MOTION}
    return Run(structure, Record(time, force=force, **motion, at_rest=True))


def _samples(record: Record, kind: str) -> Float[np.ndarray, "n dof"]:
    return np.asarray(getattr(record, kind))

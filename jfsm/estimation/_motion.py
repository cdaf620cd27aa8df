"""Displacement, velocity and acceleration from whatever was measured of them, and the force that a structure lacks.

The smoother of paper eqs. 70-71 drives a double integrator by one measured acceleration. Here every channel is a
reading, and the motion is that of a resonator with a random force, as a structure's is, so that a channel that is
missing can be told from the others. All its numbers (stiffness, damping, how the measured force enters, size and memory
of the random force, noise of each channel) are the most probable ones of the record.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from .._programs import programs_kept
from .._threads import small_matrices
from .._types import require_x64
from ..plant import check_pair, direction, lower
from ..records import Record, as_record, mended
from ..structures import LinearDamping, LinearStiffness, Structure, as_model, check_order, check_places
from ._learning import Learned, learned, smoothed
from ._missing import less_known
from ._observable import Place, require_apart, require_seen
from ._part import Part, levers

_SHORTEST = 32
_COARSE, _FAR_BEYOND = 128, 3.0  # places at which the drift of integrated noise is reckoned; how many times of it
_STRANGE = 5.0
"""Standard errors from which a spike is no part of the motion."""


@dataclass(frozen=True)
class Motion:
    """Smoothed motion of a record, with its error.

    Attributes
    ----------
    time : (n,) array
        Instants [s].
    displacement, velocity, acceleration : (n, dof) arrays
        Displacement and velocity relative to the base, acceleration absolute, as in the record.
    covariance : (n, dof, 3, 3) array
        Of (displacement, velocity, acceleration) of each degree of freedom.
    noise : dict of kind to (measured dofs,) array
        Standard deviation of the white noise of each channel.
    bias : dict of (kind, dof) to float
        What a velocity or an acceleration channel shows beside the motion, in the mean.
    drift, drift_std : dict of (kind, dof) to (n,) array
        How that differs from its mean over time, and its standard error; channels that drift only.
    places : tuple of links
        Where a force that nothing measures may act; empty without a model.
    latent_force, latent_force_std : (n, places) arrays, or None without a model
        Force that acts there beside all that the model has and the record measured, and its standard error, in the
        record's unit (N). It stands on the left-hand side, restoring side positive: an unmeasured load has its
        opposite sign.
    notes : tuple of str
        What the channels cannot tell, and the error bars therefore do not hold.
    """

    time: Float[np.ndarray, " n"]
    displacement: Float[np.ndarray, "n dof"]
    velocity: Float[np.ndarray, "n dof"]
    acceleration: Float[np.ndarray, "n dof"]
    covariance: Float[np.ndarray, "n dof 3 3"]
    noise: dict[str, Float[np.ndarray, " _"]]
    bias: dict[tuple[str, int], float]
    drift: dict[tuple[str, int], Float[np.ndarray, " n"]]
    drift_std: dict[tuple[str, int], Float[np.ndarray, " n"]]
    places: tuple[Place, ...] = ()
    latent_force: Float[np.ndarray, "n places"] | None = None
    latent_force_std: Float[np.ndarray, "n places"] | None = None
    notes: tuple[str, ...] = ()

    @property
    def std(self) -> Float[np.ndarray, "n dof 3"]:
        """Standard error (n, dof, 3) of displacement, velocity and acceleration."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=2, axis2=3), 0.0))


@programs_kept()
@small_matrices()
def estimate_motion(
    record: Record, model: Structure | None = None, places: Sequence[tuple[int, int]] | None = None
) -> Motion:
    """Displacement, velocity and acceleration at every sample, from any mix of them, with their covariance.

    Parameters
    ----------
    record : Record
        With at least one response; at least 32 samples, evenly spaced.
    model : Structure, optional
        Its masses and linear springs and dashpots tie the degrees of freedom together, so that one that is not
        measured can be estimated; all else it leaves to the random force. Gains and offsets that it states of sensors
        are undone. Without it every degree of freedom is a resonator of its own, whose numbers are learned from the
        record.
    places : sequence of links (i, j), optional
        Where forces may act that neither the model nor the record has: (0, 2) for a load on degree of freedom 2,
        (1, 2) for a force between the two. By default on every degree of freedom. The links of laws beside the linear
        ones are added.

    Returns
    -------
    Motion

    Raises
    ------
    ValueError
        If the record has no response, is short or unevenly sampled; a degree of freedom is measured by nothing and no
        model is given; a natural motion of the model shows in no channel; or `places` are no links of the model, or
        hold forces that the channels cannot tell apart. Which channel would help is said.

    Notes
    -----
    The random force is a process of Matérn's family with ν = 1/2 or 5/2, whichever makes the record more probable: the
    rougher follows the jumps that dry friction makes, and leaves a wider error band elsewhere. Where a motion
    grows or dies away, the random force does so with it.

    A velocity or acceleration channel may show a constant beside the motion, and one that wanders (a random walk) where
    this makes the record more probable by far. A slow drift of a displacement channel cannot be told from a slow
    displacement, and counts as one.

    Where `places` is left out and the channels do not tell the forces on all degrees of freedom apart, these count as
    equally large; what rests on which of them acts has an error bar that says so.

    The error bars are those of a linear structure with Gaussian forces; numbers learned count as known. Where no model
    is given and no channel shows a displacement, a shift that lasts is not told: `notes` say so, with the time from
    which slow motion drowns in noise that is integrated.
    """
    require_x64()
    check_order("jfsm.estimate_motion(record, model)", model, record)
    as_record(record)
    if model is not None:
        as_model(model)
    if not record.responses:
        raise ValueError(
            "`record` must hold a response (displacement, velocity or acceleration); it has none to start from."
        )
    if len(record) < _SHORTEST:
        raise ValueError(f"`record` must hold at least {_SHORTEST} samples; it has {len(record)}.")
    record = mended(record)
    if model is not None:
        return _with_model(record, model, places)
    if places is not None:
        raise ValueError("`places` must be left out where no model is given; pass the model whose links they are.")
    for j in range(1, record.dofs + 1):
        if not any(place == j for _, place in record.responses):
            raise ValueError(
                f"`model` must be given where a degree of freedom is measured by nothing; {j} is not. "
                "Pass the structure, whose links tell what moves it."
            )
    estimates = [_Estimate.of(Part.of_dof(record, j)) for j in range(1, record.dofs + 1)]
    found = _together(record, estimates, record.dofs)
    return replace(found, notes=_untold(found, record))


def _untold(found: Motion, record: Record) -> tuple[str, ...]:
    """What is to be said of degrees of freedom whose displacement no channel shows.

    White noise of standard deviation s, n times integrated over a time T, strays by s·sqrt(Δt·T^(2n - 1)·c) with c = 1
    for n = 1 and 1/3 for n = 2; `T` is where that is as much as the displacement's own spread.
    """
    notes = list[str]()
    for j in range(1, record.dofs + 1):
        orders = {kind: n for kind, n in (("velocity", 1), ("acceleration", 2)) if (kind, j) in record.responses}
        if ("displacement", j) in record.responses or not orders:
            continue
        kind, n = next(iter(orders.items()))
        among = [dof for of, dof in record.responses if of == kind]
        noise, spread = float(found.noise[kind][among.index(j)]), float(np.std(found.displacement[:, j - 1]))
        strays = noise**2 * record.dt / (1 if n == 1 else 3)
        seconds = (spread**2 / max(strays, np.finfo(float).tiny)) ** (1 / (2 * n - 1))
        notes.append(
            f"The displacement of {j} rests on its {kind} alone: it is that of a motion about a place that stays. A "
            f"shift that lasts, and motion slower than about {seconds:.2g} s, hardly show beside the noise of that "
            f"channel; the error bars do not hold them. Measure a displacement to know."
        )
        beside = _beside(found, record, j, kind, n, noise)
        if beside > 0:
            notes.append(
                f"Integrated, and freed of a curve of degree {n}, the {kind} of {j} goes up to {beside:.2g} "
                f"{record.units['displacement']} away from the displacement that is given, far beyond its white noise: "
                f"a shift that lasts, a slow motion, or a drift of the sensor, which this record does not tell apart."
            )
    return tuple(notes)


def _beside(found: Motion, record: Record, j: int, kind: str, n: int, noise: float) -> float:
    """How far the integral of a channel goes from the estimate; 0 where white noise alone would take it there.

    What integration leaves open, and a constant offset adds, is a polynomial of degree n and is taken off.
    """
    readings = record.responses[kind, j]
    if kind == "acceleration" and record.base_acceleration is not None:
        readings = readings - record.base_acceleration
    if not np.all(np.isfinite(readings)):
        return 0.0
    path = readings
    for _ in range(n):
        path = record.dt * np.concatenate([[0.0], np.cumsum((path[1:] + path[:-1]) / 2)])
    away = _without_curve(path - found.displacement[:, j - 1], n)
    step = record.dt * len(record) / _COARSE
    sums = np.linalg.matrix_power(np.tril(np.ones((_COARSE, _COARSE))), n)
    spread = (
        noise * np.sqrt(record.dt / step) * step**n * float(np.sqrt(np.sum(_without_curve(sums, n) ** 2) / _COARSE))
    )
    return float(np.max(np.abs(away))) if float(np.std(away)) > _FAR_BEYOND * spread else 0.0


def _without_curve(values: np.ndarray, degree: int) -> np.ndarray:
    """Columns of values less the polynomial that fits each best."""
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1, 1, values.shape[0]), degree + 1))
    return values - basis @ (basis.T @ values)


def _with_model(record: Record, model: Structure, places: Sequence[Place] | None) -> Motion:
    """The motion of a structure, and the force that it lacks."""
    check_pair(model, record)
    if model.own is not None:
        raise ValueError(
            "`model` must be a structure of masses and terms here; got a simulation. Leave it out: the motion is then "
            "estimated from the channels alone."
        )
    channels = tuple(record.responses)
    require_seen(model, channels, record.at_rest)
    if places is None:
        loads = tuple((0, j) for j in range(1, model.dof + 1))
    else:
        loads = _links(model, places)
        require_apart(model, channels, loads)
    found = _Estimate.of(Part.of_model(record, model, loads))
    moved = _together(record, [found], model.dof)
    force, covariance = _latent(found, model, loads, moved)
    return replace(
        moved,
        places=loads,
        latent_force=force,
        latent_force_std=np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)),
    )


def _links(model: Structure, places: Sequence[Place]) -> tuple[Place, ...]:
    """The places, and the links of laws that the linear part of the model does not have."""
    check_places(places, model.dof)
    given: list[Any] = [tuple(at) for at in places]
    if not given:
        raise ValueError("`places` must name at least one link; it is empty. Leave it out for all degrees of freedom.")
    laws: list[Any] = [term.at for term in model.terms if not isinstance(term, LinearStiffness | LinearDamping)]
    return tuple(dict.fromkeys([*given, *laws]))


@dataclass(frozen=True)
class _Estimate:
    """Moments (n, watched) of a part in its own units, and the numbers that they were found with."""

    part: Part
    found: Learned
    mean: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, part: Part) -> "_Estimate":
        found = learned(part)
        estimate = cls(part, found, *smoothed(part, found))
        if np.any(part.spiky):
            part = estimate.believing()
            estimate = cls(part, found, *smoothed(part, found))
        return estimate

    @property
    def noise(self) -> np.ndarray:
        return np.exp(np.asarray(self.found.numbers.noise))

    def believing(self) -> Part:
        """The part with those spikes counted that may be motion, as the kicks of dry friction are."""
        part, kind, use = self.part, self.found.kind, self.part.use.copy()
        for i, (order, j) in enumerate(kind.channels):
            place = 3 * j + order
            expected = self.mean[:, place]
            if i in kind.biased:
                expected = expected + self.mean[:, 3 * kind.dof + kind.biased.index(i)]
            spread = np.sqrt(self.covariance[:, place, place] + self.noise[i] ** 2)
            strange = np.abs(part.seen[:, i] - expected) > _STRANGE * spread
            use[part.spiky[:, i] & ~strange, i] = 1.0
        return replace(part, use=use)


def _together(record: Record, estimates: list[_Estimate], dof: int) -> Motion:
    """The estimates of all parts, in the record's units."""
    n = len(record)
    states, covariance = np.zeros((3, n, dof)), np.zeros((n, dof, 3, 3))
    noise: dict[tuple[str, int], float] = {}
    bias: dict[tuple[str, int], float] = {}
    drift: dict[tuple[str, int], np.ndarray] = {}
    drift_std: dict[tuple[str, int], np.ndarray] = {}
    for estimate in estimates:
        part, kind, mean, spread = estimate.part, estimate.found.kind, estimate.mean, estimate.covariance
        units = part.length * part.omega ** np.arange(3)
        for i, j in enumerate(part.dofs):
            rows = slice(3 * i, 3 * i + 3)
            states[:, :, j - 1] = (mean[:, rows] * units).T
            covariance[:, j - 1] = spread[:, rows, rows] * np.outer(units, units)
        noise |= dict(zip(part.channels, (estimate.noise * part.sizes).tolist(), strict=True))
        for i, c in enumerate(kind.biased):
            place, channel, size = 3 * kind.dof + i, part.channels[c], part.sizes[c]
            offset = mean[:, place] * size
            bias[channel] = float(np.mean(offset))
            if i in estimate.found.drifting:
                drift[channel] = offset - bias[channel]
                drift_std[channel] = np.sqrt(np.maximum(spread[:, place, place], 0.0)) * size
    base = 0.0 if record.base_acceleration is None else record.base_acceleration[:, None]
    kinds = dict.fromkeys(kind for kind, _ in record.responses)
    by_kind = {kind: np.array([noise[c] for c in record.responses if c[0] == kind]) for kind in kinds}
    return Motion(record.time, states[0], states[1], states[2] + base, covariance, by_kind, bias, drift, drift_std)


def _latent(found: _Estimate, model: Structure, loads: Sequence[Place], moved: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Force on each load beside everything in the model, and its covariance."""
    part, dof, count = found.part, model.dof, len(loads)
    unit = levers(model, loads)[1] * part.length * part.omega**2
    order = [*(3 * j for j in range(dof)), *(3 * j + 1 for j in range(dof))]
    size = np.concatenate([np.full(dof, part.length), np.full(dof, part.length * part.omega), unit])
    take = [*order, *range(found.mean.shape[1] - count, found.mean.shape[1])]
    covariance = found.covariance[:, take][:, :, take] * np.outer(size, size)
    # Forces on links as forces on degrees of freedom and back: the links of all laws are among them.
    rows = np.array([direction(at, dof) for at in loads])
    spread = np.block([[np.eye(2 * dof), np.zeros((2 * dof, count))], [np.zeros((dof, 2 * dof)), rows.T]])
    force = found.mean[:, -count:] * unit @ rows
    force, covariance = less_known(
        lower(model), moved.time, moved.displacement, moved.velocity, force, spread @ covariance @ spread.T
    )
    back = np.linalg.pinv(rows.T)
    return force @ back.T, back @ covariance @ back.T

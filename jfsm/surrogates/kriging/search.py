"""Hyper-parameters of largest likelihood, from a few starts, within bounds whose meaning is told."""

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from .._minimise import minimise_within
from .likelihood import Readings, negative_log_likelihood

LENGTH_BOUNDS = (1e-2, 1e2)
"""Length scales that are looked at, in standard deviations of the column."""

NUGGET_BOUNDS = (1e-10, 1e4)
"""The lower one keeps the likelihood of data without noise bounded, and K positive definite in double precision."""

STARTS = ((1.0, 1e-6), (1.0, 1e-1), (3.0, 1e-3))
"""Length scale in standard deviations of its column, times the square root of the number of columns, and nugget:
from a single start up to half of the noisy cases end where everything is called noise."""

PILOT = 400
"""Readings from which the starts are tried; all of them serve the last climb."""

NEARLY = 4.0
"""Nats by which another optimum of the pilot may be worse and still be followed with all readings."""

JITTERS = (0.0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6)

FLAT = 1e-3
"""Slope of the likelihood, in nats per unit of a logarithm, at which a climb ends."""

STEPS = 100
"""Evaluations of one climb."""


class Optimum(NamedTuple):
    """Where a search ended."""

    log_parameters: NDArray[np.float64]
    """ln of the length scales, then of the nugget."""
    value: float
    """Negative log-likelihood."""
    jitter: float
    remarks: tuple[str, ...]


def search(
    readings: Readings,
    length_scale: NDArray[np.float64] | None = None,
    nugget: float | None = None,
    start: NDArray[np.float64] | None = None,
) -> Optimum:
    """Maximise the likelihood over what is not given.

    Parameters
    ----------
    readings : Readings
        Force of about unit size.
    length_scale : (dim,) array, optional
        Kept, in the units of the columns.
    nugget : float, optional
        Kept; zero interpolates.
    start : (parameters,) array, optional
        The only place to set out from: the end of an earlier search.

    Raises
    ------
    RuntimeError
        If the matrix of correlations is positive definite nowhere.
    """
    spread = np.std(np.asarray(readings.states), axis=0)
    lower = np.log([*(LENGTH_BOUNDS[0] * spread), NUGGET_BOUNDS[0]])
    upper = np.log([*(LENGTH_BOUNDS[1] * spread), NUGGET_BOUNDS[1]])
    given = np.full(len(lower), np.nan)
    if length_scale is not None:
        given[:-1] = np.log(length_scale)
    if nugget is not None:
        given[-1] = np.log(nugget) if nugget > 0.0 else -np.inf
    starts = [np.log([*(length * np.sqrt(len(spread)) * spread), nu]) for length, nu in STARTS]
    if readings.noise_variance is not None:  # the process then varies as much as the force
        starts.append(np.array([*starts[0][:-1], np.log(float(jnp.mean(readings.noise_variance)))]))
    starts = starts if start is None else [start]
    free = np.isnan(given)
    starts = [np.where(free, np.clip(start, lower, upper), given) for start in starts]
    n = len(readings.states)
    rounding = 10.0 * n * np.finfo(float).eps
    for jitter in JITTERS:
        if nugget is not None and nugget * float(jnp.min(readings.relative_noise)) + jitter < rounding:
            continue  # K may pass for positive definite, and its inverse is rounding
        optimum = _climb_all(readings, jitter, starts, free, lower, upper)
        if optimum is not None:
            parameters, value = optimum
            remarks = _remarks(parameters, free, lower, upper, spread)
            return Optimum(parameters, value, jitter, remarks)
    raise RuntimeError(
        f"The correlation matrix of the {n} points is not positive definite, whatever was tried: "
        f"{type(readings.correlation).__name__} is no valid correlation for them, or `length_scale` is far too long. "
        "Take another correlation, such as Matern52(), or leave `length_scale` and `nugget` to be estimated."
    )


def _climb_all(readings, jitter, starts, free, lower, upper) -> tuple[NDArray[np.float64], float] | None:
    if not np.any(free):
        value = _value(jnp.asarray(starts[0]), readings, jnp.asarray(jitter))
        return (starts[0], float(value)) if np.isfinite(value) else None
    n = len(readings.states)
    if n > PILOT:
        pilot = _part(readings, np.random.default_rng(0).permutation(n)[:PILOT])
        starts = _distinct(_climbs(pilot, jitter, starts, free, lower, upper)) or starts
    parameters, value = min(_climbs(readings, jitter, starts, free, lower, upper), key=lambda one: one[1])
    return (parameters, value) if np.isfinite(value) else None


def _climbs(
    readings: Readings,
    jitter: float,
    starts: list[NDArray[np.float64]],
    free: NDArray[np.bool_],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> list[tuple[NDArray[np.float64], float]]:
    """Ends of the climbs from every start; an infinite value where the start was refused.

    One after another: a climb that comes near the end of another is over, which saves more than `jax.vmap` could on
    a processor, whose factorisations do not run side by side.
    """
    ends: list[tuple[NDArray[np.float64], float]] = []

    def completed(some: NDArray[np.float64]) -> NDArray[np.float64]:
        parameters = starts[0].copy()
        parameters[free] = some
        return parameters

    def function(some: NDArray[np.float64]) -> tuple[Any, NDArray[np.float64]]:
        value, gradient = _value_and_gradient(jnp.asarray(completed(some)), readings, jnp.asarray(jitter))
        return value, np.asarray(gradient)[free]

    for start in starts:
        known = [parameters[free] for parameters, value in ends if np.isfinite(value)]
        unit = 0.5 * readings.force.size
        end = minimise_within(
            function, start[free], lower[free], upper[free], unit=unit, flat=FLAT, steps=STEPS, known=known
        )
        ends.append((completed(end.parameters), end.value))
    return ends


_value = eqx.filter_jit(negative_log_likelihood)
_value_and_gradient = eqx.filter_jit(eqx.filter_value_and_grad(negative_log_likelihood))


def _part(readings: Readings, rows: NDArray[np.intp]) -> Readings:
    rows = np.sort(rows)
    names = ("states", "basis", "force", "relative_noise")
    taken = {name: np.asarray(getattr(readings, name))[rows] for name in names}
    taken["basis"] = np.linalg.qr(taken["basis"])[0]
    return replace(readings, **{name: jnp.asarray(column) for name, column in taken.items()})


def _distinct(found: list[tuple[NDArray[np.float64], float]]) -> list[NDArray[np.float64]]:
    """Ends of climbs that are nearly the best and differ from each other."""
    found = sorted((one for one in found if np.isfinite(one[1])), key=lambda one: one[1])
    kept: list[NDArray[np.float64]] = []
    for parameters, value in found:
        near = any(np.max(np.abs(np.exp(-np.abs(parameters - other)) - 1.0)) < 0.3 for other in kept)
        if value < found[0][1] + NEARLY and not near:
            kept.append(parameters)
    return kept


def _remarks(parameters, free, lower, upper, spread) -> tuple[str, ...]:
    """What a parameter that ran into its bound says about the readings."""
    names = column_names(len(spread))
    said = []
    for k, name in enumerate(names):
        value, share = np.exp(parameters[k]), np.exp(parameters[k]) / spread[k]
        if free[k] and parameters[k] > upper[k] - 1e-3:
            said.append(
                f"The length scale of {name} reached its upper bound, {value:.3g} ({share:.3g} standard deviations of "
                f"that column): beyond the trend the force does not change with it, or {name} is hardly excited."
            )
        elif free[k] and parameters[k] < lower[k] + 1e-3:
            said.append(
                f"The length scale of {name} reached its lower bound, {value:.3g} ({share:.3g} standard deviations of "
                "that column): neighbouring readings look unrelated. Add data, or look for a jump of the force."
            )
    if free[-1] and parameters[-1] > upper[-1] - 1e-3:
        said.append("The nugget reached its upper bound: the readings scatter about the trend like noise alone.")
    elif free[-1] and parameters[-1] < lower[-1] + 1e-3:
        said.append("The nugget reached its lower bound: no noise can be seen in the readings.")
    return tuple(said)


def column_names(dim: int) -> list[str]:
    """Columns by number and by what they are in a state x1…xd, v1…vd."""
    if dim % 2:
        return [f"column {k}" for k in range(dim)]
    dof = dim // 2
    number = [""] if dof == 1 else [f" {j + 1}" for j in range(dof)]
    kinds = [f"{kind}{j}" for kind in ("displacement", "velocity") for j in number]
    return [f"column {k} ({kind})" for k, kind in enumerate(kinds)]

"""From readings to a conditioned field: merged if many, searched, and weighed again for noise in the states."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from ..._types import as_array
from ..rkpm.basis import first_derivatives
from .correlations import AbstractCorrelation
from .likelihood import Readings
from .posterior import Posterior, condition, derivatives_at
from .readings import Checked, check_memory, merge
from .search import STARTS, Optimum, search
from .trend import PolynomialTrend, trend_basis

EXPLAINED = 1e-12
"""Share of the force, root mean square, below which what a trend leaves is rounding."""

CELLS = 1000
"""Cells of merged readings: at 5 % noise, 600 and 1500 cells give the errors of 1e4 and 1e5 samples within a tenth."""

EXACT = 1e-6
"""Noise variance of a reading that is known, relative to that of the others."""

PASSES = 3
"""How often readings are weighed by the slope of the map under noisy states."""


@dataclass(frozen=True)
class Options:
    """What holds for every output."""

    correlation: AbstractCorrelation
    trend: PolynomialTrend
    nugget: float | None
    """None: to be estimated."""
    length_scale: NDArray[np.float64] | None
    restricted: bool
    points: int

    @classmethod
    def checked(
        cls,
        correlation: AbstractCorrelation,
        trend: PolynomialTrend,
        nugget: Any,
        length_scale: Any,
        restricted: bool,
        points: Any,
        columns: int,
    ) -> "Options":
        """Options of a fit, refused where they make no sense."""
        if isinstance(nugget, str):
            if nugget != "estimate":
                raise ValueError(f"`nugget` must be 'estimate', a number, or one number per reading; got {nugget!r}.")
            value = None
        else:
            nugget = as_array(nugget, "nugget", (0, 1))
            if np.any(nugget < 0.0) or nugget.ndim and not np.all(nugget > 0.0):
                raise ValueError(
                    f"`nugget` must be 0 or more, and positive where it is given per reading; got {nugget.min():g}."
                )
            value = 1.0 if nugget.ndim else float(nugget)
        if length_scale is not None:
            length_scale = as_array(length_scale, "length_scale", 1)
            if length_scale.shape != (columns,) or not np.all(length_scale > 0.0):
                raise ValueError(
                    f"`length_scale` must hold {columns} positive numbers, one per column, in its unit; "
                    f"got {length_scale.tolist()}."
                )
        if isinstance(points, bool) or not isinstance(points, int | np.integer) or points < 2:
            raise ValueError(f"`points` must be an integer of 2 or more; got {points!r}.")
        return cls(correlation, trend, value, length_scale, bool(restricted), int(points))


class Part(NamedTuple):
    """Readings of outputs that share their hyper-parameters."""

    readings: Checked
    noise_variance: float | None
    """Known noise variance [N²] of a reading of relative noise one."""
    state_variance: NDArray[np.float64] | None
    """Variance of the noise in the states (n, dim)."""

    @classmethod
    def of(
        cls,
        states: NDArray[np.float64],
        force: NDArray[np.float64],
        nugget: Any,
        noise_variance: Any,
        state_std: Any,
        together: bool,
        zero_at_rest: bool,
    ) -> list["Part"]:
        """One part for all columns of the force together, or one for each.

        Raises
        ------
        ValueError
            If noise is given twice, is not positive, or has another shape than the readings.
        """
        n, outputs = force.shape
        relative = np.ones(n) if np.ndim(nugget) == 0 else np.asarray(nugget, dtype=float)
        if relative.shape != (n,):
            raise ValueError(f"`nugget` must be one number or one per reading ({n}); got shape {relative.shape}.")
        noise = None
        if noise_variance is not None:
            noise = _noise(noise_variance, nugget, n, outputs, together)
        spread = None if state_std is None else _state_variance(state_std, states)
        groups = [slice(None)] if together else [slice(k, k + 1) for k in range(outputs)]
        parts = []
        for group in groups:
            level = None
            if noise is not None:
                column = noise[:, group][:, 0]
                level = float(column.mean())
                relative = column / level
            part = cls(Checked(states, force[:, group], relative), level, spread)
            parts.append(part._with_rest() if zero_at_rest else part)
        return parts

    def _with_rest(self) -> "Part":
        """The part with one reading more, of no force at rest, that is hardly in doubt."""
        states, force, relative = self.readings
        spread = self.state_variance
        more = Checked(_with_row(states), _with_row(force), np.append(relative, EXACT * np.min(relative)))
        return self._replace(readings=more, state_variance=None if spread is None else _with_row(spread))


def _with_row(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows, and one of zeros."""
    return np.concatenate([rows, np.zeros_like(rows[:1])])


def _noise(noise_variance: Any, nugget: Any, n: int, outputs: int, shared: bool) -> NDArray[np.float64]:
    """Known noise variance of every reading of every output."""
    if not isinstance(nugget, str):
        raise ValueError("`noise_variance` and `nugget` both say how large the noise is; give one of them.")
    noise = as_array(noise_variance, "noise_variance", (0, 1, 2))
    if not np.all(noise > 0.0):
        raise ValueError(f"`noise_variance` must be positive; got {noise.min():g}. For exact readings, `nugget=0`.")
    if noise.shape not in ((), (n,), (n, outputs)) or shared and noise.ndim == 2:
        raise ValueError(
            f"`noise_variance` must be one number, one per reading ({n}), or (with `outputs='separate'`) of shape "
            f"({n}, {outputs}); got shape {noise.shape}."
        )
    return np.broadcast_to(noise if noise.ndim == 2 else noise.reshape(-1, 1), (n, outputs))


def _state_variance(state_std: Any, states: NDArray[np.float64]) -> NDArray[np.float64]:
    spread = as_array(state_std, "state_std", (1, 2))
    if spread.shape not in (states.shape[1:], states.shape) or np.any(spread < 0.0):
        raise ValueError(
            f"`state_std` must hold {states.shape[1]} numbers of 0 or more, one per column, or shape {states.shape}; "
            f"got shape {spread.shape}, smallest {spread.min():g}."
        )
    return np.broadcast_to(spread**2, states.shape)


class Fitted(NamedTuple):
    """A conditioned field and how it came about."""

    posterior: Posterior
    negative_log_likelihood: float
    log_parameters: NDArray[np.float64]
    remarks: tuple[str, ...]


def merged(part: Part, options: Options) -> tuple[Part, tuple[str, ...]]:
    """The part, its readings merged where they are too many, and words on it.

    Raises
    ------
    MemoryError
        If the likelihood of so many points would not fit into memory.
    """
    given = len(part.readings.states)
    if given <= options.points:
        check_memory(given)
        return part, ()
    part = _merged(part, min(options.points, CELLS))
    left = len(part.readings.states)
    check_memory(left)
    return part, (f"{given} readings were merged to means over {left} cells of a grid.",)


def fit_part(part: Part, options: Options, start: NDArray[np.float64] | None = None) -> Fitted:
    """Field of largest likelihood for outputs that share their hyper-parameters.

    `start` holds the logarithms of length scales and nugget from which alone the search sets out.
    """
    part, remarks = merged(part, options)
    trend, basis = trend_basis(options.trend, jnp.asarray(part.readings.states))
    known = part.noise_variance
    known = None if known is None else jnp.full(part.readings.force.shape[1], known)
    readings = Readings(
        states=jnp.asarray(part.readings.states),
        basis=basis,
        force=jnp.asarray(part.readings.force),
        relative_noise=jnp.asarray(part.readings.relative_noise),
        correlation=options.correlation,
        noise_variance=known,
        restricted=options.restricted,
    )
    optimum = _search(readings, options, start)
    posterior = condition(readings, trend, jnp.asarray(optimum.log_parameters), jnp.asarray(optimum.jitter))
    for _ in range(PASSES if part.state_variance is not None else 0):
        readings = _weighed(readings, posterior, part.readings.relative_noise, part.state_variance)
        optimum = _search(readings, options, start=optimum.log_parameters)
        posterior = condition(readings, trend, jnp.asarray(optimum.log_parameters), jnp.asarray(optimum.jitter))
    if optimum.jitter > 0.0:
        remarks += (f"A jitter of {optimum.jitter:g} was added to the diagonal of R to keep it positive definite.",)
    return Fitted(posterior, optimum.value, optimum.log_parameters, (*remarks, *optimum.remarks))


def _merged(part: Part, points: int) -> Part:
    states, force, relative = part.readings
    variance = part.state_variance
    together = force if variance is None else np.concatenate([force, variance], axis=1)
    merged = merge(Checked(states, together, relative), points)
    outputs = force.shape[1]
    return part._replace(
        readings=merged._replace(force=merged.force[:, :outputs]),
        state_variance=None if variance is None else merged.force[:, outputs:] * merged.relative_noise[:, None],
    )


def _search(readings: Readings, options: Options, start: NDArray[np.float64] | None = None) -> Optimum:
    """Search on force of unit size, without outputs that the trend explains to rounding."""
    force = np.asarray(readings.force)
    basis = np.asarray(readings.basis)
    rest = force - basis @ (basis.T @ force)
    unit = np.sqrt(np.mean(rest**2, axis=0))
    moving = unit > EXPLAINED * np.sqrt(np.mean(force**2, axis=0))
    if not np.any(moving):
        return _trend_alone(readings, options)
    unit = unit[moving]
    known = readings.noise_variance
    scaled = replace(
        readings,
        force=jnp.asarray(rest[:, moving] / unit),  # the likelihood does not depend on what the trend explains
        noise_variance=None if known is None else jnp.asarray(np.asarray(known)[moving] / unit**2),
    )
    optimum = search(scaled, options.length_scale, options.nugget, start)
    n, p = basis.shape
    freedom = n - p if readings.restricted else n
    return optimum._replace(value=optimum.value + freedom * float(np.sum(np.log(unit))))


def _trend_alone(readings: Readings, options: Options) -> Optimum:
    """The trend explains the force to rounding: there is no likelihood to maximise."""
    spread = np.std(np.asarray(readings.states), axis=0)
    length, nugget = STARTS[0]
    length_scale = length * spread if options.length_scale is None else options.length_scale
    nugget = nugget if options.nugget is None else max(options.nugget, nugget)
    remark = "The trend explains the force to rounding; nothing is left for the correlation to learn from."
    return Optimum(np.log([*length_scale, nugget]), -np.inf, 0.0, (remark,))


def _weighed(readings: Readings, posterior: Posterior, relative_noise: Any, state_variance: Any) -> Readings:
    """Readings whose noise includes what noise in the states makes of the map's slope.

    Notes
    -----
    Σ_k (∂f/∂x_k)² Var[x_k], averaged over the outputs, over the noise variance of a reading of relative noise one.
    """
    axes = first_derivatives(readings.states.shape[1])
    slopes = np.asarray(derivatives_at(posterior, readings.states, axes))
    made = np.einsum("nko,nk->no", slopes**2, state_variance)
    noise = np.asarray(posterior.nugget * posterior.process_variance)
    added = np.mean(made / noise, axis=1)
    return replace(readings, relative_noise=jnp.asarray(relative_noise + added))

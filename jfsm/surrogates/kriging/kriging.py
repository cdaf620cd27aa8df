"""Force state map by universal kriging."""

import math
from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float, PRNGKeyArray
from numpy.typing import NDArray

from ..._types import as_array, is_traced, require_x64
from .._blocks import padded_blocks
from .._map import AbstractForceStateMap
from .._readings import reach_of, within
from ..rkpm.basis import first_derivatives
from .coregionalisation import fit_mixed
from .correlations import AbstractCorrelation, Gaussian
from .fitting import Options, Part, fit_part
from .leave_one_out import LeaveOneOut
from .likelihood import Readings
from .likelihood import negative_log_likelihood as _negative_log_likelihood
from .posterior import (
    AbstractPosterior,
    Orders,
    Posterior,
    condition,
    derivatives_at,
    draw,
    left_out,
    standard_errors_at,
)
from .readings import check_readings
from .trend import PolynomialTrend, as_trend, trend_basis

POINTS = 2000
"""Readings of an exact fit unless asked otherwise; one evaluation of likelihood and gradient takes half a second."""

OUTPUTS = "separate", "shared", "coregionalised"

LARGEST_WORK = 2**22
"""States × points in flight at once: 32 MiB a matrix."""


class Kriging(AbstractForceStateMap):
    r"""Universal kriging map, the paper's eqs. 52 to 69; build it with `Kriging.fit`.

    The force is a trend plus a Gaussian random field Z plus noise,

    .. math:: g(x_i) = f(x_i)^T \beta + Z(x_i) + e_i, \quad
        \mathrm{Cov}[Z(x), Z(x')] = \sigma^2 R(x - x'), \quad \mathrm{Var}[e_i] = \sigma^2 \nu r_i

    with process variance σ², nugget ν, and r_i = 1 unless the noise of the readings differs.
    """

    parts: tuple[AbstractPosterior, ...]
    """One for all outputs where they share their hyper-parameters, else one per output, or per field of a mixture."""
    optima: Float[Array, " parts"]
    reach: Float[Array, ""]
    """Distance to the nearest point, in standard deviations of the states, within which a state counts as visited."""
    mixing: Float[Array, "forces fields"]
    """What each output is made of: of itself, unless outputs are coregionalised."""
    vector: bool = eqx.field(static=True)
    remarks: tuple[str, ...] = eqx.field(static=True)
    """What the fit ran into, in words: bounds, jitter, readings merged."""

    @classmethod
    def fit(
        cls,
        states: Any,
        force: Any,
        correlation: AbstractCorrelation | None = None,
        trend: str | PolynomialTrend = "quadratic",
        nugget: Literal["estimate"] | Any = "estimate",
        *,
        length_scale: Any = None,
        noise_variance: Any = None,
        state_std: Any = None,
        restricted: bool = False,
        outputs: Literal["separate", "shared", "coregionalised"] = "separate",
        zero_at_rest: bool = False,
        points: int = POINTS,
    ) -> "Kriging":
        """Map of largest likelihood through readings of the restoring force.

        Parameters
        ----------
        states : (n, dim) array
            Columns x1…xd, v1…vd, or any coordinates in any unit.
        force : (n,) or (n, outputs) array
            Restoring force at the states.
        correlation : AbstractCorrelation, optional
            `Gaussian()`, eq. 57, when None.
        trend : str or PolynomialTrend
            "constant", "linear", "quadratic", "pure quadratic" (no cross terms), "cubic", or any polynomial.
        nugget : "estimate", float or (n,) array
            Noise variance over the process variance, dimensionless. Zero interpolates; an array is kept per reading.
        length_scale : (dim,) array, optional
            Kept instead of estimated, in the units of the columns.
        noise_variance : float, (n,) or (n, outputs) array, optional
            Noise variance of the readings [N²] where it is known; in place of `nugget`. Not for
            coregionalised outputs.
        state_std : (dim,) or (n, dim) array, optional
            Standard deviation of noise in the states themselves, in the units of the columns. Each reading then gets
            the noise that it makes through the slope of the map, in three passes. It mends weights and error bars, not
            the flattening that noisy inputs cause: smooth the motion first (`jfsm.estimate_motion`).
        restricted : bool
            Restricted likelihood, which allows for the trend coefficients having been estimated.
        outputs : "separate", "shared" or "coregionalised"
            Separate outputs have length scales and a nugget each; shared, they have these in common and variances of
            their own. Coregionalised, every output is a mixture of as many independent fields, with length scales and
            a nugget each: right where forces or noise of several outputs go together (Goovaerts 1997, the linear model
            of coregionalisation). The force itself changes little, its joint distribution much.
        zero_at_rest : bool
            Whether the force is known to be zero where all states are zero: one more reading, hardly in doubt, says so.
        points : int
            Largest number of points of an exact fit, whose time grows like its cube and memory like its square. More
            readings are first merged to means over the cells of a grid, 1000 at most, which count by the number of
            their readings.

        Raises
        ------
        TypeError, ValueError
            If the arguments do not fit together, values are not finite, or the states cannot determine the trend.
        MemoryError
            If the likelihood of so many points would not fit into memory.
        RuntimeError
            If the correlation matrix is not positive definite wherever it was tried.
        """
        require_x64()
        trend = as_trend(trend)
        states = states if hasattr(states, "shape") else as_array(states, "states", 2)
        dim = states.shape[1] if len(states.shape) == 2 else 1
        states, columns = check_readings(states, force, len(trend.exponents(dim)))
        vector = columns.ndim == 2
        columns = columns.reshape(len(states), -1)
        options = Options.checked(
            _correlation(correlation), trend, nugget, length_scale, restricted, points, columns=states.shape[1]
        )
        if outputs not in OUTPUTS:
            raise ValueError(f"`outputs` must be one of {', '.join(map(repr, OUTPUTS))}; got {outputs!r}.")
        mixed = outputs == "coregionalised"
        if mixed and noise_variance is not None:
            raise ValueError(
                "`noise_variance` must be left out where outputs are coregionalised: their noise is mixed."
            )
        together = mixed or outputs == "shared"
        parts = Part.of(states, columns, nugget, noise_variance, state_std, together, zero_at_rest)
        if mixed:
            fitted, mixing, optima = fit_mixed(parts[0], options)
        else:
            fitted, mixing = [fit_part(part, options) for part in parts], np.eye(columns.shape[1])
            optima = [one.negative_log_likelihood for one in fitted]
        one_of = "Field" if mixed else "Output"
        remarks = tuple(
            f"{one_of} {k}: {remark}" if len(fitted) > 1 else remark
            for k, one in enumerate(fitted)
            for remark in one.remarks
        )
        posteriors = tuple(one.posterior for one in fitted)
        optima, mixing = jnp.asarray(optima), jnp.asarray(mixing)
        return cls(posteriors, optima, _reach(posteriors[0]), mixing, vector, remarks)

    @staticmethod
    def negative_log_likelihood(
        log_parameters: ArrayLike,
        states: ArrayLike,
        force: ArrayLike,
        correlation: AbstractCorrelation | None = None,
        trend: str | PolynomialTrend = "quadratic",
        restricted: bool = False,
    ) -> Float[Array, ""]:
        """Eq. 64 at its minimum over trend coefficients and process variance, eqs. 65 to 67, constants kept.

        Parameters
        ----------
        log_parameters : (dim + 1,) array
            Natural logarithms of the length scales, in the units of the columns, and of the nugget; shared by outputs.
        states, force, correlation, trend, restricted
            As for `fit`. All may be traced; readings are never merged.

        Returns
        -------
        value : () array
            In nats. Not finite where the matrix of correlations is not positive definite. Eq. 67 of the paper drops
            the n/2 that eq. 66 leaves in eq. 64; it is kept here.
        """
        log_parameters, states, force, trend = _point(log_parameters, states, force, trend)
        return _likelihood(log_parameters, states, force, _correlation(correlation), trend, restricted)

    @staticmethod
    def leave_one_out_errors(
        log_parameters: ArrayLike,
        states: ArrayLike,
        force: ArrayLike,
        correlation: AbstractCorrelation | None = None,
        trend: str | PolynomialTrend = "quadratic",
    ) -> Float[Array, "n *outputs"]:
        """Every reading minus what the others say there, as a function of the hyper-parameters.

        The mean of their squares is another measure of hyper-parameters than the likelihood, which needs no process
        variance and trusts the correlation less; `leave_one_out` gives the same errors of a map that was fitted.

        Parameters
        ----------
        log_parameters, states, force, correlation, trend
            As for `negative_log_likelihood`; all may be traced.

        Returns
        -------
        errors : (n,) or (n, outputs) array
            In the unit of the force, exact for hyper-parameters that are kept (Dubrule 1983). Not finite where the
            matrix of correlations is not positive definite.
        """
        log_parameters, states, force, trend = _point(log_parameters, states, force, trend)
        return _left_out(log_parameters, states, force, _correlation(correlation), trend)

    @property
    def dim(self) -> int:
        return self.parts[0].states.shape[1]

    @property
    def box(self) -> Float[Array, "2 dim"]:
        states = self.parts[0].states
        return jnp.stack([jnp.min(states, axis=0), jnp.max(states, axis=0)])

    @property
    def length_scale(self) -> Float[Array, "*parts dim"]:
        """Length scales in the units of the columns; one row per output or field unless they are shared."""
        return self._per_part("length_scale")

    @property
    def nugget(self) -> Float[Array, "*parts"]:
        """Noise variance of a reading over the process variance; one per output or field unless they are shared."""
        return self._per_part("nugget")

    @property
    def jitter(self) -> Float[Array, "*parts"]:
        """What had to be added to the diagonal of R for numerical reasons alone."""
        return self._per_part("jitter")

    @property
    def process_variance(self) -> Float[Array, "*outputs"]:
        """σ² of eq. 66 [N²]; over n - p where the likelihood is restricted."""
        return self._joined([part.process_variance for part in self.parts], 2)

    @property
    def noise_variance(self) -> Float[Array, "*outputs"]:
        """Noise variance of a reading [N²]: nugget times process variance."""
        return self._joined([part.nugget * part.process_variance for part in self.parts], 2)

    @property
    def log_likelihood(self) -> Float[Array, ""]:
        """Largest log-likelihood, of all outputs together, in nats; of the means if readings were merged.

        Infinite where the trend explains an output to rounding.
        """
        return -jnp.sum(self.optima)

    @property
    def trend_coefficients(self) -> Float[Array, "p *outputs"]:
        """β of eq. 65, of the monomials 1, x, v, x², xv, v², … of the columns, in the order of `trend.exponents`."""
        origin = jnp.zeros((1, self.dim))
        found = []
        for exponents in self.parts[0].trend.trend.exponents(self.dim):
            factorial = math.prod(map(math.factorial, exponents))
            rows = [part.trend(origin, exponents)[0] @ part.trend_coefficients / factorial for part in self.parts]
            found.append(self._joined(rows))
        return jnp.stack(found)

    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state, eq. 69."""
        return self._derivatives(self._state(state)[None], (self._value,))[0, 0]

    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives of the map at one state."""
        return jnp.moveaxis(self._derivatives(self._state(state)[None], first_derivatives(self.dim))[0], 0, -1)

    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative of the map at one state, from the derivative of the correlation; ``orders=(1, 1)`` is ∂²f/∂x∂v.

        Raises
        ------
        ValueError
            If the map has no such derivative: along one column it has twice as many as the random field, and one at
            least. Rough correlations have kinks at the readings, where the slope is the mean of both sides.
        """
        return self._derivatives(self._state(state)[None], (self._orders(orders),))[0, 0]

    def std(self, state: ArrayLike, orders: tuple[int, ...] | None = None) -> Float[Array, "*outputs"]:
        """Standard error of the force at one state, or of its derivative; without the noise of a new reading.

        The uncertainty of the trend coefficients is in it, that of the hyper-parameters is not.

        Raises
        ------
        ValueError
            If the random field has no such derivative: its slope is then infinitely uncertain.
        """
        return self._standard_errors(self._state(state)[None], self._field_orders(orders))[0]

    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[tuple[int, ...]]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states; ``(0, 0)`` among `orders` is the force itself."""
        wanted = tuple(self._orders(one) for one in orders)
        if self._traced(states):
            return self._derivatives(jnp.asarray(states), wanted)
        return self._in_blocks(states, lambda block: self._derivatives(block, wanted), (len(wanted),))

    def evaluate_std(self, states: ArrayLike, orders: tuple[int, ...] | None = None) -> Float[Array, "q *outputs"]:
        """`std` at many states."""
        wanted = self._field_orders(orders)
        if self._traced(states):
            return self._standard_errors(jnp.asarray(states), wanted)
        return self._in_blocks(states, lambda block: self._standard_errors(block, wanted), ())

    def visited(self, states: ArrayLike) -> Bool[NDArray[np.bool_], " q"]:
        """Whether each state has a point within `reach`: the distance of 95 in 100 points to a near neighbour."""
        points, scale = _scaled(self.parts[0])
        return within(points, float(self.reach), self._states(states) / scale)

    def leave_one_out(self) -> LeaveOneOut:
        """Every reading (or mean of merged readings) predicted from all others, in closed form.

        Raises
        ------
        ValueError
            If the map was estimated together with its motion.
        """
        parts = [part for part in self.parts if isinstance(part, Posterior)]
        if not parts:
            raise ValueError(
                "The map has no readings to leave out: it was estimated together with its motion, all of which each "
                "reading tells of. `Kriging.fit` makes maps of single readings."
            )
        found = [left_out(part) for part in parts]
        residual, std = self._joined([one[0] for one in found]), self._joined_std([one[1] for one in found])
        return LeaveOneOut(np.asarray(residual), np.asarray(std))

    def sample(self, states: ArrayLike, count: int, key: PRNGKeyArray) -> Float[Array, "count q *outputs"]:
        """Force at the states in `count` maps that are as plausible as this one."""
        where = jnp.asarray(self._states(states))
        keys = jax.random.split(key, len(self.parts))
        drawn = [draw(part, where, count, one) for part, one in zip(self.parts, keys, strict=True)]
        return self._joined(drawn)

    def _derivatives(self, states: Float[Array, "q dim"], orders: tuple[Orders, ...]) -> Array:
        return self._joined([derivatives_at(part, states, orders) for part in self.parts])

    def _standard_errors(self, states: Float[Array, "q dim"], orders: Orders) -> Array:
        return self._joined_std([standard_errors_at(part, states, orders) for part in self.parts])

    def _joined(self, parts: list[Array], power: int = 1) -> Array:
        """All outputs in the last axis, or none where the force was one column; `power` is 2 for variances."""
        joined = parts[0] if len(parts) == 1 else jnp.concatenate(parts, axis=-1)
        joined = joined @ (self.mixing**power).T
        return joined if self.vector else joined[..., 0]

    def _joined_std(self, parts: list[Array]) -> Array:
        return jnp.sqrt(self._joined([one**2 for one in parts], 2))

    def _per_part(self, name: str) -> Array:
        values = [getattr(part, name) for part in self.parts]
        return values[0] if len(values) == 1 else jnp.stack(values)

    def _in_blocks(self, states: Any, evaluate, axes: tuple[int, ...]) -> Array:
        """Blocks of few sizes, so that memory is bounded and few programs are compiled."""
        blocks = padded_blocks(self._states(states), LARGEST_WORK // len(self.parts[0].states))
        found = [np.asarray(evaluate(jnp.asarray(block)))[:length] for block, length in blocks]
        outputs = sum(len(part.process_variance) for part in self.parts)
        shape = (0, *axes, *([outputs] if self.vector else []))
        return jnp.asarray(np.concatenate(found) if found else np.zeros(shape))

    def _traced(self, states: Any) -> bool:
        return is_traced((states, self.parts))

    @property
    def _value(self) -> Orders:
        return (0,) * self.dim

    def _orders(self, orders: Any) -> Orders:
        return self._checked_orders(orders, max(1.0, 2.0 * self.parts[0].correlation.smoothness), "map")

    def _field_orders(self, orders: Any) -> Orders:
        smoothness = self.parts[0].correlation.smoothness
        return self._value if orders is None else self._checked_orders(orders, smoothness, "random field")

    def _checked_orders(self, orders: Any, most: float, what: str) -> Orders:
        orders = tuple(orders)
        whole = all(isinstance(o, int | np.integer) and o >= 0 for o in orders)
        if len(orders) != self.dim or not whole or max(orders) > most:
            name = type(self.parts[0].correlation).__name__
            raise ValueError(
                f"`orders` must be {self.dim} integers from 0, one per column, at most {most:g} each: more derivatives "
                f"the {what} with {name} correlation does not have; got {orders!r}. Matern52 and Gaussian have more."
            )
        return tuple(int(o) for o in orders)


def _correlation(correlation: Any) -> AbstractCorrelation:
    correlation = Gaussian() if correlation is None else correlation
    if not isinstance(correlation, AbstractCorrelation):
        raise TypeError(f"`correlation` must be a correlation such as jfsm.Gaussian(); got {correlation!r}.")
    return correlation


def _numbers(value: Any, name: str, ndim: int | tuple[int, ...]) -> Array:
    if isinstance(value, Tracer):
        return value
    array = value if name != "log_parameters" else np.asarray(value)
    if name == "log_parameters" and np.any(np.isneginf(array)):  # a nugget of zero
        return jnp.asarray(array)
    return jnp.asarray(as_array(array, name, ndim))


def _point(log_parameters: Any, states: Any, force: Any, trend: Any) -> tuple[Array, Array, Array, PolynomialTrend]:
    """Arguments of a function of the hyper-parameters, checked as far as they are not traced."""
    require_x64()
    trend = as_trend(trend)
    log_parameters = _numbers(log_parameters, "log_parameters", 1)
    states, force = _numbers(states, "states", 2), _numbers(force, "force", (1, 2))
    if log_parameters.shape != (states.shape[1] + 1,):
        raise ValueError(
            f"`log_parameters` must hold the logarithms of {states.shape[1]} length scales and of the nugget, "
            f"shape ({states.shape[1] + 1},); got shape {log_parameters.shape}."
        )
    if not isinstance(states, Tracer) and not isinstance(force, Tracer):
        check_readings(states, force, len(trend.exponents(states.shape[1])))
    return log_parameters, states, force, trend


@eqx.filter_jit
def _likelihood(log_parameters, states, force, correlation, trend, restricted):
    _, basis = trend_basis(trend, states)
    columns = force.reshape(len(states), -1)
    readings = Readings(states, basis, columns, jnp.ones(len(states)), correlation, None, restricted)
    return _negative_log_likelihood(log_parameters, readings, jnp.zeros(()))


@eqx.filter_jit
def _left_out(log_parameters, states, force, correlation, trend):
    basis, f = trend_basis(trend, states)
    readings = Readings(states, f, force.reshape(len(states), -1), jnp.ones(len(states)), correlation, None, False)
    errors, _ = condition(readings, basis, log_parameters, jnp.zeros(())).left_out()
    return errors.reshape(force.shape)


def _scaled(part: AbstractPosterior) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points in standard deviations of their columns, and these."""
    states = np.asarray(part.states)
    scale = states.std(axis=0)
    return states / scale, scale


def _reach(part: AbstractPosterior) -> Float[Array, ""]:
    return jnp.asarray(reach_of(_scaled(part)[0], part.trend.triangle.shape[0]))

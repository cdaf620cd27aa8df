"""The field given what was read: mean, derivatives and their standard errors, at fixed hyper-parameters."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from .correlations import AbstractCorrelation
from .inverse import inverse_diagonal
from .likelihood import Readings, matrix, noisy_diagonal, process_variance, scaled_states, whiten
from .trend import TrendBasis

Orders = tuple[int, ...]


class AbstractPosterior(eqx.Module):
    """Outputs that share their hyper-parameters, with a mean and a covariance everywhere."""

    correlation: eqx.AbstractVar[AbstractCorrelation]
    trend: eqx.AbstractVar[TrendBasis]
    states: eqx.AbstractVar[Float[Array, "n dim"]]
    length_scale: eqx.AbstractVar[Float[Array, " dim"]]
    nugget: eqx.AbstractVar[Float[Array, ""]]
    jitter: eqx.AbstractVar[Float[Array, ""]]
    process_variance: eqx.AbstractVar[Float[Array, " outputs"]]
    trend_coefficients: eqx.AbstractVar[Float[Array, "p outputs"]]
    """β of eq. 65, of the orthonormal functions."""
    weights: eqx.AbstractVar[Float[Array, "n outputs"]]
    """K⁻¹(g - Fβ) of eq. 69."""

    def derivatives(self, states: Float[Array, "q dim"], orders: tuple[Orders, ...]) -> Float[Array, "q d outputs"]:
        """Eq. 69 and its derivatives at several states."""
        found = []
        for beta in orders:
            trend, correlation = self._at(states, beta)
            found.append(trend @ self.trend_coefficients + correlation @ self.weights)  # eq. 69
        return jnp.stack(found, axis=1)

    def standard_errors(self, states: Float[Array, "q dim"], orders: Orders) -> Float[Array, "q outputs"]:
        """Standard error of the force, or of its derivative, with that of the trend coefficients in it."""
        explained, unexplained = self._prediction(states, orders)
        share = self.correlation.variance_of_derivative(self.length_scale, orders)
        share = share - jnp.sum(explained**2, axis=0) + jnp.sum(unexplained**2, axis=0)
        return jnp.sqrt(jnp.maximum(share, 0.0)[:, None] * self.unbiased_variance[None])

    def covariance(self, states: Float[Array, "q dim"]) -> Float[Array, "q q"]:
        """Covariance of the force between states, over the process variance."""
        explained, unexplained = self._prediction(states, (0,) * states.shape[1])
        prior = self.correlation.between(states, states, self.length_scale)
        return prior - explained.T @ explained + unexplained.T @ unexplained

    @property
    @abc.abstractmethod
    def unbiased_variance(self) -> Float[Array, " outputs"]:
        """σ² as error bars need it."""

    @abc.abstractmethod
    def _prediction(self, states: Float[Array, "q dim"], orders: Orders) -> tuple[Array, Array]:
        """Columns (_, q) whose squares what was read explains of the prior's variance, and columns whose squares the
        doubt about what was learned adds to it."""

    def _at(self, states: Float[Array, "q dim"], orders: Orders) -> tuple[Array, Array]:
        return self.trend(states, orders), self.correlation.between(states, self.states, self.length_scale, orders)


class Posterior(AbstractPosterior):
    """The field given readings of the force, each with noise of its own."""

    correlation: AbstractCorrelation
    trend: TrendBasis
    states: Float[Array, "n dim"]
    length_scale: Float[Array, " dim"]
    nugget: Float[Array, ""]
    jitter: Float[Array, ""]
    relative_noise: Float[Array, " n"]
    process_variance: Float[Array, " outputs"]
    trend_coefficients: Float[Array, "p outputs"]
    weights: Float[Array, "n outputs"]
    factor: Float[Array, "n n"]
    basis: Float[Array, "n p"]
    """U of L⁻¹F = U T."""
    triangle: Float[Array, "p p"]
    unbias: Float[Array, ""]

    def left_out(self) -> tuple[Float[Array, "n outputs"], Float[Array, "n outputs"]]:
        """Error of the prediction of every reading from all others, and its standard error, noise included.

        Notes
        -----
        With P = K⁻¹ - VVᵀ the error of reading i is (P g)_i / P_ii and its variance σ²/P_ii (Dubrule 1983), the
        hyper-parameters kept.
        """
        v = solve_triangular(self.factor, self.basis, lower=True, trans=1)
        pivot = inverse_diagonal(self.factor) - jnp.sum(v**2, axis=1)
        return self.weights / pivot[:, None], jnp.sqrt(self.unbiased_variance[None] / pivot[:, None])

    @property
    def unbiased_variance(self) -> Float[Array, " outputs"]:
        """σ² over n - p: eq. 66 divides by n."""
        return self.process_variance * self.unbias

    def _prediction(self, states: Float[Array, "q dim"], orders: Orders) -> tuple[Array, Array]:
        """L⁻¹r (n, q), whose squares the readings explain of the variance, and T⁻ᵀ(f - FᵀK⁻¹r) (p, q), whose squares
        the trend coefficients add to it."""
        trend, correlation = self._at(states, orders)
        explained = solve_triangular(self.factor, correlation.T, lower=True)
        trend_of = self.triangle.T @ (self.basis.T @ explained)  # FᵀK⁻¹r
        return explained, solve_triangular(self.triangle, trend.T - trend_of, trans=1)


class FilteredPosterior(AbstractPosterior):
    """The field given a motion that was filtered together with it: with Z at the `states`, R = LLᵀ and γ = L⁻¹Z, the
    trend coefficients β and γ are jointly normal."""

    correlation: AbstractCorrelation
    trend: TrendBasis
    states: Float[Array, "n dim"]
    """Nodes, at which the field is a state of the filter."""
    length_scale: Float[Array, " dim"]
    nugget: Float[Array, ""]
    jitter: Float[Array, ""]
    process_variance: Float[Array, " outputs"]
    trend_coefficients: Float[Array, "p outputs"]
    weights: Float[Array, "n outputs"]
    factor: Float[Array, "n n"]
    """L, of the nodes without noise."""
    doubt: Float[Array, "both both"]
    """Root C of the covariance CCᵀ of (β, γ), over σ."""

    @property
    def unbiased_variance(self) -> Float[Array, " outputs"]:
        """σ² as it is."""
        return self.process_variance

    def _prediction(self, states: Float[Array, "q dim"], orders: Orders) -> tuple[Array, Array]:
        trend, correlation = self._at(states, orders)
        explained = solve_triangular(self.factor, correlation.T, lower=True)
        return explained, self.doubt.T @ jnp.concatenate([trend.T, explained])


@eqx.filter_jit
def condition(
    readings: Readings, trend: TrendBasis, log_parameters: Float[Array, " parameters"], jitter: Float[Array, ""]
) -> Posterior:
    """The field given the readings."""
    length_scale, nugget = jnp.exp(log_parameters[:-1]), jnp.exp(log_parameters[-1])
    z, diagonal = scaled_states(readings.states, length_scale), noisy_diagonal(readings, nugget, jitter)
    white = whiten(matrix(readings.correlation, z, diagonal), readings.basis, readings.force)
    n, p = readings.basis.shape
    variance = process_variance(readings, jnp.sum(white.residual**2, axis=0), nugget)
    as_it_is = readings.restricted or readings.noise_variance is not None
    return Posterior(
        correlation=readings.correlation,
        trend=trend,
        states=readings.states,
        length_scale=length_scale,
        nugget=nugget,
        jitter=jitter,
        relative_noise=readings.relative_noise,
        process_variance=variance,
        trend_coefficients=white.trend_coefficients,
        weights=solve_triangular(white.factor, white.residual, lower=True, trans=1),
        factor=white.factor,
        basis=white.basis,
        triangle=white.triangle,
        unbias=jnp.asarray(1.0 if as_it_is else n / (n - p)),
    )


derivatives_at = eqx.filter_jit(AbstractPosterior.derivatives)
standard_errors_at = eqx.filter_jit(AbstractPosterior.standard_errors)
left_out = eqx.filter_jit(Posterior.left_out)


@eqx.filter_jit
def draw(
    posterior: AbstractPosterior, states: Float[Array, "q dim"], count: int, key: Array
) -> Float[Array, "count q outputs"]:
    """Force at the states in several equally plausible maps."""
    covariance = posterior.covariance(states)
    values, vectors = jnp.linalg.eigh(covariance)
    root = vectors * jnp.sqrt(jnp.maximum(values, 0.0))[None]
    outputs = posterior.process_variance.shape[0]
    normal = jax.random.normal(key, (count, len(states), outputs))
    mean = posterior.derivatives(states, ((0,) * states.shape[1],))[:, 0]
    scatter = jnp.einsum("qr,cro->cqo", root, normal)
    return mean[None] + scatter * jnp.sqrt(posterior.unbiased_variance)[None, None]

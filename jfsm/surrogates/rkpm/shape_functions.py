"""Shape functions of the reproducing kernel at one point; `jax.vmap` serves many."""

from typing import NamedTuple

import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from .basis import DerivativeTargets, MultiIndex, derivative_targets, monomials
from .windows import AbstractWindow


class LocalBasis(NamedTuple):
    """The monomials at the nodes around one point, weighted and made orthonormal: √W H = Q R, so that M = RᵀR."""

    q: Float[Array, "nodes basis"]
    r: Float[Array, "basis basis"]
    root_weight: Float[Array, " nodes"]
    dilation: Float[Array, " dim"]
    order: int

    @property
    def conditioning(self) -> Float[Array, ""]:
        """Smallest over largest pivot of R, about 1/√cond(M); zero when the nodes cannot tell the monomials apart."""
        pivots = jnp.abs(jnp.diagonal(self.r))
        return jnp.min(pivots) / jnp.max(pivots)

    @property
    def leverage(self) -> Float[Array, " nodes"]:
        """Share of each node's own reading in the fit at that node, 0 to 1."""
        return jnp.sum(self.q**2, axis=1)

    def derivatives(
        self, targets: DerivativeTargets, force: Float[Array, "nodes *outputs"]
    ) -> Float[Array, "derivatives *outputs"]:
        """Σ θ_i^β u_i, eqs. 11 and 46, for every target β; the polynomial through the readings comes first."""
        # Many shape functions of one basis are no way to it: XLA's threads wait for ever on a product behind the solve.
        weighted = self.root_weight[:, None] * force.reshape(force.shape[0], -1)
        polynomial = solve_triangular(self.r, self.q.T @ weighted)
        return (self._scaled(targets) @ polynomial).reshape(-1, *force.shape[1:])

    def shape_functions(self, targets: DerivativeTargets) -> Float[Array, " nodes"]:
        """θ_i^β of eq. 46 for the first target β; ψ_i of eq. 28 where its orders are zero."""
        return self.root_weight * (self.q @ solve_triangular(self.r, self._scaled(targets)[0], trans=1))

    def _scaled(self, targets: DerivativeTargets) -> Float[Array, "derivatives basis"]:
        return targets.at_origin * targets.per_unit(self.dilation)[:, None]


def safe_root(values: Float[Array, "..."]) -> Float[Array, "..."]:
    """Square root whose derivative is zero, not infinite, where it is zero itself."""
    positive = values > 0.0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, values, 1.0)), 0.0)


def window_weights(z: Float[Array, "*nodes dim"], window: AbstractWindow) -> Float[Array, "*nodes"]:
    """φ of the radial distance in dilations; smooth where a node and the point coincide."""
    return window(safe_root(jnp.sum(z**2, axis=-1)))


def moment_matrix(
    z: Float[Array, "nodes dim"], weight: Float[Array, " nodes"], order: int
) -> Float[Array, "basis basis"]:
    """M = Σ H(z_i) H(z_i)ᵀ w_i, eqs. 25 and 26, at one point."""
    h = monomials(z, order)
    return h.T @ (weight[:, None] * h)


def local_basis(
    point: Float[Array, " dim"],
    nodes: Float[Array, "nodes dim"],
    dilation: Float[Array, " dim"],
    *,
    order: int,
    window: AbstractWindow,
    multiplicity: Float[Array, " nodes"] | None = None,
) -> LocalBasis:
    """Orthonormal weighted monomials around one point.

    Parameters
    ----------
    point : (dim,) float array
    nodes : (nodes, dim) float array
        The neighbours; those outside the window's support weigh nothing.
    dilation : (dim,) float array
        Scale of the window and of the monomials per axis, in the unit of that axis.
    order : int
        Highest total order of the monomials.
    window : AbstractWindow
    multiplicity : (nodes,) float array, optional
        How many readings each node stands for.

    Notes
    -----
    Arguments of the monomials are (x - x_i)/dilation, where the paper has x - x_i: in metres and metres per second
    the moment matrix of a cubic basis reaches conditions of 1e13. M itself is not formed: the triangle R of √W H
    has the square root of its condition.
    """
    z = (point[None, :] - nodes) / dilation[None, :]
    weight = window_weights(z, window)
    if multiplicity is not None:
        weight = weight * multiplicity
    root = safe_root(weight)
    q, r = jnp.linalg.qr(root[:, None] * monomials(z, order))
    return LocalBasis(q, r, root, dilation, order)


def shape_functions(
    point: Float[Array, " dim"],
    nodes: Float[Array, "nodes dim"],
    dilation: Float[Array, " dim"],
    *,
    order: int,
    window: AbstractWindow,
    orders: MultiIndex | None = None,
) -> Float[Array, " nodes"]:
    r"""Shape functions at one point: :math:`u(x) \approx \sum_i \psi_i(x) u_i`.

    Parameters
    ----------
    point, nodes, dilation, order, window
        As for `local_basis`.
    orders : tuple of int, optional
        Derivative to be reproduced, one order per axis; the value when None. Sums to `order` at most.

    Returns
    -------
    psi : (nodes,) float array
        In 1/unit of each differentiated axis. Reproduces every monomial up to `order`, or its derivative, exactly.
        Not finite where `nodes` cannot tell the monomials apart (`LocalBasis.conditioning` is zero there).

    Notes
    -----
    :math:`\theta_i^\beta(x) = (-1)^{|\beta|} H^T(x - x_i) M^{-1}(x) H^\beta(0) \phi_a(x - x_i)`, eqs. 28 and 46.
    """
    local = local_basis(point, nodes, dilation, order=order, window=window)
    beta = (0,) * point.shape[0] if orders is None else orders
    return local.shape_functions(derivative_targets([beta], order))

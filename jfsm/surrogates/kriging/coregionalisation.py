"""Outputs that tell of each other: every one a mixture of the same independent fields.

The linear model of coregionalisation, g_i = Σ_k W_ik z_k, each z_k with length scales, variance and nugget of its own.
Its signals and its noise may both correlate between outputs: any two covariances are diagonal in one basis. In
A = W⁻¹ the likelihood is that of the fields y_k = A_k g less n ln|det A|. It climbs in turns: the hyper-parameters
of every field at fixed A, then A at fixed hyper-parameters, where the misfits of all fields are quadratic in its rows.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float
from numpy.typing import NDArray

from .fitting import Fitted, Options, Part, fit_part, merged
from .posterior import Posterior

TURNS = 30
ENOUGH = 0.01
"""Nats of a turn after which no other is taken."""
SWEEPS = 100
STILL = 1e-10
"""Change of a row, relative to itself, from which a sweep moves nothing."""


class Mixed(NamedTuple):
    """Independent fields and how they make the outputs."""

    fields: list[Fitted]
    mixing: NDArray[np.float64]
    """W (outputs, fields)."""
    negative_log_likelihood: NDArray[np.float64]
    """Of every field, with its part of -n ln|det A|, in nats."""


def fit_mixed(part: Part, options: Options) -> Mixed:
    """Mixture of largest likelihood, never below that of separate outputs, from which it sets out.

    Parameters
    ----------
    part : Part
        Readings of all outputs.

    Raises
    ------
    ValueError
        If an output, or a sum of several, holds nothing beyond the trend.
    """
    part, remarks = merged(part, options)
    force = part.readings.force
    unmixing: NDArray[np.float64] = np.eye(force.shape[1])
    fields, value = _fields(part, force, unmixing, options, None)
    for _ in range(TURNS):
        misfits = np.stack([np.asarray(_misfit(one.posterior, jnp.asarray(force))) for one in fields])
        unmixing = _unmixed(unmixing, misfits)
        fields, next_value = _fields(part, force, unmixing, options, fields)
        gained, value = np.sum(value) - np.sum(next_value), next_value
        if gained < ENOUGH:
            break
    fields[0] = fields[0]._replace(remarks=(*remarks, *fields[0].remarks))
    return Mixed(fields, np.asarray(np.linalg.inv(unmixing), dtype=float), value)


def _fields(
    part: Part,
    force: NDArray[np.float64],
    unmixing: NDArray[np.float64],
    options: Options,
    before: list[Fitted] | None,
) -> tuple[list[Fitted], NDArray[np.float64]]:
    """Every field at its own largest likelihood, and its value."""
    found = []
    for k, row in enumerate(unmixing):
        own = part._replace(readings=part.readings._replace(force=(force @ row)[:, None]))
        found.append(fit_part(own, options, None if before is None else before[k].log_parameters))
    freedom = _freedom(found[0].posterior, options)
    volume = freedom * np.linalg.slogdet(unmixing)[1] / len(found)
    return found, np.array([one.negative_log_likelihood - volume for one in found])


def _freedom(posterior: Posterior, options: Options) -> int:
    n, p = posterior.basis.shape
    return n - p if options.restricted else n


@eqx.filter_jit
def _misfit(posterior: Posterior, force: Float[Array, "n outputs"]) -> Float[Array, "outputs outputs"]:
    """(g_i - Fβ_i)ᵀ K⁻¹ (g_j - Fβ_j) of the outputs under the correlation of one field."""
    white = solve_triangular(posterior.factor, force, lower=True)
    white = white - posterior.basis @ (posterior.basis.T @ white)
    return white.T @ white


def _unmixed(unmixing: NDArray[np.float64], misfits: NDArray[np.float64]) -> NDArray[np.float64]:
    """A that makes Σ_k ½ ln A_k S_k A_kᵀ - ln|det A| smallest, given the misfits S (fields, outputs, outputs).

    Notes
    -----
    Row by row: A_k along S_k⁻¹A⁻¹e_k, which is exact while the other rows stay.

    Raises
    ------
    ValueError
        If a misfit is singular.
    """
    scale = np.sqrt(np.mean(np.diagonal(misfits, axis1=1, axis2=2), axis=0))
    if not np.all(scale > 0.0) or np.any(np.linalg.cond(misfits / np.outer(scale, scale)) > 1e12):
        raise ValueError(
            "`outputs='coregionalised'` needs outputs that each tell something beyond the trend and the other outputs; "
            "one is a sum of the others, or constant. Leave it out, or take `outputs='separate'`."
        )
    misfits, unmixing = misfits / np.outer(scale, scale), unmixing * scale
    for _ in range(SWEEPS):
        before = unmixing.copy()
        for k, misfit in enumerate(misfits):
            row = np.linalg.solve(unmixing @ misfit, np.eye(len(misfits))[k])
            unmixing[k] = row / np.sqrt(row @ misfit @ row)
        if np.max(np.abs(unmixing - before)) < STILL:
            break
    return unmixing / scale

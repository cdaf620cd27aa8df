"""What one reading makes of an estimated state: the step that all Kalman filters here share."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Float

from .._types import Array


class Updated(NamedTuple):
    """Moments of the state given the reading; variance of the innovation, and its gain."""

    mean: Float[Array, " state"]
    covariance: Float[Array, "state state"]
    variance: Float[Array, ""]
    gain: Float[Array, " state"]


def measurement_update(
    mean: Float[Array, " state"],
    covariance: Float[Array, "state state"],
    row: Float[Array, " state"],
    error: Float[Array, ""],
    noise: Float[Array, ""],
    use: Float[Array, ""],
) -> Updated:
    r"""Mean and covariance of a Gaussian state once one reading of it is known.

    Parameters
    ----------
    mean, covariance : (state,) and (state, state) arrays
        Moments predicted for the state.
    row : (state,) array
        Derivative of the reading by the state.
    error : scalar
        The innovation: the reading less what `mean` predicts of it, in the unit of the reading.
    noise : scalar
        Variance of the reading's noise, positive.
    use : scalar
        1 to use the reading; 0 to leave the moments as they are and find the variance of the innovation alone.

    Returns
    -------
    Updated

    Notes
    -----
    With the variance :math:`s = h P h^\top + r` of the innovation :math:`e` and the gain :math:`k = P h^\top / s`,

    .. math:: m \leftarrow m + k\,e, \qquad P \leftarrow P - k\,h P.

    This is the update of [1]_ for one reading. Several readings of an instant are taken one after the other [2]_, each
    with the row and the error at the mean that the earlier ones have left: nothing is inverted but a positive number.
    Products are written as sums, which XLA fuses into the loop over samples. As the covariance takes no part in the
    mean, several means with one covariance are updated together by `jax.vmap` over `mean` and `error`.

    References
    ----------
    .. [1] R. E. Kalman, J. Basic Eng. 82 (1960) 35-45.
    .. [2] G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press, 1977.
    """
    cross = jnp.sum(covariance * row[None, :], 1)
    variance = jnp.sum(row * cross) + noise
    gain = use * cross / variance
    return Updated(mean + gain * error, covariance - gain[:, None] * cross[None, :], variance, gain)

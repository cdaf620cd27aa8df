"""The force that a structure lacks, from the force beside its linear part, with the error of both."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..plant import Plant, force_along


def less_known(
    plant: Plant, time: np.ndarray, x: np.ndarray, v: np.ndarray, force: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Force (n, dof) less that of everything the plant has beside its linear springs and dashpots; its covariance.

    `covariance` (n, 3 dof, 3 dof) is that of (x, v, force). The known force is taken as straight within the error of
    the motion; that of a law with hidden states or a delay as if the error were constant.
    """
    dof = plant.dof
    if not (len(plant.smooth) or len(plant.friction) or len(plant.memory) or len(plant.delayed) or len(plant.maps)):
        return force, covariance[:, 2 * dof :, 2 * dof :]
    known, slopes = (np.asarray(q) for q in _known(plant, jnp.asarray(x), jnp.asarray(v), jnp.asarray(time)))
    rows = np.concatenate([-slopes, np.broadcast_to(np.eye(dof), (len(x), dof, dof))], 2)
    return force - known, rows @ covariance @ rows.transpose(0, 2, 1)


@eqx.filter_jit
def _known(plant: Plant, x, v, time):
    """Force (n, dof) along a motion, and its derivatives (n, dof, 2 dof) by displacement and velocity."""
    dof = plant.dof

    def along(shift):
        ones = jnp.ones((x.shape[0], 1))
        return force_along(plant, x + ones * shift[None, :dof], v + ones * shift[None, dof:], time)

    known, by_shift = jax.linearize(along, jnp.zeros(2 * dof))
    return known, jnp.moveaxis(jax.vmap(by_shift)(jnp.eye(2 * dof)), 0, 2)

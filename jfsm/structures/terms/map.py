"""A learned force state map as a term: a law with no formula."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp

from .._term import AbstractTerm, as_link


class MapTerm(AbstractTerm):
    """Force read from a map of (d, w).

    `force_map` is called with a state (2,), columns displacement and velocity, as any force state map is.
    """

    force_map: Any
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "map"
    parameters = ()

    def force(self, d, w, z, t):
        return self.force_map(jnp.stack([d, w]))

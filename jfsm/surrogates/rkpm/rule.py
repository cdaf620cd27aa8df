"""How neighbours are weighed, from what a user asks for."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jax.core import Tracer

from ..._types import as_scalar
from .basis import basis_size
from .estimates import Rule
from .interfaces import Interface, as_interfaces, regions
from .nodes import Nodes, check_determined, check_enough
from .windows import AbstractWindow, CubicSplineWindow

NEIGHBOURS_PER_MONOMIAL = 8


def weighing_rule(
    nodes: Nodes,
    order: int,
    neighbours: int | None,
    window: AbstractWindow | None,
    dilation: Any = 1.0,
    across: Sequence[Interface] = (),
) -> Rule:
    """Rule for nodes that are known, with the defaults of `RKPM.fit`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not what `RKPM.fit` says, or a region between the interfaces cannot carry the polynomials.
    """
    window = CubicSplineWindow() if window is None else window
    if not isinstance(window, AbstractWindow):
        raise TypeError(f"`window` must be a window such as CubicSplineWindow(); got {window!r}.")
    count, least = len(nodes), basis_size(nodes.dim, order)
    neighbours = min(NEIGHBOURS_PER_MONOMIAL * least, count) if neighbours is None else neighbours
    if isinstance(neighbours, bool) or not isinstance(neighbours, int | np.integer) or not least <= neighbours <= count:
        raise ValueError(
            f"`neighbours` must be an integer from {least} (n*, eq. 72, for order {order} in {nodes.dim} dimensions) "
            f"to {count} (all distinct states); got {neighbours!r}."
        )
    share = as_scalar(dilation)
    if not isinstance(share, Tracer) and not 0.0 < share <= 1.0:
        raise ValueError(
            f"`dilation` must lie above 0 and at most at 1, where `neighbours` nodes fill the support; got {share:g}."
        )
    across = as_interfaces(across, nodes.dim)
    of_nodes = regions(nodes.states, across)
    for number in np.unique(of_nodes) if across else ():
        own = np.asarray(nodes.states)[of_nodes == number]
        try:
            check_enough(own, order)
            check_determined(own, order)
        except ValueError as error:
            raise ValueError(f"In one region between the interfaces `across`: {error}") from error
    return Rule(window, order, int(neighbours), share, across)

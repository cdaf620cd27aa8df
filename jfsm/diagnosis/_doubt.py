"""How far laws of other shapes speak against a name, by what they would gain beside it."""

from ._adequacy import white
from ._lack_of_fit import Unfit
from ._trial import Trial

UNFIT = 20.0
"""Nats that laws of other shapes must gain beside a cause, beyond chance, for it to be doubted; twice as many, for it
not to be named,"""
UNFIT_SHARE = {0: 0.02, 1: 0.1, 2: 0.05}
"""and share of the nats that its last effect gains, of own values, one effect or two: own values make up for many a
law, and two together stand for many a single one."""
_UNFIT_OF_WHITE = 0.005
"""The same where innovations are white: all else is right then."""
_UNFIT_OF_REST = 0.5
"""Share of innovations that are not white from which other shapes explain too much of them, whatever the gain."""


def doubt(winner: Trial, gained: float, unfit: Unfit) -> float:
    """How far laws of other shapes gain beside the winner, whose last effect gained so many nats; above 1: too much."""
    if white(winner):
        return max(unfit.nats - UNFIT, 0.0) / max(_UNFIT_OF_WHITE * gained - UNFIT, UNFIT)
    by_nats = max(unfit.nats - UNFIT, 0.0) / max(UNFIT_SHARE[len(winner.effects)] * gained - UNFIT, UNFIT)
    return max(by_nats, unfit.share / _UNFIT_OF_REST)

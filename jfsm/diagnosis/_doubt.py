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
UNFIT_OF_WHITE, _SHARE_OF_WHITE = 15.0, 0.005
"""The same where innovations are white: all else is right then, and chance is known. Of a hundred laws that are right
one leaves as many nats."""
_UNFIT_OF_REST = 0.5
"""Share of innovations that are not white from which other shapes explain too much of them, whatever the gain."""


def doubt(winner: Trial, gained: float, unfit: Unfit) -> float:
    """How far laws of other shapes gain beside the winner, whose last effect gained so many nats; above 1: too much."""
    if white(winner):
        return _beyond(unfit.nats, UNFIT_OF_WHITE, _SHARE_OF_WHITE * gained)
    return max(_beyond(unfit.nats, UNFIT, UNFIT_SHARE[len(winner.effects)] * gained), unfit.share / _UNFIT_OF_REST)


def _beyond(nats: float, least: float, much: float) -> float:
    """0 up to `least` nats, 1 at twice as many or at `much`, whichever is more."""
    return max(nats - least, 0.0) / max(much - least, least)

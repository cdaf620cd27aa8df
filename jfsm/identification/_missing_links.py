"""Springs that a fitted structure does not have, and that would make its records more probable."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..structures import LinearStiffness
from ._posterior import Hypothesis, Posterior
from ._unknowns import Unknown

_NATS = 15.0
"""Gain from which a spring is said to be missing: of some dozens of pairs one gains a little by chance."""


class MissingLink(NamedTuple):
    """A spring that is missing at a pair: its stiffness, and the nats that it would gain."""

    at: tuple[int, int]
    stiffness: float
    nats: float


def words_of(links: Sequence[MissingLink]) -> str:
    """Missing springs in a sentence; empty where there is none."""
    if not links:
        return ""
    each = ", ".join(f"{'-'.join(map(str, at))} (about {k:.3g}, {nats:,.0f} nats)" for at, k, nats in links)
    return (
        f"The links of the model may not be enough: springs where it has none would make the record more probable, at "
        f"{each}. `diagnose` tells them from other causes."
    )


def missing_links(posterior: Posterior, theta: np.ndarray, lane: int) -> list[MissingLink]:
    """Springs between masses that nothing ties, or to the ground, that a score test finds missing; the surest first.

    Parameters
    ----------
    posterior : Posterior
        Of a fit.
    theta : (unknowns,) array
        Where it ended, in a `lane`.

    Notes
    -----
    Every pair gets a spring of no stiffness. The gradient of the log-posterior by it, once all other unknowns have
    moved along, and the information about it tell how much one step of Newton's would gain [1]_.

    References
    ----------
    .. [1] C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50-57.
    """
    hypothesis = posterior.hypothesis
    structure, unknowns = hypothesis.structures[lane], hypothesis.unknowns[lane]
    pairs = structure.untied(LinearStiffness) if structure.dof > 1 else []
    if not pairs:
        return []
    tied = structure.having(terms=(*structure.terms, *(LinearStiffness(0.0, at=pair) for pair in pairs)))
    natural = float(np.max(np.asarray(structure.mass))) * posterior.records[0].omega ** 2
    scale = max((float(t.k) for t in structure.terms if isinstance(t, LinearStiffness)), default=natural)
    springs = tuple(
        Unknown(f"{LinearStiffness.kind}@{i}-{j}.k", 0.0, scale, False, 0.0, 1.0, low=-1.0, high=1.0) for i, j in pairs
    )
    wider = Posterior(Hypothesis((tied,), ((*springs, *unknowns),)), posterior.records, posterior.until)
    start = np.concatenate([np.zeros(len(springs)), theta])[None]
    _, (slope,), (information,) = wider.evaluate(start)
    return sorted(_found(pairs, slope, information, scale), key=lambda link: -link.nats)


def _found(pairs: list[tuple[int, int]], slope: np.ndarray, information: np.ndarray, scale: float) -> list[MissingLink]:
    """The pairs at which a spring alone would gain enough, beside all other unknowns."""
    count, found = len(pairs), []
    others = slice(count, None)
    along = np.linalg.pinv(information[others, others], hermitian=True) @ information[others, :count]
    for k, pair in enumerate(pairs):
        score = slope[k] - along[:, k] @ slope[others]
        known = information[k, k] - along[:, k] @ information[others, k]
        nats = 0.5 * score**2 / max(known, 1e-300)
        if score < 0 and nats > _NATS:  # more stiffness makes it more probable
            found.append(MissingLink(pair, float(-scale * score / known), float(nats)))
    return found

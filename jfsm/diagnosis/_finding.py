"""What a diagnosis found, and what became of every candidate."""

from dataclasses import dataclass, field

from .._result import Estimate
from ..structures import Cause

FOUND = 0.99
"""Probability of a sensor's fault that shows without a search: far beyond noise, and yet a record may lie."""


@dataclass(frozen=True)
class Finding:
    """One named cause, or one own value that is wrong.

    Attributes
    ----------
    cause, family : str
        Id of the cause, and of its family.
    at : tuple
        Its place: a link (i, j), or a channel.
    probability : float
        Of the cause, with or without other effects.
    parameters : dict
        Its numbers.
    rivals : tuple of Rival
        Causes that may stand in its place.
    sentence : str
    kind : str
        The narrowest class of laws that is sure to act there, in words.
    kind_probability : float
        Of the class.
    law_open : bool
        Whether the class is sure and the law is not: then `cause` is the most probable of its `members`.
    members : dict
        Probability of every cause of the class that has a chance.
    size : Estimate or None
        What all members share: friction [N] by the energy that it takes over the way, the damping or the stiffness that
        is added, or the rms of the force, along the motion that was measured. The interval holds that of every member.
    """

    cause: str
    family: str
    at: tuple
    probability: float
    parameters: dict[str, Estimate]
    rivals: tuple["Rival", ...] = ()
    sentence: str = ""
    kind: str = ""
    kind_probability: float = 0.0
    law_open: bool = False
    members: dict[str, float] = field(default_factory=dict)
    size: Estimate | None = None

    @classmethod
    def of_sensor(
        cls,
        cause: Cause,
        at: tuple,
        name: str,
        size: Estimate,
        sentence: str,
        kind: str,
        rivals: tuple["Rival", ...] = (),
    ) -> "Finding":
        """A sensor's fault that was found without a search: its one number by name, and what class it is of."""
        return cls(
            cause.id, cause.family, at, FOUND, {name: size}, rivals, sentence, kind, FOUND,
            members={cause.id: FOUND}, size=size,
        )  # fmt: skip


@dataclass(frozen=True)
class Rival:
    """Another cause that this record cannot rule out."""

    cause: str
    at: tuple
    probability: float


@dataclass(frozen=True)
class CandidateResult:
    """A candidate that was tried.

    `evidence` counts in nats from the refitted model, `error` is its multi-step prediction error per set as a share of
    the signal, `kappa` the smallest share of the refit's excess power that it explains, `why` the reason in words.
    Of one that was fitted, `left` is what it leaves beyond noise and chance, as a share of the signal, `whiteness` the
    largest lag-one correlation of its innovations, and `unfit` the nats that forces of other shapes would gain beside
    it, where that was asked.
    """

    cause: str
    at: tuple
    evidence: float
    error: dict[str, float]
    kappa: float
    probability: float
    parameters: dict[str, Estimate]
    why: str
    left: float | None = None
    whiteness: float | None = None
    unfit: float | None = None

"""A record looked at before anything is fitted: each look a named check with what was measured and its limit."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm._result import Check, Relation, holds
from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._checks import Finding, strongest_frequency
from jfsm.records._comparison import Comparison, Reading
from jfsm.records._consistency import KINDS, comparisons, of_polarity
from jfsm.records._decay import growth_of
from jfsm.records._defects import clipped
from jfsm.records._figures import plus_minus
from jfsm.records._loudest import loudest_part
from jfsm.records._mended import hung_words, mended, torn_and_hung, torn_words
from jfsm.records._noise_floor import SHORTEST
from jfsm.records._polarity import ERRORS, polarity
from jfsm.records._power import ERRORS as POWER_ERRORS
from jfsm.records._power import Power, mean_power
from jfsm.records._rest import Span, rest_words, rough_noise, span_of_motion
from jfsm.records._silence import silent_forces
from jfsm.records._torn import far_outside
from jfsm.records._unit_factors import likely_unit, miss

FLAT = 1e-12  # of the largest value: an extent below it is rounding
SAME_FACTOR = 0.03  # distance, as a logarithm, from a factor between units, where channels of one point are compared
AGREES = 0.9  # agreement from which two channels of one point tell of the same motion
STAYS, DECAYS = 0.95, 0.8  # power of the last quarter, in that of the first, from which a motion stays; below it decays
FEWEST_PERIODS = 5.0
FEWEST_SAMPLES = 32
CLEAR = 0.7  # share of a force's variance below which its noise leaves a signal


class LookKind(NamedTuple):
    """What is the same wherever a look is made."""

    relation: Relation
    unit: str
    asks: str


LOOKS: Mapping[str, LookKind] = {
    "channel_moves": LookKind(">", "unit of the channel", "No channel shows one value throughout."),
    "no_torn_samples": LookKind(
        "<=", "samples", "No sample is far outside of all others, as a mark of an overload is; such are left out."
    ),
    "no_hung_samples": LookKind(
        "<=", "samples", "No response repeats one value while it ought to move; such stretches are left out."
    ),
    "moves_throughout": LookKind("<=", "share of the samples", "Nothing rests for long; rest is left out."),
    "signs_agree": LookKind(">", "gain", "Displacement, velocity and acceleration of a point have one sign."),
    "scales_agree": LookKind(
        ">",
        "log of a ratio",
        "Displacement, velocity and acceleration of a point are not apart by a factor between units.",
    ),
    "takes_energy": LookKind(
        ">=", "W", "The mean power of a force along an imposed motion is not negative: a passive part takes energy."
    ),
    "pushes_forward": LookKind(
        ">=",
        "standard errors",
        "A force does not move its point as if mass and stiffness were negative.",
    ),
    "drive_measured": LookKind("<", "ratio", "Where no force was measured, the motion decays: nobody drove it unseen."),
}
"""In the order in which a record is looked at."""


@dataclass(frozen=True)
class Look:
    """What a record shows before anything is fitted.

    Attributes
    ----------
    checks : tuple of Check
        Every look, passed or not.
    span : Span
        Samples between which something moves.
    pairs : tuple of Comparison
        Displacement, velocity and acceleration of each point against one another.
    inverted : tuple of (kind, dof)
        Channels of the wrong sign; where only a relative sign is wrong, the one that was derived, or the force.
    """

    checks: tuple[Check, ...]
    span: Span
    pairs: tuple[Comparison, ...]
    inverted: tuple[tuple[str, int], ...]

    @property
    def failed(self) -> tuple[Check, ...]:
        """The looks that show something."""
        return tuple(check for check in self.checks if not check.passed)


def look(record: AbstractRecord) -> Look:
    """Dead, torn, hung and resting parts of a record, signs and sizes of its channels, and what drives it.

    No model is asked, and nothing is fitted.

    Parameters
    ----------
    record : Record
        On a uniform clock.

    Raises
    ------
    ValueError
        If time is uneven; the message names the remedy.
    """
    if len(record) < FEWEST_SAMPLES:
        return Look(tuple(_dead(record)), Span(0, len(record)), (), ())
    sound = mended(record)
    checks = [*_dead(record), *_torn(record), *_torn_base(record)]
    span = span_of_motion(sound)
    share = 1.0 - (span.end - span.begin) / len(record)
    checks.append(_checked("moves_throughout", "record", share, 0.0, "; ".join(rest_words(record, span)) or "moves"))
    moving = sound[span.begin : span.end] if share else sound
    loudest = loudest_part(moving)
    pairs, signs, inverted = _signs_and_scales(loudest)
    checks += signs
    power = [*_powers(loudest)]
    checks += power
    inverted += [("force", int(check.of.split()[1])) for check in power if not check.passed]
    pushes = [*_pushes(loudest, [f"{kind} {j}" for kind, j in inverted])]
    checks += pushes
    for check in pushes:
        if not check.passed:
            inverted = _with_force(inverted, int(check.of.split()[1]), loudest)
    undriven = [*_undriven(moving)]
    checks += undriven
    if not all(check.passed for check in undriven):
        checks += _dead_forces(record)
    return Look(tuple(checks), span, pairs, tuple(dict.fromkeys(inverted)))


def _checked(name: str, of: str, measured: float, limit: float, says: str, passed: bool | None = None) -> Check:
    kind = LOOKS[name]
    outcome = holds(measured, kind.relation, limit) if passed is None else passed
    return Check("sensors", name, of, float(measured), kind.relation, float(limit), kind.unit, outcome, says)


def is_constant(y: np.ndarray) -> bool:
    """Whether a channel shows one value, but for rounding."""
    return float(np.ptp(y)) <= FLAT * float(np.max(np.abs(y)))


def _dead(record: AbstractRecord) -> Iterator[Check]:
    """A constant force may be a load; a channel that has to be predicted is dead."""
    for channel, y in {**record.responses, **record.answers}.items():
        yield _moves(record, channel, y)


def _dead_forces(record: AbstractRecord) -> Iterator[Check]:
    """Where the motion goes on, a constant force is no load: it does not drive it."""
    for channel, y in record.channels.items():
        if channel[0] == "force" and np.any(y) and is_constant(y):
            yield _moves(record, channel, y)


def _moves(record: AbstractRecord, channel: tuple[str, int], y: NDArray[np.float64]) -> Check:
    kind, j = channel
    unit, extent = record.units[kind], float(np.ptp(y))
    says = f"{kind} {j} moves by {extent:.4g} {unit}"
    if is_constant(y):
        says = (
            f"{kind} {j} is constant ({y[0]:.4g} {unit}): nothing was measured there. Leave the channel out of the "
            f"record, or mend its sensor"
        )
    return _checked("channel_moves", f"{kind} {j}", extent, FLAT * float(np.max(np.abs(y))), says)


def _torn(record: AbstractRecord) -> Iterator[Check]:
    for (kind, j), y in record.channels.items():
        torn, hung = torn_and_hung(kind, y)
        name = f"{kind} {j}"
        words = torn_words(record.time, y, torn, record.units[kind]) if np.any(torn) else "no sample is torn"
        yield _checked("no_torn_samples", name, int(torn.sum()), 0, words.rstrip("."))
        words = hung_words(record.time, hung) if np.any(hung) else "no sample repeats the one before"
        yield _checked("no_hung_samples", name, int(hung.sum()), 0, words.rstrip("."))


def _torn_base(record: AbstractRecord) -> Iterator[Check]:
    base = record.base_acceleration
    if base is not None:
        torn = far_outside("base_acceleration", base)
        words = torn_words(record.time, base, torn, record.units["base_acceleration"]) if np.any(torn) else "none torn"
        yield _checked("no_torn_samples", "base_acceleration", int(torn.sum()), 0, words.rstrip("."))


def _readings(record: AbstractRecord, dof: int) -> dict[str, Reading]:
    """The motion of one point as it is compared; an acceleration relative to the base."""
    found = {}
    for kind in KINDS:
        y = record.channels.get((kind, dof))
        if y is None or y.size < SHORTEST or is_constant(y):
            continue
        noise, lost = rough_noise(y), clipped(y) | record.lost.get((kind, dof), np.zeros(y.size, dtype=bool))
        if kind == "acceleration" and record.base_acceleration is not None:
            y, noise = y - record.base_acceleration, float(np.hypot(noise, rough_noise(record.base_acceleration)))
        found[kind] = Reading(f"{kind} {dof}", y, noise, lost)
    return found


def _signs_and_scales(
    record: AbstractRecord,
) -> tuple[tuple[Comparison, ...], list[Check], list[tuple[str, int]]]:
    """Displacement, velocity and acceleration of every point against one another."""
    every, checks, inverted = list[Comparison](), list[Check](), list[tuple[str, int]]()
    for j in range(1, record.dofs + 1):
        pairs = comparisons(_readings(record, j), record.dt)
        every += pairs
        sure = [pair for pair in pairs if pair.agreement >= AGREES]
        turned = [*of_polarity(sure)]
        for pair in sure:
            gain = -pair.gain if pair.inverted else pair.gain
            says = _sign_words(pair, turned)
            checks.append(_checked("signs_agree", pair.upper, gain, 0.0, says))
            checks.append(_scale(pair))
        inverted += [_channel(finding.channel.split(", ")[-1]) for finding in turned]
    return tuple(every), checks, inverted


def _with_force(inverted: list[tuple[str, int]], dof: int, record: AbstractRecord) -> list[tuple[str, int]]:
    """The inverted channels, a force among them; where all other motion of its point is turned already, what was left
    of the motion is the one, and not the force."""
    motion = [(kind, dof) for kind in KINDS if (kind, dof) in record.channels]
    if any(channel in inverted for channel in motion):
        left = [channel for channel in motion if channel not in inverted]
        return [channel for channel in inverted if channel not in motion] + left
    return [*inverted, ("force", dof)]


def _channel(name: str) -> tuple[str, int]:
    kind, dof = name.split()
    return kind, int(dof)


def _sign_words(pair: Comparison, turned: Sequence[Finding]) -> str:
    if not pair.inverted:
        return f"{pair.upper} has the sign that {pair.lower} implies"
    alone = next((f for f in turned if "," not in f.channel and f.channel in (pair.lower, pair.upper)), None)
    wrong = (
        f"{pair.upper} has the wrong sign, or {pair.lower} has"
        if alone is None
        else f"{alone.channel} has the wrong sign"
    )
    return f"{wrong}: {pair.upper} is {pair.gain:.4g} times what {pair.lower} implies, turned over"


def _scale(pair: Comparison) -> Check:
    """How far the sizes of two channels of a point are from being apart by a factor between units."""
    known = likely_unit(pair.gain)
    off = miss(pair.gain, known)
    says = f"{pair.upper} is {pair.gain:.4g} times what {pair.lower} implies"
    if off <= SAME_FACTOR:
        says += f" (about {known.size if pair.gain > 1 else 1 / known.size:.4g}: {known.words}?)"
    return _checked("scales_agree", pair.upper, off, SAME_FACTOR, says)


def power_words(channel: str, power: Power, unit: str) -> str:
    """The mean power of a force in words."""
    mean = f"mean power {plus_minus(power.mean, power.error)} {unit}"
    if not power.is_negative:
        return f"{channel}: {mean}"
    return f"the {channel.split()[0]} channel has the wrong sign ({channel}: {mean}; a passive part takes energy)"


def _powers(record: AbstractRecord) -> Iterator[Check]:
    """The power of every force along an imposed motion; where parts are coupled, one alone may be negative."""
    if record.drive != "motion":
        return
    forces = [j for kind, j in record.channels if kind == "force"]
    found = {j: power for j in forces if (power := mean_power(record, j)) is not None}
    total = sum(power.mean for power in found.values())
    for j, power in found.items():
        wrong = power.is_negative and (len(found) == 1 or total < 0)
        words = power_words(f"force {j}", power, "W")
        yield _checked("takes_energy", f"force {j}", power.mean, -POWER_ERRORS * power.error, words, not wrong)


def _pushes(record: AbstractRecord, inverted: Sequence[str]) -> Iterator[Check]:
    """The sign of every force against the motion of its point, by the first channel whose sign is not in doubt."""
    if record.drive != "force":
        return
    for (kind, j), force in record.channels.items():
        seen = [(k, y) for k, y in ((k, record.channels.get((k, j))) for k in KINDS) if y is not None]
        seen = [(k, y) for k, y in seen if f"{k} {j}" not in inverted and not is_constant(y)]
        if kind != "force" or is_constant(force) or not seen or force.size < 8 * SHORTEST:
            continue
        motion, y = seen[0]
        against = polarity(force, y, KINDS.index(motion), record.dt, strongest_frequency(y, record.dt))
        says = f"force {j} moves {motion} {j} as mass and stiffness let it"
        if against < -ERRORS:
            says = (
                f"force {j} has the wrong sign, or all motion of that point has: it moves {motion} {j} as if mass and "
                f"stiffness were negative (by {-against:.3g} standard errors)"
            )
        yield _checked("pushes_forward", f"force {j}", against, -ERRORS, says)


def _undriven(record: AbstractRecord) -> Iterator[Check]:
    """Whether a motion that nothing measured drives decays."""
    if record.drive == "motion" or record.base_acceleration is not None or not record.responses:
        return
    forces = [y for (kind, _), y in record.channels.items() if kind == "force" and not is_constant(y)]
    if any(rough_noise(y) ** 2 < CLEAR * np.var(y) for y in forces):
        return  # as most are: the noise need not be known well
    if len(silent_forces(record)) < len(forces):
        return
    grown = growth_of(record)
    if grown is None or grown.periods < FEWEST_PERIODS:
        return
    if grown.ratio < DECAYS:
        says = "the motion decays, as a free decay does"
    elif grown.ratio < STAYS:
        return
    else:
        says = (
            f"a force that nobody measured drives it, or it drives itself: no force was measured, and its power in the "
            f"last quarter of the motion is {grown.ratio:.3g} times that in the first"
        )
    yield _checked("drive_measured", "record", grown.ratio, STAYS, says)

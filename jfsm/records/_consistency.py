"""Displacement, velocity and acceleration of one point: do they tell of the same motion, and if not, which is wrong?"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from jfsm.records._checks import ChannelSummary, Finding, strongest_frequency
from jfsm.records._comparison import Comparison, Reading, compare
from jfsm.records._figures import plus_minus, share

KINDS = ("displacement", "velocity", "acceleration")
GAIN, DELAY, OFFSET = 0.025, 0.2, 0.025  # worth a warning: relative; samples; share of the standard deviation
ERRORS = 5.0  # standard errors that a disagreement must have besides
GAIN_BLUR, DELAY_BLUR = 0.005, 0.05  # errors of no interest, beside the standard errors
CLEARLY = 16.0  # how much better, in squared errors, a channel must explain all pairs than the next one does
LEFT = 30.0  # squared errors that it may leave
FOLLOWS = 0.7  # agreement below which two channels do not tell of the same motion


class _Pair(NamedTuple):
    """A disagreement of two channels: how much the second exceeds the first, and its error."""

    lower: str
    upper: str
    excess: float
    error: float


def comparisons(readings: Mapping[str, Reading], dt: float) -> tuple[Comparison, ...]:
    """Every pair of the kinds measured at one point, by kind, compared as far as the record allows."""
    measured = [kind for kind in KINDS if kind in readings]
    found = []
    for lower, upper in combinations(measured, 2):
        order = KINDS.index(upper) - KINDS.index(lower)
        frequency = strongest_frequency(readings[measured[0]].samples, dt)
        found.append(compare(readings[lower], readings[upper], order, dt, frequency))
    return tuple(pair for pair in found if pair is not None)


def of_comparisons(
    pairs: Sequence[Comparison], summaries: Mapping[str, ChannelSummary], dt: float
) -> Iterator[Finding]:
    """What the comparisons at one point mean, with the channel at fault where three were measured."""
    apart = [pair for pair in pairs if pair.agreement < FOLLOWS]
    for pair in apart:
        message = (
            f"Only {pair.agreement:.0%} of it follows from {pair.lower}, whatever the gain and the delay. "
            f"Check that both sit at the same point and point the same way."
        )
        yield Finding("warning", pair.upper, message)
    pairs = [pair for pair in pairs if pair.agreement >= FOLLOWS]
    yield from of_polarity(pairs)
    yield from _of_gain(pairs)
    yield from _of_delay(pairs, dt)
    yield from _of_offset(pairs, summaries)


def of_polarity(pairs: Sequence[Comparison]) -> Iterator[Finding]:
    """The channel of the wrong sign where three were measured; failing that, the two that differ."""
    yield from _of_excess(
        pairs,
        [(1.0 if pair.inverted else 0.0, 0.0) for pair in pairs],
        limit=0.5,
        blur=0.1,
        of_one=lambda _, others: f"Inverted against {others}. Turn its sign.",
        of_two=lambda pair: f"{pair.upper} is inverted against {pair.lower}: turn the sign of one of them.",
        turns=True,
    )


def _of_gain(pairs: Sequence[Comparison]) -> Iterator[Finding]:
    def amount(excess: float) -> str:
        return f"{abs(np.expm1(excess)):.1%} {'more' if excess > 0 else 'less'}"

    yield from _of_excess(
        pairs,
        [(np.log(pair.gain), pair.gain_error) for pair in pairs],
        limit=GAIN,
        blur=GAIN_BLUR,
        of_one=lambda excess, others: (
            f"Reads {amount(excess)} than {others} imply. Check its calibration factor and unit."
        ),
        of_two=lambda pair: (
            f"{pair.upper} reads {amount(pair.excess)} than {pair.lower} implies: check both calibrations."
        ),
    )


def _of_delay(pairs: Sequence[Comparison], dt: float) -> Iterator[Finding]:
    def amount(excess: float) -> str:
        return f"{abs(excess):.2f} samples ({abs(excess) * dt:.3g} s) {'late' if excess > 0 else 'early'}"

    yield from _of_excess(
        pairs,
        [(pair.delay / dt, pair.delay_error / dt) for pair in pairs],
        limit=DELAY,
        blur=DELAY_BLUR,
        of_one=lambda excess, others: f"Comes {amount(excess)} against {others}. Shift it, or check its filter.",
        of_two=lambda pair: (
            f"{pair.upper} comes {amount(pair.excess)} against {pair.lower}: check the filters of both."
        ),
    )


def _of_offset(pairs: Sequence[Comparison], summaries: Mapping[str, ChannelSummary]) -> Iterator[Finding]:
    """Offsets of rates: a constant leaves no trace in a derivative, so the upper channel has it."""
    best: dict[str, Comparison] = {}
    for pair in pairs:  # the pair with one derivative between comes to an upper channel with the smaller error
        if pair.upper not in best or pair.offset_error < best[pair.upper].offset_error:
            best[pair.upper] = pair
    for channel, pair in best.items():
        summary = summaries[channel]
        if abs(pair.offset) > max(OFFSET * summary.std, ERRORS * pair.offset_error):
            message = (
                f"Offset of {plus_minus(pair.offset, pair.offset_error)} {summary.unit} that {pair.lower} does not "
                f"show: {share(abs(pair.offset) / summary.std)} of the standard deviation. Subtract it."
            )
            yield Finding("warning", channel, message)


def _of_excess(
    pairs: Sequence[Comparison],
    excesses: Sequence[tuple[float, float]],
    limit: float,
    blur: float,
    of_one: Callable[[float, str], str],
    of_two: Callable[[_Pair], str],
    turns: bool = False,
) -> Iterator[Finding]:
    """The one channel whose fault explains all pairs; failing that, each pair that disagrees.

    `excesses` are how much the upper channel of each pair exceeds the lower one, and the standard error of that.
    """
    seen, wrong = [], []
    for pair, (excess, error) in zip(pairs, excesses, strict=True):
        seen.append(_Pair(pair.lower, pair.upper, excess, float(np.hypot(error, blur))))
        if abs(excess) > max(limit, ERRORS * error):
            wrong.append(seen[-1])
    if not wrong:
        return
    named = _culprit(seen, turns)
    if named is None:
        for pair in wrong:
            yield Finding("warning", f"{pair.lower}, {pair.upper}", of_two(pair))
        return
    channel, excess = named
    others = " and ".join(dict.fromkeys(c for pair in seen for c in pair[:2] if c != channel))
    yield Finding("warning", channel, of_one(excess, others))


def _culprit(pairs: Sequence[_Pair], turns: bool) -> tuple[str, float] | None:
    """The channel that alone explains all disagreements, and its excess; None if none stands out, as in a lone pair."""
    channels = dict.fromkeys(channel for pair in pairs for channel in pair[:2])
    left = []
    for channel in channels:
        side = np.array([0.0 if channel not in pair[:2] else 1.0 if channel == pair.upper else -1.0 for pair in pairs])
        side = np.abs(side) if turns else side  # a turned sign is seen from either end alike
        excess, weight = np.array([p.excess for p in pairs]), np.array([p.error**-2.0 for p in pairs])
        own = float((weight * side) @ excess / (weight @ side**2))
        left.append((float(weight @ (excess - own * side) ** 2), channel, own))
    (best, channel, own), (second, *_), *_ = sorted(left)
    return (channel, own) if second - best > CLEARLY and best < LEFT else None

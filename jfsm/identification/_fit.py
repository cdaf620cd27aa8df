"""Values of a structure's own numbers from records."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from .._programs import programs_kept
from .._result import Result
from .._threads import side_by_side, small_matrices
from .._types import require_x64
from ..plant import Reconstruction, check_reconstruction
from ..records import Record, check_together, mended, records_of
from ..structures import Offset, Structure, as_model, check_order, is_offset
from ._maximise import Maximum, approach, finish
from ._missing_links import missing_links, words_of
from ._modes import Mode, modes_of
from ._nuisances import Nuisances, prepare_all
from ._posterior import Hypothesis, Posterior, lanes_of
from ._starts import natural_starts, starts
from ._unknowns import Unknown, bounded, free_unknown, interval, nuisance_unknowns, untied, with_offsets

_TIED = 0.98
"""Correlation from which two values cannot be told apart in practice,"""
_SURE = 0.05
"""unless each is known to this relative standard error all the same."""
_STEPS = 60
_BEGINNINGS = 4
"""Starts of a law from which a fit begins, where they climb side by side."""
_PURSUED = 2
"""Beginnings that are followed to the top."""
_REFINEMENTS = 3
_SAID = 3
"""Missing springs that are said, the surest ones."""
_LOOSE = 0.5
"""Relative standard error from which a value is hardly determined."""


@dataclass(frozen=True, repr=False)
class Fit:
    """A structure fitted to records.

    Attributes
    ----------
    structure : Structure
        The structure with the values found, and with the offsets of the first record's channels where they are
        significant.
    values : dict of path to float
    intervals : dict of path to (low, high)
        95 % intervals.
    correlations : dict of (path, path) to float
    identifiability : tuple of str
        What the records cannot tell, in words; empty where every value is determined.
    log_likelihood : float
    noise : dict of channel to float
        Standard deviation of each channel's white noise as found, of the first record.
    result : Result
    missing : str
        Springs that the structure does not have, and that would make the records more probable, in words; empty where
        there are none.
    modes : tuple of Mode
        Frequency [Hz] and damping ratio, with 95 % intervals, of every mode of the masses, linear springs and dashpots
        that oscillates and is well defined, ascending.
    """

    structure: Structure
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    correlations: dict[tuple[str, str], float]
    identifiability: tuple[str, ...]
    log_likelihood: float
    noise: dict[str, float]
    result: Result
    missing: str = ""
    modes: tuple[Mode, ...] = ()

    def __repr__(self) -> str:
        return f"<Fit, {len(self.values)} values, {self.result.value}>\n{self.structure!r}"

    def _repr_html_(self) -> str:
        """The values with their intervals and units, for a notebook."""
        from ..reporting import notebook_table

        parameters = self.structure.entries()
        rows = []
        for path, value in self.values.items():
            low, high = self.intervals[path]
            unit = parameters[path][0].unit() if path in parameters else ""
            rows.append((path, f"{value:.6g}", f"[{low:.6g}, {high:.6g}]", unit))
        caption = f"Fit of {len(self.values)} values, {self.result.value}"
        return notebook_table(caption, ("value", "fitted", "95 % interval", "unit"), rows)

    def to_dataframe(self) -> Any:
        """Value, 95 % interval and unit by path, as a DataFrame of pandas, which must be installed."""
        import pandas as pd

        parameters = self.structure.entries()
        rows = [
            {"path": path, "value": value, "low": self.intervals[path][0], "high": self.intervals[path][1],
             "unit": parameters[path][0].unit() if path in parameters else ""}
            for path, value in self.values.items()
        ]  # fmt: skip
        return pd.DataFrame(rows).set_index("path")

    def plot(self, ax: Any = None) -> Any:
        """The 95 % intervals of the fitted values, as shares of the values [%].

        Parameters
        ----------
        ax : matplotlib axes, optional
            A new figure without them.

        Returns
        -------
        matplotlib axes
        """
        from ..reporting import draw_intervals

        shown = {path: value for path, value in self.values.items() if value}
        ends = [sorted(100 * (end / value - 1) for end in self.intervals[path]) for path, value in shown.items()]
        return draw_intervals(
            list(shown), [low for low, _ in ends], [high for _, high in ends], "95 % interval about the value [%]", ax
        )


@programs_kept()
@small_matrices()
def fit(
    model: Structure,
    record: Record | Sequence[Record],
    fixed: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    *,
    since: float | None = None,
    until: float | None = None,
    reconstruction: Reconstruction = "band-limited",
) -> Fit:
    """Most probable values of a structure's numbers, with intervals.

    The likelihood is that of the innovations of an extended Kalman filter driven by the measured force; offsets,
    initial states and noise scales are found along. Where the motion is imposed it is that of the force readings: what
    the motion needs, an offset, white noise, and what the noise of the motion makes of the force.

    Parameters
    ----------
    model : Structure
        Its values are the start, and the centre of very wide prior laws.
    record : Record or sequence of Records
        Sampled evenly; unequal lengths are fine.
    fixed : sequence of paths or kinds
        Numbers that stay, e.g. ``("mass", "stiffness@0-1.k")``.
    bounds : mapping of path or kind to (low, high), optional
        In the unit of the number.
    since, until : float, optional
        Instants [s] of the records' own clocks between which they are used.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        If a name in `fixed` or `bounds` means nothing, bounds are the wrong way round, or the record cannot be used.
    """
    require_x64()
    check_order("jfsm.fit(model, record)", model, record)
    as_model(model)
    check_reconstruction(reconstruction)
    check_names(model, fixed, bounds)
    records = [part.between(since, until) for part in records_of(record)]
    check_together(records)
    records = [mended(part) for part in records]
    prepared = prepare_all(records, model, reconstruction)
    free = free_paths(model, prepared, fixed)
    held = {path: value for path, value in model.values().items() if path not in free}
    found = starts(model, prepared[0])
    if lanes_of(model) > 1:
        found += natural_starts(model, prepared[0], _BEGINNINGS - 1 - len(found))
    beginnings = [model, *(start.with_values(held) for start in found)]
    prepared = [n.resolving(beginnings) for n in prepared]
    posterior, best, lane = _best([_beginning(m, free, prepared, bounds or {}) for m in beginnings], prepared)
    posterior, best, lane = _resolved(posterior, best, lane)
    unknowns, structure = posterior.hypothesis.unknowns[lane], posterior.hypothesis.structures[lane]
    theta = best.theta[lane]
    covariance = sandwich(best.information[lane], posterior.scatter(best.theta)[lane])
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    found = {path: interval(unknowns, theta, covariance, path) for path in free}
    values = {path: float(value) for path, (value, _, _) in found.items()}
    intervals = {path: (float(low), float(high)) for path, (_, low, high) in found.items()}
    correlation = covariance / np.maximum(np.outer(error, error), 1e-300)
    pairs = {(free[i], free[j]): float(correlation[i, j]) for i in range(len(free)) for j in range(i)}
    kept = without_small_offsets(posterior.structure(theta, lane), unknowns, theta, covariance)
    noise = {
        f"{kind} {j}": float(f * np.exp(t / 2))
        for (kind, j), f, t in zip(prepared[0].channels, prepared[0].floor, _scales(unknowns, theta), strict=False)
    }
    words = _words(unknowns[: len(free)], theta, error, pairs, structure)
    missing = words_of(missing_links(posterior, theta, lane)[:_SAID])
    modes = modes_of(structure, unknowns, theta, covariance)
    value, result = -float(best.value[lane]), best.results[lane]
    return Fit(kept, values, intervals, pairs, words, value, noise, result, missing, modes)


def check_names(model: Structure, fixed: Any, bounds: Any) -> None:
    """Refuse what stays and what is bounded where that means no number of the structure, or no interval.

    Raises
    ------
    TypeError, ValueError
        It names the argument.
    """
    if not isinstance(fixed, Iterable) or hasattr(fixed, "dtype"):
        raise TypeError(f'`fixed` must be names, as ("mass", "stiffness@0-1.k"); got {fixed!r}.')
    if bounds is not None and not isinstance(bounds, Mapping):
        raise TypeError(f'`bounds` must be intervals by name, as {{"mass": (0.9, 1.1)}}; got {bounds!r}.')
    named = [("fixed", name) for name in ([fixed] if isinstance(fixed, str) else fixed)]
    for argument, name in [*named, *(("bounds", name) for name in bounds or {})]:
        if not isinstance(name, str) or not model.select(name):
            raise ValueError(
                f"`{argument}` names {name!r}, which the structure does not have; it has {', '.join(model.values())}."
            )
    for name, ends in (bounds or {}).items():
        try:
            low, high = map(float, ends)
        except (TypeError, ValueError):
            low = high = math.nan
        if not low < high:
            given = f"({', '.join(map(str, ends))})" if isinstance(ends, tuple | list) else repr(ends)
            raise ValueError(f"`bounds` of {name!r} must be (low, high) with low < high; got {given}.")


def sandwich(
    information: Float[np.ndarray, "unknowns unknowns"], scatter: Float[np.ndarray, "unknowns unknowns"]
) -> Float[np.ndarray, "unknowns unknowns"]:
    """Covariance of the estimate: H⁻¹ J H⁻¹ where it is wider than H⁻¹, [1]_ Theorem 3.2.

    H is the information, J the covariance of the gradient as the record shows it. They agree where the model is right
    and the noise white; where they do not, J knows better. It is an estimate itself, so that it widens, never narrows.

    References
    ----------
    .. [1] H. White, Econometrica 50 (1982) 1-25.
    """
    inverse = np.linalg.pinv(information, hermitian=True)
    wide = inverse @ scatter @ inverse
    ratio = np.sqrt(np.maximum(np.diag(wide) / np.maximum(np.diag(inverse), 1e-300), 1.0))
    return inverse * ratio[:, None] * ratio[None, :]


def _beginning(
    model: Structure, free: Sequence[str], prepared: Sequence[Nuisances], bounds: Mapping[str, tuple[float, float]]
) -> tuple[Structure, tuple[Unknown, ...]]:
    structure = with_offsets(model, prepared)
    unknowns = _bounded([free_unknown(structure, path, prepared[0]) for path in free], bounds, model)
    for index, nuisances in enumerate(prepared):
        unknowns += nuisance_unknowns(structure, nuisances, index)
    return structure, tuple(unknowns)


def _best(beginnings: Sequence[tuple], prepared: Sequence[Nuisances]) -> tuple[Posterior, Maximum, int]:
    """The highest top that a climb from any of the beginnings ends at, and its lane."""
    lanes = lanes_of(beginnings[0][0])
    lots = [beginnings[i : i + lanes] for i in range(0, len(beginnings), lanes)]
    posteriors = [Posterior(Hypothesis(*zip(*lot, strict=True)), prepared) for lot in lots]
    if len(posteriors) > 1:
        posteriors[0].evaluate(posteriors[0].initial())  # compiled once, before all ask for it
    rungs = list(side_by_side(approach, posteriors))
    order = np.argsort([float(np.min(rung.value)) for rung in rungs])[:_PURSUED]
    tops = list(side_by_side(lambda k: (posteriors[k], finish(posteriors[k], rungs[k], _STEPS)), order))
    if len(beginnings) == 1:  # the top rungs lead astray what is nearly right
        given = replace(rungs[0], theta=posteriors[0].initial())
        tops.append((posteriors[0], finish(posteriors[0], given, _STEPS)))
    posterior, best = min(tops, key=lambda top: float(np.min(top[1].value)))
    return posterior, best, int(np.argmin(best.value))


def _resolved(posterior: Posterior, best: Maximum, lane: int) -> tuple[Posterior, Maximum, int]:
    """The same top climbed again, while what was found moves too fast for the steps that it was found with."""
    for _ in range(_REFINEMENTS):
        records = [n.resolving([posterior.structure(best.theta[lane], lane)]) for n in posterior.records]
        if all(new is old for new, old in zip(records, posterior.records, strict=True)):
            break
        hypothesis = Hypothesis((posterior.hypothesis.structures[lane],), (posterior.hypothesis.unknowns[lane],))
        posterior = Posterior(hypothesis, records)
        best, lane = finish(posterior, replace(best, theta=best.theta[lane : lane + 1]), _STEPS), 0
    return posterior, best, lane


def free_paths(model: Structure, records: Sequence[Nuisances], fixed: Sequence[str]) -> tuple[str, ...]:
    """Paths that a fit may change; masses stay where no force gives the scale, or no inertia shows."""
    held: set[str] = set()
    for name in [fixed] if isinstance(fixed, str) else fixed:
        held.update(model.select(name))
    if not any(n.weighs(model) for n in records):
        held.update(model.select("mass"))
    return tuple(p for p, (what, _) in model.entries().items() if p not in held and what.free and not is_offset(p))


def without_small_offsets(
    structure: Structure,
    unknowns: Sequence[Unknown],
    theta: Float[np.ndarray, " unknowns"],
    covariance: Float[np.ndarray, "unknowns unknowns"],
) -> Structure:
    """The structure without the offsets that are not three standard errors from nothing.

    It carries those of the first record that measures the channel, so these decide. They go one by one, the least sure
    first, and those that stay take over its part: a spring ties the offset of a force to that of the displacement, so
    that neither may be sure before one of them is gone.
    """
    first: dict[str, int] = {}
    for k, u in enumerate(unknowns):
        if is_offset(u.path):
            first.setdefault(u.path, k)
    while first:
        sure = {path: abs(theta[k]) / math.sqrt(max(covariance[k, k], 1e-300)) for path, k in first.items()}
        path = min(sure, key=lambda path: sure[path])
        if sure[path] >= 3:
            break
        k = first.pop(path)
        along = covariance[:, k] / max(covariance[k, k], 1e-300)
        theta, covariance = theta - along * theta[k], covariance - np.outer(along, covariance[k])
    kept = [s for s in structure.sensors if not isinstance(s, Offset) or f"{s.kind}@{s.place}.b" in first]
    values = {path: unknowns[k].value(theta[k]) for path, k in first.items()}
    return structure.having(sensors=kept).with_values(values)


def _scales(unknowns: Sequence[Unknown], theta: np.ndarray) -> list[float]:
    return [t for u, t in zip(unknowns, theta, strict=True) if u.path.startswith("noise@")]


def _bounded(unknowns: list[Unknown], bounds: Mapping[str, tuple[float, float]], model: Structure) -> list[Unknown]:
    for name, (low, high) in bounds.items():
        paths = model.select(name)
        unknowns = [untied(u, model) if u.path in paths else u for u in unknowns]
        for unknown in unknowns:
            if unknown.path in paths and unknown.log and not max(low / unknown.unit, high / unknown.unit) > 0:
                sign = "positive" if unknown.unit > 0 else "negative"
                raise ValueError(
                    f"`bounds` of {name!r} must leave room for a {sign} value, as {unknown.path} has in the model; "
                    f"got ({low}, {high})."
                )
        unknowns = [bounded(u, low, high) if u.path in paths else u for u in unknowns]
    return unknowns


def _words(
    unknowns: Sequence[Unknown], theta, error, pairs: Mapping[tuple[str, str], float], structure: Structure
) -> tuple[str, ...]:
    """What the records cannot tell."""
    words = []
    relative = {
        u.path: s if u.log else s / max(abs(t), 1e-300) for u, t, s in zip(unknowns, theta, error, strict=False)
    }
    by_path = {u.path: (u, t, s) for u, t, s in zip(unknowns, theta, error, strict=False)}
    for (a, b), r in pairs.items():
        if abs(r) > _TIED and min(relative[a], relative[b]) > _SURE:
            joint = _combination(by_path[a], by_path[b], r)
            words.append(f"{a} and {b} cannot be told apart by this record (correlation {r:+.3f}); {joint} can.")
    for u, t in zip(unknowns, theta, strict=False):
        if relative[u.path] > _LOOSE:
            words.append(
                f"{u.path} is hardly determined by this record (relative standard error {relative[u.path]:.0%})."
            )
        if t <= u.low or t >= u.high:
            words.append(f"{u.path} ends at its bound {u.value(t):.6g}.")
    return tuple(words)


def _combination(first: tuple[Unknown, float, float], second: tuple[Unknown, float, float], r: float) -> str:
    """What two numbers that are tied by a correlation `r` determine together."""
    (u, t, s), (other, t2, s2) = first, second
    if u.tie or other.tie:
        return "a combination of both"
    if u.log and other.log and 0.8 < s / s2 < 1.25:
        return "their ratio" if r > 0 else "their product"
    # The combination u + w·other that varies least.
    weight = -r * (u.slope(t) * s) / (other.slope(t2) * s2)
    if 0.8 < abs(weight) < 1.25:
        return f"{u.path} {'+' if weight > 0 else '-'} {other.path}"
    return f"{u.path} {weight:+.3g}·{other.path}"

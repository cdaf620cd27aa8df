"""Where a force jumps or kinks: lines found in scattered readings, each with an interval and a confidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray
from scipy.spatial import KDTree

from .._types import as_array
from .rkpm.basis import basis_size, chebyshev_polynomials

Kind = Literal["jump", "kink"]

HIGHEST_ORDER = 12
LARGEST_BASIS = 66
"""Polynomials of the smooth part, at most; order 10 in two dimensions."""
MOST_READINGS = 20_000
"""Readings that are used, evenly taken."""
CANDIDATES = 49
"""Places tried along each direction before the best is refined."""
INNER = 0.1
"""Share of the readings and of the range at either end where no line is looked for: little lies beyond it, and noise
in the states bends every map there."""
MOST = 4
"""Lines at most."""
MOST_GAPS = 200
"""Places of a jump that are compared around the best candidate."""
WORTH_A_TRY = 5.0
"""Gain in log-likelihood beyond its price from which a candidate is examined further."""
LOOKS = 20.0
"""Independent looks that a residual is worth which is misfit and not noise."""
FLOOR = 1e-7
"""Residual, as a share of the force's standard deviation, that is rounding: sums of squares are differences here."""
QUANTILE_95 = 1.959964
WIDTHS = 1.5 * 2.0 ** np.arange(5)
"""Smooth transitions that rival a line, in units of `resolution`."""
BLURS = 2.0 ** np.arange(-4, 1)
"""Transitions that pass for a jump blurred by noise in the states, in units of `resolution`."""


class Discontinuity(eqx.Module):
    """A point, line or plane ``normal · state = offset`` across which the force jumps or kinks.

    As a function of a state it is an interface for ``RKPM.fit(..., across=...)``.
    """

    kind: Kind = eqx.field(static=True)
    normal: Float[Array, " dim"]
    offset: Float[Array, ""]
    low: Float[Array, ""]
    high: Float[Array, ""]
    """95 % interval of `offset`."""
    size: Float[Array, ""]
    """Jump of the force, or change of its slope per unit of ``normal · state``, towards higher values."""
    size_error: Float[Array, ""]
    """Standard error of `size`."""
    confidence: Float[Array, ""]
    """Probability of a line here, against a smooth force and against a transition wider than the resolution."""

    def __call__(self, state: Float[Array, " dim"]) -> Float[Array, ""]:
        return self.normal @ state - self.offset


def find_discontinuities(
    states: Any,
    force: Any,
    directions: Any = None,
    confidence: float = 0.99,
    resolution: float = 0.02,
) -> tuple[Discontinuity, ...]:
    """Lines across which a force jumps or kinks, the most certain first; empty where the force is smooth.

    Parameters
    ----------
    states : (n, dim) array
        Any units.
    force : (n,) array
        Readings of the force; noise is estimated from them.
    directions : (k, dim) array, optional
        Normals along which lines are looked for, per unit of the columns; every column by itself when None.
    confidence : float
        Lines less certain are not returned.
    resolution : float
        Share of the range along a normal below which a smooth transition counts as a line: noise in the states blurs
        every line a little.

    Raises
    ------
    TypeError, ValueError
        If shapes disagree, values are not finite, a direction is zero, or fewer than 50 states are given.

    Notes
    -----
    The paper reads such lines off a plot (section 4.3). Here a global regression

    .. math:: f = \\sum_j \\beta_j T_j(x) + \\sum_k (a_k + b_k (s_k - o_k)) U(s_k - o_k)

    is fitted, T Chebyshev polynomials of an order chosen by BIC, s = normal · state, a = 0 for a kink. Lines enter one
    at a time at the best of many places. A kink is then refined by linearisation [1]_, a jump between neighbouring
    readings. A line is kept if it is far more probable than (i) none and (ii) a tanh or softplus of finite width at its
    best place, each with its own best polynomial order. Residuals that are no noise, by their nearest neighbours, count
    as at most twenty independent looks.

    References
    ----------
    .. [1] V. M. R. Muggeo, Statist. Med. 22 (2003) 3055-3071.
    """
    states, force = as_array(states, "states", 2), as_array(force, "force", 1)
    if len(states) != len(force):
        raise ValueError(f"`force` must have one value per state, shape ({len(states)},); got {force.shape}.")
    if len(states) < 50:
        raise ValueError(f"`states` must hold at least 50 readings to tell a line from a bend; got {len(states)}.")
    normals = np.eye(states.shape[1]) if directions is None else as_array(directions, "directions", 2)
    if normals.shape[1] != states.shape[1] or not np.all(np.any(normals, axis=1)):
        raise ValueError(f"`directions` must be nonzero rows of {states.shape[1]} numbers; got {normals.tolist()}.")
    if np.std(force) <= FLOOR * np.max(np.abs(force)):
        return ()
    taken = np.unique(np.linspace(0, len(states) - 1, min(len(states), MOST_READINGS)).astype(int))
    search = _Search(states[taken], force[taken], normals, resolution)
    found = search.weeded(search.lines(), confidence)
    return tuple(search.described(found, k, normals) for k in np.argsort([-line.confidence for line in found]))


@dataclass(frozen=True)
class _Line:
    """A candidate along one direction, in coordinates where the range is [-1, 1]."""

    kind: Kind
    direction: int
    offset: float
    confidence: float = 0.0

    def columns(self, s: NDArray[np.float64], width: float = 0.0) -> NDArray[np.float64]:
        """Step and hinge of a jump, hinge of a kink; blurred to tanh and softplus over `width`."""
        u = s[self.direction] - self.offset
        if width == 0.0:
            step, hinge = (u >= 0.0).astype(float), np.maximum(u, 0.0)
        else:
            step = 0.5 * (1.0 + np.tanh(u / width))
            hinge = 0.5 * (u + width * np.logaddexp(u / width, -u / width))
        return np.stack([step, hinge] if self.kind == "jump" else [hinge], axis=1)

    def shift(self, s: NDArray[np.float64], width: float = 0.0) -> NDArray[np.float64]:
        """Minus the derivative of the first column by the offset, as the column that corrects it."""
        u = s[self.direction] - self.offset
        if self.kind == "jump":  # of a blurred one only
            return (0.5 / width / np.cosh(np.clip(u / width, -300.0, 300.0)) ** 2)[:, None]
        step = 0.5 * (1.0 + np.tanh(u / width)) if width else (u >= 0.0).astype(float)
        return step[:, None]

    @property
    def price(self) -> float:
        """Parameters beyond the polynomial, in units of log n / 2: the place of a jump costs twice that of a kink."""
        return 4.0 if self.kind == "jump" else 2.0


class _Search:
    """The regression over all readings, for any set of lines and all polynomial orders at once."""

    def __init__(self, states: NDArray, force: NDArray, normals: NDArray, resolution: float):
        low, high = states.min(axis=0), states.max(axis=0)
        varied = high > low
        self.z = (2.0 * states - high - low)[:, varied] / (high - low)[varied]
        along = states @ normals.T
        self.middle = (along.max(axis=0) + along.min(axis=0)) / 2.0
        self.half = (along.max(axis=0) - along.min(axis=0)) / 2.0
        self.directions = np.flatnonzero(self.half > 0.0)
        self.s = ((along - self.middle) / np.where(self.half > 0.0, self.half, 1.0)).T
        self.unit = float(np.std(force))
        self.force = (force - np.mean(force)) / self.unit
        self.n, dim = self.z.shape
        fitting = [p for p in range(1, HIGHEST_ORDER + 1) if basis_size(dim, p) <= min(self.n // 10, LARGEST_BASIS)]
        self.sizes = np.array([basis_size(dim, p) for p in fitting or [1]])
        self.q = np.linalg.qr(chebyshev_polynomials(self.z, len(self.sizes)))[0]
        self.load = self.q.T @ self.force
        self.resolution = 2.0 * resolution
        self.twin = np.asarray(KDTree(self.z).query(self.z, k=2)[1])[:, 1]

    # --- the regression ---

    def squares(self, columns: NDArray) -> NDArray:
        """Sum of squared residuals for every polynomial order, with `columns` beside the polynomials."""
        rest = np.cumsum(np.append(0.0, self.load**2))[self.sizes]
        smooth = self.force @ self.force - rest
        if columns.shape[1]:
            shadow = self.q.T @ columns
            gram, load = columns.T @ columns, columns.T @ self.force
            for row, m in enumerate(self.sizes):
                g, b = gram - shadow[:m].T @ shadow[:m], load - shadow[:m].T @ self.load[:m]
                smooth[row] -= b @ np.linalg.lstsq(g, b, rcond=1e-13)[0]
        return np.maximum(smooth, self.n * FLOOR**2)

    def scores(self, squares: NDArray, price: float, looks: float) -> NDArray:
        """Negative log-likelihood and half the price of the parameters, in nats, for every polynomial order."""
        return 0.5 * looks * np.log(squares / self.n) + 0.5 * (self.sizes + price) * math.log(looks)

    def columns(self, lines: Sequence[_Line]) -> NDArray:
        return np.concatenate([np.zeros((self.n, 0)), *(line.columns(self.s) for line in lines)], axis=1)

    def residual(self, columns: NDArray, size: int) -> tuple[NDArray, NDArray, NDArray]:
        """Residual at one polynomial order, coefficients of `columns`, and these freed of the polynomials."""
        q = self.q[:, :size]
        freed = columns - q @ (q.T @ columns)
        freed = freed - q @ (q.T @ freed)
        rest = self.force - q @ self.load[:size]
        coefficients = np.linalg.lstsq(freed, rest, rcond=1e-13)[0]
        return rest - freed @ coefficients, coefficients, freed

    def looks(self, residual: NDArray) -> float:
        """How many independent readings the residual is worth: all if it is noise between nearest neighbours."""
        power = float(np.mean(residual**2))
        noise = 0.5 * float(np.mean((residual - residual[self.twin]) ** 2))
        misfit = max(0.0, 1.0 - 1.15 * noise / power) if power > FLOOR**2 else 0.0
        return 1.0 / (1.0 / self.n + misfit / LOOKS)

    # --- the search ---

    def lines(self) -> list[_Line]:
        """Candidates, added while one is worth a try."""
        found: list[_Line] = []
        while len(found) < MOST:
            line, gain = self.best_addition(found)
            if line is None or gain < WORTH_A_TRY:
                break
            settled = self.settled([*found, line])
            if self.crowded(settled):  # what is left of a line that noise in the states has blurred
                break
            found = settled
        return found

    def crowded(self, lines: Sequence[_Line]) -> bool:
        """Whether two lines of one direction lie within the width that counts as sharp."""
        return any(
            a.direction == b.direction and abs(a.offset - b.offset) < 2.0 * self.resolution
            for k, a in enumerate(lines)
            for b in lines[:k]
        )

    def places(self, direction: int) -> NDArray:
        s = np.sort(self.s[direction])
        inner = np.linspace(INNER, 1.0 - INNER, CANDIDATES)
        grid = np.unique(np.concatenate([np.quantile(s, inner), 2.0 * inner - 1.0]))
        low, high = max(s[int(INNER * self.n)], 2.0 * INNER - 1.0), min(s[-int(INNER * self.n)], 1.0 - 2.0 * INNER)
        return grid[(grid >= low) & (grid <= high)]

    def best_addition(self, lines: Sequence[_Line]) -> tuple[_Line | None, float]:
        """The single column that gains most, over directions, kinds, places and polynomial orders."""
        fixed = self.columns(lines)
        q = np.linalg.qr(np.concatenate([fixed, self.q], axis=1))[0]
        load, ahead = q.T @ self.force, fixed.shape[1]
        price = sum(line.price for line in lines)
        before = np.min(self.scores(self.squares(fixed), price, self.n))
        best, best_gain = None, -math.inf
        for direction in self.directions:
            places = self.places(int(direction))
            taken = [line.offset for line in lines if line.direction == direction]
            free = np.array([all(abs(p - o) > 2.0 * self.resolution for o in taken) for p in places], dtype=bool)
            places = places[free]
            if not places.size:
                continue
            u = self.s[direction][:, None] - places[None, :]
            single: tuple[tuple[Kind, NDArray], ...] = (
                ("jump", (u >= 0.0).astype(float)),
                ("kink", np.maximum(u, 0.0)),
            )
            for kind, columns in single:
                shadow = q.T @ columns
                rows = ahead + self.sizes - 1
                own = np.sum(columns**2, axis=0)[None, :] - np.cumsum(shadow**2, axis=0)[rows]
                along = (columns.T @ self.force)[None, :] - np.cumsum(shadow * load[:, None], axis=0)[rows]
                left = self.force @ self.force - np.cumsum(load**2)[rows][:, None]
                sound = own > 1e-9 * np.sum(columns**2, axis=0)[None, :]
                gained = np.where(sound, along**2 / np.where(sound, own, 1.0), 0.0)
                squares = np.maximum(left - gained, self.n * FLOOR**2)
                line = _Line(kind, int(direction), 0.0)
                score = 0.5 * self.n * np.log(squares / self.n)
                score = score + 0.5 * (self.sizes + price + line.price)[:, None] * math.log(self.n)
                place = int(np.argmin(np.min(score, axis=0)))
                gain = before - float(np.min(score))
                if gain > best_gain:
                    best, best_gain = replace(line, offset=float(places[place])), gain
        return best, best_gain

    def settled(self, lines: list[_Line], sweeps: int = 4) -> list[_Line]:
        """The same lines, each moved to its best place while the others stay."""
        for _ in range(sweeps):
            before = [line.offset for line in lines]
            for k, line in enumerate(lines):
                others = self.columns([*lines[:k], *lines[k + 1 :]])
                lines[k] = self.refined_kink(line, others) if line.kind == "kink" else self.refined_jump(line, others)
            if np.allclose(before, [line.offset for line in lines], rtol=0.0, atol=1e-12):
                break
        return lines

    def best_size(self, columns: NDArray) -> int:
        return int(self.sizes[np.argmin(self.scores(self.squares(columns), 0.0, self.n))])

    def refined_kink(self, line: _Line, others: NDArray, width: float = 0.0, steps: int = 12) -> _Line:
        """Linearised in the offset: a column for the shift beside the line, whose share moves the offset."""

        def at(offset: float) -> NDArray:
            return np.concatenate([others, replace(line, offset=offset).columns(self.s, width)], axis=1)

        size = self.best_size(at(line.offset))
        row = int(np.argmax(self.sizes == size))
        least = self.squares(at(line.offset))[row]
        lead = others.shape[1]
        for _ in range(steps):
            columns = np.concatenate([at(line.offset), line.shift(self.s, width)], axis=1)
            _, coefficients, _ = self.residual(columns, size)
            slope = coefficients[lead]
            if slope == 0.0:
                break
            move = float(np.clip(-coefficients[-1] / slope, -0.1, 0.1))
            for _ in range(3):
                offset = line.offset + move
                squares = self.squares(at(offset))[row] if abs(offset) < 1.0 - 2.0 * INNER else math.inf
                if squares < least:
                    break
                move /= 3.0
            else:
                break
            line, least = replace(line, offset=offset), squares
            if abs(move) < 1e-13:
                break
        return line

    def gaps(self, line: _Line) -> NDArray:
        """Values along the line's normal at which a step changes, within the reach of one candidate's spacing."""
        values = np.unique(self.s[line.direction])
        near = values[np.abs(values - line.offset) < max(2.0 / CANDIDATES, self.resolution)]
        return near if near.size <= MOST_GAPS else near[:: near.size // MOST_GAPS + 1]

    def profile(self, line: _Line, others: NDArray) -> tuple[NDArray, NDArray]:
        """Places of a step with a change of slope, and the sum of squares at each."""
        places = self.gaps(line)
        size = self.best_size(np.concatenate([others, line.columns(self.s)], axis=1))
        q = np.linalg.qr(np.concatenate([self.q[:, :size], others], axis=1))[0]
        rest = self.force - q @ (q.T @ self.force)
        u = self.s[line.direction][:, None] - places[None, :]
        step, hinge = ((c - q @ (q.T @ c)) for c in ((u >= 0.0).astype(float), np.maximum(u, 0.0)))
        aa, ab, bb = (np.sum(p * q, axis=0) for p, q in ((step, step), (step, hinge), (hinge, hinge)))
        a, b = rest @ step, rest @ hinge
        slope = np.where(bb > 0.0, b / np.where(bb > 0.0, bb, 1.0), 0.0)
        own = aa - np.where(bb > 0.0, ab**2 / np.where(bb > 0.0, bb, 1.0), 0.0)
        jump = np.where(own > 0.0, (a - slope * ab) ** 2 / np.where(own > 0.0, own, 1.0), 0.0)
        return places, np.maximum(rest @ rest - slope * b - jump, self.n * FLOOR**2)

    def refined_jump(self, line: _Line, others: NDArray) -> _Line:
        """The step lies between two neighbouring readings: at the middle of the best gap."""
        places, squares = self.profile(line, others)
        return replace(line, offset=self.before(line, float(places[np.argmin(squares)]))[1])

    def before(self, line: _Line, place: float) -> tuple[float, float]:
        """The last reading below a place, and the middle of the gap between them."""
        values = self.s[line.direction]
        below = values[values < place]
        lower = float(below.max()) if below.size else place
        return lower, (lower + place) / 2.0

    # --- the decision ---

    def weeded(self, lines: list[_Line], confidence: float) -> list[_Line]:
        """The lines that stand against every rival; the weakest goes first, and the others are weighed anew."""
        while lines:
            weighed = [replace(line, confidence=self.confidence(lines, k)) for k, line in enumerate(lines)]
            weakest = int(np.argmin([line.confidence for line in weighed]))
            if weighed[weakest].confidence >= confidence:
                return weighed
            lines = self.settled([*lines[:weakest], *lines[weakest + 1 :]])
        return []

    def confidence(self, lines: list[_Line], k: int) -> float:
        """Probability of line k against no line and against smooth transitions."""
        line, others = lines[k], self.columns([*lines[:k], *lines[k + 1 :]])
        columns = np.concatenate([others, line.columns(self.s)], axis=1)
        squares = self.squares(columns)
        size = int(self.sizes[np.argmin(self.scores(squares, 0.0, self.n))])
        residual, coefficients, freed = self.residual(columns, size)
        looks = self.looks(residual)
        base = np.min(self.scores(squares, line.price, looks))
        without = np.min(self.scores(self.squares(others), 0.0, looks)) - base
        lead = others.shape[1]
        robust = 0.5 * coefficients[lead] ** 2 / self.variance(residual, freed, lead) * looks / self.n
        none = min(without, robust - 0.5 * line.price * math.log(looks)) - math.log(2.0 * len(self.directions))
        soft = min(self.transition(line, others, width, looks) - base for width in WIDTHS * self.resolution)
        return 1.0 / (1.0 + math.exp(-np.clip(none, -700, 700)) + math.exp(-np.clip(soft, -700, 700)))

    def variance(self, residual: NDArray, freed: NDArray, which: int) -> float:
        """Variance of one coefficient under noise of unequal size (White): largest beside a line blurred by noise."""
        inverse = np.linalg.pinv(freed.T @ freed, rcond=1e-13, hermitian=True)
        row = freed @ inverse[which]
        return float(np.sum((row * residual) ** 2)) + FLOOR**2 * float(row @ row)

    def transition(self, line: _Line, others: NDArray, width: float, looks: float) -> float:
        """Score of the line blurred over a width, at its best place; one more parameter than the line."""
        moved = self.refined_kink(line, others, width, steps=5)
        columns = np.concatenate([others, moved.columns(self.s, width)], axis=1)
        return float(np.min(self.scores(self.squares(columns), line.price + 1.0, looks)))

    def blurred(self, line: _Line, others: NDArray, looks: float) -> tuple[_Line, float]:
        """A jump as noise in the states shows it: the width within the resolution that fits best, 0 if none does."""
        columns = np.concatenate([others, line.columns(self.s)], axis=1)
        least, best = float(np.min(self.scores(self.squares(columns), line.price, looks))), (line, 0.0)
        for width in BLURS * self.resolution if line.kind == "jump" else ():
            moved = self.refined_kink(line, others, width)
            columns = np.concatenate([others, moved.columns(self.s, width)], axis=1)
            score = float(np.min(self.scores(self.squares(columns), line.price + 1.0, looks)))
            if score < least:
                least, best = score, (moved, width)
        return best

    def described(self, lines: list[_Line], k: int, normals: NDArray) -> Discontinuity:
        """A line in the units of the readings, with its interval."""
        line, others = lines[k], self.columns([*lines[:k], *lines[k + 1 :]])
        columns = np.concatenate([others, line.columns(self.s)], axis=1)
        size, lead = self.best_size(columns), others.shape[1]
        looks = self.looks(self.residual(columns, size)[0])
        line, width = self.blurred(line, others, looks)
        columns = np.concatenate([others, line.columns(self.s, width)], axis=1)
        residual, coefficients, freed = self.residual(columns, size)
        error = math.sqrt(self.variance(residual, freed, lead) * self.n / looks)
        narrow = BLURS[1] * self.resolution if line.kind == "jump" else 0.0
        # a jump that is sharp to the readings is moved as if blurred a little: a step has no derivative by its place
        moving = np.concatenate([columns, line.shift(self.s, width or narrow)], axis=1)
        moved, shares, freed = self.residual(moving, size)
        unexplained = moved if line.kind == "kink" or width else residual
        half = math.sqrt(self.variance(unexplained, freed, -1) * self.n / looks) / abs(float(shares[lead]))
        low, high = line.offset - QUANTILE_95 * half, line.offset + QUANTILE_95 * half
        if line.kind == "jump" and not width:
            places, squares = self.profile(line, others)
            likely = places[0.5 * looks * np.log(squares / squares.min()) < 0.5 * QUANTILE_95**2]
            low, high = min(low, self.before(line, float(likely[0]))[0]), max(high, float(likely[-1]))
        per_unit = self.unit / (1.0 if line.kind == "jump" else self.half[line.direction])

        def place(scaled: float) -> Array:
            return jnp.asarray(self.middle[line.direction] + self.half[line.direction] * scaled)

        return Discontinuity(
            line.kind,
            jnp.asarray(normals[line.direction]),
            place(line.offset),
            place(low),
            place(high),
            jnp.asarray(coefficients[lead] * per_unit),
            jnp.asarray(error * per_unit),
            jnp.asarray(line.confidence),
        )

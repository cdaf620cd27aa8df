"""What the channels of a record can tell of the motion of a structure, and of forces that nothing measures.

The linear part of the structure decides. Motion: every natural motion must show in a channel (test of Popov, Belevitch
and Hautus). Forces: their transfer functions to the channels must be linearly independent.
"""

from collections.abc import Sequence

import numpy as np

from ..plant import direction, lower, state_matrix
from ..structures import Structure

Channel = tuple[str, int]
Place = tuple[int, int]

_UNSEEN = 1e-8
"""Share of a natural motion in the channels below which they do not show it."""
_ALIKE = 1e-6
"""Difference of the effects of forces on the channels below which these do not tell them apart."""
_TAKES_PART = 1e-3
"""Share in a combination of forces without effect from which a force takes part in it."""
_MOVES = 0.1
"""Share of the largest displacement of a natural motion from which a degree of freedom counts as moving in it."""
_PROBES = (0.1 + 0.31j, 0.1 + 0.77j, 0.1 + 1.43j)
"""Where transfer functions are compared, in highest natural frequencies."""


class _Linear:
    """The linear part of a structure in units of its fastest natural motion, and what its channels show."""

    def __init__(self, model: Structure):
        plant = lower(model)
        self.dof, self.minv = model.dof, np.linalg.inv(np.asarray(plant.mass))
        k, c = self.minv @ np.asarray(plant.stiffness), self.minv @ np.asarray(plant.damping)
        self.omega = max(float(np.max(np.abs(np.linalg.eigvals(state_matrix(k, c))))), 1e-300)
        self.rate = state_matrix(k / self.omega**2, c / self.omega)

    def rows(self, channels: Sequence[Channel]) -> np.ndarray:
        blocks = {"displacement": 0, "velocity": self.dof}
        state = np.eye(2 * self.dof)
        return np.array(
            [(state[blocks[kind] :] if kind in blocks else self.rate[self.dof :])[j - 1] for kind, j in channels]
        )

    def unseen(self, channels: Sequence[Channel]) -> list[tuple[complex, np.ndarray]]:
        """Eigenvalue and shape (dof,) of every natural motion that no channel shows."""
        found, rows = [], self.rows(channels)
        for value in np.linalg.eigvals(self.rate):
            if value.imag >= 0:
                pencil = np.concatenate([self.rate - value * np.eye(2 * self.dof), rows])
                _, size, right = np.linalg.svd(pencil)
                if size[-1] < _UNSEEN:
                    found.append((value, np.abs(right[-1][: self.dof])))
        return found

    def effects(self, channels: Sequence[Channel], places: Sequence[Place]) -> np.ndarray:
        """Transfer functions of forces on links to the channels, (probes x channels, places), each of size 1."""
        enter = self.minv @ np.array([direction(at, self.dof) for at in places]).T
        rows, at_once = self.rows(channels), np.array([[kind == "acceleration"] for kind, _ in channels])
        columns = []
        for s in _PROBES:
            state = np.linalg.solve(s * np.eye(2 * self.dof) - self.rate, np.concatenate([0 * enter, enter]))
            columns.append(rows @ state + at_once * enter[[j - 1 for _, j in channels]])
        effects = np.array(columns)
        return effects / np.maximum(np.linalg.norm(effects, axis=(0, 1)), 1e-300)


def require_seen(model: Structure, channels: Sequence[Channel], at_rest: bool) -> None:
    """Refuse channels that leave a natural motion of the structure unseen.

    One that nothing pulls back (a free body) may go unseen where the structure is known to start `at_rest`.
    """
    linear = _Linear(model)

    def unseen(shown: Sequence[Channel]) -> list[tuple[complex, np.ndarray]]:
        # Rounding splits a double eigenvalue at 0 by the root of the machine's precision.
        return [each for each in linear.unseen(shown) if not (at_rest and abs(each[0]) < 1e-5)]

    hidden = unseen(channels)
    if not hidden:
        return
    value, shape = hidden[0]
    frequency = abs(value) * linear.omega / (2 * np.pi)
    moving = [str(j + 1) for j in range(linear.dof) if shape[j] > _MOVES * np.max(shape)]
    told = f"of {frequency:.4g} Hz" if frequency * 1e5 > linear.omega else "that nothing pulls back"
    raise ValueError(
        f"`record` must show every natural motion of the model; the one {told}, in which {_listed(moving)} "
        f"{'moves' if len(moving) == 1 else 'move'}, leaves no trace in {_named(channels)}. "
        f"{_remedy(linear.dof, channels, lambda shown: not unseen(shown)).rstrip()}"
    )


def told_apart(model: Structure, channels: Sequence[Channel], places: Sequence[Place]) -> np.ndarray:
    """Which of the forces at `places` the channels tell from all others, one bool for each."""
    return _apart(_Linear(model), channels, places)


def require_apart(model: Structure, channels: Sequence[Channel], places: Sequence[Place]) -> None:
    """Refuse places whose forces act alike on the channels."""
    apart = told_apart(model, channels, places)
    if np.all(apart):
        return
    linear = _Linear(model)
    alike = [str(at) for at, alone in zip(places, apart, strict=True) if not alone]
    remedy = _remedy(linear.dof, channels, lambda shown: bool(np.all(_apart(linear, shown, places))))
    raise ValueError(
        f"`places` must be such that the channels tell their forces apart; those at {_listed(alike)} may stand for "
        f"one another in {_named(channels)}. {remedy}{'Or name' if remedy else 'Name'} fewer places."
    )


def _apart(linear: _Linear, channels: Sequence[Channel], places: Sequence[Place]) -> np.ndarray:
    effects = linear.effects(channels, places)
    # Independent at one frequency is independent; a constant that fits all frequencies does not count.
    size, right = max((np.linalg.svd(e)[1:] for e in effects), key=lambda each: _rank(each[0]))
    return np.all(np.abs(right[_rank(size) :]) < _TAKES_PART, axis=0)


def _rank(size: np.ndarray) -> int:
    return int(np.sum(size > _ALIKE))


def _remedy(dof: int, channels: Sequence[Channel], enough) -> str:
    """The channels, any one of which would do, or that several are needed."""
    more = [("displacement", j) for j in range(1, dof + 1) if ("displacement", j) not in channels]
    helpful = [f"{kind} {j}" for kind, j in more if enough([*channels, (kind, j)])]
    if helpful:
        return f"Measure also {_listed(helpful, 'or')}. "
    return f"Measure also several of {_listed([f'{kind} {j}' for kind, j in more])}. " if more else ""


def _named(channels: Sequence[Channel]) -> str:
    return _listed([f"{kind} {j}" for kind, j in channels])


def _listed(words: Sequence[str], last: str = "and") -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"

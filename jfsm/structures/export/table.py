"""The force of a link over its displacement and velocity, as a table."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..._files import as_path, write_text_atomically
from ..._types import as_array
from .._parameter import as_link
from .._term import AbstractTerm
from ..terms import MapTerm

_COLUMNS = ("displacement", "velocity", "force")


@dataclass(frozen=True, repr=False)
class ForceTable:
    """Force of the terms at a link, restoring side positive, over relative displacement and velocity.

    Attributes
    ----------
    at : (int, int)
        The link.
    terms : tuple of str
        What its force is the sum of.
    displacement, velocity : (n,), (m,) arrays
    force : (n, m) array
    """

    at: tuple[int, int]
    terms: tuple[str, ...]
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray

    def __repr__(self) -> str:
        n, m = self.force.shape
        return f"<ForceTable of {', '.join(self.terms)}: {n} displacements, {m} velocities>"

    def to_dataframe(self) -> Any:
        """The forces as a DataFrame of pandas, which must be installed: displacements down, velocities across."""
        import pandas as pd

        rows, columns = pd.Index(self.displacement, name="displacement"), pd.Index(self.velocity, name="velocity")
        return pd.DataFrame(self.force, index=rows, columns=columns)

    def write(self, path: str | Path) -> None:
        """Write a csv with the columns displacement, velocity and force; the file appears whole or not at all."""
        places = np.meshgrid(self.displacement, self.velocity, indexing="ij")
        stream = io.StringIO()
        np.savetxt(stream, np.stack([*places, self.force], -1).reshape(-1, 3), "%.17g", ",", header=",".join(_COLUMNS),
                   comments="")  # fmt: skip
        write_text_atomically(as_path(path), stream.getvalue())


def table_of(terms: Sequence[AbstractTerm], displacement: Any, velocity: Any = (0.0,), at: Any = None) -> ForceTable:
    """The table of those of the terms that are at a link.

    Raises
    ------
    ValueError
        If no term is there, or one has a memory, a delay, or depends on time; names it.
    """
    links = list(dict.fromkeys((min(term.at), max(term.at)) for term in terms))
    if at is None and len(links) != 1:
        where = ", ".join(map(str, links)) or "none"
        raise ValueError(f"`at` must say which link the table is of; there are terms at {where}.")
    i, j = links[0] if at is None else as_link(at)
    here = [term for term in terms if set(term.at) == {i, j}]
    if not here:
        raise ValueError(f"`at` must be a link that has a term; got {(i, j)}, there are terms at {links}.")
    d, w = (as_array(values, name, 1) for name, values in (("displacement", displacement), ("velocity", velocity)))
    states = np.stack(np.meshgrid(d, w, indexing="ij"), -1).reshape(-1, 2)
    force = sum(
        _force(term, states if term.at == (i, j) else -states) * (1 if term.at == (i, j) else -1) for term in here
    )
    names = tuple(f"{term.kind}@{term.place}" for term in here)
    return ForceTable((i, j), names, d, w, np.reshape(force, (d.size, w.size)))


def _force(term: AbstractTerm, states: np.ndarray) -> np.ndarray:
    """Force in many states (n, 2)."""
    reason = (
        "has a memory" if term.states
        else "answers the motion of the past" if term.delay is not None
        else "changes with time" if term.timed
        else ""
    )  # fmt: skip
    if reason:
        raise ValueError(
            f"{term.kind}@{term.place} {reason}: its force is no table over displacement and velocity. to_python and "
            "to_matlab write laws with a memory and of time."
        )
    if isinstance(term, MapTerm) and hasattr(term.force_map, "evaluate"):
        return np.asarray(term.force_map.evaluate(states))
    law = jax.vmap(lambda d, w: term.force(d, w, (), jnp.zeros(())))
    return np.asarray(law(jnp.asarray(states[:, 0]), jnp.asarray(states[:, 1])))

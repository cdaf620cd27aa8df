"""Where each number of a structure stands in its plant.

A plant is linear in every mass, stiffness, law parameter and sensor value, so a vector of values times a constant
matrix is the plant. That matrix is data: another place, sign or law leaves the compiled program as it is.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ..plant import Channel, Plant, numbers_of
from ..structures import Structure

_PARTS = (
    "mass",
    "damping",
    "stiffness",
    "force_gain",
    "force_offset",
    "force_delay",
    "channel_gain",
    "channel_offset",
    "channel_delay",
    "own_numbers",
    "behind",
)
_SLOTS = ("smooth", "friction", "memory", "delayed")


def plant_vector(plant: Plant) -> Float[np.ndarray, " size"]:
    """All numbers of a plant that parameters can change, in one row."""
    parts = [getattr(plant, name) for name in _PARTS] + [getattr(plant, name).parameters for name in _SLOTS]
    return np.concatenate([np.asarray(part).ravel() for part in parts])


def with_vector(plant: Plant, vector: Float[Array, " size"]) -> Plant:
    """The plant with these numbers; the inverse of `plant_vector`, traceable."""
    place, parts = 0, {}
    for name in _PARTS:
        shape = getattr(plant, name).shape
        size = int(np.prod(shape))
        parts[name], place = jnp.reshape(vector[place : place + size], shape), place + size
    for name in _SLOTS:
        old = getattr(plant, name)
        size = int(np.prod(old.parameters.shape))
        row = jnp.reshape(vector[place : place + size], old.parameters.shape)
        parts[name], place = type(old)(old.kind, row, old.direction, old.laws), place + size
    return replace(plant, **parts)


def besides_numbers(plant: Plant) -> Hashable:
    """What a plant holds besides numbers that parameters can change: places, directions and kinds of laws."""
    parts = {name: getattr(plant, name) for name in _PARTS + _SLOTS}
    bare: dict[str, Any] = {name: np.zeros(parts[name].shape) for name in _PARTS}
    for name in _SLOTS:
        old = parts[name]
        bare[name] = type(old)(old.kind, np.zeros(old.parameters.shape), old.direction, old.laws)
    leaves, tree = jax.tree.flatten(replace(plant, **bare))
    return tree, tuple(np.asarray(leaf).tobytes() for leaf in leaves)


def place_of(plant: Plant, name: str) -> slice:
    """Where the numbers of one of its arrays stand in those of a plant."""
    begin = sum(getattr(plant, part).size for part in _PARTS[: _PARTS.index(name)])
    return slice(begin, begin + getattr(plant, name).size)


def without_part(plant: Plant, name: str) -> Plant:
    """The plant without one of its arrays."""
    return replace(plant, **{name: getattr(plant, name)[:0]})


class _Layout:
    """A structure, equal to every other that differs from it in numbers only."""

    def __init__(self, structure: Structure):
        self.structure = structure
        self.key = jax.tree.structure(structure), structure.mass.shape

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Layout) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def plant_rows(
    structure: Structure, paths: Sequence[str], channels: Sequence[Channel], **slots: Any
) -> Float[np.ndarray, "paths size"]:
    """Derivative of the plant's vector by each of the structure's numbers `paths`; it depends on no number's value."""
    return _rows(_Layout(structure), tuple(paths), tuple(channels), tuple(slots.items()))


@lru_cache(maxsize=512)
def _rows(layout: _Layout, paths: tuple[str, ...], channels: tuple[Channel, ...], slots) -> np.ndarray:
    """As the plant is linear in each number, doubling it shows its row exactly.

    A number of the plant's own function stands in the vector as it is; the mass at rest that goes with it stays.
    """
    structure, how = layout.structure, dict(slots)
    numbers = numbers_of(structure, channels, **how)
    base, values = plant_vector(numbers), structure.values()
    rows = []
    for path in paths:
        if structure.own is not None and path in structure.own.names:
            row = np.zeros(base.size)
            row[place_of(numbers, "own_numbers").start + structure.own.names.index(path)] = 1.0
            rows.append(row)
            continue
        value = values[path]
        step = value if value != 0 else 1.0
        doubled = numbers_of(structure.with_values({path: value + step}), channels, **how)
        rows.append((plant_vector(doubled) - base) / step)
    found = np.array(rows).reshape(len(paths), base.size)
    found.setflags(write=False)
    return found

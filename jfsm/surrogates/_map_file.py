"""A force state map as a file: its arrays by name in a NumPy archive, and beside them what it is made of.

Nothing in a file is run. It names classes of a fixed list, and every part is held to the type and the axes that its
class states for it: an axis of one name has one length throughout the file.
"""

import io
import json
import typing
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO, Literal, no_type_check

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import jaxtyped
from numpy.typing import NDArray

from .._files import parsed_json
from .._types import require_x64
from ..reporting import write_atomically
from ._map import AbstractForceStateMap
from ._table import HermiteTable
from .discontinuities import Discontinuity
from .kriging import (
    Cubic,
    Exponential,
    Gaussian,
    Kriging,
    Linear,
    Matern32,
    Matern52,
    PolynomialTrend,
    PowerExponential,
    Spherical,
    Spline,
)
from .kriging.posterior import FilteredPosterior, Posterior
from .kriging.trend import TrendBasis
from .moving_least_squares import MovingLeastSquares
from .polynomial import Polynomial
from .radial_basis import RadialBasis
from .rkpm import RKPM, CubicSplineWindow, GaussianWindow, Plane, QuarticSplineWindow
from .rkpm.estimates import Rule
from .rkpm.nodes import Nodes
from .rkpm.rule import weighing_rule

HEADER, FORMAT = "header", "jfsm force state map, 1"
MAPS = (RKPM, Kriging, MovingLeastSquares, RadialBasis, Polynomial, HermiteTable)
PARTS = (
    Nodes, Rule, CubicSplineWindow, QuarticSplineWindow, GaussianWindow, Plane, Discontinuity,
    Posterior, FilteredPosterior, TrendBasis, PolynomialTrend,
    Gaussian, Exponential, PowerExponential, Linear, Spherical, Cubic, Spline, Matern32, Matern52,
)  # fmt: skip
KNOWN = {known.__name__: known for known in (*MAPS, *PARTS)}


def save_map(force_map: AbstractForceStateMap | HermiteTable, file: str | Path | BinaryIO) -> None:
    """Write a map as an npz file; of a path it appears whole or not at all.

    Raises
    ------
    ValueError
        If a part of the map is no part of jfsm, such as an interface that is a function of yours.
    """
    arrays: dict[str, NDArray[Any]] = {}
    made_of = _taken_apart(force_map, "", arrays)
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **{HEADER: np.array(json.dumps({"format": FORMAT, "map": made_of})), **arrays})
    if isinstance(file, str | Path):
        write_atomically({file: stream.getvalue()})
    else:
        file.write(stream.getvalue())


def load_map(path: str | Path) -> Any:
    """The map that ``save`` wrote: it gives the same forces to the last bit.

    Parameters
    ----------
    path : str or Path
        Of an npz file.

    Returns
    -------
    RKPM, Kriging, MovingLeastSquares, RadialBasis, Polynomial or HermiteTable

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is damaged or is not that of a map; nothing in it is run.
    """
    require_x64()
    target = Path(path)
    if not target.is_file():
        raise FileNotFoundError(f"There is no map file {target}; write one with `force_map.save(path)`.")
    try:
        header, arrays = _read(target)
        with jaxtyped("context"):  # axes of one name have one length
            force_map = _put_together(header, "", arrays)
        if arrays:
            raise ValueError(f"{next(iter(arrays))!r} belongs to no part of the map")
        _check(force_map)
    except (ArithmeticError, LookupError, TypeError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(
            f"{target} must be a map that `force_map.save(path)` wrote; it cannot be read as one: {error}. "
            "It may be cut short, or be another file. Save or copy it again."
        ) from error
    return force_map


def _read(target: Path) -> tuple[Any, dict[str, NDArray[np.float64]]]:
    """What the map is made of, and its arrays by name."""
    with target.open("rb") as stream:
        if stream.read(2) != b"PK":  # else numpy would speak of pickles
            raise ValueError("it is no NumPy archive")
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    if HEADER not in arrays:
        raise ValueError("it says of no map what it is made of")
    header = parsed_json(str(arrays.pop(HEADER)))
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"its format must be {FORMAT!r}")
    return header["map"], arrays


def _taken_apart(value: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """What a part is made of, as JSON has it; null stands for the array of this path."""
    if isinstance(value, jax.Array | np.ndarray):
        arrays[path] = np.asarray(value)
        return None
    if isinstance(value, tuple):
        return [_taken_apart(item, _below(path, i), arrays) for i, item in enumerate(value)]
    if isinstance(value, bool | int | str):
        return value
    name = type(value).__name__
    if KNOWN.get(name) is not type(value):
        raise ValueError(
            f"A map can be written if all its parts are those of jfsm; its {path} is {value!r}. "
            "Of interfaces jfsm has Plane and Discontinuity."
        )
    parts = {f.name: _taken_apart(getattr(value, f.name), _below(path, f.name), arrays) for f in fields(value)}
    return {"class": name, **parts}


@no_type_check  # or its axes would be its own under the tests
def _put_together(form: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """The part that `form` tells of, with its arrays, which are taken out of `arrays`."""
    if form is None:
        return _array(arrays.pop(path))
    if isinstance(form, list):
        return tuple(_put_together(item, _below(path, i), arrays) for i, item in enumerate(form))
    if not isinstance(form, Mapping):
        return form
    known = KNOWN[form["class"]]
    names = {f.name: f.type for f in fields(known)}
    if set(form) != {"class", *names}:
        raise ValueError(f"a {known.__name__} has {', '.join(names) or 'no fields'}, not {', '.join(form)}")
    parts = {name: _put_together(form[name], _below(path, name), arrays) for name in names}
    for name, part in parts.items():
        if not _fits(part, names[name]):
            shape = f" of shape {part.shape}" if isinstance(part, jax.Array) else ""
            raise TypeError(f"{name} of {known.__name__}{shape} is none, or does not fit to the other parts")
    return known(**parts)


def _below(path: str, name: str | int) -> str:
    """Path of a part of a part, ``rule.across.0``."""
    return f"{path}.{name}" if path else str(name)


def _array(values: NDArray[Any]) -> jax.Array:
    if values.dtype != np.float64 or np.isnan(values).any():
        raise ValueError(f"its arrays must hold numbers in double precision; one is of {values.dtype}")
    return jnp.asarray(values)


@no_type_check  # or its axes would be its own under the tests
def _fits(value: Any, kind: Any) -> bool:
    """Whether a part is what its class says of it."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is tuple:
        return isinstance(value, tuple) and all(_fits(item, arguments[0]) for item in value)
    if origin is Literal:
        return value in arguments
    if origin is Callable:
        return callable(value)
    return type(value) is kind if kind in (bool, int, str) else isinstance(value, kind)


def _check(force_map: Any) -> None:
    """Refuse numbers that do not go together, by what a fit asks and by tracing one call."""
    if not isinstance(force_map, MAPS):
        raise TypeError(f"it holds a {type(force_map).__name__}, which is no map")
    if isinstance(force_map, MovingLeastSquares):
        _check(force_map.values)
    if isinstance(force_map, RKPM):
        nodes, rule = force_map.nodes, force_map.rule
        weighing_rule(nodes, rule.order, rule.neighbours, rule.window, rule.dilation, rule.across)
    dim = 2 if isinstance(force_map, HermiteTable) else force_map.dim
    jax.eval_shape(force_map, jax.ShapeDtypeStruct((dim,), jnp.float64))

"""Traced programs outlive their process as compiled ones do.

JAX keeps on disk what XLA makes of a program, and finds it by the program's text. To have the text, every process has
to trace the program anew, which takes longer than all the rest of a first call. Here the text is kept, too, in the same
folder and by the same settings. It is found by all that it depends on: the source of jfsm, the versions of the
libraries that trace it, the function, the shapes of its arrays, and whatever else is in its arguments. Programs of laws
that are not jfsm's own are not kept: their source is not known.
"""

import hashlib
import os
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, wraps
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from types import FunctionType
from typing import Any, TypeVar

import jax
import numpy as np
from jax import export
from jax.core import Tracer

from ._files import write_atomically
from ._programs import TRACED

Found = TypeVar("Found")
Named = TypeVar("Named", bound=tuple)

_KEPT = 40
"""Programs of a function that stay in memory, those used last: one of them takes up to fifty megabytes."""
_in_memory: list[OrderedDict[Any, "_Program"]] = []
"""The programs of each function."""
_SOURCE = Path(__file__).parent
_ARRAY = "array"
"""Stands for an array among arguments."""
_LIBRARIES = "jax", "jaxlib", "equinox", "lineax", "optimistix"
_OURS = "jfsm", "builtins", "jax", "jaxlib", "equinox", "numpy"
"""Packages whose classes and functions are known by their name: they change with the source or with a version."""


class _UnknownError(Exception):
    """A value of which no text says all."""


class _Program:
    """What runs for arguments of a kind, once it is there."""

    def __init__(self):
        self.lock = Lock()
        self.call: Callable[..., Any] | None = None


def jit_kept(
    function: Callable[..., Found], options: Callable[[], dict[str, Any] | None] = lambda: None
) -> Callable[..., Found]:
    """`equinox.filter_jit` whose traced programs are kept on disk, where compiled ones are.

    The function gives arrays in tuples, or in named ones that `kept_result` knows. `options` are those of the compiler.
    Programs that have not been used for long are dropped from memory.
    """
    programs: OrderedDict[Any, _Program] = OrderedDict()
    _in_memory.append(programs)
    lock = Lock()

    @wraps(function)
    def run(*arguments: Any, **named: Any) -> Found:
        leaves, tree = jax.tree.flatten((arguments, named))
        is_array = [isinstance(leaf, jax.Array | np.ndarray | np.generic) for leaf in leaves]
        arrays = [leaf for leaf, array in zip(leaves, is_array, strict=True) if array]
        others = tuple(_ARRAY if array else (type(leaf), leaf) for leaf, array in zip(leaves, is_array, strict=True))
        inside = any(isinstance(array, Tracer) for array in arrays)
        key = tree, others, tuple((array.shape, array.dtype) for array in arrays), inside
        there = key, jax.config.values["jax_default_device"], frozenset[Any]() if inside else _devices(arrays)
        with lock:
            program = programs.setdefault(there, _Program())
            programs.move_to_end(there)
            while len(programs) > _KEPT:
                programs.popitem(last=False)
        with program.lock:  # of threads that ask for the same at once, the first one traces it
            if program.call is None:
                chosen = options()
                compiled = jax.jit(_of_arrays(function, tree, others), compiler_options=chosen)
                program.call = compiled if inside else _kept(function, compiled, key, arrays, chosen)
        return program.call(*arrays)

    return run


def clear_programs() -> None:
    """Drop the programs of all functions from memory, as `jax.clear_caches` drops those that JAX keeps."""
    for programs in _in_memory:
        programs.clear()


def _devices(arrays: list[Any]) -> frozenset[Any]:
    """Where arrays are, if they can be in several places; those of NumPy are nowhere yet."""
    if len(jax.devices()) == 1:
        return frozenset()
    return frozenset(device for array in arrays if isinstance(array, jax.Array) for device in array.devices())


def _of_arrays(function: Callable[..., Found], tree: Any, others: tuple[Any, ...]) -> Callable[..., Found]:
    """A function of the arrays alone that are in its arguments; `others` stand between them."""

    def of_arrays(*arrays: Any) -> Found:
        rest = iter(arrays)
        leaves = [next(rest) if other is _ARRAY else other[1] for other in others]
        arguments, named = jax.tree.unflatten(tree, leaves)
        return function(*arguments, **named)

    of_arrays.__name__ = of_arrays.__qualname__ = function.__name__
    return of_arrays


def kept_result(kind: type[Named]) -> type[Named]:
    """Decorator of a named tuple that a function of `jit_kept` gives."""
    return export.register_namedtuple_serialization(kind, serialized_name=f"{kind.__module__}.{kind.__qualname__}")


def _kept(
    function: Callable[..., Found], compiled: Any, key: Any, arrays: list[Any], options: dict[str, Any] | None
) -> Callable[..., Found]:
    """A compiled function, traced by this process or an earlier one; `key` says all but what is in `arrays`."""
    settings = jax.config.values
    folder = settings["jax_compilation_cache_dir"]
    if not folder or "://" in folder or not settings["jax_enable_compilation_cache"] or settings["jax_disable_jit"]:
        return compiled
    chosen = [settings[name] for name in ("jax_enable_x64", "jax_default_matmul_precision", "jax_debug_nans")]
    try:
        text = _text((_versions(), jax.default_backend(), *chosen, function, key))
    except _UnknownError:
        return compiled
    path = Path(folder) / f"{function.__name__}-{hashlib.sha256(text.encode()).hexdigest()}{TRACED}"
    found = _read(path)
    if found is None:
        shapes = [jax.ShapeDtypeStruct(array.shape, array.dtype) for array in arrays]
        try:
            found = bytes(export.export(compiled)(*shapes).serialize())
        except Exception:  # what cannot be kept is traced once more, and what cannot be traced says so again
            return compiled
        _write(path, found)
    traced = export.deserialize(bytearray(found)).call
    # Compiled here: a call would be compiled once more for results of an earlier one, which say where they are.
    return jax.jit(traced, compiler_options=options).lower(*arrays).compile()


def _read(path: Path) -> bytes | None:
    """What was written, or None: after a file that holds something else, too."""
    with suppress(OSError):
        held = path.read_bytes()
        os.utime(path)
        if hashlib.sha256(held[32:]).digest() == held[:32]:
            return held[32:]
    return None


def _write(path: Path, found: bytes) -> None:
    """Write a file, where it can be written."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically({path: hashlib.sha256(found).digest() + found})


@cache
def _versions() -> str:
    """Of the libraries that trace, and of the source of jfsm."""
    paths, source = sorted(_SOURCE.rglob("*.py")), hashlib.sha256()
    if not paths:
        raise _UnknownError  # an archive, say
    for path in paths:
        source.update(path.read_bytes())
    return " ".join([source.hexdigest(), *map(version, _LIBRARIES)])


def _text(value: Any) -> str:
    """A text that says all of a value: of trees, classes and plain values; `_UnknownError` of any other."""
    if isinstance(value, jax.tree_util.PyTreeDef):
        return "".join(_of_tree(value))
    if isinstance(value, tuple | list | frozenset):
        parts = sorted(map(_text, value)) if isinstance(value, frozenset) else map(_text, value)
        return f"{_text(type(value))}({','.join(parts)})"
    if isinstance(value, type | FunctionType):
        if value.__module__.split(".")[0] in _OURS and "<" not in value.__qualname__:
            return f"{value.__module__}.{value.__qualname__}"
        raise _UnknownError
    if value is None or isinstance(value, str | int | float | complex | np.dtype):
        return repr(value)
    if type(value).__module__.split(".")[0] == "equinox":  # its mark of a field without a value
        return _text(type(value))
    raise _UnknownError


def _of_tree(tree: Any) -> Iterator[str]:
    """The text of a tree's structure, part by part."""
    node = tree.node_data()
    if node is None:
        yield "*" if tree.num_leaves else "-"
        return
    kind, rest = node
    yield f"{_text(kind)}[{_text(rest)}]("
    for child in tree.children():
        yield from _of_tree(child)
    yield ")"

"""What a function of `jax.numpy` computes, as expressions of single numbers that every language can write.

The program that JAX traces of a law is followed operation by operation. Arrays fall apart into their numbers, and what
does not depend on a symbol is computed here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.extend.core import Literal


@dataclass(frozen=True)
class Expression:
    """A number by its value, a symbol by its name, or an operation on others."""

    operation: str
    operands: tuple["Expression", ...] = ()
    value: float | bool | str = 0.0

    @property
    def is_number(self) -> bool:
        return self.operation == "number"

    def symbols(self) -> set[str]:
        """Names of the symbols in it."""
        if self.operation == "symbol":
            return {str(self.value)}
        return set().union(*(operand.symbols() for operand in self.operands))


def number(value: Any) -> Expression:
    """A number, or true or false."""
    return Expression("number", (), bool(value) if isinstance(value, bool | np.bool_) else float(value))


def symbol(name: str) -> Expression:
    """What has a name."""
    return Expression("symbol", (), name)


ELEMENTWISE: dict[str, Callable[..., Any]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "pow": np.power,
    "abs": np.abs, "sign": np.sign, "max": np.maximum, "min": np.minimum, "floor": np.floor, "ceil": np.ceil,
    "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin,
    "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
    "expm1": np.expm1, "log1p": np.log1p, "gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal,
    "eq": np.equal, "ne": np.not_equal, "and": np.logical_and, "or": np.logical_or, "not": np.logical_not,
    "select": lambda condition, yes, no: yes if condition else no,
}  # fmt: skip
"""Operations that a text may hold, each with what it does to numbers."""
_CALLS = ("jit", "pjit", "closed_call", "custom_jvp_call", "custom_vjp_call")
_SAME = ("copy", "copy_p", "stop_gradient", "optimization_barrier")


class NotWrittenError(ValueError):
    """An operation that no text is known of."""


def traced(function: Callable[..., Any], *arguments: Any) -> list[np.ndarray]:
    """What a function gives of expressions, in the order of its results; arrays of them hold objects."""
    flat, tree = jax.tree.flatten(arguments, is_leaf=lambda leaf: isinstance(leaf, Expression | np.ndarray))
    given = [np.asarray(leaf, object) for leaf in flat]
    shapes = [jax.ShapeDtypeStruct(each.shape, float) for each in given]
    program = jax.make_jaxpr(lambda *leaves: function(*jax.tree.unflatten(tree, leaves)))(*shapes)
    return _followed(program.jaxpr, program.consts, given)


def _followed(program: Any, constants: Sequence[Any], given: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The results of a program of JAX."""
    known: dict[Any, np.ndarray] = dict(zip(program.invars, given, strict=True))
    known |= {name: _numbers(value) for name, value in zip(program.constvars, constants, strict=True)}

    def read(atom: Any) -> np.ndarray:
        return _numbers(atom.val) if isinstance(atom, Literal) else known[atom]

    for step in program.eqns:
        found = _done(step, [read(atom) for atom in step.invars])
        known.update(zip(step.outvars, found, strict=True))
    return [read(atom) for atom in program.outvars]


def _numbers(value: Any) -> np.ndarray:
    """Numbers of JAX as expressions."""
    held = np.asarray(value)
    found = np.empty(held.shape, object)
    for place in np.ndindex(held.shape):
        found[place] = number(held[place])
    return found


def _done(step: Any, given: list[np.ndarray]) -> list[np.ndarray]:
    """The results of one step."""
    name, how = step.primitive.name, step.params
    if name in _CALLS:
        called = how["jaxpr"] if "jaxpr" in how else how["call_jaxpr"]
        return _followed(called.jaxpr, called.consts, given)
    if name in _SAME:
        return given
    if name == "convert_element_type":
        return [_converted(given[0], step.invars[0].aval.dtype, how["new_dtype"])]
    if name == "select_n" and len(given) == 3 and step.invars[0].aval.dtype == bool:
        return [_each("select", given[0], given[2], given[1])]
    if name in ("integer_pow", "square"):
        return [_each("pow", given[0], _numbers(float(how.get("y", 2))))]
    if name in ELEMENTWISE and not (name in ("and", "or", "not") and step.outvars[0].aval.dtype != bool):
        return [_each(name, *given)]
    if name in _SHAPES:
        return [np.asarray(_SHAPES[name](how, *given), object)]
    raise NotWrittenError(name)


def _converted(given: np.ndarray, was: Any, becomes: Any) -> np.ndarray:
    """Numbers of another kind; true is 1."""
    was_truth, becomes_truth = (np.issubdtype(kind, np.bool_) for kind in (was, becomes))
    if was_truth and not becomes_truth:
        return _each("select", given, _numbers(1.0), _numbers(0.0))
    if becomes_truth and not was_truth:
        return _each("ne", given, _numbers(0.0))
    if np.issubdtype(was, np.floating) and np.issubdtype(becomes, np.integer):
        raise NotWrittenError("convert_element_type to whole numbers")
    return given


def _each(name: str, *given: np.ndarray) -> np.ndarray:
    """An operation on every number of arrays."""
    shared: Any = np.broadcast_arrays(*given)
    found = np.empty(shared[0].shape, object)
    for place in np.ndindex(found.shape):
        found[place] = _of_numbers(name, *(each[place] for each in shared))
    return found


def _of_numbers(name: str, *given: Expression) -> Expression:
    """An operation, done where all numbers are known or where it changes nothing."""
    if all(each.is_number for each in given):
        return number(ELEMENTWISE[name](*(each.value for each in given)))
    if name == "select" and (given[0].is_number or given[1] == given[2]):
        return given[2] if given[0] == number(False) else given[1]
    if name == "neg" and given[0].operation == "neg":
        return given[0].operands[0]
    one, nothing = number(1.0), number(0.0)
    if name in ("mul", "div") and given[1] == one or name in ("add", "sub") and given[1] == nothing:
        return given[0]
    if name == "mul" and given[0] == one or name == "add" and given[0] == nothing:
        return given[1]
    return Expression(name, tuple(given))


def _summed(how: Any, given: np.ndarray) -> Any:
    for axis in sorted(how["axes"], reverse=True):
        parts = np.split(given, given.shape[axis], axis)
        total = parts[0]
        for part in parts[1:]:
            total = _each("add", total, part)
        given = np.squeeze(total, axis)
    return given


def _spread(how: Any, given: np.ndarray) -> np.ndarray:
    shape = [1] * len(how["shape"])
    for axis, place in enumerate(how["broadcast_dimensions"]):
        shape[place] = given.shape[axis]
    return np.broadcast_to(given.reshape(shape), how["shape"])


def _cut(how: Any, given: np.ndarray) -> np.ndarray:
    strides = how["strides"] or (1,) * given.ndim
    places = zip(how["start_indices"], how["limit_indices"], strides, strict=True)
    return given[tuple(slice(begin, end, stride) for begin, end, stride in places)]


_SHAPES: dict[str, Callable[..., Any]] = {
    "broadcast_in_dim": _spread,
    "concatenate": lambda how, *given: np.concatenate(given, how["dimension"]),
    "reduce_sum": _summed,
    "reshape": lambda how, given: given.reshape(how["new_sizes"]),
    "slice": _cut,
    "squeeze": lambda how, given: np.squeeze(given, tuple(how["dimensions"])),
    "stack": lambda how, *given: np.stack(given, how["axis"]),
}
"""Operations that only put numbers elsewhere, or add them up."""

"""Loops over samples, which XLA's processor runtime would run operation by operation."""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from jax.experimental.xla_metadata import set_xla_metadata

from .._traced import jit_kept

Found = TypeVar("Found")

_OPTIONS = {"xla_backend_optimization_level": 1}
"""On a CPU. The further LLVM passes take a quarter of the compile time and make nothing faster."""

_refused = False
"""Whether XLA has refused in this process to compile a program to one kernel."""


def jit_with_kernels(function: Callable[..., Found]) -> Callable[..., Found]:
    """`jax.jit` of a function whose keyword `one_kernel` says whether its loops may be kernels.

    The first argument is hashable and part of the program, the others are trees of arrays. Traced programs are kept on
    disk (`jit_kept`). The operations that a kernel may hold differ between versions of XLA: after a first refusal there
    are no more kernels.
    """
    compiled = jit_kept(function, lambda: _OPTIONS if jax.default_backend() == "cpu" else None)

    @wraps(function)
    def run(static: Hashable, *arguments: Any) -> Found:
        global _refused
        if not _refused:
            try:
                return compiled(static, *arguments, one_kernel=True)
            except jax.errors.JaxRuntimeError:
                found = compiled(static, *arguments, one_kernel=False)  # any other error is raised again
                _refused = True
                return found
        return compiled(static, *arguments, one_kernel=False)

    return run


def as_one_kernel(loop: Callable[..., Found]) -> Callable[..., Found]:
    """A function that is a loop of very many operations on a few numbers each.

    Most of the time of such a loop goes by between its operations. On a processor it is compiled to one kernel here:
    three times faster, and on one core. A kernel calls no library, so that matrices must be small, too small for XLA to
    have them multiplied by one, and nothing may be decomposed.
    """

    def called(*arguments: Any) -> Found:
        leaves, tree = jax.tree.flatten(arguments)
        shape: list[Any] = []

        def on_full(full: list[Any]) -> list[Any]:
            outcome = loop(*jax.tree.unflatten(tree, _filled_up(full, leaves)))
            shape[:] = [jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype), outcome)]
            return [leaf for leaf in jax.tree.leaves(outcome) if leaf.size]

        # The attributes belong to the call, not to its body: a tagged result tags the operation that it comes
        # from. An empty array has no place in a kernel.
        full = jax.jit(on_full)([leaf for leaf in leaves if leaf.size])
        tagged: Any = set_xla_metadata(full, inlineable="false", xla_cpu_small_call="true")
        found = _filled_up(tagged, jax.tree.leaves(shape[0]))
        return jax.tree.unflatten(jax.tree.structure(shape[0]), found)

    return called if jax.default_backend() == "cpu" else loop


def _filled_up(full: list[Any], shapes: list[Any]) -> list[Any]:
    """Arrays of these shapes: those that hold anything, and the empty ones between them."""
    rest = iter(full)
    return [next(rest) if shape.size else jnp.zeros(shape.shape, shape.dtype) for shape in shapes]

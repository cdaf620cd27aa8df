"""Loops over samples, which XLA's processor runtime would run operation by operation."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from threading import Lock
from typing import Any, TypeVar

import equinox as eqx
import jax
from jax.experimental.xla_metadata import set_xla_metadata

Found = TypeVar("Found")

_KEPT = 40
"""Programs of a function that are kept, those used last: one of them takes up to fifty megabytes."""

_OPTIONS = {"xla_backend_optimization_level": 1}
"""On a processor. What LLVM does beyond that takes a quarter of the time of compiling, and gains none."""

_refused = False
"""Whether this process has met a program that XLA does not make one kernel of."""


def jit_with_kernels(function: Callable[..., Found]) -> Callable[..., Found]:
    """`eqx.filter_jit` of a function whose keyword `one_kernel` says whether its loops may be kernels.

    Programs that have not been used for long are dropped. Which operations a kernel may hold differs between versions
    of XLA: after a first refusal there are no more kernels.
    """
    programs: OrderedDict[Hashable, Callable[..., Found]] = OrderedDict()
    lock = Lock()

    def compiled(arguments: tuple, *, one_kernel: bool) -> Found:
        dynamic, static = eqx.partition(arguments, eqx.is_array)
        fixed, shape_of = jax.tree.flatten(static)
        kinds = tuple((leaf.shape, leaf.dtype) for leaf in jax.tree.leaves(dynamic))
        key = shape_of, tuple(fixed), kinds, one_kernel
        with lock:
            program = programs.pop(key, None) or _program(function, static, one_kernel)
            programs[key] = program
            while len(programs) > _KEPT:
                programs.popitem(last=False)
        return program(dynamic)

    @wraps(function)
    def run(*arguments: Any) -> Found:
        global _refused
        if not _refused:
            try:
                return compiled(arguments, one_kernel=True)
            except jax.errors.JaxRuntimeError:
                found = compiled(arguments, one_kernel=False)  # raises again what is no refusal
                _refused = True
                return found
        return compiled(arguments, one_kernel=False)

    return run


def _program(function: Callable[..., Found], static: Any, one_kernel: bool) -> Callable[..., Found]:
    """The function of what is not `static` among its arguments, compiled at its first call."""

    @wraps(function)
    def program(dynamic):
        return function(*eqx.combine(dynamic, static), one_kernel=one_kernel)

    return jax.jit(program, compiler_options=_OPTIONS if jax.default_backend() == "cpu" else None)


def one_kernel_scan(body: Callable[[Any, Any], tuple[Any, Any]], start: Any, inputs: Any) -> tuple[Any, Any]:
    """`jax.lax.scan` for a body of very many operations on a few numbers each.

    Most of the time of such a loop goes by between its operations. On a processor it is compiled to one kernel here:
    three times faster, and on one core. A kernel calls no library, so that matrices must be small, too small for XLA to
    have them multiplied by one, and nothing may be decomposed.
    """

    def loop(start, inputs):
        return jax.lax.scan(body, start, inputs)

    if jax.default_backend() != "cpu":
        return loop(start, inputs)
    # The attributes belong to the call, not to what is inside: a tagged result tags the operation that it comes from.
    found: Any = set_xla_metadata(jax.jit(loop)(start, inputs), inlineable="false", xla_cpu_small_call="true")
    return found

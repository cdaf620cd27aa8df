"""The forces of one law along a given motion of its link, for many sets of its numbers.

A law without hidden states is evaluated at each instant independently: one program of one size serves all laws of a
table and every record, and a number chooses the law. Laws with hidden states have one program too, a loop over samples
with any number of steps.
"""

from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._traced import jit_kept
from .._types import Array
from ..structures import (
    FRICTION_TERMS,
    MEMORY_TERMS,
    SMOOTH_TERMS,
    AbstractTerm,
    LinearDamping,
    LinearStiffness,
    MapTerm,
    Structure,
)
from ._along import HIDDEN_SUBSTEPS
from ._grid import delayed_along
from ._kernel import as_one_kernel, jit_with_kernels
from ._plant import LAW_PARAMETERS, Plant, Slots, hidden_width, numbers_of
from ._stepper import runge_kutta

_TABLE = (LinearStiffness, LinearDamping, *SMOOTH_TERMS, *FRICTION_TERMS)
_ROWS, _INSTANTS = 16, 1024
"""Sets of numbers, and instants, that one call is for."""


def forces_of_law(
    kind: type[AbstractTerm],
    numbers: Float[np.ndarray, "rows numbers"],
    d: Float[np.ndarray, " n"],
    w: Float[np.ndarray, " n"],
    time: Float[np.ndarray, " n"],
    *,
    substeps: int = HIDDEN_SUBSTEPS,
) -> Float[np.ndarray, "rows n"]:
    """Force [N] of a law on a link of displacement `d` and velocity `w`, for rows of its numbers; friction slides.

    Hidden states begin relaxed, and take `substeps` a sample.
    """
    if kind.states:
        laws, more = (MEMORY_TERMS if kind in MEMORY_TERMS else (kind,)), max(LAW_PARAMETERS - numbers.shape[1], 0)
        chosen, padded = np.array([laws.index(kind)], np.int32), np.pad(numbers, ((0, 0), (0, more)))
        return np.asarray(_remembered(laws, chosen, padded, d, w, time, np.asarray(substeps)))
    law = kind(*numbers[0].tolist(), at=(0, 1))
    if law.delay is not None:
        plant = numbers_of(Structure([1.0], [law]))
        padded = np.pad(numbers, ((0, 0), (0, plant.delayed.parameters.shape[1] - numbers.shape[1])))
        return np.asarray(_answering_the_past(plant, padded, d, w, time))
    return _at_once(kind, numbers, d, w, time)


def force_at(term: AbstractTerm, d: Float[np.ndarray, " n"], w: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Force [N] of a term in states of its link; it must need neither a memory nor the time."""
    if isinstance(term, MapTerm):
        return np.asarray(term.force_map.evaluate(np.column_stack([d, w])))
    return _at_once(type(term), np.array([term.values], dtype=float), d, w, np.zeros(d.size))[0]


def _at_once(kind: type[AbstractTerm], numbers: np.ndarray, d: np.ndarray, w: np.ndarray, time: np.ndarray):
    """Forces (rows, n) of a law without memory, in lots of one size."""
    laws, (rows, width) = _TABLE if kind in _TABLE else (kind,), numbers.shape
    chosen = np.array([laws.index(kind)], np.int32)
    more = -rows % _ROWS, -d.size % _INSTANTS
    numbers = np.pad(np.pad(numbers, ((0, more[0]), (0, 0)), "edge"), ((0, 0), (0, max(LAW_PARAMETERS - width, 0))))
    instants = np.pad(np.stack([d, w, time]), ((0, 0), (0, more[1])), "edge")
    found = np.empty((len(numbers), instants.shape[1]))
    for i in range(0, len(numbers), _ROWS):
        for k in range(0, instants.shape[1], _INSTANTS):
            lot = slice(i, i + _ROWS), slice(k, k + _INSTANTS)
            found[lot] = _lot_at_once(laws, chosen, numbers[lot[0]], *instants[:, lot[1]])
    return found[:rows, : d.size]


@jit_kept
def _lot_at_once(laws: tuple[type[AbstractTerm], ...], chosen, numbers, d, w, time):
    def one(row):
        slot = Slots(chosen, row[None], jnp.ones((1, 1)), laws)
        return slot.choose(0, lambda law: jax.vmap(lambda d, w, t: law.force(d, w, (), t))(d, w, time))

    return jax.vmap(one)(numbers)


@jit_kept
def _answering_the_past(plant: Plant, numbers, d, w, time):
    def one(row):
        changed = eqx.tree_at(lambda plant: plant.delayed.parameters, plant, row[None])
        return delayed_along(changed, d[:, None], w[:, None], time)[:, 0]

    return jax.vmap(one)(numbers)


@jit_with_kernels
def _remembered(
    laws: tuple[type[AbstractTerm], ...], chosen, numbers, d, w, time, substeps, *, one_kernel: bool
) -> Float[Array, "rows n"]:
    def loop(chosen, numbers, *motion):
        return jax.vmap(partial(_remembering, laws, chosen), in_axes=(0, *(None,) * len(motion)))(numbers, *motion)

    run = as_one_kernel(loop) if one_kernel and laws == MEMORY_TERMS else loop
    return run(chosen, numbers, d, w, time, substeps)


def _remembering(laws: tuple[type[AbstractTerm], ...], chosen, row, d, w, time, substeps) -> Float[Array, " n"]:
    slots = Slots(chosen, row[None], jnp.ones((1, 1)), laws)
    step, width = time[1] - time[0], hidden_width(slots)

    def of_law(ask: Callable[[AbstractTerm], Float[Array, " states"]]) -> Float[Array, " hidden"]:
        return slots.choose(0, lambda law: jnp.pad(ask(law), (0, width - law.states)))

    def sample(z, inputs):
        d0, d1, w0, w1, t = inputs

        def substep(i, z):
            begin, end, h = i / substeps, (i + 1) / substeps, step / substeps
            middle = (begin + end) / 2

            def along(law):
                def rate(z, s):
                    return law.state_rate(d0 + s * (d1 - d0), w0 + s * (w1 - w0), z, t + s * step)

                fading, z0 = law.fading(w0 + middle * (w1 - w0)), z[: law.states]
                if fading is None:
                    after = runge_kutta(rate, z0, h, (begin, middle, end))
                else:  # exact for a speed that stays: however stiff, in any step
                    after = z0 + h * _mean_of_what_fades(fading * h) * rate(z0, middle)
                return law.settle(d0 + end * (d1 - d0), after)

            return of_law(along)

        force = slots.choose(0, lambda law: law.force(d0, w0, z[: law.states], t))
        return jax.lax.fori_loop(0, substeps, substep, z), force

    after = [jnp.concatenate([q[1:], q[-1:]]) for q in (d, w)]
    start = of_law(lambda law: law.initial_state(d[0], w[0]))
    return jax.lax.scan(sample, start, (d, after[0], w, after[1], time))[1]


def _mean_of_what_fades(x):
    """Mean of exp(-s) from 0 to `x` ≥ 0."""
    small = x < 1e-6
    return jnp.where(small, 1.0 - x / 2, -jnp.expm1(-x) / jnp.where(small, 1.0, x))

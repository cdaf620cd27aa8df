"""The forces of one law along a given motion of its link, for many sets of its numbers.

A law that has no hidden states answers every instant by itself: one program of one size serves all of a table and every
record, and a number chooses among them. A law with hidden states is a loop over samples and has a program of its own,
whatever steps it needs.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..structures import FRICTION_TERMS, SMOOTH_TERMS, AbstractTerm, LinearDamping, LinearStiffness, MapTerm, Structure
from ._along import SUBSTEPS
from ._grid import delayed_along
from ._plant import LAW_PARAMETERS, Plant, Slots, numbers_of
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
    substeps: int = SUBSTEPS,
) -> Float[np.ndarray, "rows n"]:
    """Force [N] of a law on a link of displacement `d` and velocity `w`, for rows of its numbers; friction slides.

    Hidden states begin relaxed, and take `substeps` a sample.
    """
    if kind.states:
        return np.asarray(_remembered(kind, numbers, d, w, time, np.asarray(substeps)))
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


@partial(jax.jit, static_argnums=0)
def _lot_at_once(laws: tuple[type[AbstractTerm], ...], chosen, numbers, d, w, time):
    def one(row):
        slot = Slots(chosen, row[None], jnp.ones((1, 1)), laws)
        return slot.choose(0, lambda law: jax.vmap(lambda d, w, t: law.force(d, w, (), t))(d, w, time))

    return jax.vmap(one)(numbers)


@eqx.filter_jit
def _answering_the_past(plant: Plant, numbers, d, w, time):
    def one(row):
        changed = eqx.tree_at(lambda plant: plant.delayed.parameters, plant, row[None])
        return delayed_along(changed, d[:, None], w[:, None], time)[:, 0]

    return jax.vmap(one)(numbers)


@partial(jax.jit, static_argnums=0)
def _remembered(kind: type[AbstractTerm], numbers, d, w, time, substeps):
    return jax.vmap(partial(_remembering, kind), in_axes=(0, None, None, None, None))(numbers, d, w, time, substeps)


def _remembering(kind: type[AbstractTerm], row, d, w, time, substeps) -> Float[Array, " n"]:
    law = kind(*(row[i] for i in range(len(kind.parameters))), at=(0, 1))
    step = time[1] - time[0]

    def sample(z, inputs):
        d0, d1, w0, w1, t = inputs

        def rate(z, s):
            return law.state_rate(d0 + s * (d1 - d0), w0 + s * (w1 - w0), z, t + s * step)

        def substep(i, z):
            begin, end = i / substeps, (i + 1) / substeps
            after = runge_kutta(rate, z, step / substeps, (begin, (begin + end) / 2, end))
            return law.settle(d0 + end * (d1 - d0), after)

        return jax.lax.fori_loop(0, substeps, substep, z), law.force(d0, w0, z, t)

    after = [jnp.concatenate([q[1:], q[-1:]]) for q in (d, w)]
    return jax.lax.scan(sample, law.initial_state(d[0], w[0]), (d, after[0], w, after[1], time))[1]

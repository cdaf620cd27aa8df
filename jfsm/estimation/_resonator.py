r"""A resonator with a random force, as a linear model on the grid of a record.

    ẍ = -K x - C ẋ + B (g + e) - L r,     y = (x, v, ẍ) + bias + noise

g is the measured force and e its white noise. The random forces r are processes of Matérn's family with ν = p + 1/2,
which have p derivatives (none or two); their variance may swell and fade along the record. A bias may wander.
"""

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ._kalman import LinearModel, log_likelihood, smoothed

_BIAS = 0.3
"""Standard deviation of a bias beforehand, in sizes of its channel."""
_TAYLOR, _DEGREE, _HALVINGS = 0.5, 13, 16
"""Norm up to which a Taylor series of this degree is exact to double precision; halvings of a matrix, at most."""


class Kind(NamedTuple):
    """What a compiled program is made for.

    `channels` are the order of differentiation and the index of the degree of freedom of each; `learned` tells whether
    stiffness, damping and gains are among the numbers; `loads` is the number of random forces, `alike` whether they
    have one size, `smoothness` how many derivatives they have.
    """

    channels: tuple[tuple[int, int], ...]
    dof: int
    inputs: int
    learned: bool
    loads: int
    alike: bool
    smoothness: int

    @property
    def biased(self) -> tuple[int, ...]:
        """Channels that may show a constant, or something slow, beside the motion."""
        return tuple(i for i, (order, _) in enumerate(self.channels) if order > 0)


class Numbers(NamedTuple):
    """What is learned; logarithms but for `gain`, in units of the motion's size and rate.

    Stiffness, damping and gains of the measured forces; memory and size of the random forces; noise of the measured
    forces, of the velocity over a step (what forces do between samples), and of the channels; how far each bias
    wanders in a radian of the motion.
    """

    stiffness: Any
    damping: Any
    gain: Any
    memory: Any
    size: Any
    force: Any
    between: Any
    noise: Any
    drift: Any

    @classmethod
    def unpacked(cls, theta: Array, kind: Kind) -> "Numbers":
        """The numbers from one vector."""
        free = kind.dof if kind.learned else 0
        sizes = (
            free, free, free * kind.inputs, 1, 1 if kind.alike else kind.loads, kind.inputs, kind.dof,
            len(kind.channels), len(kind.biased),
        )  # fmt: skip
        k, c, gain, memory, size, force, between, noise, drift = jnp.split(theta, np.cumsum(sizes)[:-1].tolist())
        size = jnp.broadcast_to(size, (kind.loads,))
        return cls(k, c, gain.reshape(free, kind.inputs), memory[0], size, force, between, noise, drift)

    @property
    def packed(self) -> np.ndarray:
        return np.concatenate([np.ravel(q) for q in self])


class Data(NamedTuple):
    """Readings, which of them count, measured forces, the base, the swelling of the random forces' variance; the step,
    the standard deviation of the first state, where the random forces act, and what is used where it is not learned.
    """

    seen: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    drive: Float[Array, "n inputs"]
    base: Float[Array, "n 1"]
    swell: Float[Array, " n"]
    step: Float[Array, ""]
    first: Float[Array, ""]
    lever: Float[Array, "dof loads"]
    stiffness: Float[Array, "dof dof"]
    damping: Float[Array, "dof dof"]
    gain: Float[Array, "dof inputs"]


class _Built(NamedTuple):
    """A linear model; how a driving acceleration, its slope and its bend enter it; rows of (x, v, a), biases and r."""

    linear: LinearModel
    enter: Float[Array, "state three_dof"]
    watch: Float[Array, "watched state"]


def _expm(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Exponential of a matrix: its Taylor series at a small fraction of it, squared again and again.

    With a choice between several rational functions instead, a likelihood takes nearly twice as long to compile.
    """
    norm = jnp.max(jnp.sum(jnp.abs(matrix), 0))
    halvings = jnp.clip(jnp.ceil(jnp.log2(jnp.maximum(norm, _TAYLOR) / _TAYLOR)), 0, _HALVINGS)
    part, eye = matrix * 2.0**-halvings, jnp.eye(len(matrix))
    total = jax.lax.fori_loop(0, _DEGREE, lambda i, sum_: eye + part @ sum_ / (_DEGREE - i), eye)
    return jax.lax.fori_loop(0, _HALVINGS, lambda i, root: jnp.where(i < halvings, root @ root, root), total)


def _matern(smoothness: int, size, tau):
    """Rate matrix of a Matérn process and its derivatives, density of the noise that drives the last, and covariance.

    It has none or two derivatives; they are blocks of loads, and `size` (loads,) is its standard deviation.
    J. Hartikainen, S. Särkkä, IEEE MLSP 2010.
    """
    p, eye = smoothness, jnp.eye(size.size)
    rate = math.sqrt(2 * p + 1) / tau
    last = [-math.comb(p + 1, i) * rate ** (p + 1 - i) for i in range(p + 1)]
    upper = jnp.concatenate([jnp.eye(p + 1)[1:], jnp.stack(last)[None, :]])
    density = size**2 * (2 * rate) ** (2 * p + 1) * math.factorial(p) ** 2 / math.factorial(2 * p)
    covariance = jnp.eye(1)
    if p == 2:
        bend = rate**2 / 3
        covariance = jnp.diag(jnp.stack([1.0, bend, rate**4])).at[0, 2].set(-bend).at[2, 0].set(-bend)
    driven = jnp.zeros((p + 1, p + 1)).at[p, p].set(1.0)
    return jnp.kron(upper, eye), jnp.kron(driven, jnp.diag(density)), jnp.kron(covariance, jnp.diag(size**2))


def _built(numbers: Numbers, gain, data: Data, kind: Kind) -> _Built:
    dof, dt, eye = kind.dof, data.step, jnp.eye(kind.dof)
    k, c = data.stiffness, data.damping
    if kind.learned:
        k, c = jnp.diag(jnp.exp(numbers.stiffness)), jnp.diag(jnp.exp(numbers.damping))
    memory, density, stationary = _matern(kind.smoothness, jnp.exp(numbers.size), jnp.exp(numbers.memory))
    n, biased, forces = 2 * dof + len(memory), len(kind.biased), kind.inputs
    total = n + biased + forces
    pull = jnp.concatenate([-k, -c, -data.lever, jnp.zeros((dof, n - 2 * dof - kind.loads))], 1)
    a = jnp.zeros((n, n)).at[:dof, dof : 2 * dof].set(eye).at[2 * dof :, 2 * dof :].set(memory)
    a = a.at[dof : 2 * dof].set(pull)
    # C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404: the covariance that a step adds.
    spread = jnp.zeros((n, n)).at[2 * dof :, 2 * dof :].set(density)
    loan = _expm(dt * jnp.block([[-a, spread], [jnp.zeros((n, n)), a.T]]))
    step = loan[n:, n:].T
    added = step @ loan[:n, n:]
    # The drive is a parabola between samples: x' = a x + enter u, with u, u' and u'' at the start of the step.
    held = jnp.zeros((n + 3 * dof, n + 3 * dof)).at[:n, :n].set(dt * a)
    held = held.at[dof : 2 * dof, n : n + dof].set(dt * eye)
    held = held.at[n : n + dof, n + dof : n + 2 * dof].set(eye).at[n + dof : n + 2 * dof, n + 2 * dof :].set(eye)
    enter = _expm(held)[:n, n:]
    between = jnp.zeros(total).at[dof : 2 * dof].set(jnp.exp(2 * numbers.between))
    between = between.at[n : n + biased].set(dt * jnp.exp(2 * numbers.drift))
    fresh = jnp.diag(jnp.exp(2 * numbers.force))
    shown = jnp.zeros((3, dof, total)).at[0, :, :dof].set(eye).at[1, :, dof : 2 * dof].set(eye)
    shown = shown.at[2, :, :n].set(pull).at[2, :, n + biased :].set(gain)
    rows = jnp.stack([shown[order, j] for order, j in kind.channels])
    for i, channel in enumerate(kind.biased):
        rows = rows.at[channel, n + i].set(1.0)
    start = jnp.diag(jnp.concatenate([jnp.full(2 * dof, data.first**2), jnp.zeros(n - 2 * dof + biased + forces)]))
    start = start.at[2 * dof : n, 2 * dof : n].set(stationary)
    start = start.at[n : n + biased, n : n + biased].set(_BIAS**2 * jnp.eye(biased))
    linear = LinearModel(
        step=jnp.eye(total).at[:n, :n].set(step).at[:n, n + biased :].set(enter[:, :dof] @ gain)
        .at[n + biased :, n + biased :].set(0.0),
        noise=jnp.diag(between).at[n + biased :, n + biased :].set(fresh),
        rows=rows,
        variance=jnp.exp(2 * numbers.noise),
        start=start.at[n + biased :, n + biased :].set(fresh),
        wander=jnp.zeros((total, total)).at[:n, :n].set((added + added.T) / 2),
    )  # fmt: skip
    watch = jnp.concatenate([shown.transpose(1, 0, 2).reshape(3 * dof, total), jnp.eye(total)[n : n + biased]])
    watch = jnp.concatenate([watch, jnp.eye(total)[2 * dof : 2 * dof + kind.loads]])
    return _Built(linear, jnp.pad(enter, ((0, total - n), (0, 0))), watch)


class _Driven(NamedTuple):
    """What is built; the acceleration that drives; what it adds over every step; readings without it."""

    built: _Built
    push: Float[Array, "n dof"]
    pushed: Float[Array, "n state"]
    seen: Float[Array, "n channels"]


def _driven(theta: Array, data: Data, kind: Kind) -> _Driven:
    numbers = Numbers.unpacked(theta, kind)
    gain = numbers.gain if kind.learned else data.gain
    push = data.drive @ gain.T - data.base
    built = _built(numbers, gain, data, kind)
    after = jnp.concatenate([push[1:], push[-1:]])
    bend = jnp.concatenate([push[:1], push[:-1]]) - 2 * push + after
    bend = (bend + jnp.concatenate([bend[1:], bend[-1:]])) / 2
    pushed = jnp.concatenate([push, after - push - bend / 2, bend], 1) @ built.enter.T
    at_once = jnp.stack([push[:, j] * (order == 2) for order, j in kind.channels], 1)
    return _Driven(built, push, pushed, data.seen - at_once)


@partial(jax.jit, static_argnames="kind")
def cost(theta: Array, data: Data, centre: Array, width: Array, *, kind: Kind):
    """Minus log-posterior of the numbers, and its slope."""

    def value(theta):
        d = _driven(theta, data, kind)
        likelihood = log_likelihood(d.built.linear, d.pushed, d.seen, data.use, data.swell)
        return 0.5 * jnp.sum(((theta - centre) / width) ** 2) - likelihood

    return jax.value_and_grad(value)(theta)


@partial(jax.jit, static_argnames="kind")
def motion(theta: Array, data: Data, *, kind: Kind):
    """Mean and covariance of (x, v, a) of every degree of freedom, then of the biases, then of the random forces."""
    d = _driven(theta, data, kind)
    mean, covariance = smoothed(d.built.linear, d.pushed, d.seen, data.use, d.built.watch, data.swell)
    return mean.at[:, 2 : 3 * kind.dof : 3].add(d.push), covariance

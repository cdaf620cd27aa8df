"""A force state map and the motion that it was read from, estimated together: error bars that know of all noise."""

import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float
from scipy.optimize import minimize
from scipy.spatial import KDTree

from .._programs import programs_kept
from .._types import as_scalar, require_x64
from ..plant import bucket
from ..records import Record, noise_floor
from ..surrogates import Kriging
from ..surrogates.kriging.correlations import AbstractCorrelation
from ..surrogates.kriging.posterior import FilteredPosterior
from ..surrogates.kriging.trend import PolynomialTrend
from ._map_filter import JITTER, Field, Hyper, Recording, Smoothed, cost, smoothed
from ._motion import Motion, estimate_motion
from ._part import Part

NODES = 40
SHORTEST, LONGEST = 64, 16384
"""Samples: a filter of 50 states keeps 20 kB for each."""
TURN = 0.4
"""Largest angle [rad] by which the fastest motion turns in one step of Runge and Kutta's."""
LEAST_STEPS, FINER = 2, 4
"""Steps in a sample at least; more are so many times as many."""
VAGUE = 10.0
"""Standard deviation of the trend beforehand, in sizes of the force."""
PROCESS, DOUBT = 0.05, 2.0
"""Standard deviation of the random field that is believed beforehand, in sizes of the force, and doubt of ln of it."""
LENGTHS = 0.05, 30.0
"""Length scales that are looked at, in standard deviations of the motion."""
ROUNDS, CLIMB, ENOUGH = 3, 12, 0.05
"""How often hyper-parameters and motion are found in turn, steps of a climb, and nats that one step more is worth."""
BEGIN = 400
"""Readings, or means of them, from which a first map is learned that tells where to begin."""
SETTLED, PASSES = 1e-3, 12
"""Change of the motion, in its standard deviations, at which passes of the smoother end, and most of them."""


@programs_kept()
def estimate_force_map(
    record: Record,
    mass: Any,
    *,
    correlation: AbstractCorrelation | None = None,
    trend: str | PolynomialTrend = "quadratic",
    nodes: int = NODES,
    motion: Motion | None = None,
) -> Kriging:
    """Kriging map of all the force that holds a single mass, found together with its motion.

    A map that is fitted to estimated states takes their errors for none, or for white noise. Here the value of the
    random field at some nodes and the coefficients of the trend are states of the filter that smooths the motion:
    whatever noise there is in displacement, velocity, acceleration and force widens the error bars of the map as far as
    it should, and the map tells the smoother how the mass moves.

    Parameters
    ----------
    record : Record
        Of one degree of freedom whose force drives it; with a response, evenly spaced, 64 to 16384 samples.
    mass : float
        In kg, or in the record's set of units.
    correlation : AbstractCorrelation, optional
        `Gaussian()` when None.
    trend : str or PolynomialTrend
        As for `Kriging.fit`.
    nodes : int
        Number of visited states at which the random field is a state of the filter. The time of a pass grows like the
        square of it.
    motion : Motion, optional
        What `estimate_motion` makes of the record, where that is known already.

    Returns
    -------
    Kriging
        With `std` and `sample` of the joint estimate; `nugget` tells the noise of a reading g - m a. It has no readings
        to leave out one by one.

    Raises
    ------
    ValueError
        If the record has several degrees of freedom, another drive than the force, no response, too few or too many
        samples, or the motion cannot tell the coefficients of the trend; if the mass is not positive.
    RuntimeError
        If the smoother diverges.

    Notes
    -----
    The state space model with a random field in it is that of Svensson and Schön (Automatica 80 (2017) 189-199), the
    field's features those of its values at inducing points. The noise of every channel is the one that
    `estimate_motion` and the force channel's own floor tell; the most probable process variance and length scales are
    found about the smoothed motion. Between samples the force is taken as a cubic.
    """
    require_x64()
    mass = _checked(record, mass, nodes)
    motion = estimate_motion(record) if motion is None else motion
    force = record.channels.get(("force", 1), np.zeros(len(record)))
    states = np.column_stack([motion.displacement[:, 0], motion.velocity[:, 0]])
    held = force - mass * motion.acceleration[:, 0]
    begin = Kriging.fit(states, held, correlation, trend, points=BEGIN)
    posterior = begin.parts[0]
    size, spread = float(np.std(held)), states.std(axis=0)
    field = Field(
        posterior.trend, posterior.correlation, jnp.asarray(_apart(states, np.asarray(posterior.length_scale), nodes))
    )
    recording = _recording(record, motion, field, mass, states, force, _substeps(begin, states, mass, record.dt))
    smooth = np.column_stack([states, force, np.gradient(force, record.dt)])
    smooth = jnp.asarray(np.pad(smooth, ((0, len(recording.seen) - len(smooth)), (0, 0)), mode="edge"))
    lengths = np.clip(np.asarray(posterior.length_scale), *(spread * np.array(LENGTHS)[:, None]))
    hyper = _hyper(np.log([PROCESS * size, *lengths]))
    found, change = _settled(recording, smooth, _ridge(field, hyper, states, begin), hyper, spread)
    for _ in range(ROUNDS - 1):
        hyper = _likeliest(recording, found, hyper, size, spread)
        found, change = _settled(recording, found.states, found.mean, hyper, spread)
    remark = f"The smoothed motion still changed by {change:.1g} of its size in the last pass: the map is less sure."
    return _kriging(recording, found, hyper, states, (remark,) if change > SETTLED else ())


def _checked(record: Record, mass: Any, nodes: Any) -> float:
    if record.dofs != 1 or record.drive != "force" or not record.responses:
        raise ValueError(
            "`record` must hold a response of one degree of freedom that its force drives; it has degrees of freedom "
            f'up to {record.dofs}, drive "{record.drive}" and {len(record.responses)} responses. Use '
            "`restoring_force` and `Kriging.fit` for others."
        )
    if not SHORTEST <= len(record) <= LONGEST:
        raise ValueError(
            f"`record` must hold {SHORTEST} to {LONGEST} samples; it has {len(record)}. Cut or resample a longer one, "
            "or use `restoring_force` and `Kriging.fit`."
        )
    weight = float(as_scalar(mass))
    if not weight > 0.0:
        raise ValueError(f"`mass` must be positive; got {weight:g}. Give it in kg, or in the record's set of units.")
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer) or not 4 <= nodes <= SHORTEST:
        raise ValueError(f"`nodes` must be an integer from 4 to {SHORTEST}; got {nodes!r}.")
    return weight


def _recording(
    record: Record,
    motion: Motion,
    field: Field,
    mass: float,
    states: Float[np.ndarray, "n 2"],
    force: Float[np.ndarray, " n"],
    substeps: int,
) -> Recording:
    """The record's readings without what their sensors add, padded."""
    part, n = Part.of_dof(record, 1), len(record)
    orders = tuple(order for order, _ in part.kind(0).channels)
    base = np.zeros(n) if record.base_acceleration is None else record.base_acceleration
    seen, noise = [], []
    for order, channel in zip(orders, part.channels, strict=True):
        beside = motion.bias.get(channel, 0.0) + motion.drift.get(channel, 0.0) + base * (order == 2)
        seen.append(record.responses[channel] - beside)
        noise.append(float(motion.noise[channel[0]][0]))
    size = float(np.std(mass * motion.acceleration))
    driven = bool(np.any(force))
    rough = noise_floor(force, record.dt).std if driven else size
    rate = np.gradient(force, record.dt)
    fill = bucket(n) - n
    columns = np.pad(np.column_stack([*seen, force]), ((0, fill), (0, 0)), mode="edge")
    use = np.column_stack([part.use, np.full(n, float(driven))])
    return Recording(
        field=field,
        seen=jnp.asarray(columns),
        use=jnp.asarray(np.pad(use, ((0, fill), (0, 0)))),
        going=jnp.asarray(np.pad(np.ones(n), (0, fill))),
        base=jnp.asarray(np.pad(base, (0, fill), mode="edge")),
        variance=jnp.asarray(np.square([*noise, max(rough, 1e-6 * size)])),
        walk=jnp.asarray(np.var(np.diff(rate)) / record.dt),
        mass=jnp.asarray(mass),
        dt=jnp.asarray(record.dt),
        first=jnp.asarray([*states[0], force[0], rate[0]]),
        spread=jnp.asarray([*states.std(axis=0), 3.0 * force.std(), 3.0 * rate.std()]),
        vague=jnp.asarray(VAGUE * size / np.sqrt(np.mean(np.square(field.trend(jnp.asarray(states), (0, 0)))))),
        orders=orders,
        substeps=substeps,
    )


def _substeps(force_map: Kriging, states: Float[np.ndarray, "n 2"], mass: float, dt: float) -> int:
    """Steps of Runge and Kutta's in a sample, by the slopes of a map: two, eight and so on, each with its programs."""
    stiff, damped = np.abs(np.asarray(force_map.evaluate_derivatives(states, ((1, 0), (0, 1))))).T / mass
    turn = float(np.quantile(np.sqrt(stiff) + damped, 0.99)) * dt
    return LEAST_STEPS * FINER ** max(0, math.ceil(math.log(turn / TURN / LEAST_STEPS, FINER)))


def _apart(
    states: Float[np.ndarray, "n 2"], length_scale: Float[np.ndarray, "2"], count: int
) -> Float[np.ndarray, "count 2"]:
    """Visited states far apart in length scales: the ends of both columns, then always the farthest from all before."""
    z = states / length_scale
    taken = list(dict.fromkeys([*z.argmin(axis=0).tolist(), *z.argmax(axis=0).tolist()]))
    distance = np.asarray(KDTree(z[taken]).query(z)[0])
    while len(taken) < count:
        taken.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(z - z[taken[-1]], axis=1))
    return states[taken]


def _ridge(field: Field, hyper: Hyper, states: Float[np.ndarray, "n 2"], begin: Kriging) -> Any:
    """Coefficients nearest to a map at the states, weakly drawn to zero."""
    length_scale = jnp.exp(hyper.length_scale)
    columns = field.functions(jnp.asarray(states), length_scale, field.factor(length_scale))
    normal = columns.T @ columns + 1e-3 * jnp.eye(field.size)
    return jnp.linalg.solve(normal, columns.T @ begin.evaluate(states))


def _settled(
    recording: Recording, states: Any, c: Any, hyper: Hyper, spread: Float[np.ndarray, "2"]
) -> tuple[Smoothed, float]:
    """Passes of the smoother until the motion stays, and its last change."""
    for _ in range(PASSES):
        found = smoothed(recording, states, c, hyper)
        change = float(np.max(np.abs(np.asarray(found.states - states))[:, :2] / spread))
        if not np.isfinite(change) or not np.isfinite(float(found.log_likelihood)):
            raise RuntimeError(
                "The smoother of motion and map diverged: the record may not obey m a = g - f(x, v), or be sampled too "
                "coarsely. Look at `jfsm inspect`, or use `restoring_force` and `Kriging.fit`."
            )
        states, c = found.states, found.mean
        if change < SETTLED:
            break
    return found, change


def _likeliest(
    recording: Recording, found: Smoothed, hyper: Hyper, size: float, spread: Float[np.ndarray, "2"]
) -> Hyper:
    """Hyper-parameters of largest posterior about a smoothed motion."""
    centre = math.log(PROCESS * size)

    def value(theta: np.ndarray) -> tuple[float, np.ndarray]:
        minus, slope = cost(_hyper(theta), recording, found.states, found.mean)
        away = (theta[0] - centre) / DOUBT
        slope = np.append(np.asarray(slope.process_std) + away / DOUBT, np.asarray(slope.length_scale))
        return float(minus) + 0.5 * away**2, slope

    begin = np.append(np.asarray(hyper.process_std), np.asarray(hyper.length_scale))
    lengths = np.log(spread[:, None] * np.array(LENGTHS))
    bounds = [(centre - 3.0 * DOUBT, centre + 2.0 * DOUBT), *lengths.tolist()]
    # What SciPy takes is a share of the value.
    options = {"maxiter": CLIMB, "ftol": ENOUGH / max(abs(float(found.log_likelihood)), 1.0)}
    best = minimize(value, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=options).x
    return _hyper(best)


def _hyper(theta: Float[np.ndarray, "3"]) -> Hyper:
    return Hyper(jnp.asarray(theta[0]), jnp.asarray(theta[1:]))


def _kriging(
    recording: Recording, found: Smoothed, hyper: Hyper, states: Float[np.ndarray, "n 2"], remarks: tuple[str, ...]
) -> Kriging:
    """The map of what the filter found."""
    field, length_scale = recording.field, jnp.exp(hyper.length_scale)
    trend = field.trend.triangle.shape[0]
    variance = jnp.exp(2.0 * hyper.process_std)
    of_force = recording.variance[-1] + recording.mass**2 * recording.variance[-2] * (2 in recording.orders)
    factor = field.factor(length_scale)
    values, vectors = jnp.linalg.eigh(found.covariance)
    posterior = FilteredPosterior(
        correlation=field.correlation,
        trend=field.trend,
        states=field.nodes,
        length_scale=length_scale,
        nugget=of_force / variance,
        jitter=jnp.asarray(JITTER),
        process_variance=variance[None],
        trend_coefficients=found.mean[:trend, None],
        weights=solve_triangular(factor, found.mean[trend:, None], lower=True, trans=1),
        factor=factor,
        doubt=vectors * jnp.sqrt(jnp.maximum(values, 0.0) / variance)[None],
    )
    scale = np.asarray(field.nodes).std(axis=0)
    nearest = KDTree(np.asarray(field.nodes) / scale).query(states / scale)[0]
    reach = jnp.asarray(float(np.quantile(np.asarray(nearest), 0.99)))
    optima = -found.log_likelihood[None]
    return Kriging((posterior,), optima, reach, jnp.eye(1), False, remarks)

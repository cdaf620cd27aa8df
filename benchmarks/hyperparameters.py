"""Fifty data sets studied in one call: hyper-parameters of kriging and RKPM by gradient, with intervals.

    python benchmarks/hyperparameters.py [--sets 50] [--n 80] [--out hyperparameters.json]

Every set is drawn from a Gaussian field of known length scales and nugget. `jax.vmap` of `optimistix.minimise` finds
those of largest likelihood, `jax.lax.map` those of least leave-one-out error; `jax.hessian` gives intervals, of which
95 in 100 should hold the truth. `below` is how many nats, in the median, an end lies below that of our likelihood
study; for ends by leave-one-out this is a price and no fault. RKPM's scales and dilation are found by its own
leave-one-out error, set after set within one program. scikit-learn and SMT (ten sets of it), both under the BSD
licence, fit the same sets where they are installed. Times are processor seconds for all sets, with compilation
(`cold`) and without (`warm`).
"""

import argparse
import importlib.util
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

jax.config.update("jax_enable_x64", True)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from benchmarks import kriging_peers as peers  # noqa: E402

TRUTH = np.log([0.5, 0.8, 0.02])
START = jnp.log(jnp.array([0.6, 0.6, 0.1]))
ORDER, NEIGHBOURS = 1, 24


def drawn(sets: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """States (sets, n, 2) and force (sets, n) from the prior."""
    rng = np.random.default_rng(0)
    states, length = rng.uniform(-1.0, 1.0, (sets, n, 2)), np.exp(TRUTH[:2])
    force = np.empty((sets, n))
    for k, points in enumerate(states):
        lag = (points[:, None] - points[None]) / length
        covariance = np.exp(-0.5 * np.sum(lag**2, axis=-1)) + np.exp(TRUTH[2]) * np.eye(n)
        force[k] = np.linalg.cholesky(covariance) @ rng.normal(size=n)
    return states, force


def minus_likelihood(p, states, force):
    return jfsm.Kriging.negative_log_likelihood(p, states, force, trend="constant") / len(force)


def left_out(p, states, force):
    errors = jfsm.Kriging.leave_one_out_errors(p, states, force, trend="constant")
    return 0.5 * jnp.log(jnp.mean(errors**2))


def left_out_of_rkpm(p, states, force):
    """Of the ratio of the scales, and the dilation, which a logistic map keeps between a half and one."""
    values = jnp.array([p[0], -p[0], jnp.log(0.5 + 0.5 * jax.nn.sigmoid(p[1]))])
    return 0.5 * jnp.log(jnp.mean(jfsm.RKPM.leave_one_out_errors(values, states, force, ORDER, NEIGHBOURS) ** 2))


def least(measure: Callable, start: jax.Array, states: jax.Array, force: jax.Array) -> jax.Array:
    """Hyper-parameters of one set."""
    solver = optx.BFGS(rtol=1e-5, atol=1e-5)
    return optx.minimise(lambda p, _: measure(p, states, force), solver, start, max_steps=100, throw=False).value


@jax.jit
def by_likelihood(states, force):
    """Ends, and their standard errors by the Hessian."""
    ends = jax.vmap(lambda x, f: least(minus_likelihood, START, x, f))(states, force)
    # One after another: of many Hessians at once XLA's threads wait for each other without end.
    hessian = jax.lax.map(lambda one: jax.hessian(minus_likelihood)(*one), (ends, states, force)) * force.shape[1]
    return ends, jnp.sqrt(jnp.diagonal(jnp.linalg.inv(hessian), axis1=1, axis2=2))


@jax.jit
def by_leaving_out(states, force):
    return jax.lax.map(lambda one: least(left_out, START, *one), (states, force))


@jax.jit
def of_rkpm(states, force):
    """Leave-one-out errors before and after: set after set, since so many small factorisations at once may hang XLA."""
    start = jnp.array([0.0, 2.0])

    def one(pair):
        end = least(left_out_of_rkpm, start, *pair)
        return left_out_of_rkpm(start, *pair), left_out_of_rkpm(end, *pair)

    return jax.lax.map(one, (states, force))


def timed(call: Callable[[], Any], repeats: int = 2) -> tuple[Any, list[float]]:
    """What a call gives, and the processor time [s] of each."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        found = jax.block_until_ready(call())
        times.append(time.process_time() - start)
    return found, times


def of_scikit_learn(states: np.ndarray, force: np.ndarray) -> np.ndarray:
    known = dict(peers.objectives(states, force))
    return peers.climbed(known["sklearn"], states, force)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=50)
    parser.add_argument("--n", type=int, default=80)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    states, force = drawn(arguments.sets, arguments.n)
    x, f = jnp.asarray(states), jnp.asarray(force)
    value = jax.jit(jax.vmap(lambda p, x, f: minus_likelihood(p, x, f) * len(f)))
    table: dict[str, Any] = {}

    def told(name: str, times: list[float], **row: float) -> None:
        table[name] = {"cold": times[0], "warm": times[-1], **row}
        print(f"{name:28s} " + "  ".join(f"{what} {figure:.3g}" for what, figure in table[name].items()), flush=True)

    (ends, error), times = timed(lambda: by_likelihood(x, f))
    best = np.asarray(value(ends, x, f))
    sure = np.all(np.isfinite(error), axis=1)
    inside = np.abs(np.asarray(ends) - TRUTH)[sure] < 1.96 * np.asarray(error)[sure]
    told("jfsm, likelihood", times, below=0.0, coverage=float(np.mean(inside)), sets=int(np.sum(sure)))
    ends, times = timed(lambda: by_leaving_out(x, f))
    told("jfsm, leave-one-out", times, below=float(np.median(np.asarray(value(ends, x, f)) - best)))
    (before, after), times = timed(lambda: of_rkpm(x, f))
    told("jfsm, RKPM leave-one-out", times, error_ratio=float(np.exp(np.mean(np.asarray(after - before)))))
    fits = {"sklearn": (of_scikit_learn, arguments.sets), "smt": (peers.smt, 10)}
    for module, (fit, sets) in fits.items():
        if not importlib.util.find_spec(module):
            print(f"{module} is not installed; skipped")
            continue
        centred = [(points, one - one.mean()) for points, one in zip(states[:sets], force[:sets], strict=True)]
        found, times = timed(lambda fit=fit, some=centred: np.stack([fit(*one) for one in some]), 1)
        below = np.median(np.asarray(value(jnp.asarray(found), x[:sets], f[:sets])) - best[:sets])
        told(module, [times[0] * arguments.sets / len(centred)], below=float(below))
    if arguments.out:
        arguments.out.write_text(json.dumps(table, indent=1))


if __name__ == "__main__":
    main()

"""How does the time that a fit takes grow with the degrees of freedom?

    python benchmarks/growth.py [--dof 1 2 3 5 8] [--storeys]

A chain of equal masses, driven at its last one, is fitted from values off by some per cent: 1500 samples, the
acceleration of every mass with 1 % noise, at rest before. With `--storeys` also a tower of five storeys whose springs
act across two storeys as well, which the model does not know: 600 samples with 20 % noise, sensors that drift. Times
are CPU seconds of the process: of the first fit, which compiles, of the same fit again, and of that for each evaluation
of the likelihood with its derivatives. `error` is the largest relative error of a spring.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402  (needs the line above when run as a script)

SAMPLES, RATE = 1500, 100.0


class Case(NamedTuple):
    """A record, the model that is fitted to it, and its true springs [N/m]."""

    record: object
    model: object
    stiffness: float


def chain(dof: int) -> Case:
    """Masses of 1 kg, springs of 400 N/m, dashpots of 1 N s/m."""
    import jfsm

    rng, t = np.random.default_rng(0), np.arange(SAMPLES) / RATE
    mass, stiffness, damping = np.ones(dof), np.full(dof, 400.0), np.ones(dof)
    force = 10 * np.convolve(rng.standard_normal(t.size), np.full(3, 1 / 3), "same")
    acceleration = _simulated(jfsm.Structure.chain(mass=mass, stiffness=stiffness, damping=damping), t, dof, force)
    acceleration += 0.01 * acceleration.std(0) * rng.standard_normal(acceleration.shape)
    begin = stiffness * (1 + 0.05 * rng.standard_normal(dof))
    model = jfsm.Structure.chain(mass=mass, stiffness=begin, damping=1.1 * damping)
    return Case(_record(t, dof, force, acceleration), model, 400.0)


def storeys() -> Case:
    """A tower of five storeys of 19 t, and the shear model of it, of which every spring is 1.4 times too stiff."""
    import jfsm

    def shear(factor: float, damping: float) -> list:
        links = [(i, i + 1) for i in range(5)]
        springs = [jfsm.LinearStiffness(2.74e6 * factor, at=link) for link in links]
        return springs + [jfsm.LinearDamping(damping, at=link) for link in links]

    rng, t, mass = np.random.default_rng(0), np.arange(600) / 20.0, [19365.0] * 5
    force = 500 * np.convolve(rng.standard_normal(t.size), [0.25, 0.5, 0.25], "same")
    across = [jfsm.LinearStiffness(8e5, at=(i, i + 2)) for i in range(4)]
    acceleration = _simulated(jfsm.Structure(mass=mass, terms=shear(1.0, 2e4) + across), t, 5, force)
    drift = 0.02 + 0.3 * np.sin(t / 9)[:, None]
    acceleration += acceleration.std(0) * (0.2 * rng.standard_normal(acceleration.shape) + drift)
    record = jfsm.Record(t, force={5: force}, acceleration=acceleration)
    return Case(record, jfsm.Structure(mass=mass, terms=shear(1.4, 2e3)), 2.74e6)


def _simulated(true, t, last: int, force):
    import jfsm

    still = jfsm.Record(t, force={last: force}, displacement={last: 0 * force}, at_rest=True)
    return np.array(jfsm.simulate(true, still).acceleration)


def _record(t, last: int, force, acceleration):
    import jfsm

    channels = {j + 1: a for j, a in enumerate(acceleration.T)}
    return jfsm.Record(t, force={last: force}, acceleration=channels, at_rest=True)


def timed(make: Callable[[], Case]) -> tuple[float, float, int, float]:
    """CPU seconds cold and warm, evaluations, and the largest relative error of a spring."""
    import jfsm
    from jfsm.identification import _posterior

    case, spent, count = make(), [], [0]
    slopes = _posterior.values_and_slopes

    def counted(*arguments):
        count[0] += 1
        return slopes(*arguments)

    _posterior.values_and_slopes = counted
    try:
        for _ in range(2):
            count[0], begin = 0, time.process_time()
            found = jfsm.fit(case.model, case.record)  # pyright: ignore[reportArgumentType]
            spent.append(time.process_time() - begin)
    finally:
        _posterior.values_and_slopes = slopes
    springs = [value for path, value in found.values.items() if path.startswith("stiffness")]  # pyright: ignore[reportPossiblyUnbound]
    return spent[0], spent[1], count[0], max(abs(value / case.stiffness - 1) for value in springs)


def main() -> None:
    """Print the table."""
    import jax

    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--dof", type=int, nargs="*", default=[1, 2, 3, 5, 8])
    parser.add_argument("--storeys", action="store_true")
    asked = parser.parse_args()
    cases = [(str(dof), lambda dof=dof: chain(dof)) for dof in asked.dof]
    print(f"{'dof':>8} {'cold/s':>8} {'warm/s':>8} {'evaluations':>12} {'each/s':>8} {'error':>8}")
    for name, make in cases + [("storeys", storeys)] * asked.storeys:
        cold, warm, count, error = timed(make)
        print(f"{name:>8} {cold:8.2f} {warm:8.2f} {count:12d} {warm / count:8.3f} {error:8.1e}", flush=True)


if __name__ == "__main__":
    main()

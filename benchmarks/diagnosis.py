"""Time of a first and of a second diagnosis, and the number of programs compiled for it.

    python benchmarks/diagnosis.py [--samples 3000]

The record is a Duffing oscillator under a multisine, integrated by SciPy, 1 % noise on force, displacement, velocity
and acceleration. The second record differs in length, noise and size, as another file would.
"""

import argparse
import logging
import time

import jax
import numpy as np
from scipy.integrate import solve_ivp

jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)

MASS, STIFFNESS, DAMPING, CUBIC = 1.0, 9.0, 0.3, 1.0


class Compilations(logging.Handler):
    """Counts what JAX compiles."""

    def __init__(self):
        super().__init__()
        self.names: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if message.startswith("Finished XLA compilation of"):
            self.names.append(message.split("(")[1].split(")")[0])


def duffing(samples: int, size: float, seed: int) -> jfsm.Record:
    """A noisy record of the oscillator."""
    rng = np.random.default_rng(seed)
    omegas, phases = rng.uniform(0.5, 7.0, 12), rng.uniform(0, 2 * np.pi, 12)

    def force(t):
        return size * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    def slope(t, y):
        return [y[1], (force(t) - STIFFNESS * y[0] - DAMPING * y[1] - CUBIC * y[0] ** 3) / MASS]

    time_ = np.arange(samples) * 0.05
    x, v = solve_ivp(slope, (0, time_[-1]), [0, 0], t_eval=time_, rtol=1e-10, atol=1e-12).y
    channels = {"force": force(time_), "displacement": x, "velocity": v, "acceleration": slope(time_, (x, v))[1]}
    noisy = {k: y + 0.01 * y.std() * rng.standard_normal(y.size) for k, y in channels.items()}
    return jfsm.Record(time_, **noisy, at_rest=True)


def main() -> None:
    """Run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=3000)
    samples = parser.parse_args().samples
    counter = Compilations()
    logger = logging.getLogger("jax")
    jax.config.update("jax_log_compiles", True)
    logger.handlers, logger.propagate = [counter], False

    model = jfsm.Structure.sdof(MASS, 1.01 * STIFFNESS, 0.9 * DAMPING)
    records = [duffing(samples, 1.0, 1), duffing(samples - 20, 1.2, 2)]
    for name, record in zip(("first", "second"), records, strict=True):
        counter.names.clear()
        begun = time.perf_counter()
        d = jfsm.diagnose(record, model, key=jax.random.key(0))
        seconds = time.perf_counter() - begun
        large = [n for n in counter.names if n in ("derivatives", "predictions")]
        found = ", ".join(f.cause for f in d.findings)
        assert d.gain is not None
        print(
            f"{name:<7}{seconds:7.1f} s   {len(large)} likelihood programs, {len(counter.names)} in all   "
            f"{d.verdict}: {found}, closed {d.gain.closed:.3f}"
        )


if __name__ == "__main__":
    main()

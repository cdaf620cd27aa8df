"""A channel with few digits under a harmonic force, on data that SciPy made: its errors repeat with the motion."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.identification import prepare

MASS, STIFFNESS, DAMPING, SQUARE = 17.0, 1000.0, 16.0, -4.4e4
BELIEVED = jfsm.Structure.sdof(1.01 * MASS, STIFFNESS, 0.95 * DAMPING)


def shaken(steps: float | None, noise: float = 0.002) -> jfsm.Record:
    """A spring beside the believed one, driven by a line; the displacement in so many steps of its rms."""
    time, rng = np.arange(2000) * 0.02, np.random.default_rng(4)

    def force(t):
        return 2.1 * np.cos(3.85 * t + 0.5)

    def rate(t, y):
        return [y[1], (force(t) - STIFFNESS * y[0] - DAMPING * y[1] - SQUARE * y[0] * abs(y[0])) / MASS]

    x = solve_ivp(rate, (0, time[-1]), [2e-3, 0.0], t_eval=time, rtol=1e-9, atol=1e-12).y[0]
    force_read, x = (y + noise * y.std() * rng.standard_normal(time.size) for y in (force(time), x))
    step = 1.0 if steps is None else x.std() / steps
    return jfsm.Record(time, force_read, x if steps is None else step * np.round(x / step))


@pytest.mark.parametrize(("steps", "coarse"), [(15, True), (None, False), (2000, False)])
def test_a_channel_is_coarse_where_its_digits_err_more_than_its_noise(steps, coarse):
    assert prepare(shaken(steps), BELIEVED).coarse.tolist() == [coarse]


def test_what_few_digits_err_does_not_speak_against_a_law():
    d = jfsm.diagnose(shaken(15), BELIEVED, causes=["square_stiffness", "quadratic_damping"], key=jax.random.key(0))
    assert [f.cause for f in d.findings] == ["square_stiffness"] and d.findings[0].probability > 0.9
    law = next(c for c in d.candidates if c.cause == "square_stiffness")
    assert law.whiteness is not None and law.whiteness < 0.1 and law.unfit == 0.0

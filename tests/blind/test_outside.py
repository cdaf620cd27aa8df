"""Effects that no catalogue names are what they are said to be, and are not drawn unless asked for."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from . import CAUSES, OUTSIDE, draw

FORMULAS: dict[str, Callable[[Any, Any], Any]] = {
    "speed_stiffness": lambda x, v: x * np.abs(v),
    "fading_friction": lambda x, v: np.tanh(4 * v) * np.exp(-(v**2)),
    "bump": lambda x, v: np.sin(4 * x) * np.exp(-2 * x**2),
    "wedge_friction": lambda x, v: x**2 * np.tanh(6 * v),
    "wavy_damping": lambda x, v: v * np.cos(2 * v) ** 2,
    "half_damping": lambda x, v: v * np.maximum(x, 0),
    "whirl": lambda x, v: x * v**2,
    "slanted_damping": lambda x, v: x * v,
}


@pytest.mark.parametrize("cause", OUTSIDE)
def test_the_motion_is_that_of_the_formula(cause: str):
    challenge = draw(1, causes=cause, excitation="sweep")
    plant, p, motion = challenge.truth, challenge.parameters, challenge.motion
    count = 300  # a kink of the law costs this integrator its order, not its convergence

    def rate(t, state):
        x, v = state
        law = p["F"] * FORMULAS[cause](x / p["x0"], v / p["v0"])
        return v, (challenge.drive(np.array([t]))[0] - plant.damping * v - plant.stiffness * x - law) / plant.mass

    times = motion.time[:count]
    found = solve_ivp(
        rate, (0.0, times[-1]), challenge.start, "DOP853", times, rtol=1e-11, atol=1e-13, max_step=times[1]
    )
    np.testing.assert_allclose(found.y[0], motion.x[:count], rtol=0, atol=1e-7 * np.abs(motion.x).max())
    law = p["F"] * FORMULAS[cause](motion.x / p["x0"], motion.v / p["v0"])
    np.testing.assert_allclose(motion.effect, law, rtol=0, atol=1e-6 * np.abs(law).max())


@pytest.mark.parametrize("cause", OUTSIDE)
def test_its_effect_is_neither_lost_in_noise_nor_another_plant(cause: str):
    for seed in range(2, 5):
        challenge = draw(seed, causes=cause)
        assert 0.03 <= challenge.share <= 0.5 and challenge.left >= 0.015


def test_none_of_them_is_in_the_catalogue_or_drawn_by_default():
    assert set(OUTSIDE).isdisjoint(CAUSES) and sorted(OUTSIDE) == sorted(FORMULAS)
    with pytest.raises(ValueError, match="`causes` must be one or more of"):
        draw(0, causes="outside")

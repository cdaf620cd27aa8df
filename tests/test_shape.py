"""What a missing force follows, told of forces of known shape along a motion that a driven oscillator would have."""

import numpy as np
import pytest

from jfsm.diagnosis.evidence.missing_force import Residual
from jfsm.diagnosis.report.force_shape import Shape, shape_of
from jfsm.surrogates import RKPM

NOISE = 0.05
TIME = np.arange(3000) * 0.02


def seen(force, memory: float = 0.0) -> Shape:
    """Shape of a force of displacement and velocity, a share of which came so many seconds late."""
    rng = np.random.default_rng(8)
    lines = [(rng.uniform(2.0, 6.0), rng.uniform(0.0, 6.28)) for _ in range(20)]

    def motion(t):
        omegas, phases = np.array(lines).T[..., None]
        x = np.cos(omegas * t + phases).sum(0) / 3.0
        return x, -(omegas * np.sin(omegas * t + phases)).sum(0) / 12.0

    clean = force(*motion(TIME - memory))
    std = NOISE * clean.std() * np.ones_like(TIME)
    (x, v), y = motion(TIME), clean + std * rng.standard_normal(TIME.size)
    force_map = RKPM.fit(np.column_stack([x, v])[::2], y[::2], order=3, neighbours=160)
    found = shape_of(Residual((0, 1), x, v, y, std, force_map))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("force", "follows", "odd", "growth", "words"),
    [
        (lambda x, v: x**3, "displacement", True, 1, "grows faster"),
        (lambda x, v: np.tanh(3 * x), "displacement", True, -1, "levels off"),
        (lambda x, v: x**2, "displacement", False, 0, "is even"),
        (lambda x, v: np.sign(v), "velocity", True, -1, "levels off"),
        (lambda x, v: v * np.abs(v), "velocity", True, 1, "is odd and grows faster"),
        (lambda x, v: np.where(v > 0, v, 0.0) + 0.5 * v**3, "velocity", None, None, "follows the velocity"),
    ],
)
def test_a_force_of_one_of_them_is_told_by_what_it_follows_and_how_it_grows(force, follows, odd, growth, words):
    shape = seen(force)
    assert shape.of_state > 0.9
    assert getattr(shape, follows) > 0.7 and shape.mixed < 0.25
    assert words in shape.words
    if odd is not None:
        assert (shape.odd > 0.9) == odd and shape.growth == growth


def test_a_force_of_both_follows_neither_by_itself():
    shape = seen(lambda x, v: np.sin(3 * x) * v)
    assert shape.mixed > 0.8 and "together" in shape.words


def test_a_force_that_remembers_is_no_matter_of_the_state():
    shape = seen(lambda x, v: np.tanh(3 * v), memory=4.0)
    assert shape.of_state < 0.4 and "remembers" in shape.words


def test_along_a_steady_vibration_a_force_of_the_velocity_is_not_told_as_one_of_the_displacement():
    rng = np.random.default_rng(3)
    x, v = np.cos(np.pi / 0.4 * TIME), -np.sin(np.pi / 0.4 * TIME)  # forty samples a period
    std = 0.05 * np.ones_like(TIME)
    y = np.sign(v) * (1.0 + 0.1 * x**2) + std * rng.standard_normal(TIME.size)
    x, v = (q + 0.003 * rng.standard_normal(TIME.size) for q in (x, v))
    force_map = RKPM.fit(np.column_stack([x, v]), y, order=3, neighbours=160)
    shape = shape_of(Residual((0, 1), x, v, y, std, force_map))
    assert shape is not None and shape.of_state > 0.9 and "follows the velocity" in shape.words

"""The smallest size of an effect that a record would have shown."""

import jax
import numpy as np
import pytest
from test_diagnose import DAMPING, FEW, MASS, STIFFNESS, linear, made

import jfsm
from jfsm.diagnosis.advice.detection_limits import _significant
from jfsm.structures import causes

RIGHT = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)


@pytest.fixture(scope="module")
def silent():
    return jfsm.diagnose(made(linear), RIGHT, causes=(*FEW, "jenkins", "stribeck"), key=jax.random.key(0))


def test_nine_of_ten_effects_of_that_size_are_significant():
    strength, needed = np.array([[3.0, 1.0], [1.0, 2.0]]), 8.0

    def cost(factor: float) -> float:
        return 2.0 + np.log(factor)

    factor = _significant(strength, needed, cost)
    chance = np.random.default_rng(0).standard_normal(100_000)
    gained = 0.5 * (factor * np.sqrt(strength.sum()) + chance) ** 2
    assert np.mean(gained > needed + cost(factor)) == pytest.approx(0.9, abs=0.005)
    third = 0.5 * (factor / 3 * np.sqrt(strength.sum()) + chance) ** 2
    assert np.mean(third > needed + cost(factor / 3)) < 0.05


def test_what_does_nothing_to_the_readings_is_never_significant():
    assert _significant(np.zeros((1, 1)), 5.0, lambda factor: 0.0) == np.inf


def test_an_effect_of_that_size_comes_with_its_place_and_all_its_numbers(silent):
    assert silent.verdict == "consistent"
    for cause, said in silent.data["detectable"].items():
        numbers = {name: number["value"] for name, number in said["effect"].items()}
        assert abs(numbers[said["parameter"]]) == said["value"] == silent.detectable[cause].value > 0
        extended = causes()[cause].apply(RIGHT, at=tuple(said["at"]), **numbers)
        assert set(numbers.values()) <= set(extended.values().values())
    stribeck = silent.data["detectable"]["stribeck"]["effect"]
    assert stribeck["F_static"]["value"] / stribeck["F"]["value"] in (pytest.approx(1.3), pytest.approx(2.0))
    assert silent.data["detectable"]["jenkins"]["effect"]["slip"]["unit"] == "m"


def test_a_law_that_is_another_one_at_that_size_has_none():
    d = jfsm.diagnose(made(linear), RIGHT, causes=["double_well", "cubic_hardening"], key=jax.random.key(0))
    assert set(d.detectable) == {"cubic_hardening"}  # with less stiffness taken than there is it has one well


def test_a_spring_of_that_size_is_found_and_one_of_a_third_of_it_is_not(silent):
    size = silent.detectable["cubic_hardening"].value
    found = []
    for share in (1.0, 1.0 / 3.0):

        def restoring(x, v, k3=share * size):
            return linear(x, v) + k3 * x**3

        d = jfsm.diagnose(made(restoring), RIGHT, causes=FEW, key=jax.random.key(0))
        found.append(d.verdict == "cause" and d.findings[0].family == "stiffness")
    assert found == [True, False]


def test_more_noise_hides_larger_effects(silent):
    louder = jfsm.diagnose(made(linear, noise=0.02), RIGHT, causes=FEW, key=jax.random.key(0))
    for cause in louder.detectable.keys() - {"force_gain"}:  # what is believed of own values tells it from them
        assert 2.0 < louder.detectable[cause].value / silent.detectable[cause].value < 6.0

"""The linear model that the owner of a plant believes in."""

import dataclasses

import numpy as np

from .plants import Plant

# cause id -> (field of Plant, the parameter's name in the catalogue, place)
WRONG_VALUES: dict[str, tuple[str, str, tuple[int, ...]]] = {
    "stiffness_value": ("stiffness", "k", (0, 1)),
    "damping_value": ("damping", "c", (0, 1)),
    "mass_value": ("mass", "mass", (1,)),
}


def wrong_value(rng: np.random.Generator, plant: Plant, field: str) -> Plant:
    """One value wrong: damping 1.5 to 3 times too large or too small, stiffness or mass off by 8 to 40 %."""
    if field == "damping":
        factor = rng.uniform(1.5, 3.0) ** rng.choice((-1.0, 1.0))
    else:
        factor = 1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(0.08, 0.4)
    return dataclasses.replace(plant, **{field: float(factor * getattr(plant, field))})


def roughly_known(rng: np.random.Generator, plant: Plant) -> Plant:
    """In half of the cases the truth, else stiffness within 3 % and damping within 25 % of it."""
    exact = rng.random() < 0.5
    stiffness, damping = rng.uniform(-0.03, 0.03), rng.uniform(-0.25, 0.25)
    if exact:
        return plant
    return Plant(plant.mass, float((1.0 + stiffness) * plant.stiffness), float((1.0 + damping) * plant.damping))

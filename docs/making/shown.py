"""One example of every cause: its numbers, the force along an imposed motion, and a run of a mass on a spring."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import jfsm
from jfsm.structures import AbstractTerm, Cause, Scale

FREQUENCY = 2.0  # Hz, natural
OMEGA = 2 * math.pi * FREQUENCY
MASS, RATIO = 1.0, 0.03  # kg, damping ratio
RATE, SECONDS = 100.0, 6.0  # Hz, s
PEAK = 0.01  # m, of the imposed motion
STIFFNESS = MASS * OMEGA**2
SHARE = 0.3
"""Size of the example's force over the elastic one."""
GROUND = (0, 1)

SCALE = Scale(
    force=STIFFNESS * PEAK / math.sqrt(2), length=PEAK / math.sqrt(2), peak=PEAK, omega=OMEGA, begin=0.0, end=SECONDS
)
TIME = np.arange(int(SECONDS * RATE)) / RATE
BASE = jfsm.Structure.sdof(MASS, STIFFNESS, 2 * RATIO * MASS * OMEGA)
NUMBERS = {
    "cubic_softening": {"k3": -2.5e5},
    "quintic_stiffness": {"k5": 3e9},
    "double_well": {"k_neg": 200.0, "k3": 5e6},
    "coulomb": {"F": 0.07},
    "coulomb_asymmetric": {"F_plus": 0.10, "F_minus": 0.04},
    "stribeck": {"F": 0.05, "F_static": 0.10, "v_s": 0.02},
    "smooth_coulomb": {"F": 0.07, "v_s": 0.01},
    "lugre": {"F": 0.05, "F_static": 0.08, "v_s": 0.02, "sigma0": 200.0, "sigma1": 1.0},
}
"""Numbers of examples whose natural ones hold the mass fast, let it escape, or hide their shape."""
SENSORS = {
    "force_gain": 0.3,
    "force_delay": 0.04,
    "command_delay": 0.04,
    "accel_bias": 0.4,
    "accel_gain": 0.3,
    "channel_delay": 0.04,
}
"""Numbers of the sensors' faults; a clipped channel ends at half of its largest reading."""


@dataclass(frozen=True)
class Shown:
    """What is drawn of one cause.

    `along` holds d [m], w [m/s] and the force [N] along an imposed motion of growing amplitude; None of what is no law.
    `believed` and `true` are the same channel without and with the cause, over `TIME`.
    """

    cause: Cause
    part: Any
    along: tuple[np.ndarray, np.ndarray, np.ndarray] | None
    channel: str
    believed: np.ndarray
    true: np.ndarray

    @property
    def memoryless(self) -> bool:
        """Whether the force is a function of d and w alone."""
        law = self.part
        return isinstance(law, AbstractTerm) and not law.states and not law.timed and law.delay is None


def multisine(seed: int = 0) -> np.ndarray:
    """Force [N] of twenty lines about the resonance."""
    lines = 2 * math.pi * np.linspace(0.4, 5.0, 20)
    phases = np.random.default_rng(seed).uniform(0, 2 * math.pi, lines.size)
    return 0.09 * STIFFNESS * PEAK * np.sum(np.cos(np.outer(TIME, lines) + phases), axis=1) / math.sqrt(10)


def example(cause: Cause) -> Any:
    """The law or the sensor's fault with numbers that show it."""
    if cause.is_sensor:
        return _fault(cause)
    if cause.id in NUMBERS:
        return cause.term(GROUND, **NUMBERS[cause.id])
    shapes = cause.effect.shapes(SCALE)
    numbers = dict(shapes[len(shapes) // 2])
    for parameter in cause.effect.parameters:
        if parameter.force and parameter.name != "sigma1":
            numbers[parameter.name] *= SHARE
    first = cause.effect.parameters[0].name
    if cause.sign:
        numbers[first] = math.copysign(numbers[first], cause.sign)
    return cause.term(GROUND, **numbers)


def _fault(cause: Cause) -> Any:
    kind = cause.effect.channels[-1]
    clipped = 0.5 * float(np.max(np.abs(_run(BASE)[kind])))
    return cause.effect(SENSORS.get(cause.id, clipped), at=(kind, 1))


def show(cause: Cause) -> Shown:
    """Everything that is drawn of a cause that is a term or a sensor's fault."""
    part, without = example(cause), _run(BASE)
    if cause.is_sensor:
        true = without[part.at[0]]
        return Shown(cause, part, None, part.at[0], true, _read(part, true))
    return Shown(
        cause, part, force_along(part), "displacement", without["displacement"], _run(BASE + part)["displacement"]
    )


def force_along(law: AbstractTerm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement, velocity and force of a law while its ends are moved to and fro, farther with every period."""
    grows = TIME / SECONDS
    d = PEAK * grows * np.sin(OMEGA * TIME)
    w = PEAK * (np.sin(OMEGA * TIME) / SECONDS + grows * OMEGA * np.cos(OMEGA * TIME))
    a = PEAK * (2 * OMEGA * np.cos(OMEGA * TIME) / SECONDS - grows * OMEGA**2 * np.sin(OMEGA * TIME))
    moved = jfsm.Record(TIME, force=0 * TIME, displacement=d, velocity=w, acceleration=a, drive="motion", at_rest=True)
    needed = jfsm.simulate(jfsm.Structure([0.0], [law]), moved).force
    return d, w, np.asarray(needed)[:, 0]


def _run(model: jfsm.Structure) -> dict[str, np.ndarray]:
    """Force, and the motion of a model from rest, on `TIME`."""
    force = multisine()
    run = jfsm.simulate(model, jfsm.Record(TIME, force=force, at_rest=True))
    return {"force": force} | {kind: np.asarray(getattr(run, kind))[:, 0] for kind in jfsm.ChannelDelay.channels}


def _read(sensor: Any, true: np.ndarray) -> np.ndarray:
    """What a sensor with a fault shows of the truth."""
    match sensor.kind:
        case "force_gain" | "accel_gain":
            return (1 + sensor.value) * true
        case "force_delay" | "channel_delay":
            return np.interp(TIME - sensor.value, TIME, true)
        case "command_delay":
            return np.interp(TIME - float(sensor.tau), TIME, true)
        case "clipping":
            return np.clip(true, -sensor.value, sensor.value)
    return true + sensor.value

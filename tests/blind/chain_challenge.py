"""Challenges with two masses in a chain: one hidden effect, at one of its links, masses or sensors."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from .arrays import FloatArray, rms
from .beliefs import WRONG_VALUES, roughly_known, wrong_value
from .chain import REST, Chain, ChainMotion, ChainState, Link, across, integrate, responses, sketch, trusted_motion
from .challenge import (
    CAUSES,
    FARTHEST,
    NEEDS_REST,
    NOISE_LEVELS,
    SAMPLES,
    can_tell,
    drawn_setting,
    is_fair,
    named,
    sized,
)
from .drives import DRIVES, Drive
from .laws import LAWS, Law, NoLaw, Scene
from .laws.base import log_uniform
from .plants import EscapeError, Plant, UnfairError
from .sensors import DELAYS, RESPONSES, SENSORS, UNITS, Sensor, with_noise
from .two import SHARES

Place: TypeAlias = tuple[str, int]  # kind of channel, mass
Readings: TypeAlias = dict[Place, FloatArray]

CHAIN_CAUSES = tuple(cause for cause in CAUSES if cause != "clipping")  # which shows by itself
# name -> kinds of channel, whether at both masses, and the set of one mass that tells as much
CHAIN_SETS: dict[str, tuple[tuple[str, ...], bool, str]] = {
    "xva": (RESPONSES, True, "xva"),
    "xx": (("displacement",), True, "x"),
    "aa": (("acceleration",), True, "a"),
    "x": (("displacement",), False, "x"),
    "a": (("acceleration",), False, "a"),
}
HANGS = ("attached_oscillator", "preload", "periodic_disturbance")  # on a mass, whether or not a link holds it
RATIOS = (1.5, 3.0)  # of the two natural frequencies
THIRD_LINKS = 0.3  # how many chains have one
# What of an effect no own values, start and offsets take up in the channels, in their rms: a fifth of the loudest
# noise, of which all samples of one channel make sixty nats.
LEAST_SEEN = 0.01
# What of a wrong value no other one takes up in the channels, in its own rms.
LEAST_OWN = 0.2


# what a record shows


@dataclasses.dataclass(frozen=True)
class _View:
    """What the response channels of a record would show of forces along a motion, each in its channel's rms."""

    chain: Chain
    motion: ChainMotion
    places: Sequence[Place]

    @property
    def shown(self) -> list[Place]:
        return [place for place in self.places if place[0] != "force"]

    def of(self, forces: Sequence[FloatArray], begin: FloatArray | None = None) -> FloatArray:
        """All channels after one another (samples, columns), for forces (n, 2) each [N]."""
        columns = np.stack(forces, axis=2)
        begin = np.zeros((4, len(forces))) if begin is None else begin
        time, sizes = self.motion.time, self.motion.responses
        found = responses(self.chain, columns, begin, float(time[1] - time[0]))
        return np.concatenate([found[kind][:, j - 1] / rms(sizes[kind][:, j - 1]) for kind, j in self.shown])

    def values(self) -> dict[tuple[str, tuple[int, ...]], FloatArray]:
        """Forces (n, 2) that another value of each link and mass would be, by cause and place.

        No mass is free in a decay: with all other values it is the scale, which a decay does not show.
        """
        found: dict[tuple[str, tuple[int, ...]], FloatArray] = {}
        for at in self.chain.links:
            b = across(at)
            found["stiffness_value", at] = np.outer(self.motion.x @ b, b)
            found["damping_value", at] = np.outer(self.motion.v @ b, b)
        for mass in (1, 2) if any(kind == "force" for kind, _ in self.places) else ():
            found["mass_value", (mass,)] = self.motion.acceleration * (np.array([1, 2]) == mass)
        return found

    def nuisances(self, starts: bool = True) -> FloatArray:
        """What another start, unless it is known, and offsets would be."""
        n = self.motion.time.size
        offsets = np.repeat(np.eye(len(self.shown)), n, axis=0)
        if not starts:
            return offsets
        return np.concatenate([self.of([np.zeros((n, 2))] * 4, np.eye(4)), offsets], axis=1)


def left_beside(y: FloatArray, basis: FloatArray) -> FloatArray:
    """What no combination of the columns of `basis` (n, columns) is of each column of y (n, others)."""
    columns = basis / np.maximum(np.sqrt(np.mean(basis**2, axis=0)), np.finfo(float).tiny)
    return y - columns @ np.linalg.lstsq(columns, y, rcond=1e-10)[0]


# challenges


@dataclasses.dataclass(frozen=True)
class ChainChallenge:
    """A record of a chain with its hidden truth; what its fields mean is what they mean in a `Challenge`.

    `channels` and `clean` hold (n, 2) by kind where both masses are measured, and by mass where one is. `share` and
    `left` compare with the force of the law's link, or with all that holds the mass on which a load is; `seen` is what
    of the effect no other values, start and offsets take up in the response channels, in their rms, and 0 where no law
    is hidden. `driven` is the mass under the drive.
    """

    seed: int
    cause: str
    at: tuple[int | str, ...]
    parameters: dict[str, Any]
    time: FloatArray
    channels: dict[str, FloatArray | dict[int, FloatArray]]
    clean: dict[str, FloatArray | dict[int, FloatArray]]
    units: dict[str, str]
    model: Chain
    truth: Chain
    noise: float
    channel_set: str
    excitation: str
    at_rest: bool
    share: float
    left: float
    seen: float
    law: Law
    driven: int
    drive: Drive
    start: ChainState
    motion: ChainMotion

    @property
    def noise_floor(self) -> dict[Place, float]:
        """Rms of the noise that was put on each channel, in its unit."""
        clean = by_place(self.clean)
        return {place: rms(y - clean[place]) for place, y in by_place(self.channels).items()}


def by_place(channels: Mapping[str, FloatArray | dict[int, FloatArray]]) -> Readings:
    """Each channel by itself, (n,)."""
    return {
        (kind, mass): y
        for kind, found in channels.items()
        for mass, y in (found if isinstance(found, dict) else {1: found[:, 0], 2: found[:, 1]}).items()
    }


def _together(readings: Readings) -> dict[str, FloatArray | dict[int, FloatArray]]:
    """(n, 2) by kind where both masses have it, else by mass."""
    masses: dict[str, dict[int, FloatArray]] = {}
    for (kind, mass), y in readings.items():
        masses.setdefault(kind, {})[mass] = y
    return {kind: np.stack([y[1], y[2]], axis=1) if len(y) == 2 else y for kind, y in masses.items()}


@dataclasses.dataclass(frozen=True)
class _Bench:
    """A chain under a drive on one mass, from a start, with sensors at some places, the force's among them."""

    chain: Chain
    time: FloatArray
    driven: int
    drive: Drive
    start: ChainState
    places: tuple[Place, ...]

    def true_readings(self, motion: ChainMotion) -> Readings:
        return {
            (kind, mass): self.drive(motion.time) if kind == "force" else motion.responses[kind][:, mass - 1]
            for kind, mass in self.places
        }

    def view(self, motion: ChainMotion) -> _View:
        return _View(self.chain, motion, self.places)


def draw_chain(
    seed: int,
    causes: str | Sequence[str] = CHAIN_CAUSES,
    noise: float | Sequence[float] = NOISE_LEVELS,
    channels: str | Sequence[str] = tuple(CHAIN_SETS),
    excitation: str | Sequence[str] | None = None,
) -> ChainChallenge:
    """The challenge of a seed with two masses: the same for the same arguments, whatever the noise level.

    The effect is at one link (a load or an attached mass: on one mass), a sensor's fault at one channel, a wrong value
    at one link or mass; each is drawn.

    Parameters
    ----------
    seed : int
    causes : of `CHAIN_CAUSES`; one is drawn among those that the channel sets and excitations can tell
    noise : share of each channel's rms; one is drawn
    channels : of `CHAIN_SETS`; one is drawn
    excitation : of `DRIVES`; one is drawn, of all by default

    Raises
    ------
    ValueError
        If a name is unknown, or if no cause asked for can be told from the records asked for.
    """
    choice, physics, static = (np.random.default_rng(s) for s in np.random.SeedSequence((seed, 3)).spawn(3))
    wanted = {cause: (cause,) for cause in named("causes", causes, CHAIN_CAUSES)}
    cause, channel_set, excitation = drawn_setting(
        choice, "causes", wanted, channels, excitation, tuple(CHAIN_SETS), chain_can_tell
    )
    level = float(choice.choice(np.atleast_1d(noise)))

    question = _fair_question(physics, cause, excitation, channel_set)
    bench, motion, start = question.bench, question.motion, question.start
    place, parameters, share, left = (), {}, 0.0, 0.0
    clean = bench.true_readings(motion)
    if cause in SENSORS:
        sensor = _drawn_sensor(physics, cause, bench, clean)
        place, parameters = sensor.at, sensor.parameters
        motion, clean = _misread(sensor, bench, motion)
        start = motion.state if sensor.early else start
    elif cause in WRONG_VALUES:
        place, parameters = question.at, _value(bench.chain, cause, question.at)
    elif cause != "none":
        place, parameters = question.at, dataclasses.asdict(question.law)
        share, left = motion.link.shares(bench.chain.around(question.at))
    return ChainChallenge(
        seed=seed, cause=cause, at=place, parameters=parameters, time=motion.time,
        channels=_together(with_noise(static, clean, level)), clean=_together(clean),
        units={kind: UNITS[kind] for kind, _ in bench.places}, model=question.model, truth=bench.chain,
        noise=level,
        channel_set=channel_set, excitation=excitation,
        at_rest=start == REST and (bool(choice.random() < 0.5) or cause in NEEDS_REST),
        share=share, left=left, seen=question.seen, law=question.law,
        driven=bench.driven, drive=bench.drive, start=start, motion=motion,
    )  # fmt: skip


def chain_can_tell(cause: str, channel_set: str, excitation: str) -> bool:
    """Whether the record of a chain can show this cause and no other in its place.

    What a record of one mass does not tell, one of two does not either. One channel alone shows enough of a chain only
    under a drive that moves both modes, none of its masses by itself, and not on which mass a load is that does not
    change.
    """
    _, both, alike = CHAIN_SETS[channel_set]
    enough = both or (cause not in ("mass_value", "preload") and excitation not in ("free_decay", "harmonic"))
    return enough and can_tell(cause, alike, excitation)


@dataclasses.dataclass(frozen=True)
class _Question:
    """A bench with an effect at a link, or a value believed wrong there, and the motion."""

    bench: _Bench
    at: Any
    law: Law
    start: ChainState
    motion: ChainMotion
    model: Chain
    seen: float


def _fair_question(rng: np.random.Generator, cause: str, excitation: str, channel_set: str) -> _Question:
    """A bench with an effect that is of the wanted size and can be seen, redrawn until it is."""
    for _ in range(100):
        bench = _drawn_bench(rng, cause, excitation, channel_set)
        if cause not in LAWS:
            at, chain = (0, 1), bench.chain
            scale = rms(sketch(chain, at, NoLaw(), bench.driven, bench.drive, bench.start, bench.time).link.x)
            motion = integrate(chain, at, NoLaw(), bench.driven, bench.drive, bench.start, bench.time, scale)
            if cause not in WRONG_VALUES:
                model = chain if cause == "none" else _roughly_known(rng, chain)
                return _Question(bench, at, NoLaw(), bench.start, motion, model, 0.0)
            places = [(1,), (2,)] if cause == "mass_value" else chain.links
            place = places[rng.integers(len(places))]
            model = _wrong(rng, chain, cause, place)
            if _value_is_seen(bench, motion, model, cause, place):
                return _Question(bench, place, NoLaw(), bench.start, motion, model, 0.0)
            continue
        links = ((0, 1), (0, 2)) if cause in HANGS else bench.chain.links
        at = links[rng.integers(len(links))]
        for _ in range(10):
            try:
                law, start, motion = _drawn_law(rng, cause, bench, at)
            except (EscapeError, OverflowError):  # of a power, in a sketch that has left all bounds within a step
                continue
            seen = _seen(bench, at, motion, cause)
            if seen >= LEAST_SEEN:
                return _Question(bench, at, law, start, motion, _roughly_known(rng, bench.chain), seen)
    raise UnfairError(f"no fair {cause} under {excitation} in 100 chains; its law's draw must be made to suit it.")


def _drawn_bench(rng: np.random.Generator, cause: str, excitation: str, channel_set: str) -> _Bench:
    """A chain of any size that moves by 10 um to 100 mm rms, and what is measured of it."""
    chain, time = _drawn_plant(rng, cause)
    size = log_uniform(rng, 1e-5, 0.1)
    # So low that every drive passes both modes, but for one line.
    drive = DRIVES[excitation](rng, float(chain.omega[1]) / 1.5, float(time[-1]))
    kinds, both, _ = CHAIN_SETS[channel_set]
    masses = (1, 2) if both else (int(rng.integers(1, 3)),)
    responses_at = tuple((kind, mass) for kind in kinds for mass in masses)
    (x1, x2), (v1, v2) = (size * rng.standard_normal((2, 2)) * [[1.0], [chain.omega[0]]]).tolist()
    if excitation == "free_decay":
        return _Bench(chain, time, 0, drive, ((x1, x2), (0.0, 0.0)), responses_at)
    driven = int(rng.integers(1, 3))
    still = rng.random() < 0.8 or cause in NEEDS_REST
    drive = drive.scaled(size / rms(sketch(chain, (0, 1), NoLaw(), driven, drive, REST, time).x))
    start = REST if still else ((x1, x2), (v1, v2))
    return _Bench(chain, time, driven, drive, start, (("force", driven), *responses_at))


def _drawn_plant(rng: np.random.Generator, cause: str) -> tuple[Chain, FloatArray]:
    """Constants over decades, two modes not far apart, and the sample times, (SAMPLES,) [s].

    A link is critically damped to 0.4 to 4 % at the mean frequency. There is no third link where a well is hidden: what
    is stretched to its bottom must leave the other links alone.
    """
    first = 2.0 * np.pi * log_uniform(rng, 0.3, 100.0)
    mass = log_uniform(rng, 0.1, 1000.0)
    while True:
        masses = (mass, mass * log_uniform(rng, 0.4, 2.5))
        stiffness = {(0, 1): 1.0, (1, 2): log_uniform(rng, 0.4, 2.5)}
        if rng.random() < THIRD_LINKS and cause != "double_well":
            stiffness[0, 2] = log_uniform(rng, 0.2, 1.0)
        low, high = Chain(masses, stiffness, dict.fromkeys(stiffness, 0.0)).omega
        if RATIOS[0] <= high / low <= RATIOS[1]:
            break
    unit, mean = (first / low) ** 2, first * np.sqrt(high / low)
    stiffness = {at: float(unit * k) for at, k in stiffness.items()}
    damping = {at: float(2.0 * rng.uniform(0.004, 0.04) * k / mean) for at, k in stiffness.items()}
    step = 2.0 * np.pi / (rng.uniform(25.0, 50.0) * first * high / low)
    return Chain(masses, stiffness, damping), float(step) * np.arange(SAMPLES, dtype=float)


def _drawn_law(rng: np.random.Generator, cause: str, bench: _Bench, at: Link) -> tuple[Law, ChainState, ChainMotion]:
    """A law of the wanted size at a link, where the motion begins, and the motion.

    Raises
    ------
    EscapeError
        If there is none, or if it is not fair.
    """
    chain, driven, drive, time, kind = bench.chain, bench.driven, bench.drive, bench.time, LAWS[cause]
    plain, around = sketch(chain, at, NoLaw(), driven, drive, bench.start, time).link, chain.around(at)
    limit, scale = FARTHEST * plain.peak, rms(plain.x)
    shares = (max(SHARES[0], kind.shares[0]), min(SHARES[1], kind.shares[1])) if kind.sized else kind.shares
    law = sized(
        rng, kind, Scene(around, drive, plain), shares,
        lambda law: sketch(chain, at, law, driven, drive, bench.start, time, limit).link,
    )  # fmt: skip
    if law.delay and not _is_stable(chain, at, law):
        raise EscapeError("a force that comes late feeds the motion")
    start = _begun(chain, at, law, bench.start)
    motion = trusted_motion(chain, at, law, driven, drive, start, time, scale, limit)
    if not is_fair(law, Scene(around, drive, motion.link), shares):
        raise EscapeError("an effect is not of its size, linear, or not natural to the motion that has come about")
    return law, start, motion


def _begun(chain: Chain, at: Link, law: Law, start: ChainState) -> ChainState:
    """Where a motion under a law begins; in a well, what hangs on the link moves with its end."""
    b, (x, v) = across(at), np.array(start)
    away = law.start(float(b @ x), float(b @ v), chain.around(at).stiffness)[0] - float(b @ x)
    if not away:
        return start
    (x1, x2) = (x + away * (np.array([1, 2]) >= at[1])).tolist()
    return (x1, x2), start[1]


def _is_stable(chain: Chain, at: Link, law: Any) -> bool:
    """Whether both modes decay beside k d(t - tau)."""
    (k, c), b = chain.matrices, across(at)

    def characteristic(s: complex) -> complex:
        dynamic = s * s * np.diag(chain.mass) + s * c + k + law.k * np.exp(-s * law.tau) * np.outer(b, b)
        return complex(np.linalg.det(dynamic))

    for omega in chain.omega.tolist():
        s = 1j * omega
        for _ in range(50):  # Newton
            slope = (characteristic(s + 1e-6 * omega) - characteristic(s - 1e-6 * omega)) / (2e-6 * omega)
            s -= characteristic(s) / slope
        if not s.real < 0.0:
            return False
    return True


def _seen(bench: _Bench, at: Link, motion: ChainMotion, cause: str) -> float:
    """What of a law's force no other values, start and offsets take up in the response channels, in their rms."""
    view = bench.view(motion)
    own = view.of(list(view.values().values()))
    beside = np.concatenate([own, view.nuisances(starts=cause not in NEEDS_REST)], axis=1)
    return rms(left_beside(view.of([np.outer(motion.link.effect, across(at))]), beside))


def _value_is_seen(bench: _Bench, motion: ChainMotion, model: Chain, cause: str, place: Any) -> bool:
    """Whether a wrong value shows beside other starts and offsets, and no other one is much like it."""
    view = bench.view(motion)
    beside, values = view.nuisances(), view.values()
    wrong = _value(model, cause, place)
    off = sum(wrong.values()) - sum(_value(bench.chain, cause, place).values())
    shown = left_beside(view.of([off * values.pop((cause, place))]), beside)[:, 0]
    others = left_beside(view.of(list(values.values())), beside)
    own = shown[:, None] - others * (shown @ others) / np.sum(others**2, axis=0)
    return rms(shown) >= LEAST_SEEN and bool(np.all(np.mean(own**2, axis=0) >= (LEAST_OWN * rms(shown)) ** 2))


# beliefs and sensors


def _value(chain: Chain, cause: str, place: Any) -> dict[str, float]:
    """A value of the chain under its name in the catalogue."""
    field, name, _ = WRONG_VALUES[cause]
    return {name: chain.mass[place[0] - 1] if field == "mass" else getattr(chain, field)[place]}


def _wrong(rng: np.random.Generator, chain: Chain, cause: str, place: Any) -> Chain:
    """One value of the chain wrong."""
    field = WRONG_VALUES[cause][0]
    if field != "mass":
        return chain.believed(place, wrong_value(rng, chain.around(place), field))
    first, second = (
        wrong_value(rng, Plant(mass, 1.0, 0.0), field).mass if (j,) == place else mass
        for j, mass in enumerate(chain.mass, start=1)
    )
    return dataclasses.replace(chain, mass=(first, second))


def _roughly_known(rng: np.random.Generator, chain: Chain) -> Chain:
    """Each link as its owner knows that of a plant with one."""
    for at in chain.links:
        chain = chain.believed(at, roughly_known(rng, chain.around(at)))
    return chain


def _drawn_sensor(rng: np.random.Generator, cause: str, bench: _Bench, clean: Readings) -> Sensor:
    kind, kinds = SENSORS[cause]
    masses = sorted({mass for name, mass in bench.places if name in kinds})
    mass = masses[rng.integers(len(masses))]
    there = {name: clean[name, at] for name, at in bench.places if at == mass}
    sensor = kind.draw(rng, there, [name for name in there if name in kinds], float(bench.time[1]))
    return dataclasses.replace(sensor, mass=mass)


def _misread(sensor: Sensor, bench: _Bench, motion: ChainMotion) -> tuple[ChainMotion, Readings]:
    """The motion and what is shown of it; where the sensor is late, both have begun before the record."""
    now, late, time = motion, motion, motion.time
    if sensor.early:
        tau, begin = sensor.parameters["tau"], -np.ceil(max(DELAYS)) * time[1]
        every = np.unique(np.concatenate([[begin], time - tau, time]))
        scale = rms(motion.link.x)
        longer = integrate(bench.chain, (0, 1), NoLaw(), bench.driven, bench.drive, bench.start, every, scale)
        now, late = (longer.picked(np.searchsorted(every, times)) for times in (time, time - tau))
    truth, earlier = bench.true_readings(now), bench.true_readings(late)
    there = {kind: y for (kind, mass), y in truth.items() if mass == sensor.mass}
    shown = sensor.misread(there, lambda kind, tau: earlier[kind, sensor.mass])
    return now, {**truth, (sensor.channel, sensor.mass): shown}

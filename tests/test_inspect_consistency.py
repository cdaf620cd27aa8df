"""Displacement, velocity and acceleration of one point are held against one another, and the odd one out is named."""

import numpy as np
import pytest

import jfsm
from jfsm.records import Record
from jfsm.records._comparison import Reading, compare
from jfsm.records._polarity import is_inverted, polarity

DT, N = 0.01, 3000
T = DT * np.arange(N)
NOISE = 0.01
OMEGA = np.array([4.0, 5.1, 5.9, 6.3, 6.9, 8.2, 10.3, 12.7])  # rad/s, a resonance of the structure at 6.3
STIFFNESS, DAMPING = 6.3**2, 0.3  # per unit mass
KINDS = ("displacement", "velocity", "acceleration")


def motion(late=0.0, omega=OMEGA):
    """Steady motion of an oscillator under lines of equal force, each channel `late` seconds later; clean."""
    response = 1.0 / (STIFFNESS - omega**2 + 1j * DAMPING * omega)
    turning = np.exp(1j * (np.outer(T - late, omega) + 2.0 * np.arange(omega.size) ** 2))
    orders = {kind: (1j * omega) ** order * response for order, kind in enumerate(KINDS)}
    lines = {**orders, "force": np.ones(omega.size)}
    return {kind: np.real(turning @ line) for kind, line in lines.items()}


def noisy(channels, seed=0, level=NOISE):
    rng = np.random.default_rng(seed)
    return {kind: y + level * y.std() * rng.standard_normal(N) for kind, y in channels.items()}


def warnings(channels, **more):
    found = Record(T, **channels, **more).inspect().findings
    return [(finding.channel, finding.message) for finding in found if finding.severity == "warning"]


def faulty(fault, kind):
    channels = motion()
    y = channels[kind]
    match fault:
        case "gain":
            y = 1.05 * y
        case "offset":
            y = y + 0.05 * y.std()
        case "half a sample":
            y = motion(late=0.5 * DT)[kind]
        case "two samples":
            y = motion(late=2.0 * DT)[kind]
        case "sign":
            y = -y
    return {**channels, kind: y}


def test_channels_that_agree_raise_no_warning():
    for seed in range(5):
        assert warnings(noisy(motion(), seed)) == []


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("gain", "Reads 5."),
        ("half a sample", "samples (0.00"),
        ("two samples", "samples (0.0"),
        ("sign", "Inverted against"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_of_three_channels_the_one_at_fault_is_named(fault, words, kind):
    ((channel, message),) = warnings(noisy(faulty(fault, kind)))
    assert channel == f"{kind} 1"
    assert words in message
    assert all(f"{other} 1" in message for other in KINDS if other != kind)


@pytest.mark.parametrize("kind", ["velocity", "acceleration"])
def test_an_offset_of_a_rate_is_found_against_the_motion_below(kind):
    ((channel, message),) = warnings(noisy(faulty("offset", kind)))
    assert channel == f"{kind} 1"
    assert "1 does not show" in message
    assert "5.0% of the standard deviation" in message


@pytest.mark.parametrize("fault", ["gain", "half a sample", "sign"])
def test_of_two_channels_the_pair_is_named_and_neither_accused(fault):
    channels = noisy(faulty(fault, "velocity"))
    ((channel, message),) = warnings({kind: channels[kind] for kind in ("displacement", "velocity")})
    assert channel == "displacement 1, velocity 1"
    assert "both" in message or "one of them" in message


def test_with_two_faults_every_pair_is_named():
    channels = faulty("gain", "velocity") | {"acceleration": 0.9 * motion()["acceleration"]}
    assert {channel for channel, _ in warnings(noisy(channels))} == {
        "displacement 1, velocity 1",
        "displacement 1, acceleration 1",
        "velocity 1, acceleration 1",
    }


def test_a_channel_of_another_point_is_not_called_late_or_weak():
    elsewhere = motion(omega=OMEGA + 0.7)["velocity"]
    found = warnings(noisy(motion() | {"velocity": elsewhere}))
    assert found
    assert all("follows from" in message for _, message in found)


def test_absolute_acceleration_is_compared_after_that_of_the_base_is_taken_off():
    base = 20.0 * (np.cos(5.3 * T) + np.cos(7.7 * T))
    channels = motion()
    channels["acceleration"] = channels["acceleration"] + base
    del channels["force"]
    assert warnings(noisy(channels), base_acceleration=base) == []
    assert warnings(noisy(channels)) != []


@pytest.mark.parametrize(("lower", "upper", "order"), [(0, 1, 1), (1, 2, 1), (0, 2, 2)])
def test_figures_are_right_within_their_errors(lower, upper, order):
    off = []
    for seed in range(20):
        channels = noisy(motion(), seed)
        late = noisy(motion(late=1.3 * DT), seed + 100)
        one, other = (
            Reading(KINDS[i], 1.0 * y, NOISE * y.std(), np.zeros(N, dtype=bool))
            for i, y in ((lower, channels[KINDS[lower]]), (upper, -1.07 * late[KINDS[upper]] + 0.3))
        )
        pair = compare(one, other, order, DT, 1.0)
        assert pair is not None and pair.inverted
        assert pair.gain == pytest.approx(1.07, rel=0.01)
        assert pair.delay == pytest.approx(1.3 * DT, abs=0.05 * DT)
        assert pair.agreement > 0.99
        off.append(((pair.gain - 1.07) / pair.gain_error, (pair.delay - 1.3 * DT) / pair.delay_error))
        off[-1] += ((pair.offset - 0.3) / pair.offset_error,)
    assert np.mean(np.abs(off) < 2.5) > 0.9
    assert np.abs(off).max() < 6.0


def test_clipped_stretches_take_no_part():
    channels = noisy(motion())
    cut = np.where(T < 10.0, np.clip(channels["velocity"], -0.3, 0.3), channels["velocity"])
    found = warnings(channels | {"velocity": np.minimum(cut, cut[T < 10.0].max() + 10.0)})
    assert not any("Reads" in message and "velocity" not in channel for channel, message in found)
    lost = T < 10.0
    one = Reading("displacement 1", channels["displacement"], 0.01, np.zeros(N, dtype=bool))
    pair = compare(one, Reading("velocity 1", cut, 0.05, lost), 1, DT, 1.0)
    assert pair is not None
    assert pair.gain == pytest.approx(1.0, abs=0.01)
    assert compare(one, Reading("velocity 1", cut, 0.05, T < 29.0), 1, DT, 1.0) is None


def test_noise_alone_and_a_record_too_short_are_not_compared():
    rng = np.random.default_rng(3)
    noise = [Reading(kind, rng.standard_normal(N), 1.0, np.zeros(N, dtype=bool)) for kind in KINDS]
    assert compare(noise[0], noise[1], 1, DT, 1.0) is None
    short = [Reading(kind, y[:60], 1e-3, np.zeros(60, dtype=bool)) for kind, y in motion().items()]
    assert compare(short[0], short[1], 1, DT, 1.0) is None


def test_an_inverted_force_is_named():
    channels = noisy(motion())
    found = warnings(channels | {"force": -channels["force"]})
    assert [channel for channel, _ in found] == ["force 1"]
    assert "negative" in found[0][1]
    ((channel, _),) = warnings({"force": -channels["force"], "acceleration": channels["acceleration"]})
    assert channel == "force 1, acceleration 1"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("late", [0.0, 2.0 * DT])
def test_the_sign_of_a_force_is_told_from_any_motion_even_if_it_is_late(kind, late):
    channels, force = noisy(motion()), noisy(motion(late))["force"]
    arguments = (channels[kind], KINDS.index(kind), DT, 1.0)
    assert is_inverted(-force, *arguments)
    assert not is_inverted(force, *arguments)


def test_nothing_is_said_of_the_sign_of_a_force_under_a_single_line_or_without_a_connection():
    clean = motion(omega=2 * np.pi / T[-1] * np.array([24.0]))
    assert not is_inverted(-clean["force"], clean["displacement"], 0, DT, 0.8)
    one = noisy(clean)
    assert not is_inverted(-one["force"], one["displacement"], 0, DT, 0.8)
    strange = np.random.default_rng(4).standard_normal(N)
    assert not is_inverted(strange, one["displacement"], 0, DT, 0.8)


def test_a_motion_that_the_force_does_not_drive_tells_nothing_of_its_sign():
    t = np.arange(3000) / 100
    motion = np.sin(9 * t) + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    assert polarity(np.sin(3 * t), motion, 0, 0.01, 9 / (2 * np.pi)) == 0.0
    assert jfsm.Record(time=t, force=np.sin(3 * t), displacement=motion).inspect().findings is not None

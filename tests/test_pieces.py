"""Long records: causes are sought in pieces, and what was found is fitted to all of them."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.diagnosis.search.segments import pieces

RNG = np.random.default_rng(8)
N, DT = 60_000, 0.05
T = np.arange(N) * DT


def bursts(begins: tuple[int, ...], n: int = N) -> jfsm.Record:
    """A quiet record that is loud for 4000 samples from each of these."""
    envelope = np.full(n, 0.1)
    for begin in begins:
        envelope[begin : begin + 4000] = 1.0
    x = envelope * np.sin(0.3 * np.arange(n))
    return jfsm.Record(T[:n], force=np.cos(0.3 * np.arange(n)), displacement=x)


def test_of_each_part_of_a_long_record_it_is_the_loudest_piece():
    found = pieces([(bursts((5000, 21_000, 50_000)), N)], [1.0])
    assert found is not None and [until for _, until in found] == [4000] * 3
    assert [piece.time[0] / DT for piece, _ in found] == pytest.approx([5000, 21_000, 50_000])


def test_of_several_long_records_each_has_a_say_and_short_ones_stay_whole():
    short = bursts((0,), 5000)
    found = pieces([(bursts((20_000,)), N), (short, 5000), (bursts((30_000,)), 40_000)], [1.0] * 3)
    assert found is not None and [len(piece) for piece, _ in found] == [4000, 5000, 4000]
    assert found[1][0] is short


@pytest.mark.parametrize(("until", "period"), [(47_000, 1.0), (N, 30.0)])
def test_a_record_of_few_pieces_or_of_few_periods_is_searched_as_it_is(until: int, period: float):
    assert pieces([(bursts((5000,)), until)], [period]) is None


@pytest.mark.slow
def test_a_cause_in_a_long_record_is_found_within_the_error_of_all_of_it():
    omega, k3 = 2.0, 0.6
    tones = RNG.uniform(0.5, 4.0, 12), RNG.uniform(0, 2 * np.pi, 12)

    def g(t):
        return np.sum(np.cos(np.multiply.outer(t, tones[0]) + tones[1]), -1)

    run = solve_ivp(
        lambda t, y: [y[1], g(t) - omega**2 * y[0] - 0.2 * y[1] - k3 * y[0] ** 3],
        (0, T[-1]), [0, 0], t_eval=T, rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    x = run.y[0]
    noise = 0.02 * RNG.standard_normal((2, N))
    record = jfsm.Record(T, force=g(T) + np.std(g(T)) * noise[0], displacement=x + np.std(x) * noise[1], at_rest=True)
    model = jfsm.Structure.sdof(mass=1.0, stiffness=1.02 * omega**2, damping=0.18)
    wanted = ["cubic_hardening", "quintic_stiffness", "coulomb"]
    d = jfsm.diagnose(record, model, holdout=0.15, causes=wanted, max_causes=1, key=jax.random.key(0))
    assert d.verdict == "cause" and d.findings[0].cause == "cubic_hardening"
    found = d.findings[0].parameters["k3"]
    assert found.low < k3 < found.high and found.high - found.low < 0.01 * k3
    assert d.gain is not None and d.gain.closed > 0.95

"""Work that is ended before it is finished: what was found until then is told, and that it is not all."""

import json
import os
import re
import signal
import threading

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm._limit import Limit, ended_by_interrupt
from jfsm.reporting import diagnosis_text, render_page

FEW = ("cubic_hardening", "coulomb", "quadratic_damping", "force_gain")
MASS, STIFFNESS, DAMPING, CUBIC = 2.0, 18.0, 0.5, 4.0
MODEL = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)


@pytest.fixture(autouse=True)
def interruptible():
    """As in a terminal; what runs in the background may have been told to ignore interrupts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def record():
    """A Duffing oscillator from rest, which the model takes for a linear one."""
    rng, time = np.random.default_rng(3), np.arange(300) * 0.05
    omegas, phases = rng.uniform(0.5, 7.0, 12), rng.uniform(0, 2 * np.pi, 12)

    def force(t):
        return 2.0 * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    def rate(t, y):
        return [y[1], (force(t) - STIFFNESS * y[0] - CUBIC * y[0] ** 3 - DAMPING * y[1]) / MASS]

    x = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-9, atol=1e-12).y[0]
    noisy = [y + 0.005 * y.std() * rng.standard_normal(time.size) for y in (force(time), x)]
    return jfsm.Record(time, noisy[0], displacement=noisy[1], at_rest=True)


class Watch:
    """Told of progress: keeps it, and interrupts the process when it is told of some stage."""

    def __init__(self, *stages: str):
        self.steps: list[tuple[str, int, int]] = []
        self.stages = list(stages)

    def __call__(self, what: str, done: int, total: int) -> None:
        self.steps.append((what, done, total))
        if self.stages and self.stages[0] in what:
            self.stages.pop(0)
            os.kill(os.getpid(), signal.SIGINT)


def diagnosed(record, watch=None, **options):
    return jfsm.diagnose(record, MODEL, causes=FEW, max_causes=1, key=jax.random.key(0), progress=watch, **options)


@pytest.fixture(scope="module")
def whole(record):
    watch = Watch()
    return diagnosed(record, watch), watch


def test_one_that_has_the_time_is_finished(whole):
    d, _ = whole
    assert d.finished and d.untried == () and d.data["finished"] is True
    assert [f.cause for f in d.findings] == ["cubic_hardening"] and d.findings[0].probability > 0.9
    assert not any("Not finished" in note for note in d.notes)


def test_steps_are_counted_upwards_and_are_never_more_than_there_are(whole):
    done, total = np.array([step[1:] for step in whole[1].steps]).T
    assert np.all(np.diff(done) >= 0) and np.all(done <= total)
    assert done[0] == 0 and done[-1] == total[-1] and done[-1] > 10


def test_without_time_the_model_alone_is_judged_and_nothing_is_sure(record, tmp_path):
    watch = Watch()
    d = diagnosed(record, watch, time_limit=1e-6)
    assert (d.verdict, d.findings, d.finished) == ("undecided", (), False)
    assert d.untried == FEW and "not finished" in repr(d)
    d.to_json(tmp_path / "d.json")
    data = json.loads((tmp_path / "d.json").read_text())
    assert (data["finished"], data["untried"]) == (False, list(FEW))
    assert "ended before it was finished" in data["sentence"]
    for shown in (re.sub(r"[\s│]+", " ", diagnosis_text(data)), re.sub(r"\s+", " ", render_page(data))):
        assert "Undecided, not finished" in shown and "4 causes were not tried to the end: cubic_hardening" in shown
    assert all(done <= total for _, done, total in watch.steps)


def test_an_interrupt_ends_with_what_was_found_half_as_sure(record):
    before, watch = signal.getsignal(signal.SIGINT), Watch("the best candidates")
    d = diagnosed(record, watch)
    assert signal.getsignal(signal.SIGINT) is before
    assert watch.stages == [] and not d.finished and set(d.untried) < set(FEW)
    assert (d.verdict, [f.cause for f in d.findings]) == ("cause", ["cubic_hardening"])
    assert d.findings[0].probability <= 0.5 and d.findings[0].kind_probability <= 0.5
    assert "not finished" in d.sentence and "Let the search go on" in d.advice
    cut = {c.cause: c.why for c in d.candidates if c.cause in d.untried}
    assert cut and all("the time was over" in why for why in cut.values())
    assert all(done <= total for _, done, total in watch.steps)


def test_a_second_interrupt_stops_it(record):
    with pytest.raises(KeyboardInterrupt):
        diagnosed(record, Watch("single causes", "verdict"))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_before_anything_is_known_stops_it(record):
    with pytest.raises(KeyboardInterrupt):
        diagnosed(record, Watch("the model as given"))


def test_in_another_thread_interrupts_are_left_alone():
    handlers = []

    def work():
        with ended_by_interrupt(Limit()):
            handlers.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert handlers == [signal.default_int_handler]


def test_a_handler_of_somebody_else_stays():
    def other(number, frame):
        raise AssertionError

    before = signal.signal(signal.SIGINT, other)
    try:
        with ended_by_interrupt(Limit()):
            assert signal.getsignal(signal.SIGINT) is other
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_a_time_limit_is_positive(seconds, record):
    with pytest.raises(ValueError, match="`time_limit` must be positive, in seconds; got"):
        diagnosed(record, time_limit=seconds)

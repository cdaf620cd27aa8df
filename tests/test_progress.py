"""Progress: the time left is that of what was measured, and nobody is shown anything who did not ask for it."""

import io

import pytest
from rich.console import Console

from jfsm.diagnosis.search.steps import Steps
from jfsm.reporting import shown_by_default, stages
from jfsm.reporting._progress import TimeLeft, bar


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_the_time_left_follows_the_pace_of_the_last_steps():
    clock = Clock()
    left = TimeLeft(clock)
    left.told(0, 100)
    assert left.seconds is None and str(left) == ""
    for done in range(1, 51):
        clock.now += 3.0
        left.told(done, 100)
    assert left.seconds == pytest.approx(150.0) and str(left) == "about 2 min left"
    clock.now += 1.0
    assert left.seconds == pytest.approx(149.0)
    for done in range(51, 91):  # the last ones count, not those that were slow
        clock.now += 0.5
        left.told(done, 100)
    assert left.seconds == pytest.approx(5.0) and str(left) == "about 5 s left"


def test_a_step_that_takes_longer_than_those_before_lets_the_time_left_grow():
    clock = Clock()
    left = TimeLeft(clock)
    for done in range(3):
        left.told(done, 12)
        clock.now += 1.0
    clock.now += 7.0
    assert left.seconds == pytest.approx(10 * 10.0 / 3)
    left.told(12, 12)
    assert left.seconds is None


def test_steps_that_turn_up_on_the_way_are_added_and_others_are_not_taken_back_before_the_end():
    seen: list[tuple[str, int, int]] = []
    steps = Steps(lambda *step: seen.append(step), fixed=2)
    steps.next("model")
    tell = steps.of("search")
    for left in (5, 4, 1, 0):
        tell("one", left)
    again = steps.of("more")
    for left in (3, 2, 1, 0):
        again("one", left)
    steps.next("verdict")
    steps.end()
    assert seen[0] == ("model", 0, 2) and seen[-1] == ("done", 10, 10)
    assert [total for _, _, total in seen] == [2, 2, 8, 8, 8, 8, 8, 10, 10, 10, 10, 10, 10]
    assert [done for _, done, _ in seen] == [0, 0, 2, 3, 4, 5, 5, 6, 7, 8, 9, 9, 10]


def test_every_stage_is_said_once():
    said: list[str] = []
    told = stages(said.append)
    for step, what in enumerate(("looking", "trying: a", "trying: b", "deciding")):
        told(what, step, 4)
    assert said == ["0 s: looking", "0 s: trying", "0 s: deciding"]
    stages(said.append)("fitting", 0, 1)
    assert len(said) == 3


def test_nothing_is_shown_where_nobody_looks(capsys):
    for progress in (None, True, False):
        with shown_by_default(progress) as told:
            assert told is None
    given = lambda what, done, total: None  # noqa: E731
    with shown_by_default(given) as told:
        assert told is given
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_a_bar_unless_it_is_switched_off(monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with shown_by_default(None) as told:
        assert told is not None
    with shown_by_default(False) as told:
        assert told is None


def test_a_bar_tells_steps_and_the_time_left():
    stream = io.StringIO()
    with bar(Console(file=stream, force_terminal=True, width=100)) as told:
        told("looking", 0, 4)
        told("trying", 3, 4)
    assert "3/4" in stream.getvalue() and "trying" in stream.getvalue()

"""Pictures of single objects: axes in, axes out, units along them; and what the objects print."""

from collections.abc import Iterator
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import jfsm
from jfsm._result import Result

TIME = np.arange(60) * 0.1
MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.1)


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def labels(axes: Any) -> list[tuple[str, str]]:
    return [(ax.get_xlabel(), ax.get_ylabel()) for ax in np.atleast_1d(axes)]


def record() -> jfsm.Record:
    x = np.column_stack([np.sin(TIME), np.cos(TIME)])
    return jfsm.Record(time=TIME, force=np.sin(TIME), displacement=x, units={"displacement": "mm"})


def response() -> jfsm.Response:
    x = np.sin(TIME)[:, None]
    return jfsm.Response(TIME, x, x, x, Result.successful, None, "reference", ())


def curve() -> jfsm.ForcedResponse:
    frequency, amplitude = np.array([1.0, 2.0, 1.5, 3.0]), np.array([[0.1], [0.5], [0.4], [0.1]])
    stable = np.array([True, True, False, True])
    return jfsm.ForcedResponse(
        frequency, amplitude, amplitude, stable, np.zeros((4, 3, 1)), np.array([1]), Result.successful
    )


def orbit() -> jfsm.LimitCycle:
    t = np.linspace(0, 2 * np.pi, 50)
    states = np.column_stack([t, np.cos(t), -np.sin(t)])
    return jfsm.LimitCycle(2 * np.pi, np.array([1.0]), np.array([1.0, 0.5]), True, states, 0.0, "")


def fitted() -> jfsm.Fit:
    values = {"mass@1": 1.0, "stiffness@0-1.k": 9.0}
    intervals = {"mass@1": (0.9, 1.1), "stiffness@0-1.k": (8.1, 10.8)}
    return jfsm.Fit(MODEL, values, intervals, {}, (), 0.0, {}, Result.successful)


def test_a_record_is_drawn_kind_by_kind_in_its_units():
    axes = record().plot()
    assert labels(axes) == [("time [s]", "force [N]"), ("time [s]", f"displacement [{record().units['displacement']}]")]
    first, second = axes[1].lines
    assert np.array_equal(first.get_ydata(), record().channels[("displacement", 1)])
    assert (first.get_label(), second.get_label()) == ("displacement 1", "displacement 2")


def test_axes_that_are_given_are_drawn_on():
    _, given = plt.subplots(3)
    assert list(response().plot(given)) == list(given)
    assert labels(given)[1] == ("time [s]", "velocity [m/s]")
    with pytest.raises(ValueError, match=r"`ax` must be 3 axes, as plt\.subplots\(3\)\[1\] gives; got 1"):
        response().plot(given[0])


def test_a_forced_response_is_drawn_over_hertz_with_its_unstable_part_broken():
    ax = curve().plot()
    assert labels(ax) == [("frequency [Hz]", "amplitude [m]")]
    solid, broken = ax.lines
    assert (solid.get_linestyle(), broken.get_linestyle()) == ("-", "--")
    assert solid.get_color() == broken.get_color()
    assert np.isfinite(broken.get_ydata()).tolist() == [False, False, True, False]
    assert solid.get_xdata()[1] == pytest.approx(1 / np.pi)


def test_a_backbone_and_an_orbit_are_drawn_with_units():
    backbone = jfsm.Backbone(np.array([1.0, 2.0]), np.array([0.1, 0.2]), np.zeros((2, 3, 1)), Result.successful)
    assert labels(backbone.plot()) == [("frequency [Hz]", "amplitude [m]")]
    assert repr(backbone) == "<Backbone, 2 points from 0.1592 to 0.3183 Hz>"
    assert backbone.to_dataframe()["amplitude"].tolist() == [0.1, 0.2]
    ax = orbit().plot()
    assert labels(ax) == [("displacement [m]", "velocity [m/s]")]
    assert ax.lines[0].get_xdata()[0] == 1.0


def test_a_map_is_drawn_within_its_box():
    states = np.random.default_rng(1).uniform(-1, 1, (60, 2))
    learned = jfsm.Polynomial.fit(states, 3 * states[:, 0], order=1)
    _, given = plt.subplots()
    assert learned.plot(given, labels=("d [m]", "w [m/s]", "force [N]")) is given
    assert labels(given) == [("d [m]", "w [m/s]")]
    assert given.get_xlim() == pytest.approx((states[:, 0].min(), states[:, 0].max()))
    (drawn,) = given.collections
    assert np.max(np.asarray(drawn.get_array())) == pytest.approx(3 * states[:, 0].max())
    four = np.random.default_rng(1).uniform(-1, 1, (40, 4))
    with pytest.raises(ValueError, match="A map can be drawn over states of 2 columns; this one has 4"):
        jfsm.Polynomial.fit(four, four[:, 0], order=1).plot()
    with pytest.raises(ValueError, match="this one has 2 outputs"):
        jfsm.Polynomial.fit(states, states, order=1).plot()


def test_a_fit_is_drawn_by_its_intervals_and_is_a_table():
    ax = fitted().plot()
    assert [text.get_text() for text in ax.get_yticklabels()] == ["mass@1", "stiffness@0-1.k"]
    (first, second) = ax.collections[0].get_segments()
    assert first[:, 0] == pytest.approx([-10.0, 10.0]) and second[:, 0] == pytest.approx([-10.0, 20.0])
    frame = fitted().to_dataframe()
    assert frame.loc["stiffness@0-1.k"].tolist() == [9.0, 8.1, 10.8, "N/m"]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (response, "<Response, 60 samples of 1 degree of freedom, 5.9 s, reference solver>"),
        (curve, "<ForcedResponse, 4 points from 0.1592 to 0.4775 Hz, 1 folds, 1 points unstable>"),
        (orbit, "<LimitCycle, stable, period 6.28319 s, amplitude 1 m>"),
        (fitted, "<Fit, 2 values, converged>\nStructure of 1 degree of freedom\n"),
    ],
)
def test_what_is_printed_is_short(made, words):
    text = repr(made())
    assert text.startswith(words) and len(text.splitlines()) < 10


def test_a_curve_is_a_table():
    frame = curve().to_dataframe()
    assert list(frame) == ["frequency_hz", "amplitude_1", "phase_1", "stable"]
    assert frame["frequency_hz"][1] == pytest.approx(1 / np.pi)


def test_a_notebook_shows_channels_and_values_with_their_units():
    shown = record()._repr_html_()
    assert "<td>displacement 2</td><td>m</td><td>-0.0009991</td><td>0.001</td>" in shown
    assert "60 samples over 5.9 s" in shown
    shown = response()._repr_html_()
    assert "<td>velocity 1</td><td>m/s</td><td>-0.999" in shown and "force" not in shown
    shown = fitted()._repr_html_()
    assert "<td>stiffness@0-1.k</td><td>9</td><td>[8.1, 10.8]</td><td>N/m</td>" in shown
    assert shown.startswith("<p>Fit of 2 values, converged</p><table>")


def test_what_a_notebook_shows_of_a_name_is_no_markup():
    named = jfsm.Record(time=TIME, displacement=np.sin(TIME), name="<script>")
    assert "<script>" not in named._repr_html_()

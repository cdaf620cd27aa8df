"""Pictures of the causes: the force over displacement and velocity, and what a run shows of it."""

import io
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from shown import OMEGA, PEAK, SECONDS, TIME, Shown

UNITS = {"displacement": ("mm", 1e3), "velocity": ("m/s", 1.0), "acceleration": ("m/s²", 1.0), "force": ("N", 1.0)}
WITHOUT, WITH = "#8a8f98", "#c0392b"
_SIDE = 25
"""States along each axis of the picture of a force."""


def png(figure: Figure) -> bytes:
    """The file of a figure."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=90, metadata={"Software": None})
    return out.getvalue()


def large(s: Shown) -> bytes:
    """Everything that is drawn of a cause."""
    if s.along is None:
        figure = Figure(figsize=(8.0, 2.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(2, 1))
        _run(left, s)
        _reading(right, s)
        return png(figure)
    figure = Figure(figsize=(8.0, 5.2), layout="constrained")
    parts: Any = figure.subfigures(2, 1)
    above, below = parts
    axes = above.subplots(1, 3 if s.memoryless else 2)
    _over(axes[0], s.along[0] * 1e3, s.along[2], "displacement [mm]")
    _over(axes[1], s.along[1], s.along[2], "velocity [m/s]")
    if s.memoryless:
        _surface(axes[2], s.part)
    _run(below.subplots(), s)
    return png(figure)


def small(s: Shown) -> bytes:
    """A picture for the gallery."""
    figure = Figure(figsize=(2.7, 1.8), layout="constrained")
    axes = figure.subplots()
    if s.along is None:
        _run(axes, s, SECONDS / 3)
    elif s.cause.family == "damping":
        _over(axes, s.along[1], s.along[2], "velocity [m/s]")
    else:
        _over(axes, s.along[0] * 1e3, s.along[2], "displacement [mm]")
    if legend := axes.get_legend():
        legend.remove()
    return png(figure)


def _over(axes: Any, x: np.ndarray, force: np.ndarray, label: str) -> None:
    axes.plot(x, force, color=WITH, linewidth=1.0)
    axes.set(xlabel=label, ylabel="force [N]")
    axes.grid(alpha=0.3)


def _surface(axes: Any, law: Any) -> None:
    """The force at every state (d, w) of a law without memory."""
    d, w = np.meshgrid(np.linspace(-PEAK, PEAK, _SIDE), np.linspace(-OMEGA * PEAK, OMEGA * PEAK, _SIDE))
    force = np.asarray(jax.vmap(lambda x, v: law.force(x, v, jnp.zeros(0), jnp.zeros(())))(d.ravel(), w.ravel()))
    largest = max(float(np.max(np.abs(force))), 1e-12)
    filled = axes.contourf(d * 1e3, w, force.reshape(d.shape), 20, cmap="RdBu_r", vmin=-largest, vmax=largest)
    axes.figure.colorbar(filled, ax=axes, label="force [N]")
    axes.set(xlabel="displacement [mm]", ylabel="velocity [m/s]")


def _run(axes: Any, s: Shown, until: float = SECONDS) -> None:
    unit, size = UNITS[s.channel]
    now, labels = TIME <= until, ("true", "as read") if s.along is None else ("model", "with the cause")
    axes.plot(TIME[now], s.believed[now] * size, color=WITHOUT, linewidth=1.0, label=labels[0])
    axes.plot(TIME[now], s.true[now] * size, color=WITH, linewidth=1.0, label=labels[1])
    axes.set(xlabel="time [s]", ylabel=f"{s.channel} [{unit}]")
    axes.legend(loc="upper right", fontsize="small")
    axes.grid(alpha=0.3)


def _reading(axes: Any, s: Shown) -> None:
    unit, size = UNITS[s.channel]
    axes.plot(s.believed * size, s.true * size, color=WITH, linewidth=0.8)
    axes.set(xlabel=f"true {s.channel} [{unit}]", ylabel=f"reading [{unit}]")
    axes.grid(alpha=0.3)

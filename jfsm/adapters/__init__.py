"""Simulations of other programs as simulations of jfsm; each needs its program's own package, an extra."""

from . import fmu as fmu
from . import mujoco as mujoco

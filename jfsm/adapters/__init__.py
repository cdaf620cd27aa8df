"""Simulations of other programs as simulations of jfsm, and maps as regressors of scikit-learn, in
`jfsm.adapters.sklearn`; each needs its program's own package, an extra."""

from . import fmu as fmu
from . import mujoco as mujoco

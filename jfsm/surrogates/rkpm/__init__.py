"""Reproducing kernel particle method: polynomials reproduced exactly from scattered readings."""

from .interfaces import Plane as Plane
from .rkpm import RKPM as RKPM
from .shape_functions import shape_functions as shape_functions
from .windows import AbstractWindow as AbstractWindow
from .windows import CubicSplineWindow as CubicSplineWindow
from .windows import GaussianWindow as GaussianWindow
from .windows import QuarticSplineWindow as QuarticSplineWindow

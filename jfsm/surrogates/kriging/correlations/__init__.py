"""Correlations of kriging: the paper's eqs. 55 to 61 and two of Matérn's."""

from .base import AbstractCorrelation as AbstractCorrelation
from .cubic import Cubic as Cubic
from .exponential import Exponential as Exponential
from .gaussian import Gaussian as Gaussian
from .linear import Linear as Linear
from .matern32 import Matern32 as Matern32
from .matern52 import Matern52 as Matern52
from .power_exponential import PowerExponential as PowerExponential
from .spherical import Spherical as Spherical
from .spline import Spline as Spline

"""Universal kriging: a trend, a random field with a learned correlation, and noise."""

from .correlations import AbstractCorrelation as AbstractCorrelation
from .correlations import Cubic as Cubic
from .correlations import Exponential as Exponential
from .correlations import Gaussian as Gaussian
from .correlations import Linear as Linear
from .correlations import Matern32 as Matern32
from .correlations import Matern52 as Matern52
from .correlations import PowerExponential as PowerExponential
from .correlations import Spherical as Spherical
from .correlations import Spline as Spline
from .kriging import Kriging as Kriging
from .leave_one_out import LeaveOneOut as LeaveOneOut
from .trend import PolynomialTrend as PolynomialTrend

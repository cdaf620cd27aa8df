"""What the data say: force state maps, each a term without a formula."""

from ._map import AbstractForceStateMap as AbstractForceStateMap
from ._table import HermiteTable as HermiteTable
from ._table import tabulate as tabulate
from .discontinuities import Discontinuity as Discontinuity
from .discontinuities import find_discontinuities as find_discontinuities
from .kriging import AbstractCorrelation as AbstractCorrelation
from .kriging import Cubic as Cubic
from .kriging import Exponential as Exponential
from .kriging import Gaussian as Gaussian
from .kriging import Kriging as Kriging
from .kriging import Linear as Linear
from .kriging import Matern32 as Matern32
from .kriging import Matern52 as Matern52
from .kriging import PolynomialTrend as PolynomialTrend
from .kriging import PowerExponential as PowerExponential
from .kriging import Spherical as Spherical
from .kriging import Spline as Spline
from .moving_least_squares import MovingLeastSquares as MovingLeastSquares
from .polynomial import Polynomial as Polynomial
from .radial_basis import RadialBasis as RadialBasis
from .rkpm import RKPM as RKPM
from .rkpm import AbstractWindow as AbstractWindow
from .rkpm import CubicSplineWindow as CubicSplineWindow
from .rkpm import GaussianWindow as GaussianWindow
from .rkpm import Plane as Plane
from .rkpm import QuarticSplineWindow as QuarticSplineWindow

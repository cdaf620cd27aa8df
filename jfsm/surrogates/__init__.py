"""What the data say: force state maps, each a term without a formula."""

from ._discontinuities import Discontinuity as Discontinuity
from ._discontinuities import find_discontinuities as find_discontinuities
from ._map import AbstractForceStateMap as AbstractForceStateMap
from ._table import HermiteTable as HermiteTable
from ._table import tabulate as tabulate
from .moving_least_squares import MovingLeastSquares as MovingLeastSquares
from .polynomial import Polynomial as Polynomial
from .radial_basis import RadialBasis as RadialBasis
from .rkpm import RKPM as RKPM
from .rkpm import AbstractWindow as AbstractWindow
from .rkpm import CubicSplineWindow as CubicSplineWindow
from .rkpm import GaussianWindow as GaussianWindow
from .rkpm import Plane as Plane
from .rkpm import QuarticSplineWindow as QuarticSplineWindow

"""What the data say: force state maps, each a term without a formula."""

from ._map import AbstractForceStateMap as AbstractForceStateMap
from ._table import HermiteTable as HermiteTable
from ._table import tabulate as tabulate
from .rkpm import RKPM as RKPM
from .rkpm import AbstractWindow as AbstractWindow
from .rkpm import CubicSplineWindow as CubicSplineWindow
from .rkpm import GaussianWindow as GaussianWindow
from .rkpm import QuarticSplineWindow as QuarticSplineWindow

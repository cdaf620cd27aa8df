"""Where a force jumps or kinks: lines found in scattered readings, each with an interval and a confidence."""

from .discontinuity import Discontinuity as Discontinuity
from .find import find_discontinuities as find_discontinuities

from .coulomb import Coulomb as Coulomb
from .linear import LinearDamping as LinearDamping
from .linear import LinearStiffness as LinearStiffness
from .map import MapTerm as MapTerm
from .polynomial_damping import QuadraticDamping as QuadraticDamping
from .polynomial_stiffness import CubicStiffness as CubicStiffness
from .polynomial_stiffness import QuadraticStiffness as QuadraticStiffness

SMOOTH_TERMS = (CubicStiffness, QuadraticStiffness, QuadraticDamping)
"""Laws that share one compiled program: smooth, without memory."""

FRICTION_TERMS = (Coulomb,)
"""Laws that stick."""

TERMS = (LinearStiffness, LinearDamping, *SMOOTH_TERMS, *FRICTION_TERMS)
"""Every law with a formula."""

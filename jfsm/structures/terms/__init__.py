from .coulomb import Coulomb as Coulomb
from .coulomb import CoulombAsymmetric as CoulombAsymmetric
from .coulomb import Stribeck as Stribeck
from .delayed import DelayedForce as DelayedForce
from .geometric_stiffness import CosineStiffness as CosineStiffness
from .geometric_stiffness import SineStiffness as SineStiffness
from .hysteresis import BoucWen as BoucWen
from .hysteresis import FreePlay as FreePlay
from .hysteresis import Iwan as Iwan
from .hysteresis import Jenkins as Jenkins
from .linear import LinearDamping as LinearDamping
from .linear import LinearStiffness as LinearStiffness
from .linear_memory import AttachedOscillator as AttachedOscillator
from .linear_memory import ElasticJoint as ElasticJoint
from .linear_memory import Maxwell as Maxwell
from .load import PeriodicDisturbance as PeriodicDisturbance
from .load import Preload as Preload
from .lugre import LuGre as LuGre
from .map import MapTerm as MapTerm
from .piecewise_stiffness import BilinearStiffness as BilinearStiffness
from .piecewise_stiffness import DampedStop as DampedStop
from .piecewise_stiffness import DeadZone as DeadZone
from .piecewise_stiffness import EndStop as EndStop
from .piecewise_stiffness import Saturation as Saturation
from .polynomial_damping import BilinearDamping as BilinearDamping
from .polynomial_damping import CubicDamping as CubicDamping
from .polynomial_damping import PowerDamping as PowerDamping
from .polynomial_damping import QuadraticDamping as QuadraticDamping
from .polynomial_stiffness import CubicStiffness as CubicStiffness
from .polynomial_stiffness import DoubleWell as DoubleWell
from .polynomial_stiffness import QuadraticStiffness as QuadraticStiffness
from .polynomial_stiffness import QuinticStiffness as QuinticStiffness
from .polynomial_stiffness import SquareStiffness as SquareStiffness
from .position_damping import PositionDamping as PositionDamping
from .position_damping import VanDerPol as VanDerPol
from .ripple import Ripple as Ripple
from .smooth_friction import SmoothCoulomb as SmoothCoulomb
from .time_dependent import DampingDrift as DampingDrift
from .time_dependent import ParametricStiffness as ParametricStiffness
from .time_dependent import StiffnessDrift as StiffnessDrift
from .time_dependent import StiffnessDrop as StiffnessDrop

# A law that stands in one of these tables shares its compiled programs with the others there.
SMOOTH_TERMS = (
    CubicStiffness, QuadraticStiffness, QuadraticDamping, QuinticStiffness, SquareStiffness, DoubleWell, SineStiffness,
    CosineStiffness, BilinearStiffness, DeadZone, EndStop, Saturation, DampedStop, CubicDamping, PowerDamping,
    BilinearDamping, VanDerPol, PositionDamping, SmoothCoulomb, StiffnessDrift, DampingDrift, StiffnessDrop,
    ParametricStiffness, Preload, PeriodicDisturbance, Ripple,
)  # fmt: skip
"""Laws of the present motion and of time."""

FRICTION_TERMS = (Coulomb, CoulombAsymmetric, Stribeck)
"""Laws that stick."""

MEMORY_TERMS = (BoucWen, Jenkins, LuGre, FreePlay, Maxwell, AttachedOscillator, ElasticJoint)
"""Laws with at most two hidden states."""

DELAYED_TERMS = (DelayedForce,)
"""Laws of the past."""

TERMS = (LinearStiffness, LinearDamping, *SMOOTH_TERMS, *FRICTION_TERMS, *MEMORY_TERMS, Iwan, *DELAYED_TERMS)
"""Every law with a formula."""

"""Laws a plant may hide, by cause id. A new law is one class, listed here."""

from .base import Law as Law
from .base import NoLaw as NoLaw
from .base import Scene as Scene
from .both import Both as Both
from .damping import (
    BilinearDamping,
    Coulomb,
    CoulombAsymmetric,
    CubicDamping,
    PositionDamping,
    PowerDamping,
    QuadraticDamping,
    SmoothCoulomb,
    Stribeck,
    VanDerPol,
)
from .input import PeriodicDisturbance, Preload
from .memory import AttachedOscillator, BoucWen, DelayedForce, FreePlay, Jenkins, LuGre, Maxwell
from .outside import (
    Bump,
    FadingFriction,
    HalfDamping,
    SlantedDamping,
    SpeedStiffness,
    WavyDamping,
    WedgeFriction,
    Whirl,
)
from .stiffness import (
    BilinearStiffness,
    CubicHardening,
    CubicSoftening,
    DeadZone,
    DoubleWell,
    EndStop,
    QuadraticStiffness,
    QuinticStiffness,
    Saturation,
    SineStiffness,
    SquareStiffness,
)
from .time import DampingDrift, ParametricStiffness, StiffnessDrift, StiffnessDrop

FIRST_LAWS: dict[str, type[Law]] = {
    law.cause: law for law in (CubicHardening, CubicSoftening, QuadraticStiffness, QuadraticDamping, Coulomb)
}
LAWS: dict[str, type[Law]] = FIRST_LAWS | {
    law.cause: law
    for law in (
        *(QuinticStiffness, BilinearStiffness, DeadZone, EndStop),
        *(Saturation, DoubleWell, SineStiffness, SquareStiffness),
        *(CoulombAsymmetric, Stribeck, SmoothCoulomb, CubicDamping),
        *(PowerDamping, VanDerPol, PositionDamping, BilinearDamping),
        *(BoucWen, Jenkins, LuGre, FreePlay, Maxwell, AttachedOscillator, DelayedForce),
        *(StiffnessDrift, StiffnessDrop, DampingDrift, ParametricStiffness),
        *(Preload, PeriodicDisturbance),
    )
}
# None of these is in the catalogue, nor near a law that is.
OUTSIDE: dict[str, type[Law]] = {
    law.cause: law
    for law in (
        *(SpeedStiffness, FadingFriction, Bump, WedgeFriction),
        *(WavyDamping, HalfDamping, Whirl, SlantedDamping),
    )
}

"""Laws a plant may hide, by cause id. A new law is one class, listed here."""

from .base import Law as Law
from .base import NoLaw as NoLaw
from .damping import Coulomb, QuadraticDamping
from .stiffness import CubicHardening, CubicSoftening, QuadraticStiffness

LAWS: dict[str, type[Law]] = {
    law.cause: law for law in (CubicHardening, CubicSoftening, QuadraticStiffness, QuadraticDamping, Coulomb)
}

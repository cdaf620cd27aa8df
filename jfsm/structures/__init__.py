"""What is believed: structures made of terms and sensors."""

from ._catalogue import PARAMETER_CAUSES as PARAMETER_CAUSES
from ._catalogue import Cause as Cause
from ._catalogue import causes as causes
from ._sensors import AbstractSensor as AbstractSensor
from ._sensors import AccelerationGain as AccelerationGain
from ._sensors import ForceGain as ForceGain
from ._sensors import Offset as Offset
from ._structure import Structure as Structure
from ._term import AbstractFriction as AbstractFriction
from ._term import AbstractTerm as AbstractTerm
from ._term import Parameter as Parameter
from .terms import FRICTION_TERMS as FRICTION_TERMS
from .terms import SMOOTH_TERMS as SMOOTH_TERMS
from .terms import Coulomb as Coulomb
from .terms import CubicStiffness as CubicStiffness
from .terms import LinearDamping as LinearDamping
from .terms import LinearStiffness as LinearStiffness
from .terms import MapTerm as MapTerm
from .terms import QuadraticDamping as QuadraticDamping
from .terms import QuadraticStiffness as QuadraticStiffness

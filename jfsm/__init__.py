"""jfsm: what a simulation gets wrong, the name of the cause, and the gain of mending it."""

from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .dynamics import Response as Response
from .dynamics import simulate as simulate
from .identification import Fit as Fit
from .identification import fit as fit
from .records import Record as Record
from .records import read as read
from .structures import AccelerationGain as AccelerationGain
from .structures import Cause as Cause
from .structures import Coulomb as Coulomb
from .structures import CubicStiffness as CubicStiffness
from .structures import ForceGain as ForceGain
from .structures import LinearDamping as LinearDamping
from .structures import LinearStiffness as LinearStiffness
from .structures import Offset as Offset
from .structures import QuadraticDamping as QuadraticDamping
from .structures import QuadraticStiffness as QuadraticStiffness
from .structures import Structure as Structure
from .structures import causes as causes
from .surrogates import RKPM as RKPM

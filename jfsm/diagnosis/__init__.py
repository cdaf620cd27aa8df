"""What is wrong: candidates, evidence, verdict, gain."""

from ._diagnose import diagnose as diagnose
from ._diagnosis import Diagnosis as Diagnosis
from ._diagnosis import Estimate as Estimate
from ._diagnosis import Finding as Finding
from ._map_force import MappedForce as MappedForce
from ._map_force import map_force as map_force
from ._next import Proposal as Proposal
from .evidence.evidence import Evidence as Evidence
from .thresholds import Thresholds as Thresholds
from .verdict.decision import Decision as Decision
from .verdict.judge import judge as judge

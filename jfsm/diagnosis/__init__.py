"""What is wrong: candidates, evidence, verdict, gain."""

from .._result import Estimate as Estimate
from ._compare import Sides as Sides
from ._compare import compare as compare
from ._compare import compare_numbers as compare_numbers
from ._diagnose import diagnose as diagnose
from ._diagnosis import Diagnosis as Diagnosis
from ._finding import Finding as Finding
from .advice.next_test import Proposal as Proposal
from .evidence.evidence import Evidence as Evidence
from .hypotheses.alike import confused_with as confused_with
from .thresholds import Thresholds as Thresholds
from .verdict.again import judge_again as judge_again
from .verdict.decision import Decision as Decision
from .verdict.judge import judge as judge

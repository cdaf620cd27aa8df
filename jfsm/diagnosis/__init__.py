"""What is wrong: candidates, evidence, verdict, gain."""

from .._result import Estimate as Estimate
from ._arguments import check_settings as check_settings
from ._arguments import held_records as held_records
from ._compare import Sides as Sides
from ._compare import compare as compare
from ._compare import compare_numbers as compare_numbers
from ._diagnose import diagnose as diagnose
from ._diagnosis import Diagnosis as Diagnosis
from ._finding import Finding as Finding
from ._provenance import from_files as from_files
from ._provenance import jfsm_version as jfsm_version
from ._provenance import key_of as key_of
from ._provenance import model_fingerprint as model_fingerprint
from ._provenance import plain_input as plain_input
from ._provenance import plain_key as plain_key
from ._provenance import plain_settings as plain_settings
from ._provenance import toml_of as toml_of
from ._verify import Verification as Verification
from ._verify import verify as verify
from .advice.next_test import Proposal as Proposal
from .evidence.evidence import Evidence as Evidence
from .hypotheses.alike import confused_with as confused_with
from .thresholds import Thresholds as Thresholds
from .verdict.again import judge_again as judge_again
from .verdict.decision import Decision as Decision
from .verdict.judge import judge as judge

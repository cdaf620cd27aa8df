"""What it does: free runs of a structure, and the analysis of its motions."""

from ._backbone import Backbone as Backbone
from ._backbone import backbone as backbone
from ._fixed_points import FixedPoint as FixedPoint
from ._fixed_points import fixed_points as fixed_points
from ._forced_response import ForcedResponse as ForcedResponse
from ._forced_response import forced_response as forced_response
from ._limit_cycles import LimitCycle as LimitCycle
from ._limit_cycles import limit_cycles as limit_cycles
from ._linearise import Linearisation as Linearisation
from ._linearise import linearise as linearise
from ._many import Responses as Responses
from ._many import simulate_many as simulate_many
from ._simulate import Response as Response
from ._simulate import simulate as simulate

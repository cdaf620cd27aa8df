"""Plants with a hidden effect each, or two, drawn by seed: what the diagnosis is examined on.

Nothing here knows the library: laws, sensors and the integrator are written a second time on NumPy and SciPy alone, so
that an error made in the library cannot be made in its examination as well.
"""

from .chain_challenge import CHAIN_CAUSES as CHAIN_CAUSES
from .chain_challenge import CHAIN_SETS as CHAIN_SETS
from .chain_challenge import ChainChallenge as ChainChallenge
from .chain_challenge import draw_chain as draw_chain
from .challenge import CAUSES as CAUSES
from .challenge import FIRST_CAUSES as FIRST_CAUSES
from .challenge import Challenge as Challenge
from .challenge import Effect as Effect
from .challenge import draw as draw
from .dirt import DIRT as DIRT
from .dirt import soiled as soiled
from .laws import OUTSIDE as OUTSIDE
from .plants import UnfairError as UnfairError
from .two import PAIRS as PAIRS
from .two import draw_two as draw_two

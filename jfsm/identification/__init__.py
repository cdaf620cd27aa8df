"""What values: the likelihood, what is known beforehand, and the fit."""

from ._fit import Fit as Fit
from ._fit import fit as fit
from ._fit import without_small_offsets as without_small_offsets
from ._maximise import Maximum as Maximum
from ._maximise import approach as approach
from ._maximise import finish as finish
from ._maximise import maximise as maximise
from ._nuisances import Nuisances as Nuisances
from ._nuisances import prepare as prepare
from ._posterior import Hypothesis as Hypothesis
from ._posterior import Posterior as Posterior
from ._posterior import lanes_of as lanes_of
from ._posterior import prior as prior
from ._starts import missing_force as missing_force
from ._starts import place as place
from ._starts import scale_of as scale_of
from ._starts import starts as starts
from ._unknowns import DEGREES as DEGREES
from ._unknowns import DEGREES_BESIDE as DEGREES_BESIDE
from ._unknowns import Unknown as Unknown
from ._unknowns import effect_unknown as effect_unknown
from ._unknowns import free_unknown as free_unknown
from ._unknowns import natural_size as natural_size
from ._unknowns import nuisance_unknowns as nuisance_unknowns
from ._unknowns import own_unknown as own_unknown
from ._unknowns import with_offsets as with_offsets

"""The paper's study, repeated: every number that it prints beside ours and the truth, and its figures.

"The paper" is *Force State Maps Using Reproducing Kernel Particle Method and Kriging Based Functional Representations*;
its systems are in `jfsm.systems`. It measured nothing: all its records are simulated, and so are these.
"""

from ._cases import smooth_case as smooth_case
from ._kriging import Finding as Finding
from ._kriging import findings as findings
from ._noise import FITS as FITS
from ._noise import noise_rows as noise_rows
from ._noise import saturating as saturating
from ._rows import NoiseRow as NoiseRow
from ._rows import Outcome as Outcome
from ._rows import Row as Row
from ._simulated import Run as Run
from ._simulated import oscillator as oscillator
from ._study import SECTIONS as SECTIONS
from ._study import Study as Study
from ._study import study as study

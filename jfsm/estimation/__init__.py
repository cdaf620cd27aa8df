"""What state: the filter of a plant, and the force that a model lacks."""

from ._filter import Innovations as Innovations
from ._filter import ProcessNoise as ProcessNoise
from ._filter import Readings as Readings
from ._filter import Start as Start
from ._filter import innovations as innovations
from ._force_map import estimate_force_map as estimate_force_map
from ._latent import Latent as Latent
from ._latent import latent_force as latent_force
from ._motion import Motion as Motion
from ._motion import estimate_motion as estimate_motion
from ._restoring_force import RestoringForce as RestoringForce
from ._restoring_force import restoring_force as restoring_force

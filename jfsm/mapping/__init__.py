"""Maps of a force over the state of its link, from a record: no model is judged."""

from .map_force import MappedForce as MappedForce
from .map_force import map_force as map_force

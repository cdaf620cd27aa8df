"""What it does: structures lowered to arrays, and their free runs."""

from ._drive import Reconstruction as Reconstruction
from ._plant import lower as lower
from ._simulate import Response as Response
from ._simulate import simulate as simulate

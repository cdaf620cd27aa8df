"""A structure as the text of other programs: its equation of motion in Python and in MATLAB, its forces as a table."""

from .equations import Equations as Equations
from .equations import equations_of as equations_of
from .files import exported as exported
from .files import function_name as function_name
from .matlab import matlab_text as matlab_text
from .python import python_text as python_text
from .table import ForceTable as ForceTable
from .table import table_of as table_of

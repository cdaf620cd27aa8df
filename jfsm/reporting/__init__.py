"""What is shown: terminal text, pictures and pages, from plain dictionaries such as ``Diagnosis.to_json`` writes."""

from ._checks import stopping_line as stopping_line
from ._files import write_atomically as write_atomically
from ._files import write_text_atomically as write_text_atomically
from ._force_map_page import force_map_pictures as force_map_pictures
from ._force_map_page import print_force_map as print_force_map
from ._force_map_page import render_force_map as render_force_map
from ._inspection_page import render_inspection as render_inspection
from ._inspection_pictures import inspection_pictures as inspection_pictures
from ._page import render_page as render_page
from ._page_again import read_diagnosis as read_diagnosis
from ._page_again import render_json as render_json
from ._pictures import pictures as pictures
from ._pictures import plot_diagnosis as plot_diagnosis
from ._progress import bar as bar
from ._progress import shown_by_default as shown_by_default
from ._progress import stages as stages
from ._sketch import Picture as Picture
from ._text import diagnosis_text as diagnosis_text
from ._text import inspection_text as inspection_text
from ._text import print_diagnosis as print_diagnosis
from ._text import print_inspection as print_inspection
from ._why import print_why as print_why
from ._why import why_text as why_text
from ._wording import capitalised as capitalised
from ._wording import cause_name as cause_name
from ._wording import place_name as place_name

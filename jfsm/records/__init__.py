"""What was measured: records, their files, their units and their noise."""

from jfsm.records._advance import advanced as advanced
from jfsm.records._combine import align as align
from jfsm.records._combine import join as join
from jfsm.records._declip import declipped as declipped
from jfsm.records._defects import bridged as bridged
from jfsm.records._defects import clipped as clipped
from jfsm.records._defects import defects as defects
from jfsm.records._defects import spikes as spikes
from jfsm.records._noise_floor import NoiseFloor as NoiseFloor
from jfsm.records._noise_floor import noise_floor as noise_floor
from jfsm.records._quantisation import quantisation_step as quantisation_step
from jfsm.records._read import read as read
from jfsm.records._record import Record as Record
from jfsm.records._rolloff import rolloff as rolloff
from jfsm.records._silence import silent_forces as silent_forces
from jfsm.records._tones import tones as tones

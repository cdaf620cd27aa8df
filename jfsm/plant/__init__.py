"""What moves: a structure lowered to arrays, its forces, its step, and the drive of a run.

`lower` makes a `Plant` of a structure, `observation_of` the response channels of its state, `excitation` the
`InterpolatedInput` of a record, and `starting_state` its initial state. `run_grid` integrates the motion; the functions
of one step and one sample serve filters. `imposed_motion` and `force_needed` are for records whose motion is imposed,
`force_along` and `forces_of_law` for forces along a known motion.
"""

from ._along import HIDDEN_SUBSTEPS as HIDDEN_SUBSTEPS
from ._along import force_along as force_along
from ._drive import Reconstruction as Reconstruction
from ._excitation import Swing as Swing
from ._excitation import bucket as bucket
from ._excitation import excitation as excitation
from ._excitation import fastest_mode as fastest_mode
from ._excitation import force_limits as force_limits
from ._excitation import measured_force as measured_force
from ._excitation import probes as probes
from ._excitation import relaxed_jacobian as relaxed_jacobian
from ._excitation import substeps_for as substeps_for
from ._excitation import typical_size as typical_size
from ._forces import carried as carried
from ._forces import friction_limits as friction_limits
from ._forces import hidden_rate as hidden_rate
from ._forces import hidden_start as hidden_start
from ._forces import settle as settle
from ._forces import smooth_force as smooth_force
from ._grid import DelayBuffer as DelayBuffer
from ._grid import InterpolatedInput as InterpolatedInput
from ._grid import advance_sample as advance_sample
from ._grid import begin as begin
from ._grid import cubic_weights as cubic_weights
from ._grid import drive_before as drive_before
from ._grid import free_run as free_run
from ._grid import load_of as load_of
from ._grid import push as push
from ._grid import run_again as run_again
from ._grid import run_grid as run_grid
from ._grid import run_strided as run_strided
from ._grid import shifted as shifted
from ._grid import true_force as true_force
from ._grid import undelayed as undelayed
from ._imposed import Imposed as Imposed
from ._imposed import Path as Path
from ._imposed import imposed_motion as imposed_motion
from ._imposed import imposed_substeps as imposed_substeps
from ._imposed import noise_of as noise_of
from ._kernel import as_one_kernel as as_one_kernel
from ._kernel import jit_with_kernels as jit_with_kernels
from ._law_along import force_at as force_at
from ._law_along import forces_of_law as forces_of_law
from ._needed import force_needed as force_needed
from ._needed import needed as needed
from ._own_motion import linear_part as linear_part
from ._own_motion import own_force as own_force
from ._pair import check_pair as check_pair
from ._plant import Channel as Channel
from ._plant import Grid as Grid
from ._plant import Observation as Observation
from ._plant import Plant as Plant
from ._plant import alone as alone
from ._plant import direction as direction
from ._plant import hidden_width as hidden_width
from ._plant import laws_of as laws_of
from ._plant import lower as lower
from ._plant import numbers_of as numbers_of
from ._plant import observation_of as observation_of
from ._plant import state_matrix as state_matrix
from ._start import starting_state as starting_state
from ._stepper import Load as Load
from ._stepper import Motion as Motion
from ._stepper import acceleration as acceleration
from ._stepper import any_ended as any_ended
from ._stepper import free_acceleration as free_acceleration
from ._stepper import holding_force as holding_force
from ._stepper import in_mode as in_mode
from ._stepper import inverse_mass as inverse_mass
from ._stepper import inverse_mass_at as inverse_mass_at
from ._stepper import linearised as linearised
from ._stepper import mode_at as mode_at
from ._stepper import stopping as stopping
from ._stepper import through_events as through_events
from ._stepper import times as times
from ._stepper import with_friction as with_friction

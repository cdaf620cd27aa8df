"""Models of MuJoCo: joints on hinges and slides as a `Simulation`, and what was found written back to the model.

What sticks or can be wrong in a joint becomes a term: dry friction, which MuJoCo itself only makes softly, dashpots and
springs. The rest, with the inertias and gravity, is asked of MuJoCo at every state.
"""

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from threading import local
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float

from ..structures import AbstractTerm, Coulomb, LinearDamping, LinearStiffness, Simulation, Structure

_LOCKED = 1e9
"""Inertia of joints that are held, as a multiple of the largest of the others."""
_UNSTATED, _UNCERTAIN = 1e-4, 5.0
"""An armature that a model does not state, as a share of the inertia of its joint, and how uncertain it is;"""
_WORTH = 1e-3
"""and the share from which it is written."""
_ATTRIBUTES = {"coulomb": "frictionloss", "damping": "damping", "stiffness": "stiffness"}
"""What a term in a joint is called in a model, by its kind."""


class _Loop(NamedTuple):
    """A position actuator of a joint, by its number: force per command, and its spring and dashpot in the joint."""

    actuator: int
    gain: float
    stiffness: float
    damping: float


class _Joint(NamedTuple):
    """A joint that moves: its name, and where its coordinate and its velocity stand."""

    name: str
    index: int
    position: int
    velocity: int


@dataclass(frozen=True)
class Written:
    """A model with what was found.

    Attributes
    ----------
    xml : str
        The model.
    changes : str
        The lines that differ, before and after.
    left : tuple of str
        Terms that no attribute of a joint stands for, in words.
    """

    xml: str
    changes: str
    left: tuple[str, ...]


def simulation(
    model: Any,
    joints: Sequence[str] | None = None,
    trust: Mapping[str, float] | None = None,
    *,
    commanded: bool = False,
) -> Simulation:
    """A model of MuJoCo, its joints as coordinates.

    A record holds the forces in the joints (N m, or N in slides), measured or commanded, and their positions (rad, or
    m): channel 1 is the first joint. Contacts, limits and equality constraints take no part; nor do actuators, unless
    their commands drive.

    Parameters
    ----------
    model : path, str or mujoco.MjModel
        File of a model, its text, or a compiled one; it is left as it is.
    joints : sequence of str, optional
        Names of the joints that move, in the order of the record's channels; the others stay where the model has them.
        By default all.
    trust : mapping of path to float, optional
        Relative uncertainty of own values, as of a `Structure`.
    commanded : bool
        Whether the model's position actuators hold its joints. The forces of a record are then what
        `forces_of_commands` makes of their commands.

    Returns
    -------
    Simulation
        With a Coulomb term for each joint's `frictionloss`, a dashpot for its `damping` and a spring for its
        `stiffness`; its `armature` is a number of the function, ``armature_<joint>``. One that the model does not state
        begins at next to nothing, and may become anything. The loop of an actuator is one more spring and dashpot; see
        `Structure.commanded`.

    Raises
    ------
    ImportError
        If MuJoCo is not installed.
    ValueError
        If a joint is not there, is no hinge or slide, or equality constraints tie the joints; if they are commanded and
        a joint has no position actuator, or several.

    Examples
    --------
    >>> model = jfsm.adapters.mujoco.simulation("arm.xml", joints=["shoulder", "elbow"])
    >>> d = jfsm.diagnose(record, model)
    >>> print(jfsm.adapters.mujoco.written("arm.xml", d.extended, ["shoulder", "elbow"]).changes)
    """
    mj = _package()
    compiled = _compiled(mj, model)
    moving = _joints(mj, compiled, joints)
    if compiled.neq:
        raise ValueError(
            f"`model` must have no equality constraints, whose forces would be no function of the state; it has "
            f"{compiled.neq}. Write their joints as one, or leave them out."
        )
    asked = _Accelerations(_bare(mj, compiled, moving), moving)
    stated = {_armature(joint): float(compiled.dof_armature[joint.velocity]) for joint in moving}
    least = dict(zip(stated, _UNSTATED * _inertias(asked, stated), strict=True))
    numbers = {name: value or float(least[name]) for name, value in stated.items()}
    believed = {name: _UNCERTAIN for name, value in stated.items() if not value} | dict(trust or {})
    found = Simulation.from_accelerations(asked, len(moving), numbers, _terms(compiled, moving), trust=believed)
    for number, loop in enumerate(_loops(mj, compiled, moving) if commanded else (), 1):
        found = found.commanded(number, loop.stiffness, loop.damping)
    return found


def forces_of_commands(
    model: Any, commands: Float[ArrayLike, "n joints"], joints: Sequence[str] | None = None
) -> Float[np.ndarray, "n joints"]:
    """The forces (n, joints) of a record whose joints are held by a model's position actuators: what the actuators make
    of their commands (n, joints) where the joints are at zero.

    Parameters
    ----------
    model, joints
        As of `simulation`.
    commands : (n, joints) array
        Positions that were commanded (rad, or m), one column for each joint.

    Raises
    ------
    ImportError, ValueError
        As `simulation`; or if the commands are not one column for each joint.

    Examples
    --------
    >>> force = jfsm.adapters.mujoco.forces_of_commands("arm.xml", wanted)
    >>> record = jfsm.Record(t, force=force, displacement=angles, units={"displacement": "rad"})
    >>> d = jfsm.diagnose(record, jfsm.adapters.mujoco.simulation("arm.xml", commanded=True))
    """
    mj = _package()
    compiled = _compiled(mj, model)
    loops, given = _loops(mj, compiled, _joints(mj, compiled, joints)), np.asarray(commands, dtype=float)
    if given.ndim != 2 or given.shape[1] != len(loops):
        raise ValueError(f"`commands` must have a column for each of {len(loops)} joints; got shape {given.shape}.")
    return given * np.array([loop.gain for loop in loops])


def written(model: Any, found: Structure, joints: Sequence[str] | None = None) -> Written:
    """The model with the values and terms of a structure that was made of it, say `Diagnosis.extended`.

    Friction, dashpots and springs of joints, and armatures, become attributes; whatever else there is stands in
    `Written.left`.

    Parameters
    ----------
    model : path or str
        File of the model, or its text; nothing is written to it.
    found : Structure
    joints : sequence of str, optional
        As of `simulation`.

    Raises
    ------
    ImportError, ValueError
        As `simulation`.
    """
    mj = _package()
    compiled = _compiled(mj, model)
    moving = _joints(mj, compiled, joints)
    changed = mj.MjSpec.from_string(model if _is_text(model) else Path(model).read_text(encoding="utf-8"))
    before = changed.to_xml()
    left, values = list[str](), dict[tuple[str, str], float]()
    loops = _loops(mj, compiled, moving) if found.commands else []
    held = [_loop_of(found, number) for number, _ in enumerate(loops, 1)]
    for loop, terms in zip(loops, held, strict=True):
        _tune(changed.actuators[loop.actuator], float(compiled.actuator_gear[loop.actuator, 0]), terms)
    for term in found.terms:
        if any(term is one for terms in held for one in terms):
            continue
        attribute = _ATTRIBUTES.get(term.kind) if min(term.at) == 0 else None
        if attribute is None:
            left.append(f"{term.kind} at {term.place}")
            continue
        key = moving[max(term.at) - 1].name, attribute
        values[key] = values.get(key, 0.0) + float(term.values[0])
    own = dict(zip(found.own.names if found.own else (), np.asarray(found.own_numbers).tolist(), strict=True))
    for joint, inertia in zip(moving, np.diag(np.asarray(found.mass)), strict=True):
        there = own.get(_armature(joint), 0.0)
        if compiled.dof_armature[joint.velocity] or there > _WORTH * inertia:
            values[joint.name, "armature"] = there
    for (name, attribute), value in values.items():
        _set(changed.joint(name), attribute, value)
    after = changed.to_xml()
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), "given", "found", lineterm="", n=0)
    return Written(after, "\n".join(lines), tuple(left))


class _Accelerations:
    """Accelerations of the joints that move, in many states at once, whose own memory is that of a thread."""

    def __init__(self, model: Any, joints: Sequence[_Joint]):
        self._model, self._joints, self._threads = model, joints, local()

    def __reduce__(self) -> tuple[Any, ...]:
        return _Accelerations, (self._model, self._joints)

    def __call__(
        self,
        q: Float[np.ndarray, "n dof"],
        v: Float[np.ndarray, "n dof"],
        force: Float[np.ndarray, "n dof"],
        t: Float[np.ndarray, " n"],
        p: Mapping[str, float],
    ) -> Float[np.ndarray, "n dof"]:
        mj = _package()
        if not hasattr(self._threads, "data"):
            self._threads.model = copy(self._model)
            self._threads.data = mj.MjData(self._threads.model)
        model, data = self._threads.model, self._threads.data
        for joint in self._joints:
            model.dof_armature[joint.velocity] = p[_armature(joint)]
        positions = [joint.position for joint in self._joints]
        velocities = [joint.velocity for joint in self._joints]
        whole, nothing = mj.mjtStage.mjSTAGE_NONE, 1
        position, speed, applied, moved = data.qpos, data.qvel, data.qfrc_applied, data.qacc  # views, made once
        found = np.empty(q.shape)
        for k in range(len(q)):
            position[positions], speed[velocities], applied[velocities] = q[k], v[k], force[k]
            mj.mj_forwardSkip(model, data, whole, nothing)
            found[k] = moved[velocities]
        return found


def _package() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise ImportError("MuJoCo is needed to read its models: pip install jfsm[mujoco]") from error
    return mujoco


def _is_text(model: Any) -> bool:
    """Whether a model is given as its text, not as its file."""
    return isinstance(model, str) and "<mujoco" in model


def _compiled(mj: Any, model: Any) -> Any:
    """A compiled model, the user's own or one of a file or a text."""
    if isinstance(model, mj.MjModel):
        return model
    if _is_text(model):
        return mj.MjModel.from_xml_string(model)
    if not Path(model).is_file():
        raise ValueError(f"`model` must be the file of a model of MuJoCo, its text or an MjModel; there is no {model}.")
    return mj.MjModel.from_xml_path(str(model))


def _joints(mj: Any, model: Any, names: Sequence[str] | None) -> list[_Joint]:
    """The joints that move, in the order of their channels."""
    every = [mj.mj_id2name(model, mj.mjtObj.mjOBJ_JOINT, i) or f"joint_{i + 1}" for i in range(model.njnt)]
    missing = [name for name in names or () if name not in every]
    if missing:
        raise ValueError(f"`joints` must name joints of the model, {', '.join(every)}; got {missing[0]!r}.")
    straight = (int(mj.mjtJoint.mjJNT_HINGE), int(mj.mjtJoint.mjJNT_SLIDE))
    found = []
    for name in names or every:
        i = every.index(name)
        if int(model.jnt_type[i]) not in straight:
            raise ValueError(
                f"`joints` must be hinges and slides; {name} is a ball or a free joint. Name the others, and it stays "
                "where the model has it."
            )
        found.append(_Joint(name, i, int(model.jnt_qposadr[i]), int(model.jnt_dofadr[i])))
    if not found:
        raise ValueError("`model` must have a joint that moves; it has none.")
    return found


def _terms(model: Any, joints: Sequence[_Joint]) -> Iterator[AbstractTerm]:
    """What a model states of its joints that may be wrong."""
    for number, joint in enumerate(joints, 1):
        friction, damping = model.dof_frictionloss[joint.velocity], model.dof_damping[joint.velocity]
        if friction > 0:
            yield Coulomb(float(friction), at=(0, number))
        if damping > 0:
            yield LinearDamping(float(damping), at=(0, number))
        if _has_spring(model, joint):
            yield LinearStiffness(float(model.jnt_stiffness[joint.index]), at=(0, number))


def _loops(mj: Any, model: Any, joints: Sequence[_Joint]) -> list[_Loop]:
    """The position actuators of the joints."""
    affine, on_joint = int(mj.mjtBias.mjBIAS_AFFINE), int(mj.mjtTrn.mjTRN_JOINT)
    loops = []
    for joint in joints:
        mine = [
            i
            for i in range(model.nu)
            if (int(model.actuator_trntype[i]), int(model.actuator_trnid[i, 0])) == (on_joint, joint.index)
        ]
        if len(mine) != 1 or int(model.actuator_biastype[mine[0]]) != affine or model.actuator_biasprm[mine[0], 1] >= 0:
            raise ValueError(
                f"`model` must have one position actuator in each joint that is commanded; {joint.name} has "
                f"{len(mine)} actuators, of this kind or others. Name the joints that have one in `joints`."
            )
        [i] = mine
        gear = float(model.actuator_gear[i, 0])
        spring, dashpot = (-float(model.actuator_biasprm[i, k]) * gear**2 for k in (1, 2))
        loops.append(_Loop(i, gear * float(model.actuator_gainprm[i, 0]), spring, dashpot))
    return loops


def _has_spring(model: Any, joint: _Joint) -> bool:
    """Whether a joint has a spring that is at rest in its zero; another one is left to MuJoCo."""
    return model.jnt_stiffness[joint.index] > 0 and model.qpos_spring[joint.position] == 0


def _bare(mj: Any, model: Any, joints: Sequence[_Joint]) -> Any:
    """The model without what its terms stand for, and without all that is no function of its state."""
    bare, moving = copy(model), [joint.velocity for joint in joints]
    disable = mj.mjtDisableBit
    bare.opt.disableflags |= int(disable.mjDSBL_CONSTRAINT) | int(disable.mjDSBL_ACTUATION)
    bare.dof_damping[moving] = 0.0
    for joint in joints:
        if _has_spring(model, joint):
            bare.jnt_stiffness[joint.index] = 0.0
    held = [i for i in range(model.nv) if i not in moving]
    bare.dof_armature[held] = _LOCKED * max(1.0, float(np.max(model.body_inertia)), float(np.max(model.body_mass)))
    return bare


def _armature(joint: _Joint) -> str:
    """What the armature of a joint is called among the numbers of the function."""
    return "armature_" + re.sub(r"\W", "_", joint.name)


def _inertias(asked: _Accelerations, numbers: Mapping[str, float]) -> Float[np.ndarray, " dof"]:
    """Inertia of every joint at rest, the others moving freely."""
    dof = len(numbers)
    pushes, rest = np.concatenate([np.zeros((1, dof)), np.eye(dof)]), np.zeros((dof + 1, dof))
    a = asked(rest, rest, pushes, np.zeros(dof + 1), numbers)
    return 1.0 / np.diag(a[1:] - a[0])


def _loop_of(found: Structure, number: int) -> list[AbstractTerm]:
    """Spring and dashpot of the loop that holds a joint: the last of their kind that the simulation had there."""
    mine = [term for term in found.terms if term.at == (0, number)]
    kinds = [[term for term in mine if isinstance(term, kind)] for kind in (LinearStiffness, LinearDamping)]
    return [terms[-1] for terms in kinds if terms]


def _tune(actuator: Any, gear: float, terms: Sequence[AbstractTerm]) -> None:
    """Give an actuator the spring and the dashpot that its loop was found to have."""
    bias = np.array(actuator.biasprm)
    for term in terms:
        bias[1 if isinstance(term, LinearStiffness) else 2] = -float(term.values[0]) / gear**2
    actuator.biasprm = bias


def _set(joint: Any, attribute: str, value: float) -> None:
    """An attribute of a joint, of which some versions keep further coefficients behind the first."""
    old = getattr(joint, attribute)
    if np.ndim(old):
        new = np.array(old)
        new[0] = value
        setattr(joint, attribute, new)
    else:
        setattr(joint, attribute, value)

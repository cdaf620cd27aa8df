"""From a record and a model to a verdict."""

import secrets
from collections.abc import Sequence
from dataclasses import replace

import jax

from .._limit import Limit, ended_by_interrupt
from .._programs import programs_kept
from .._threads import small_matrices
from .._types import require_x64
from ..plant import Reconstruction
from ..records import Record, check_together, records_of
from ..reporting import shown_by_default
from ..structures import MODEL, CauseLike, Runs, Structure, check_order, check_places, check_terms, remedy
from ._arguments import check_holdout, check_settings
from ._conduct import conduct
from ._diagnosis import Diagnosis
from ._provenance import plain_settings, provenance
from ._stand_in import departure, driven_alike, stand_in
from .evidence.box_runs import Box
from .search.steps import Progress, Steps


@programs_kept()
@small_matrices()
def diagnose(
    record: Record | Sequence[Record],
    model: Structure | Runs | None = None,
    holdout: float | Record | Sequence[Record] | None = 0.3,
    causes: Sequence[CauseLike] | None = None,
    max_causes: int = 2,
    key: jax.Array | None = None,
    *,
    since: float | None = None,
    until: float | None = None,
    places: Sequence[tuple[int, int]] | None = None,
    reconstruction: Reconstruction | None = None,
    simulated: Record | Sequence[Record] | None = None,
    time_limit: float | None = None,
    progress: Progress | bool | None = None,
) -> Diagnosis:
    """What `model` gets wrong about `record`, the name of the cause, and the gain of mending it.

    Where the motion is imposed (``drive="motion"``) it is judged by the force that was measured. Of the sensors' faults
    only a late force is looked for then: a gain of the force is that of all own values. A response channel that is late
    by less than a sample is no finding: it is put in time, and the verdict is that of the rest. A force that is late,
    or held between its samples, is a finding where that changes a run of `model` as given.

    Before anything is fitted the records are looked at. Torn and hung samples take no part, and neither does rest, and
    notes say so. A force or an acceleration of the wrong sign is a cause; it is turned, and the verdict on the rest
    follows. A dead channel, a displacement or a velocity of the wrong sign, and a size that is off by a factor between
    units are refused.

    Parameters
    ----------
    record : Record or sequence of them
        One verdict that must hold on all.
    model : Structure or Simulation.from_runs(...), optional
        The simulation that its owner believes in. Its own values are refitted within its trust (`Structure.uncertain`).
        One that can only be run is run under what drives every record, and a structure found that stands for it; what
        is found is then run in the simulation itself, where it takes the force, and the gain is its own.
    holdout : float, Record, sequence of Records, or None
        A share is the last part in time, unless what the model lacks shows only there: then it is the first. Where
        nothing drives the structure it is the last part of what is more than noise, run from the release; where it is
        driven and hardly moves in the end, the last part of its way. Records are never fitted; None decides on the
        whole record and gives no gain.
    causes : sequence of ids, causes, laws or sensor effects, optional
        What to look for; the whole catalogue by default. Wrong own values always. Of many laws, those are fitted that
        explain most of the force that the model lacks. A law is a class, one of your own too, or an object, which is
        looked for at its place alone, and from its numbers as well: ``["coulomb", TanhSpring]``.
    max_causes : int
        Effects that may act at once, at most. Two are looked for where any single one leaves more than noise; more than
        two are not.
    key : jax.random.key, optional
        Source of the few draws (the floor of the gain); made at the call when None.
    since, until : float, optional
        Instants [s] of the records' own clocks between which they are used, held-out ones aside.
    places : sequence of links, optional
        Where laws and loads are tried; by default laws on the model's links, loads on every mass.
    reconstruction : "band-limited", "linear" or "hold", optional
        The force between its samples. By default band-limited, as whatever was filtered before it was sampled, unless
        another one turns out far likelier.
    simulated : Record or sequence of Records, optional
        Runs of a simulation of which there is nothing but the output: the motion under the record's force, on its
        clock, or under any other force that they hold as well. A structure that follows them stands for the simulation.
        `model` need not be given then; if it is, it says which masses and links the simulation has, and its values need
        not be right.
    time_limit : float, optional
        Seconds after which the best verdict so far is given, marked as unfinished. The first interrupt (Ctrl-C) does
        the same; a second one stops everything.
    progress : callable or bool, optional
        Told of every step: what, steps done, steps in all. By default a bar shows them on a terminal and in a notebook,
        and nothing elsewhere; False shows nothing.

    Returns
    -------
    Diagnosis
        Half as sure of a cause where it is not `finished`, and undecided without one.

    Raises
    ------
    ValueError
        If the record cannot be used, does not fit the model, or an argument is out of its range; a look before the
        first fit may refuse it.
    KeyboardInterrupt
        If it is interrupted before the model itself was fitted, or for the second time.

    Notes
    -----
    Most of the time of a first diagnosis is compilation. Programs are therefore kept on disk, up to 500 MB in the
    user's cache folder, or in the folder that ``jax_compilation_cache_dir`` names; none are if JAX is told so
    (``jax.config.update("jax_enable_compilation_cache", False)``).

    ``d.data["provenance"]`` and the page say what the diagnosis was made of: digests of the records and of the model,
    settings, key, version and machine. `verify` makes it again from these.
    """
    require_x64()
    check_order("jfsm.diagnose(record, model)", model, record)
    check_settings(causes, max_causes, key, reconstruction, time_limit, progress)
    limit = Limit(time_limit)
    whole = records_of(record)
    records = [part.between(since, until) for part in whole]
    check_together(records)
    check_holdout(records, holdout)
    key = jax.random.key(secrets.randbits(32)) if key is None else key
    runs = _runs(whole, model, simulated)
    if isinstance(model, Structure):
        check_places(places, model.dof)
        check_terms(model)
    believed, box = model, None
    with shown_by_default(progress) as told, ended_by_interrupt(limit):
        steps = Steps(told, 4 + bool(runs))
        if runs:
            steps.next("what the simulation does")
            tell = steps.of("what the simulation does")
            records, model, box = _standing_for(
                model, runs, whole, records, key, limit, lambda what, done, total: tell(what, total - done)
            )
        assert isinstance(model, Structure)
        d = conduct(records, model, holdout, causes, max_causes, key, places, reconstruction, limit, steps, box)
        steps.end()
    settings = plain_settings(
        holdout=holdout, causes=causes, max_causes=max_causes, since=since, until=until, places=places,
        reconstruction=reconstruction, time_limit=time_limit,
    )  # fmt: skip
    made = provenance(whole, believed, key, settings, holdout=holdout, simulated=simulated)
    return replace(d, told={**d.told, "provenance": made})


def _standing_for(
    model: Structure | Runs | None,
    runs: Sequence[Record],
    whole: Sequence[Record],
    records: Sequence[Record],
    key: jax.Array,
    limit: Limit,
    tell: Progress,
) -> tuple[list[Record], Structure, Box | None]:
    """The records with what is said of the simulation, what stands for it, and itself if it can be run."""
    found = stand_in(runs, model.form if isinstance(model, Runs) else model, key, limit, tell)
    said = [found.words, *filter(None, map(departure, runs, whole))]
    if isinstance(model, Runs):
        box = Box(model, found.structure, found.drive, whole)
        said += [note for run in runs for note in run.notes]
    else:
        box = None
        said.append("Gains, too, are those of this structure.")
    return [part.noted(*said) for part in records], found.structure, box


def _runs(
    records: Sequence[Record], model: Structure | Runs | None, simulated: Record | Sequence[Record] | None
) -> list[Record]:
    """Runs of the simulation where nothing else is known of it, with what drove them; none where it is a structure.

    Raises
    ------
    TypeError, ValueError
        If the model is none, or there is neither a model nor a run.
    """
    if isinstance(model, Runs):
        if simulated is not None:
            raise ValueError("`simulated` must be left out where `model` makes runs itself.")
        return [driven_alike(model.tried_on(record), record) for record in records]
    if model is not None and not isinstance(model, Structure):
        raise TypeError(f"`model` must be {MODEL}; got {model!r}.{remedy(model)}")
    if simulated is not None:
        runs = records_of(simulated, "simulated")
        return [driven_alike(run, records[min(i, len(records) - 1)]) for i, run in enumerate(runs)]
    if model is None:
        raise ValueError(
            "`model` must be the simulation that you believe in, such as jfsm.Structure.sdof(1.0, 9.0, 0.1); where you "
            "have nothing but its output, give that: simulated=run."
        )
    return []

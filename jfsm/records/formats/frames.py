"""Tables and labelled arrays in memory: pandas, polars, pyarrow and xarray, told by their classes; none is needed."""

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import Contents, Lazy
from jfsm.records.formats.headings import are_units, headings_of
from jfsm.records.formats.numbers import decimal_mark, is_gap, is_number, number

CLOCK = "time"  # what an index or a coordinate that holds instants is called if it has no name


@dataclass(frozen=True)
class _Table:
    """Columns side by side, as each library gives them.

    Attributes
    ----------
    headings : sequence of rows
        Headings as rows above the table; the last may be units.
    column : function
        The column at a place, from 0.
    units : mapping
        What the table says of units, by the heading of a column.
    instants : set of int
        Places of columns that are the clock by what they are.
    """

    headings: Sequence[Sequence[str]]
    column: Callable[[int], NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    instants: frozenset[int] = frozenset()
    notes: tuple[str, ...] = ()


def is_frame(thing: Any) -> bool:
    """Whether a thing is a table or a labelled array that `contents_of_frame` reads."""
    return _reader(thing) is not None


def contents_of_frame(frame: Any) -> Contents:
    """What a table or a labelled array holds.

    Raises
    ------
    TypeError
        If it is of none of the kinds that are read.
    """
    reader = _reader(frame)
    if reader is None:
        raise TypeError(
            f"`frame` must be a DataFrame or Series of pandas, a DataFrame of polars, a Table of pyarrow, or a Dataset "
            f"or DataArray of xarray; it was {type(frame).__name__}. For arrays: jfsm.Record(time, force=...)."
        )
    return reader(frame)


def frame_of(contents: Contents) -> Any:
    """The contents of a record as a DataFrame of pandas over its instants.

    Raises
    ------
    ModuleNotFoundError
        If pandas is not installed.
    """
    try:
        pandas = importlib.import_module("pandas")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "A DataFrame is made by the package pandas, which is not installed. Run `pip install pandas`."
        ) from error
    columns = {name: np.array(array) for name, array in contents.arrays.items() if name != CLOCK}
    frame = pandas.DataFrame(columns, index=pandas.Index(np.array(contents.arrays[CLOCK]), name=CLOCK))
    frame.attrs["units"] = {name: unit for name, unit in contents.units.items() if name != CLOCK}
    return frame


def _reader(thing: Any) -> Callable[[Any], Contents] | None:
    kinds = ((each.__module__.partition(".")[0], each.__name__) for each in type(thing).__mro__)
    return next((_READERS[kind] for kind in kinds if kind in _READERS), None)


def _of_pandas(frame: Any) -> Contents:
    levels = [frame.index.get_level_values(level) for level in range(frame.index.nlevels)]
    kept = [level for level in levels if not _numbers_rows(level)]
    names = [str(level.name) if level.name is not None else CLOCK for level in kept]
    columns = [*kept, *(frame.iloc[:, place] for place in range(frame.shape[1]))]

    def column(place: int) -> NDArray[Any]:
        values = columns[place]
        if getattr(values.dtype, "tz", None) is not None:
            values = values.tz_convert(None) if place < len(kept) else values.dt.tz_convert(None)
        if values.isna().any() and getattr(values.dtype, "kind", "O") in "iub":
            return values.to_numpy(dtype=float, na_value=np.nan)  # whole numbers and missing ones, side by side
        found = values.to_numpy()
        return found.astype(float) if getattr(values.dtype, "kind", "O") == "f" else found

    instants = {
        place
        for place, level in enumerate(kept)
        if level.dtype.kind in "mM" or getattr(level.dtype, "tz", None) is not None or level.name is None
    }
    rows = [[*names, *row] for row in _rows_of_headings(frame.columns)]
    stated = dict(frame.attrs.get("units", {}))
    return _contents(_Table(rows, column, stated, frozenset(instants), tuple(_skipped_rows(levels))))


def _numbers_rows(level: Any) -> bool:
    """Whether an index says no more than which row this is."""
    return level.name is None and level.dtype.kind in "iuO"


def _skipped_rows(levels: Iterable[Any]) -> Iterable[str]:
    for level in levels:
        steps = np.diff(level.to_numpy()) if _numbers_rows(level) and level.dtype.kind in "iu" else np.empty(0)
        if steps.size and np.any(steps != steps[0]):
            place = int(np.flatnonzero(steps != steps[0])[0])
            yield (
                f"The index numbers the rows and goes from {level[place]} to {level[place + 1]}: rows were left out "
                f"there, or it is not in order. A rate counts the rows that are left."
            )


def _rows_of_headings(columns: Any) -> list[list[str]]:
    """The headings as rows: names, and units below them; other levels are joined by slashes."""
    rows = [
        ["" if str(text).startswith("Unnamed: ") else str(text) for text in columns.get_level_values(level)]
        for level in range(columns.nlevels)
    ]
    units = rows[-1:] if len(rows) > 1 and are_units(rows[-1]) else []
    names = rows[:-1] if units else rows
    return [["/".join(filter(None, parts)) for parts in zip(*names, strict=True)], *units]


def _of_series(series: Any) -> Contents:
    return _of_pandas(series.to_frame(series.name if series.name is not None else "column 1"))


def _of_polars(frame: Any) -> Contents:
    def column(place: int) -> NDArray[Any]:
        values = frame.to_series(place)
        return (values.cast(float) if values.dtype.is_decimal() else values).to_numpy()

    return _contents(_Table([list(frame.columns)], column))


def _of_lazy_polars(frame: Any) -> Contents:
    return _of_polars(frame.collect())


def _of_arrow(table: Any) -> Contents:
    return _contents(_Table([list(table.column_names)], lambda place: table.column(place).to_numpy()))


def _contents(table: _Table) -> Contents:
    headings = headings_of(table.headings, len(table.headings[0]))
    places = {name: place for place, name in enumerate(headings.names)}
    _, texts, neither = _sorted(places, table.column)
    first = {name: str(table.column(places[name])[0]).strip() for name in texts}
    of_numbers = [name for name in texts if _are_numbers(table.column(places[name])[1:])]
    below = bool(of_numbers) and are_units([first[name] for name in of_numbers])  # a row of units under the headings
    as_text = [name for name in of_numbers if below or is_number(first[name])]
    texts = [name for name in texts if name not in as_text]
    rows = slice(1, None) if below else slice(None)
    aliases = dict(headings.aliases)
    for name in (name for name, place in places.items() if place in table.instants and name != CLOCK):
        aliases[CLOCK] = (name,) if CLOCK not in places else aliases.get(CLOCK, ())
    stated = {
        name: str(table.units[text])
        for name in places
        for text in (name, table.headings[0][places[name]])
        if text in table.units
    }

    if below:
        stated = {**{name: first[name].strip("[](){}<> ") for name in as_text if first[name]}, **stated}

    def column(name: str) -> NDArray[Any]:
        if name in texts:
            raise ValueError(
                f"The column {name!r} must hold numbers to be a channel; it holds text. Convert it, or name another."
            )
        values = table.column(places[name])[rows]
        return _read(values, name) if name in as_text else as_numbers(values)

    left_out = (f"Neither numbers nor text, and left out: {', '.join(neither[:6])}.",) if neither else ()
    converted = f"Numbers are kept as text in {', '.join(map(repr, as_text))}; they are read as numbers."
    return Contents(
        Lazy([name for name in places if name not in neither], column),
        {**headings.units, **stated},
        notes=(*table.notes, *left_out, *headings.notes, *([converted] if as_text else [])),
        texts=Lazy(texts, lambda name: table.column(places[name])[rows].astype(str)),
        aliases=aliases,
    )


def _are_numbers(values: NDArray[Any]) -> bool:
    """Whether texts are numbers, as far as the first hundred tell."""
    return values.size > 0 and all(is_number(str(value)) or is_gap(str(value)) for value in values[:100])


def _read(values: NDArray[Any], name: str) -> NDArray[np.float64]:
    """The numbers that the texts of a column stand for."""
    fields = [str(value) for value in values]
    mark = decimal_mark(fields, ".")
    try:
        return np.array([number(field, mark) for field in fields])
    except ValueError as error:
        raise ValueError(
            f"The column {name!r} must hold numbers to be a channel; {error}. Mend it, or name another."
        ) from error


def as_numbers(values: NDArray[Any]) -> NDArray[Any]:
    """A column of objects that are numbers, or missing, as doubles; any other as it is."""
    if values.dtype.kind != "O" or not all(value is None or isinstance(value, Real) for value in values):
        return values
    return np.array([np.nan if value is None else float(value) for value in values])


def _sorted(places: Mapping[str, int], column: Callable[[int], NDArray[Any]]) -> tuple[list[str], list[str], list[str]]:
    """Names of columns of numbers, of text, and of anything else."""
    numbers, texts, neither = list[str](), list[str](), list[str]()
    for name, place in places.items():
        values = as_numbers(column(place))
        if values.dtype.kind in "iufbmM":
            numbers.append(name)
        elif values.size and any(isinstance(value, str) or hasattr(value, "isoformat") for value in values):
            texts.append(name)
        else:
            neither.append(name)
    return numbers, texts, neither


def _of_dataset(dataset: Any) -> Contents:
    """Variables over a dimension of time; where there are several such dimensions, as ``dimension/variable``."""
    held = {str(name): variable for name, variable in dataset.data_vars.items() if variable.dtype.kind in "iufb"}
    along = {name: _dimension_of_time(variable) for name, variable in held.items()}
    shared = len(set(along.values())) == 1
    arrays: dict[str, Any] = {}
    aliases: dict[str, tuple[str, ...]] = {}
    for name, variable in held.items():
        dimension = along[name]
        around = "" if shared or not dimension else f"{dimension}/"
        arrays |= _with_clock(variable, name, dimension, around)
        if around:
            aliases[name] = (around + name,)
    skipped = [str(name) for name in dataset.data_vars if str(name) not in held]
    return Contents(
        Lazy(arrays, lambda name: np.asarray(arrays[name].values)),
        {name: str(each.attrs["units"]) for name, each in arrays.items() if each.attrs.get("units")},
        notes=(f"Not numbers, and left out: {', '.join(skipped[:6])}.",) if skipped else (),
        aliases=aliases,
    )


def _with_clock(variable: Any, name: str, dimension: str, around: str) -> dict[str, Any]:
    """A variable with its samples first, behind the coordinate of its dimension, if it has one."""
    if not dimension:
        return {around + name: variable}
    clock = {around + CLOCK: variable.coords[dimension]} if dimension in variable.coords else {}
    return {**clock, around + name: variable.transpose(dimension, ...)}


def _dimension_of_time(variable: Any) -> str:
    """The dimension along which the samples lie: that of instants, or called time, else the longest; else empty."""
    dimensions = [str(dimension) for dimension in variable.dims]
    ranked = sorted(
        dimensions,
        key=lambda d: (
            not (d in variable.coords and variable.coords[d].dtype.kind in "mM"),
            d.lower() not in (CLOCK, "t"),
            -variable.sizes[d],
        ),
    )
    return ranked[0] if ranked else ""


def _of_data_array(array: Any) -> Contents:
    return _of_dataset(array.to_dataset(name=array.name if array.name is not None else "column 1"))


_READERS: dict[tuple[str, str], Callable[[Any], Contents]] = {
    ("pandas", "DataFrame"): _of_pandas,
    ("pandas", "Series"): _of_series,
    ("polars", "DataFrame"): _of_polars,
    ("polars", "LazyFrame"): _of_lazy_polars,
    ("pyarrow", "Table"): _of_arrow,
    ("xarray", "Dataset"): _of_dataset,
    ("xarray", "DataArray"): _of_data_array,
}

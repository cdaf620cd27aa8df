"""The outcome of a batch, as a value."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from .._files import parsed_json
from ..diagnosis import Diagnosis
from ..records import OutUnits, out_units
from ..reporting import print_batch, shown_in
from ._outcome import Row
from ._table import COLUMNS, lines_of


@dataclass(frozen=True)
class RecordResult:
    """What became of one record.

    Attributes
    ----------
    name, source : str
        What the record is called, and the file that it is in.
    verdict : str or None
        As `Diagnosis.verdict`; None where there is no diagnosis.
    findings : tuple of dict
        As `Diagnosis.findings`, as plain types.
    path, page : Path or None
        The files of the diagnosis, or of the reason why there is none.
    failure, message : str
        Why there is none, and in words: "unreadable", "refused", "internal" or "not done"; empty where there is one.
    finished : bool
        Whether everything was looked into.
    """

    name: str
    source: str
    verdict: str | None
    findings: tuple[dict[str, Any], ...]
    path: Path | None
    page: Path | None
    failure: str = ""
    message: str = ""
    finished: bool = True

    def load(self) -> Diagnosis:
        """The diagnosis.

        Raises
        ------
        ValueError
            If there is none.
        """
        if self.failure or self.path is None:
            raise ValueError(f"{self.name} has no diagnosis ({self.failure}): {self.message}")
        return Diagnosis.load(self.path)


@dataclass(frozen=True, repr=False)
class Batch:
    """What `diagnose_many` found, from the summary in its folder.

    ``batch["part1"]`` is the result of one record, which ``.load()`` makes a `Diagnosis` of.
    """

    folder: str
    data: dict[str, Any]
    """What ``summary.json`` holds."""

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """The batch whose folder this is.

        Raises
        ------
        OSError
            If there is no summary.
        ValueError
            If it is none.
        """
        path = Path(folder) / "summary.json"
        found = parsed_json(path.read_bytes())
        if not isinstance(found, dict) or "clusters" not in found:
            raise ValueError(f"{path} must be the summary of a batch; it is another file.")
        return cls(str(folder), found)

    @property
    def sentence(self) -> str:
        """The verdict on the kind in words: what its records have in common, how large, and which stand out."""
        return self.data["sentence"]

    @cached_property
    def results(self) -> tuple[RecordResult, ...]:
        """Of every record, in their order."""
        return tuple(self._result(row) for row in self.data["records"])

    @property
    def failures(self) -> tuple[RecordResult, ...]:
        """Of the records without a diagnosis."""
        return tuple(one for one in self.results if one.failure)

    @property
    def effects(self) -> Sequence[dict[str, Any]]:
        """What the records show: `cause`, `at`, `records`, and `sizes` with mean, spread between records, outliers."""
        return self.data["effects"]

    @property
    def clusters(self) -> Sequence[dict[str, Any]]:
        """Records of equal verdicts, the most first."""
        return self.data["clusters"]

    @property
    def changes(self) -> Sequence[dict[str, Any]]:
        """Records whose verdict differs from that of the last batch in the folder, with both."""
        return self.data["changes"]

    def __len__(self) -> int:
        return len(self.data["records"])

    def __getitem__(self, name: str) -> RecordResult:
        for one in self.results:
            if one.name == name:
                return one
        raise KeyError(f"There is no record {name!r} in this batch.")

    def __repr__(self) -> str:
        return f"<Batch of {len(self)} in {self.folder}: {self.sentence}>"

    def print(self, units: OutUnits = None) -> None:
        """The verdict on all, effects, clusters, failures and changes on the terminal; `units` as of a diagnosis."""
        with shown_in(out_units(units)):
            print_batch(self.data)

    def to_dataframe(self) -> Any:
        """A DataFrame of pandas, which must be installed: a line for every number of every finding, as ``summary.csv``.

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed.
        """
        import pandas

        return pandas.DataFrame(list(lines_of(self.data["records"])), columns=list(COLUMNS))

    def _result(self, row: Row) -> RecordResult:
        path, page = (None if row.get(name) is None else Path(self.folder) / row[name] for name in ("json", "page"))
        return RecordResult(
            row["name"], row["source"], row["verdict"], tuple(row["findings"]), path, page,
            row.get("kind") or "", row.get("message", ""), row.get("finished", True),
        )  # fmt: skip

"""The seam of analyses: a question, its table, its jobs, its solution record by record, its dataset."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.assembly.parts.reduced import Store, in_memory
from stickslip.study.analyses import ANALYSES
from stickslip.study.analyses.verdict import Verdict


@dataclass(frozen=True, eq=False)
class Case:
    """One member of the family that [vary] spans.

    Parameters
    ----------
    index
        Its position.
    label
        What is varied, as text; empty for a study without [vary].
    values
        Varied key -> its value here.
    settings
        Tables of the study with the varied keys in place: ``harmonics``, ``solver``, ``limits``, and one for each analysis
        asked for, by name.
    build
        Makes the model; called in the runner's process and only where a job is not sealed yet.
    digest
        Hash of all that the model depends on: its tables and the content of its files.
    home
        Folder that names of files are relative to.
    checks
        Further checks that this run asks for, of those that the analysis names in `Analysis.checks`.
    store
        Keeps what is expensive of the model: for `assemble`.
    digest_at_rest
        As `digest`, without harmonic loads and outputs.
    at
        Makes the model with another value of a key, picklable; None where no key can be changed.
    accepts
        Refuses a value of a key, without a model; None where only the model itself can tell.
    drive
        Harmonic forces over static ones: the more, the more contacts slip, and the longer a response takes.
    """

    index: int
    label: str
    values: Mapping[str, Any]
    settings: Any
    build: Callable[[], Model]
    digest: str
    home: Path
    checks: frozenset[str] = frozenset()
    store: Store = in_memory
    digest_at_rest: str = ""
    at: "Callable[[str, float], Model] | None" = None
    accepts: "Callable[[str, float], object] | None" = None
    drive: float = 0.0

    def as_text(self, *tables: str) -> str:
        """Return tables of the settings, by name, as a text that changes where they do."""
        own = (getattr(self.settings, name) for name in tables)
        return json.dumps([table.model_dump(mode="json") for table in own], sort_keys=True)


@dataclass(frozen=True, eq=False)
class Job:
    """One case of one analysis, picklable: solved anywhere, it appends records to its own journal and seals one file.

    Parameters
    ----------
    label
        What is said of it while it runs.
    inputs
        All that `Analysis.solve` needs; made by `Analysis.inputs`.
    """

    label: str
    inputs: Any


@dataclass(frozen=True, eq=False)
class Solved:
    """What a sealed job holds.

    Parameters
    ----------
    case
        The case.
    records
        In the order in which they came.
    notes
        Named arrays, numbers and texts that the job put down beside its records (`Notes.put`).
    """

    case: Case
    records: Sequence[Any]
    notes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


class Notes(Protocol):
    """Where a job puts down what is no record, and finds it after an interruption: the journal."""

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        """Store named arrays, numbers and texts."""
        ...

    def get(self, name: str) -> dict[str, Any] | None:
        """Return what was stored under `name`, or None."""
        ...

    def forget(self, name: str) -> None:
        """Remove what was stored under `name`."""
        ...


@dataclass(eq=False)
class Pieces:
    """Pieces of a long computation in the notes of a job, so that a stopped one goes on where it was.

    Parameters
    ----------
    notes
        Of the job.
    name
        What the names of the pieces begin with.
    seconds
        On the clock: pieces that are made faster are made again.
    places
        Of the pieces that are kept.
    taken
        Number of pieces that a stopped job had made.
    """

    notes: Notes
    name: str
    seconds: float = 0.5
    places: set[str] = field(default_factory=set)
    taken: int = 0

    def keep(self, content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return what `make` makes, or what it made before the job was stopped; `content` is all that this depends on."""
        place = f"{self.name} {sha256(content.encode()).hexdigest()}"
        known = self.notes.get(place)
        if known is not None:
            self.taken += place not in self.places
            self.places.add(place)
            return known
        began = perf_counter()
        made = make()
        if perf_counter() - began >= self.seconds:
            self.places.add(place)
            self.notes.put(place, made)
        return made

    def give_up(self) -> None:
        """Remove the pieces, once what they were made for is kept."""
        for place in self.places:
            self.notes.forget(place)
        self.places.clear()


class Analysis(Protocol):
    """A question that a study may ask. Its module defines one instance; `ANALYSES` lists them.

    Attributes
    ----------
    name
        Key of its table in the study file, its node in the result, its section of the page.
    table
        pydantic section of the study file.
    record
        Dataclass of what `solve` yields: arrays, numbers, texts, enumerations and None.
    linear
        Whether it looks at small vibrations about the static state, of which harmonic loads and outputs are no part: cases that
        differ in these alone then share a job.
    checks
        Names of checks that a run may ask for beside the answer (``verify``). A sealed job that has not had them is opened again:
        `solve` then finds all its records in `done`, and puts what the checks found into the notes.
    """

    name: str
    table: type[Any]
    record: type[Any]
    linear: bool
    checks: tuple[str, ...]

    def key(self, case: Case) -> str:
        """Return all that the records of a case depend on beside its model, as text: tables and files, not titles or checks."""
        ...

    def inputs(self, case: Case, model: Model) -> Any:
        """Return what `solve` needs, refusing what cannot be answered; raises InputError before any long computation."""
        ...

    def solve(self, inputs: Any, done: Sequence[Any], notes: Notes) -> Iterator[Any]:
        """Yield the records that are not in `done`, as they are found; a generator.

        What `dataset` needs beside the records goes into `notes`: it has no model. Progress is told by `keep.progress.advance`.
        """
        ...

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return the node of the result from all cases sealed so far.

        Variables of a case have the leading dimension ``case``; the runner adds ``case_label`` and ``vary_value``. Attributes:
        ``failed``, how many points have no solution (0 if left out); what `verdicts` needs.
        """
        ...

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what is to be trusted of a finished dataset; terminal, page, file and Python show these and nothing else."""
        ...

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Return what ``stickslip check`` says of a case beyond its static state and natural frequencies: choices and estimates."""
        ...

    def summary(self, data: xr.Dataset) -> "tuple[TextTable, ...]":
        """Return what the terminal prints of a dataset."""
        ...


def named(name: str) -> Analysis:
    """Return an analysis of `ANALYSES`; its module is imported now, not before."""
    module, _, instance = ANALYSES[name].partition(":")
    found: Analysis = getattr(import_module(module), instance)
    return found


@dataclass(frozen=True)
class TextTable:
    """A table as text: its heading, the names of its columns, its cells, and lines below it; `detail`: a terminal shows it on request."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[str, ...] = ()
    detail: bool = False

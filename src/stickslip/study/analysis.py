"""The seam of analyses: a question, its table, its jobs, its solution record by record, its dataset."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.assembly.parts.reduced import Store, in_memory
from stickslip.study.models.measured import MeasuredPeaks
from stickslip.study.questions import ANALYSES
from stickslip.study.verdict import Verdict, stored


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


def of_tables(*tables: str) -> Callable[[Case], str]:
    """Return what gives the key of a case whose records depend on some tables beside the model."""
    return partial(_key, tables)  # which another process can be given


def _key(tables: tuple[str, ...], case: Case) -> str:
    return case.as_text(*tables)


def judged_when_made(data: xr.Dataset) -> tuple[Verdict, ...]:
    """Return the verdicts that a dataset was given when it was made."""
    return stored(data.attrs)


def nothing_to_add(data: xr.Dataset, _measured: MeasuredPeaks | None) -> xr.Dataset:
    """Return the dataset as it is."""
    return data


@dataclass(frozen=True, eq=False, kw_only=True)
class Analysis:
    """A question that a study may ask. The module of each defines one instance; `ANALYSES` lists them.

    Parameters
    ----------
    name
        Key of its table in the study file, its node in the result, its section of the page.
    table
        pydantic section of the study file.
    record
        Dataclass of what `solve` yields: arrays, numbers, texts, enumerations and None.
    key
        Returns all that the records of a case depend on beside its model, as text: tables and files, not titles or checks.
    inputs
        Returns what `solve` needs, refusing what cannot be answered; raises InputError before any long computation.
    solve
        Yields the records that are not among those done, as they are found; a generator. What `dataset` needs beside the records goes
        into the notes: it has no model. Progress is told by `store.progress.advance`.
    dataset
        Returns the node of the result from all cases sealed so far. Variables of a case have the leading dimension ``case``; the runner
        adds ``case_label`` and ``vary_value``. Attributes: ``failed``, how many points have no solution (0 if left out), and the verdicts.
    check
        Returns what ``stickslip check`` says of a case beyond its static state and natural frequencies: choices and estimates.
    summary
        Returns what the terminal prints of a dataset.
    linear
        Whether it looks at small vibrations about the static state, of which harmonic loads and outputs are no part: cases that
        differ in these alone then share a job.
    checks
        Names of checks that a run may ask for beside the answer (``verify``). A sealed job that has not had them is opened again:
        `solve` then finds all its records among those done, and puts what the checks found into the notes.
    verdicts
        Returns what is to be trusted of a finished dataset; terminal, page, file and Python show these and nothing else.
    completed
        Adds to a dataset what takes all cases, or the measured peaks of the study.
    """

    name: str
    table: type[Any]
    record: type[Any]
    key: Callable[[Case], str]
    inputs: Callable[[Case, Model], Any]
    solve: Callable[[Any, Sequence[Any], Notes], Iterator[Any]]
    dataset: Callable[[Sequence[Solved]], xr.Dataset]
    check: Callable[[Case, Model], tuple[str, ...]]
    summary: Callable[[xr.Dataset], "tuple[TextTable, ...]"]
    linear: bool = False
    checks: tuple[str, ...] = ()
    verdicts: Callable[[xr.Dataset], tuple[Verdict, ...]] = judged_when_made
    completed: Callable[[xr.Dataset, MeasuredPeaks | None], xr.Dataset] = nothing_to_add


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

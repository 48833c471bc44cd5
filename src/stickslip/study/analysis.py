"""Interface between the runner and an analysis: its table, jobs, records and dataset."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.study.models.measured import MeasuredPeaks
from stickslip.study.questions import ANALYSES, loaded
from stickslip.study.verdict import Verdict, stored


@dataclass(frozen=True, eq=False)
class Case:
    """One case of a study: one combination of the values in [vary].

    Parameters
    ----------
    index
        Index of the case.
    label
        Varied keys with their values; empty for a study without [vary].
    values
        Varied key -> its value here.
    settings
        Tables of the study with the values of this case: ``harmonics``, ``solver``, ``limits``, and one for each analysis of the study, by
        name.
    build
        Function that makes the model. The runner calls it in its own process, and only for unfinished jobs.
    digest
        Hash of everything the model depends on: tables and the content of files.
    home
        Folder to which file names are relative.
    checks
        Additional checks of this run, a subset of `Analysis.checks`.
    store
        Cache for expensive parts of the model; argument of `assemble`.
    digest_at_rest
        Hash without harmonic loads and outputs.
    at
        Picklable function that makes the model with another value of a key; None if no key can be changed.
    accepts
        Function that refuses an invalid value of a key without building a model; None if only building the model shows it.
    drive
        Ratio of harmonic to static forces. With a larger ratio more contacts slip, and a response takes longer.
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
        """Return some tables of the settings as text; equal texts mean equal tables."""
        own = (getattr(self.settings, name) for name in tables)
        return json.dumps([table.model_dump(mode="json") for table in own], sort_keys=True)


@dataclass(frozen=True, eq=False)
class Job:
    """One case of one analysis, picklable. Any process can solve it, and writes its records to a journal, one file.

    Parameters
    ----------
    label
        Name of the job in the log.
    inputs
        Inputs of `Analysis.solve`, made by `Analysis.inputs`.
    """

    label: str
    inputs: Any


@dataclass(frozen=True, eq=False)
class Solved:
    """Content of a sealed job.

    Parameters
    ----------
    case
        The case.
    records
        Records in the order of solution.
    notes
        Named arrays, numbers and texts that the job stored in addition to its records (`Notes.put`).
    """

    case: Case
    records: Sequence[Any]
    notes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


class Notes(Protocol):
    """Store of a job for data that are no records. It is part of the journal, so it survives an interruption."""

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        """Store named arrays, numbers and texts."""
        ...

    def get(self, name: str) -> dict[str, Any] | None:
        """Return the note stored under `name`; None for an unknown name."""
        ...

    def forget(self, name: str) -> None:
        """Remove the note stored under `name`."""
        ...


@dataclass(eq=False)
class Pieces:
    """Intermediate results of a long computation, kept in the notes of a job so that an interrupted run continues from them.

    Parameters
    ----------
    notes
        Notes of the job.
    name
        Common beginning of the names of the pieces.
    seconds
        Wall-clock time below which a piece is not stored but computed again.
    places
        Names of the stored pieces.
    taken
        Number of pieces that an interrupted run had made.
    """

    notes: Notes
    name: str
    seconds: float = 0.5
    places: set[str] = field(default_factory=set)
    taken: int = 0

    def keep(self, content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return the stored result of `make`, or make and store it; `content` is everything that it depends on."""
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
        """Remove the pieces after the final result is stored."""
        for place in self.places:
            self.notes.forget(place)
        self.places.clear()


@dataclass(frozen=True)
class Advice:
    """Lines of ``stickslip check`` on a case, each a sentence without a full stop.

    Parameters
    ----------
    computed
        Planned computations and their cost.
    doubts
        Probable mistakes, in whole sentences.
    at_rest
        States of contacts and dampers under the static loads.
    beside
        Context of the frequency range: natural frequencies, and the possible effect of friction.
    solving_s
        Likely and largest time on one core to solve the case, s; zero if not estimated.
    """

    computed: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    at_rest: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    solving_s: tuple[float, float] = (0.0, 0.0)


def of_tables(*tables: str) -> Callable[[Case], str]:
    """Return the `key` function of an analysis whose records depend on these tables and the model."""
    return partial(_key, tables)  # a partial is picklable, a nested function is not


def _key(tables: tuple[str, ...], case: Case) -> str:
    return case.as_text(*tables)


def judged_when_made(data: xr.Dataset) -> tuple[Verdict, ...]:
    """Return the verdicts stored in the attributes of a dataset."""
    return stored(data.attrs)


def nothing_asked(_case: Case) -> frozenset[str]:
    """Return no additional check."""
    return frozenset()


def nothing_to_add(data: xr.Dataset, _measured: MeasuredPeaks | None) -> xr.Dataset:
    """Return the dataset unchanged."""
    return data


@dataclass(frozen=True, eq=False, kw_only=True)
class Analysis:
    """An analysis that a study may request. Its module defines one instance; `ANALYSES` lists them.

    Parameters
    ----------
    name
        Name of its table in the study file, of its node in the result, and of its section on the page.
    table
        pydantic class of its table in the study file.
    record
        Dataclass of the records of `solve`: arrays, numbers, texts, enumerations and None.
    key
        Returns, as text, everything except the model that the records of a case depend on: tables and files, not titles or checks.
    inputs
        Returns the inputs of `solve`. Raises InputError, before any long computation, for a case that cannot be answered.
    solve
        Generator of the missing records, in the order of solution. `dataset` has no access to the model, so other data for it go into the
        notes. `store.progress.advance` reports progress.
    dataset
        Returns the node of the result from all cases sealed so far. Variables of a case have the leading dimension ``case``; the runner
        adds ``case_label`` and ``vary_value``. Attributes: ``failed``, the number of points without a solution (default 0), and the
        verdicts.
    check
        Returns the lines of ``stickslip check`` on a case (planned computations, choices, cost), or an `Advice`.
    summary
        Returns the terminal tables of a dataset.
    linear
        Whether the analysis concerns small vibrations about the static state. These do not depend on harmonic loads and outputs, so cases
        that differ only in these share a job.
    shared
        Names of other tables that the analysis reads; the method of `Model` accepts their keys, too.
    answers
        Classes of the records of a case, whose columns are the variables of the node; the documentation lists them.
    checks
        Names of additional checks that a run may request (``verify``). A sealed job without them is opened again: `solve` then finds all
        records done and writes the outcome of the checks into the notes.
    asks
        Returns further names of this kind, of what the tables of a case ask for beside its records and what `key` leaves out.
    verdicts
        Returns the verdicts on a finished dataset, the only ones that terminal, page, file and Python show.
    completed
        Adds variables to a dataset that need all cases or the measured peaks of the study.
    """

    name: str
    table: type[Any]
    record: type[Any]
    key: Callable[[Case], str]
    inputs: Callable[[Case, Model], Any]
    solve: Callable[[Any, Sequence[Any], Notes], Iterator[Any]]
    dataset: Callable[[Sequence[Solved]], xr.Dataset]
    check: Callable[[Case, Model], tuple[str, ...] | Advice]
    summary: Callable[[xr.Dataset], "tuple[TextTable, ...]"]
    linear: bool = False
    shared: tuple[str, ...] = ()
    answers: tuple[type[Any], ...] = ()
    checks: tuple[str, ...] = ()
    asks: Callable[[Case], frozenset[str]] = nothing_asked
    verdicts: Callable[[xr.Dataset], tuple[Verdict, ...]] = judged_when_made
    completed: Callable[[xr.Dataset, MeasuredPeaks | None], xr.Dataset] = nothing_to_add


def named(name: str) -> Analysis:
    """Return an analysis of `ANALYSES`; its module is imported at this call."""
    found: Analysis = loaded(ANALYSES[name].analysis)
    return found


@dataclass(frozen=True)
class TextTable:
    """A table as text: heading, column names, cells, and lines below. With `detail` a terminal shows it only on request."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[str, ...] = ()
    detail: bool = False

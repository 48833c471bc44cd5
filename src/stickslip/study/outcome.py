"""The result of a run, assembled from its jobs."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import xarray as xr

from stickslip.study.analysis import Analysis, Case, Solved, TextTable
from stickslip.study.coordinates import with_coordinates
from stickslip.study.models.measured import MeasuredPeaks
from stickslip.study.questions import ANALYSES, OWN_ANALYSIS
from stickslip.study.store.journal import read_note, read_sealed
from stickslip.study.store.netcdf import variable
from stickslip.study.store.progress import tell
from stickslip.study.store.provenance import Provenance
from stickslip.study.store.watch import ASIDE
from stickslip.study.verdict import ATTRIBUTE, Verdict, of_tree, stored, to_json

# names of notes that the runner itself writes
UNSOLVED, CHECKED = "no solution", "checks"
REMEDIES = {
    UNSOLVED: "Check what holds the parts, and the size of the loads.",
    ASIDE: "The same command goes on with it: give it more time or memory, or leave the case out.",
}


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a run.

    Parameters
    ----------
    tree
        One node for each analysis; the attributes of the root hold the provenance.
    summaries
        Terminal tables of each analysis.
    failed
        Number of points without a solution.
    files
        Files of the run, the result first.
    waits
        Sentence about missing shards; empty for a complete result.
    """

    tree: xr.DataTree
    summaries: dict[str, tuple[TextTable, ...]]
    failed: int
    files: tuple[Path, ...]
    waits: str = ""

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts of all analyses."""
        return of_tree(self.tree)


@dataclass(frozen=True, eq=False)
class Task:
    """One case of one analysis, and the file of its job."""

    analysis: Analysis
    case: Case
    sealed: Path

    def ended(self) -> bool:
        """Whether the job is sealed, and either has had its checks or was set aside."""
        if not self.sealed.exists():
            return False
        wanted = self.case.checks
        if not wanted or wanted <= checked(read_note(self.sealed, CHECKED)):
            return True
        return read_note(self.sealed, ASIDE) is not None

    def finished(self) -> bool:
        """Whether the job has ended and was not set aside."""
        return self.ended() and read_note(self.sealed, ASIDE) is None


def checked(note: Mapping[str, Any] | None) -> frozenset[str]:
    """Return the names of the checks that a job has had, from its note."""
    return frozenset() if note is None else frozenset(map(str, note["names"]))


@dataclass(frozen=True, eq=False)
class Book:
    """Finished jobs of a run. Each case is judged when its job ends; the nodes of analyses are made on request of the tree."""

    origin: Provenance
    solved: dict[Path, tuple[list[Any], dict[str, dict[str, Any]]]] = field(default_factory=dict)
    nodes: dict[str, xr.Dataset] = field(default_factory=dict)
    aside: dict[str, list[Verdict]] = field(default_factory=dict)
    apart: dict[str, tuple[Analysis, list[Task]]] = field(default_factory=dict)
    told: set[str] = field(default_factory=set)
    of_a_kind: set[str] = field(default_factory=set)
    measured: MeasuredPeaks | None = None

    def read(self, tasks: Sequence[Task], unfinished: Container[Path]) -> None:
        """Read the jobs sealed since the last call, and log the verdicts on their cases."""
        for asked in {t.analysis.name: t.analysis for t in tasks}.values():
            own = [t for t in tasks if t.analysis is asked and t.sealed not in unfinished]
            new = {t.sealed for t in own} - self.solved.keys()
            self.solved.update({path: read_sealed(path, asked.record) for path in new})
            if new:
                self.apart[asked.name] = asked, own
            for task in own:
                if task.sealed in new:
                    self._judge(asked, Solved(task.case, *self.solved[task.sealed]))

    def _judge(self, asked: Analysis, solved: Solved) -> None:
        """Log the verdicts on a case; a verdict that an earlier case had is logged later, for all cases together."""
        if ASIDE in solved.notes:
            self._tell([_unsolved(solved, ASIDE)])
            return
        _, found = _judged(asked, [solved])
        new = [v for v in found if replace(v, case="").sentence not in self.of_a_kind]
        self.of_a_kind.update(replace(v, case="").sentence for v in new)
        self._tell(new)

    def enter(self, asked: Analysis, solved: Sequence[Solved]) -> None:
        """Make the node of an analysis from its solved cases; cases set aside are left out."""
        self.aside[asked.name] = [_unsolved(s, ASIDE) for s in solved if ASIDE in s.notes]
        solved = [s for s in solved if ASIDE not in s.notes]
        if not solved:
            return
        node, found = _judged(asked, solved)
        node = asked.completed(node, self.measured)
        unsolved = sum(UNSOLVED in s.notes for s in solved)
        failed = max(int(node.attrs.get("failed", 0)), unsolved)
        own = {ATTRIBUTE: to_json(found), "failed": failed}
        if asked.name not in ANALYSES:  # the page may find its section
            own[OWN_ANALYSIS] = str(getattr(getattr(solved[0].case.settings, asked.name, None), "analysis", ""))
        self.nodes[asked.name] = with_coordinates(node.assign_attrs(own), asked.name)

    def _put_together(self) -> None:
        """Make the nodes of the analyses with newly sealed jobs."""
        for asked, own in self.apart.values():
            self.enter(asked, [Solved(t.case, *self.solved[t.sealed]) for t in own])
        self.apart.clear()

    def _tell(self, found: Iterable[Verdict]) -> None:
        """Log verdicts that have not been logged."""
        for verdict in found:
            if verdict.told and verdict.sentence not in self.told:
                self.told.add(verdict.sentence)
                tell(verdict.word, verdict.sentence)

    @property
    def _names(self) -> list[str]:
        """Names of the nodes in an order that does not depend on the order in which jobs end."""
        return sorted(self.nodes, key=[*ANALYSES, *self.nodes].index)

    def tree(self, *, complete: bool) -> xr.DataTree:
        """Return the tree of all nodes with its provenance."""
        self._put_together()
        attributes = self.origin.attributes(complete=complete)
        aside = [verdict for found in self.aside.values() for verdict in found]
        if aside:
            attributes[ATTRIBUTE] = to_json(aside)
        root = xr.Dataset(attrs=attributes)
        return xr.DataTree.from_dict({"/": root, **{n: self.nodes[n] for n in self._names}})

    def outcome(self, asked: Sequence[Analysis]) -> Outcome:
        """Return the result of a complete run, and log the verdicts not logged before."""
        tree = self.tree(complete=True)
        self._tell(verdict for found in self.aside.values() for verdict in found)
        for name in self._names:
            self._tell(stored(self.nodes[name].attrs))
        return Outcome(
            tree=tree,
            summaries={a.name: a.summary(self.nodes[a.name]) for a in asked if a.name in self.nodes},
            failed=sum(int(self.nodes[a.name].attrs["failed"]) for a in asked if a.name in self.nodes)
            + sum(map(len, self.aside.values())),
            files=(),
        )


def _judged(asked: Analysis, solved: Sequence[Solved]) -> tuple[xr.Dataset, tuple[Verdict, ...]]:
    """Return the dataset of cases, and the verdicts on them."""
    node = asked.dataset(solved).assign(case_variables([s.case for s in solved]))
    unsolved = [_unsolved(s, UNSOLVED) for s in solved if UNSOLVED in s.notes]
    return node, (*unsolved, *asked.verdicts(node))


def _unsolved(solved: Solved, note: str) -> Verdict:
    why = str(solved.notes[note]["text"])
    return Verdict("wrong", solved.case.label, None, why, REMEDIES[note])


def case_variables(cases: Sequence[Case]) -> dict[str, Any]:
    """Return the labels of the cases, and the values of the varied keys if there are any."""
    found: dict[str, Any] = {"case_label": variable("case", [c.label for c in cases], "1", "what is varied")}
    keys = list(cases[0].values)
    if keys:
        rows = [[case.values[key] for key in keys] for case in cases]
        numeric = all(isinstance(v, int | float) for row in rows for v in row)
        rows = [[float(v) if numeric else str(v) for v in row] for row in rows]
        found["vary_value"] = variable("case vary", rows, "1", "values of the varied keys")
        found["vary"] = variable("vary", keys, "1", "varied keys")
    return found

"""The common part of the analyses by waves."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.study.analyses.analysis import Case, Notes, Solved, TextTable
from stickslip.study.analyses.verdict import Verdict, stored
from stickslip.study.analyses.waves.records.dataset import Variables, dataset
from stickslip.study.analyses.waves.solve import Question, each_wave
from stickslip.study.analyses.waves.tables import WaveTable
from stickslip.study.analyses.waves.texts import of_cases


class WaveAnalysis(ABC):
    """An analysis of small vibrations, a record a wave; see `Analysis` for what its methods promise.

    Attributes
    ----------
    compared
        Keys of its table that no record depends on: what the records are compared with.
    of_wave
        Solves one wave.
    of_case
        Returns the variables of a case beside those of its model and waves, and what the user should know.
    of_text
        Returns what the terminal prints of a case.
    """

    name: str
    table: type[WaveTable]
    record: type[Any]
    linear = True
    checks: tuple[str, ...] = ()
    compared: frozenset[str] = frozenset()
    of_wave: Callable[[Question, int], Any]
    of_case: Callable[[Solved], tuple[Variables, list[Verdict]]]
    of_text: Callable[[xr.Dataset], Sequence[TextTable]]

    @abstractmethod
    def inputs(self, case: Case, model: Model) -> Any:
        """Return what is solved."""

    def asked(self, case: Case) -> Any:
        """Return its table in a case."""
        return getattr(case.settings, self.name)

    def key(self, case: Case) -> str:
        """Return all that the records depend on."""
        return str(self.asked(case).model_dump_json(exclude=set(self.compared)))

    def solve(self, inputs: Question, done: Sequence[Any], notes: Notes) -> Iterator[Any]:
        """Yield what is found of each wave."""
        return each_wave(self.of_wave, inputs, done, notes)

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return all waves of all cases."""
        return dataset(solved, self.of_case)

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Say how many modes of how many waves there will be."""
        asked = self.inputs(case, model)
        return (f"{self.name}: {asked.n_modes} modes of each of {len(asked.numbers)} waves",)

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what its records and its model cast doubt on, put down when the dataset was made."""
        return stored(data.attrs)

    def summary(self, data: xr.Dataset) -> tuple[TextTable, ...]:
        """Return what the terminal prints."""
        return of_cases(data, self.of_text)

"""The problem of a job: model, loads sorted by frequency, and candidates for a second tone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.problem import peak_first
from stickslip.analyses.forced_response.stability.in_time import seconds_in_time
from stickslip.analyses.quasi_periodic.table import QuasiPeriodicTable
from stickslip.analyses.vibrating import modes_of
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.assembling import assemble
from stickslip.assembly.forces import Load
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.quasi_periodic.problem import TwoTones, two_tones
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analysis import Case
from stickslip.units import HZ, RPM

NAME = "quasi_periodic"
APART = 1000  # offset of the harmonics of second loads while they are assembled with the first loads
MARCHED = 5.0  # time steps of a comparison over the steps of `seconds_in_time`
SOON = 30.0  # largest estimated seconds of all comparisons of a case without request
MODES = 12  # modes whose growth is examined
# largest ratio of the second frequency to the first: contacts are sampled for the faster one, over many turns of the slower
MOST_RATIO = 100.0


@dataclass(frozen=True, eq=False)
class Question:
    """A case of the analysis.

    Parameters
    ----------
    label
        Label of the case.
    model
        The assembled model; a wheel has all its waves. The first output is the one shown.
    asked
        The table [quasi_periodic].
    first, second
        Loads of either frequency; the static load belongs to `first`.
    second_of
        Frequency of the second loads, rad/s, or None and its ratio to the first; both None for a self-excited tone.
    waves
        Engine orders of the first and second loads of a tuned wheel; None for a single structure. For a self-excited tone the second is its
        wave.
    facts
        Facts about the model for the result.
    """

    label: str
    model: Assembled
    asked: QuasiPeriodicTable
    first: HarmonicLoad
    second: HarmonicLoad
    second_of: tuple[float | None, float | None]
    waves: tuple[int, int] | None
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def driven(self) -> bool:
        """Whether a load has the second frequency."""
        return self.second_of != (None, None)

    @property
    def in_time(self) -> bool:
        """Whether motions are compared with time integration: as requested, or if that is short."""
        if self.asked.in_time is not None:
            return self.asked.in_time
        each = MARCHED * seconds_in_time(self.model.system)
        return self.waves is None and len(self.asked.first_hz) * each < SOON

    def second_frequency(self, omega: float) -> float:
        """Return the frequency of the second loads for a first frequency, rad/s."""
        own, ratio = self.second_of
        return own if own is not None else (ratio or 1.0) * omega

    def problem(self) -> TwoTones:
        """Return the problem with the fewest harmonics."""
        return two_tones(
            self.model.system,
            self.first,
            self.second,
            self.asked.harmonics,
            waves=self.waves,
            more=np.asarray(self.model.system.outputs),
        )

    def growing(self) -> list[tuple[int, StuckMode]]:
        """Return the unstable modes with contacts stuck and their wave numbers (0 for a single structure), the fastest growing first."""
        side, chosen = self.model.system.structure, self.asked.second_wave
        waves: Sequence[int] = [0]
        if side.wheel is not None:
            waves = range(side.wheel.sectors) if chosen is None else [chosen]
        found = [(wave, m) for wave in waves for m in modes_of(self.model, MODES, wave)]
        return sorted((m for m in found if m[1].unstable), key=lambda m: m[1].ratio)


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job.

    Raises
    ------
    InputError
        If no load vibrates with the first frequency, the loads have more than two frequencies, or the loads of a wheel
        cannot be distinguished.
    """
    asked: QuasiPeriodicTable = case.settings.quasi_periodic
    first = {n: load for n, load in model.loads.items() if load.harmonic and not load.second}
    second = {n: load for n, load in model.loads.items() if load.second}
    if not first:
        raise input_error(NAME, "no load acts with the first frequency", "Give a harmonic load.")
    frequencies = {(load.omega, load.omega_ratio) for load in second.values()}
    if len(frequencies) > 1:
        raise input_error(
            f"load.{list(second)[1]}",
            "has another frequency of its own than load." + next(iter(second)),
            "There are two frequencies: give the same to all such loads.",
        )
    _check_second(asked, second)
    wheel = model.sectors > 1 and model.mistuning is None
    if wheel and asked.in_time:
        raise input_error(f"{NAME}.in_time", "is for single structures", "Leave it out of a wheel.")
    orders = [_one_order(name, loads) for name, loads in (("first", first), ("second", second))]
    together = replace(model, loads={n: _plain(load, wheel=model.sectors > 1) for n, load in model.loads.items()})
    keys = [{n: together.driven[n] for n in loads} for loads in (first, second)]
    if set(keys[0].values()) & set(keys[1].values()):
        raise input_error(
            f"load.{next(iter(second))}.engine_order",
            "is that of a load with the first frequency",
            f"Add the number of sectors to it, {model.sectors}: that is the same wave.",
        )
    most = max(asked.most_harmonics, *(h for own in keys for h in own.values()))
    refuse_whole(NAME, together)
    assembled = peak_first(assemble(together, most, case.store, every_wave=wheel))
    static = assembled.load.static
    loads = [
        HarmonicLoad(static if i == 0 else np.zeros_like(static), _of(assembled, own, keys[i]))
        for i, own in enumerate((first, second))
    ]
    question = Question(
        case.label,
        assembled,
        asked,
        loads[0],
        loads[1],
        next(iter(frequencies), (None, None)),
        (orders[0] or 0, orders[1] or 0) if wheel else None,
        facts_of(model, model.speed / RPM),
    )
    if wheel and not second:
        question = replace(question, waves=(orders[0] or 0, _wave(question)))
    question.problem()  # raises the refusals of the solver now
    return question


def _check_second(asked: QuasiPeriodicTable, second: Mapping[str, Load]) -> None:
    """Refuse second loads whose frequency is the first one or far above it, and a second tone beside them."""
    for name, load in second.items():
        given = "frequency_ratio" if load.omega is None else "frequency_hz"
        each = [load.omega_ratio if load.omega is None else load.omega / (HZ * f) for f in asked.first_hz]
        ratios = [r or 1.0 for r in each]
        if all(r == 1.0 for r in ratios):
            raise input_error(
                f"load.{name}.{given}",
                "is the first frequency, that of the other loads",
                "Leave it out and ask [forced_response], or give another one.",
            )
        if max(ratios) > MOST_RATIO:
            raise input_error(
                f"load.{name}.{given}",
                f"is {max(ratios):.4g} times the first frequency, more than {MOST_RATIO:g}",
                "Give the slower loads a frequency of their own instead, or a nearer one.",
            )
    for key in ("second_hz", "second_wave") if second else ():
        if getattr(asked, key) is not None:
            raise input_error(
                f"{NAME}.{key}",
                f"is of a tone that nothing drives, and load.{next(iter(second))} has a frequency of its own",
                "Leave one of them out.",
            )


def _wave(question: Question) -> int:
    """Return the wave number of a self-excited tone."""
    if question.asked.second_wave is not None:
        return question.asked.second_wave
    growing = question.growing()
    if not growing:
        raise input_error(
            f"{NAME}.second_wave",
            "is missing, and no mode grows with contacts stuck",
            "Give the wave number of the second tone, or a load with a frequency of its own.",
        )
    return growing[0][0]


def _plain(load: Load, *, wheel: bool) -> Load:
    """Return a load as it is assembled; second loads of a single structure get harmonics of their own."""
    if not load.second:
        return load
    apart = 0 if wheel else APART
    return replace(load, omega=None, omega_ratio=None, harmonic=load.harmonic + apart)


def _one_order(name: str, loads: Mapping[str, Load]) -> int | None:
    orders = {load.engine_order for load in loads.values()}
    if len(orders) > 1:
        raise input_error(
            "load",
            f"has several engine orders with the {name} frequency: {sorted(str(o) for o in orders)}",
            "Give all loads of a frequency one engine order, others as harmonics of it.",
        )
    return next(iter(orders), None)


def _of(assembled: Assembled, loads: Mapping[str, Load], keys: Mapping[str, int]) -> dict[int, Any]:
    """Return the forces of loads by the harmonics of their own frequency."""
    return {load.harmonic: assembled.load.harmonics[keys[name]] for name, load in loads.items()}


def hertz(omega: float) -> str:
    """Write a frequency in Hz."""
    return f"{omega / HZ:.5g} Hz"

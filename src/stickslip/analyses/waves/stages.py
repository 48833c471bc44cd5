"""Modes of coupled wheels with different numbers of sectors, one record a nodal diameter of the assembly."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from stickslip.analyses.facts import NOTE, facts_of
from stickslip.analyses.waves.records import WaveModes
from stickslip.analyses.waves.solve import STATIC
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.model.facts import facts_of_part
from stickslip.reduction.coupled_stages import Multistage, Wave, multistage_modes
from stickslip.study.analysis import Notes
from stickslip.study.store.progress import advance
from stickslip.study.verdict import Verdict, doubt, to_json

LEFT_OUT = 0.01  # relative change of a frequency by harmonics that are not coupled, above which there is a doubt


@dataclass(frozen=True, eq=False)
class StagesQuestion:
    """Inputs of a computation of coupled stages; picklable.

    Parameters
    ----------
    model
        A model of several stages.
    numbers
        Nodal diameters of the assembly.
    n_modes
        Number of modes of each nodal diameter.
    """

    model: Model
    numbers: tuple[int, ...]
    n_modes: int

    @property
    def assembly(self) -> Multistage:
        """The stages and their flanges."""
        found = self.model.stages
        assert found is not None
        return found


def stages_question(model: Model, diameters: Sequence[int] | None, n_modes: int) -> StagesQuestion:
    """Return the inputs after a check of the nodal diameters; None: all diameters that vibrate independently."""
    assembly = model.stages
    assert assembly is not None
    unknown = sorted(set(diameters or ()) - set(assembly.harmonics))
    if unknown:
        kept = ", ".join(map(str, assembly.harmonics))
        raise input_error(
            "modes.nodal_diameters",
            f"{unknown[0]} is no harmonic that a flange couples, these are {kept}",
            "Add it to join.NAME.harmonics, or leave it out.",
        )
    return StagesQuestion(model, tuple(sorted(diameters or assembly.nodal_diameters)), n_modes)


def each_diameter(asked: StagesQuestion, done: Sequence[WaveModes], notes: Notes) -> Iterator[WaveModes]:
    """Yield the modes of unfinished nodal diameters; the note about the model comes first."""
    if notes.get(NOTE) is None:
        notes.put(NOTE, _about(asked))
    known = {w.wave_number for w in done}
    for i, number in enumerate(asked.numbers):
        if number not in known:
            found = _solved(asked, number)
            yield found
            low, high = found.frequencies_hz.min(), found.frequencies_hz.max()
            told = f"nodal diameter {number}: {low:.6g} to {high:.6g} Hz in {found.seconds:.1f} s"
            advance((i + 1) / len(asked.numbers), told)


def _solved(asked: StagesQuestion, number: int) -> WaveModes:
    began = perf_counter()
    found = multistage_modes(asked.assembly, number, asked.n_modes)
    return WaveModes(
        wave_number=number,
        seconds=perf_counter() - began,
        frequencies_hz=found.frequencies_hz,
        growth=np.zeros(asked.n_modes),
        shares=found.shares.T,
        stiffest_hz=found.stiffest_hz,
    )


def flange_doubts(waves: Sequence[WaveModes]) -> list[Verdict]:
    """Doubt frequencies that the uncoupled harmonics of the flanges could change."""
    off = {w.wave_number: w.stiffest_hz / w.frequencies_hz - 1 for w in waves if w.stiffest_hz is not None}
    poor = [f"{k} (up to {100 * d.max():.2g} %)" for k, d in off.items() if d.max() > LEFT_OUT]
    if not poor:
        return []
    why = (
        f"the flanges couple few harmonics: those left out could raise the frequencies of the nodal diameters {', '.join(poor)}, "
        "as they do where they are held"
    )
    return [Verdict("doubtful", why=why, remedy="Give join.NAME.harmonics more of them.")]


def unreached(assembly: Multistage) -> list[Verdict]:
    """Name the waves of the stages that no kept harmonic excites and no list of modes holds."""
    own = _in_words(assembly, assembly.unreached)
    if not own:
        return []
    why = f"no kept harmonic of the flanges leads to the waves {own}: their modes are in no list here"
    lowest = sorted({k for _, k in assembly.unreached})
    remedy = f"Add the harmonics {', '.join(map(str, lowest))} to join.NAME.harmonics."
    return [Verdict("trusted", why=why, remedy=remedy)]


def _about(asked: StagesQuestion) -> dict[str, Any]:
    """Return the note about the model; its number of sectors is the least common multiple of the stages."""
    stages = asked.assembly.stages
    counts = [sector.sectors for sector in stages.values()]
    told = [f"{name} of {count} sectors" for name, count in zip(stages, counts, strict=True)]
    each = [facts_of_part(asked.model.parts[name]) for name in stages]
    masses = np.array([count * f.mass for count, f in zip(counts, each, strict=True)])
    axis = asked.model.axis
    along = masses @ (np.array([f.centre for f in each]) - np.asarray(axis.origin)) @ axis.unit
    return facts_of(asked.model, 0.0) | {
        "stages": ", ".join(told),
        "mass_kg": float(masses.sum()),
        "centre_m": np.asarray(axis.origin) + along / masses.sum() * axis.unit,
        "sectors": math.lcm(*counts),
        "stage_name": np.array(list(stages), dtype=str),
        "stage_sectors": np.array(counts, dtype=np.int64),
        "stage_waves": np.array([_waves(asked.assembly, k) for k in asked.numbers], dtype=str),
        "speed_rpm": 0.0,
        "contacts": "none",
        "parted": False,
        "verdicts": to_json([*unreached(asked.assembly), *map(doubt, asked.model.warnings)]),
        **dict.fromkeys(STATIC, np.nan),
    }


def _waves(assembly: Multistage, number: int) -> str:
    """Return the waves of a nodal diameter in words: first 2, second 2 and 7."""
    return _in_words(assembly, assembly.waves(number))


def _in_words(assembly: Multistage, waves: Sequence[Wave]) -> str:
    own = {name: [str(k) for other, k in waves if other == name] for name in assembly.stages}
    return ", ".join(f"{name} {' and '.join(numbers)}" for name, numbers in own.items() if numbers)

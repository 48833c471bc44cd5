"""A result written for other programs: the motion to write, and the model that expands it to all nodes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.model.readers.units import Units
from stickslip.study.exchange.chosen import Chosen, chosen
from stickslip.study.exchange.frd import write_frd
from stickslip.study.exchange.motion import Motion, motion_of
from stickslip.study.exchange.stress import SurfaceFields, stress_fields, write_stress_csv, write_stress_vtu
from stickslip.study.exchange.uff import write_uff
from stickslip.study.exchange.vtu import contacts_of, write_vtu
from stickslip.study.file.study import StudyFile, validated
from stickslip.study.file.toml import parsed
from stickslip.study.models.study import Study
from stickslip.study.own_code import OwnCode
from stickslip.study.store.atomic_write import unwritable
from stickslip.study.store.progress import LOG

Format = Literal["vtu", "frd", "uff", "csv"]
MOST_STEPS = 1000
NO_STRESS = "Add the table [stress] to the study and run it: only the stress is computed then. Leave hz out: stress is that of the peak."
IN_PYTHON = "A result imports no code. In Python: result.export(of=Study.from_file(path, allow_code=True).model())."


@dataclass(frozen=True)
class Wanted:
    """Choice of the motion and of the format; see `Result.export`."""

    to: Format = "vtu"
    case: int = 0
    hz: float | None = None
    steps: int = 24
    wheel: bool = False
    units: str = "SI"
    analysis: str = ""
    number: int = 0
    amplitude_mm: float | None = None

    def __post_init__(self) -> None:
        if self.to not in get_args(Format):
            remedy = f"Give one of {', '.join(get_args(Format))}."
            raise input_error("export: to", f"is {self.to!r}", remedy)
        if not 1 <= self.steps <= MOST_STEPS:
            remedy = f"Give 1 to {MOST_STEPS} instants."
            raise input_error("export: steps", f"is {self.steps}", remedy)
        if self.units != "SI" and self.to != "frd":
            what = f"is {self.units}, and only frd takes other units"
            remedy = "Leave it out: the others are in m, N, Pa and Hz."
            raise input_error("export: units", what, remedy)


def export_result(
    tree: xr.DataTree, path: Path | None, folder: Path | None, wanted: Wanted, of: Model | Path | None
) -> tuple[Path, ...]:
    """Write a motion of the result at `path`; return the files."""
    case, units = wanted.case, Units.named(wanted.units)
    picked = chosen(tree, wanted.analysis, case, number=wanted.number, hz=wanted.hz, amplitude_mm=wanted.amplitude_mm)
    LOG.info(f"[{picked.analysis}] {picked.told}")
    model = of if isinstance(of, Model) else _model(tree, path, of, case)
    if wanted.wheel and model.sectors == 1:
        remedy = "Leave it out: a structure that is no sector is written whole."
        raise input_error("export: wheel", "is asked of a single structure", remedy)
    motion = motion_of(picked, model, wheel=wanted.wheel)
    forced = tree[picked.analysis].to_dataset() if picked.point is not None else None
    stress = None if forced is None else _stress(forced, picked, case, wanted, motion)
    name = f"{wanted.to}_{case}" if forced is not None else f"{wanted.to}_{picked.analysis}_{case}_{wanted.number}"
    place = _place(path, f"{name}_wheel" if wanted.wheel else name, folder)
    count = sum(len(body.nodes.points) for body in motion.bodies)
    sectors = f" of {motion.sectors} sectors" if motion.sectors > 1 else ""
    if wanted.to == "csv":
        if stress is None:
            raise input_error("export: to", "is csv, and this motion has no stress", NO_STRESS)
        LOG.info(f"writing the stress of {len(stress.points)} nodes{sectors} to {place}")
        return (write_stress_csv(stress, place / "stress.csv"),)
    LOG.info(f"writing {count} nodes{sectors} to {place}")
    if wanted.to == "vtu":
        contacts = (
            contacts_of(forced, motion, case, picked.point) if forced is not None and picked.point is not None else ()
        )
        files = write_vtu(motion, contacts, place, wanted.steps)
        return files if stress is None else (write_stress_vtu(stress, place / "stress.vtu"), *files)
    if wanted.to == "frd":
        return (write_frd(motion, place / "motion.frd", units, stress),)
    return (write_uff(motion, forced, case, place / "motion.uff"),)


def _stress(forced: xr.Dataset, picked: Chosen, case: int, wanted: Wanted, motion: Motion) -> SurfaceFields | None:
    """Return the stress of the motion to write; None where the result has none of this motion."""
    found = stress_fields(forced, case)
    if found is None or wanted.to == "uff":
        return None
    if picked.point != int(forced["peak_point"].values[case]):
        LOG.info("the stress of the result is that of the peak: it is not written with another point")
        return None
    return found.turned(motion.axis, motion.pitch, motion.sectors)


def _place(path: Path | None, name: str, folder: Path | None) -> Path:
    beside = Path() if path is None else path.parent
    place = beside / name if folder is None else folder
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(place, error) from None
    return place


def _model(tree: xr.DataTree, path: Path | None, home: Path | None, case: int) -> Model:
    """Return the model of a case, built from the study's text in the result."""
    text = str(tree.attrs.get("study_toml", ""))
    if not text:
        remedy = "Give the model that was asked: result.export(..., of=model)."
        raise input_error("export", "the result is of a model made in Python", remedy)
    raw = parsed(text, Path("study.toml"))
    if home is None:
        inner = Path(str(raw.get("output", {}).get("folder", "results")))
        last = () if path is None else path.resolve().parent.parts
        if last[-len(inner.parts) :] != inner.parts:
            remedy = "Say in which folder the study's files lie: --of FOLDER, or of=..."
            raise input_error("export", "the result does not lie where its study put it", remedy)
        home = Path(*last[: -len(inner.parts)])
    place = home / "study.toml"
    return Study(StudyFile(place, text, raw, validated(place, raw, OwnCode(home, remedy=IN_PYTHON)))).model(case)

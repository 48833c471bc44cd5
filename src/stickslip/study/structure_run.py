"""The commands for bladed disks, from a study file to results: modes, Campbell diagram, SAFE diagram."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import TypeVar

import numpy as np

from stickslip import __version__
from stickslip.errors import input_error
from stickslip.study.folder import prepare_folder
from stickslip.study.journal import Journal
from stickslip.study.netcdf import write_dataset
from stickslip.study.progress import Interrupted, Log, Sink, library_versions
from stickslip.study.reference import read_reference
from stickslip.study.static_state import StaticState, static_state
from stickslip.study.structure_doubts import (
    basis_doubts,
    campbell_doubts,
    safe_doubts,
    static_doubts,
)
from stickslip.study.structure_model import DiskModel, disk_model
from stickslip.study.structure_results import WaveBranches, WaveModes
from stickslip.study.structure_store import (
    RPM,
    Origin,
    campbell_dataset,
    modes_dataset,
    safe_dataset,
)
from stickslip.study.structure_study import Command, StructureStudy, read_structure_study
from stickslip.study.structure_summary import (
    StructureSummary,
    TextTable,
    campbell_tables,
    modes_tables,
    safe_tables,
    static_table,
)
from stickslip.study.waves import (
    follow_wave,
    interference,
    solve_wave,
    unfollowed_orders,
    unseen_orders,
    waves_of_campbell,
    waves_of_modes,
)

W = TypeVar("W", WaveModes, WaveBranches)


def run_structure(path: Path, command: Command, *, fresh: bool, sink: Sink) -> StructureSummary:
    """Run a command for bladed disks, going on from what an interrupted run has finished.

    Parameters
    ----------
    path
        The study file.
    command
        ``modes``, ``campbell`` or ``safe``.
    fresh
        Forget what the results folder holds of this command.
    sink
        Where progress is told.

    Raises
    ------
    InputError
        If the study, its files or its folder do not allow it.
    Interrupted
        If the user stops it; the message says how to go on.
    """
    study = read_structure_study(path)
    _check_cheaply(study, command)
    own = (
        f"{command}.sqlite",
        f"{command}.sqlite-journal",
        f"{command}.nc",
        f"{command}.nc.part",
        f"{command}.log",
    )
    prepare_folder(study.folder, fresh=False)
    # what is there is not given up for a model that cannot be built
    built = disk_model(study, sink.say) if fresh else None
    if built is not None:
        _check_model(study, command, built)
    prepare_folder(study.folder, fresh=fresh, own=own)
    versions = library_versions()
    point = WaveBranches if command == "campbell" else WaveModes
    # waves that were kept with other fields cannot be gone on with
    parts = [study.content_hash(command), versions, [f.name for f in fields(point)]]
    mark = sha256(json.dumps(parts).encode()).hexdigest()
    with Journal(study.folder / f"{command}.sqlite", mark, point) as journal:
        log = Log(study.folder / f"{command}.log", sink)
        run = _Run(study, command, versions, journal, log, built)
        try:
            return {"modes": _modes, "campbell": _campbell, "safe": _safe}[command](run)
        except KeyboardInterrupt:
            log.say("interrupted by the user")
            raise Interrupted(
                f"Interrupted. What is finished is kept in {study.folder}. The same command goes on from there."
            ) from None


def check_structure(path: Path, sink: Sink) -> list[str]:
    """Do everything but the computation of modes; return warnings. Nothing is written."""
    study = read_structure_study(path)
    return list(disk_model(study, sink.say).warnings)


@dataclass(frozen=True, eq=False)
class _Run:
    """What every step of a run needs."""

    study: StructureStudy
    command: Command
    versions: dict[str, str]
    journal: Journal
    log: Log
    built: DiskModel | None
    began: float = field(default_factory=perf_counter)
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))

    def model(self) -> DiskModel:
        """Build the model, and tell what is doubtful about it."""
        self.log.say(f"stickslip {__version__}, {self.command} of {self.study.path}")
        model = self.built or disk_model(self.study, self.log.say)
        _check_model(self.study, self.command, model)
        for text in model.warnings:
            self.log.say(f"WARNING: {text}")
        return model

    def static(self, model: DiskModel, rpm: float) -> StaticState | None:
        """Find what the centrifugal load does at a speed, and tell it before the modes are computed."""
        found = static_state(model, rpm)
        for text in static_doubts(found):
            self.log.say(f"WARNING: {text}")
        return found

    def origin(
        self,
        model: DiskModel,
        speed_rpm: float,
        static: StaticState | None,
        *,
        complete: bool,
        doubts: tuple[str, ...] = (),
    ) -> Origin:
        """Return the attributes of the result; `doubts` are warnings beside those of the model and its static state."""
        x, y, z = (float(v) for v in model.axis.unit)
        return Origin(
            command=self.command,
            title=self.study.tables.title,
            study_toml=self.study.text,
            stickslip_version=__version__,
            versions=self.versions,
            created=self.created,
            wall_seconds=perf_counter() - self.began,
            warnings=(*model.warnings, *static_doubts(static), *doubts),
            complete=complete,
            model_hash=self.study.content_hash(),
            sectors=model.sectors,
            axis_direction=(x, y, z),
            axis_origin=model.axis.origin,
            speed_rpm=speed_rpm,
            rotation=_in_words(model, speed_rpm if self.command != "campbell" else None),
            static=static,
        )

    def each(
        self,
        numbers: Sequence[int],
        solve: Callable[[int], W],
        write: Callable[[list[W], bool], None],
    ) -> list[W]:
        """Return what `solve` finds for each wave number, journalled as it comes; `write` takes all there is, and whether it is all."""
        done = {w.wave_number: w for w in self.journal.points(0)}
        if done:
            self.log.say(f"{len(done)} of {len(numbers)} waves are already there")
        found: list[W] = []
        self.log.sink.begin(f"{self.command}: {len(numbers)} waves")
        for i, number in enumerate(numbers):
            known = done.get(number)
            wave = solve(number) if known is None else known
            found.append(wave)
            if known is None:
                self.journal.add(0, wave)
                if i + 1 < len(numbers):
                    write(found, False)
            self.log.sink.advance((i + 1) / len(numbers), _progress(wave))
        write(found, True)
        return found

    @property
    def target(self) -> Path:
        """The result's file."""
        return self.study.folder / f"{self.command}.nc"

    def summary(
        self,
        tables: tuple[TextTable, ...],
        model: DiskModel,
        static: StaticState | None,
        doubts: tuple[str, ...] = (),
    ) -> StructureSummary:
        """Return what the command prints at its end."""
        warnings = (*model.warnings, *static_doubts(static), *doubts)
        files = (self.target, self.log.path)
        return StructureSummary((*tables, *static_table(static)), warnings, self.target, files)


def _modes(run: _Run) -> StructureSummary:
    tables, known = run.study.tables, read_reference(run.study)
    model, rpm = run.model(), tables.rotation.speed_rpm
    static, speed = run.static(model, rpm), RPM * rpm
    numbers = waves_of_modes(tables.modes.nodal_diameters, model, speed)
    reference = None
    if known is not None:
        reference = known.of_waves(numbers, tables.modes.number, model.sectors)
    shapes = tables.modes.shapes and model.skin is not None

    def write(waves: list[WaveModes], complete: bool) -> None:
        origin = run.origin(model, rpm, static, complete=complete)
        rows = None if reference is None else reference[: len(waves)]
        write_dataset(modes_dataset(waves, rows, model.skin, model.facts, origin), run.target)

    waves = run.each(
        numbers, lambda k: solve_wave(model, speed, k, tables.modes.number, shapes=shapes), write
    )
    return run.summary(modes_tables(waves, reference, model.sectors, rpm), model, static)


def _campbell(run: _Run) -> StructureSummary:
    table, model = run.study.tables.campbell, run.model()
    assert table is not None
    speeds = RPM * np.linspace(table.speeds_rpm[0], table.speeds_rpm[1], table.points)
    static = run.static(model, table.speeds_rpm[1])
    numbers = waves_of_campbell(table, model)
    unseen = unseen_orders(numbers, model, table)

    def doubts(waves: list[WaveBranches]) -> tuple[str, ...]:
        unfollowed = unfollowed_orders(waves, model, table, speeds)
        return (*basis_doubts(waves), *campbell_doubts(unfollowed, unseen, waves))

    def write(waves: list[WaveBranches], complete: bool) -> None:
        origin = run.origin(model, np.nan, static, complete=complete, doubts=doubts(waves))
        unfollowed = unfollowed_orders(waves, model, table, speeds)
        data = campbell_dataset(waves, speeds, table.engine_orders, unfollowed, model.facts, origin)
        write_dataset(data, run.target)

    waves = run.each(numbers, lambda k: follow_wave(model, k, table, speeds), write)
    tables = campbell_tables(waves, speeds, model.sectors)
    return run.summary(tables, model, static, doubts(waves))


def _safe(run: _Run) -> StructureSummary:
    table, rpm = run.study.tables.safe, _safe_rpm(run.study)
    assert table is not None
    model = run.model()
    static, speed = run.static(model, rpm), RPM * rpm
    at = speed if model.rotating is not None else 0.0
    numbers = waves_of_modes(None, model, at)

    def write(waves: list[WaveModes], complete: bool) -> None:
        if complete:
            found = interference(waves, model, table, speed)
            origin = run.origin(model, rpm, static, complete=True, doubts=safe_doubts(found))
            write_dataset(safe_dataset(waves, found, model.facts, origin), run.target)

    waves = run.each(numbers, lambda k: solve_wave(model, at, k, table.modes, shapes=False), write)
    found = interference(waves, model, table, speed)
    return run.summary(safe_tables(found), model, static, safe_doubts(found))


def _progress(wave: WaveModes | WaveBranches) -> str:
    low, high = wave.frequencies_hz.min(), wave.frequencies_hz.max()
    basis = f", basis good to {wave.error:.0e}" if isinstance(wave, WaveBranches) else ""
    return (
        f"wave number {wave.wave_number}: {low:.6g} to {high:.6g} Hz in {wave.seconds:.1f} s{basis}"
    )


def _check_cheaply(study: StructureStudy, command: Command) -> None:
    """Refuse what can be told before the model is built."""
    if getattr(study.tables, command) is None:
        raise input_error(
            f"{study.path}: {command}",
            "is missing",
            f"Add the table [{command}]: 'stickslip new NAME --kind sector' writes an example.",
        )
    if command == "modes":
        read_reference(study)
    if command == "safe" and _safe_rpm(study) <= 0:
        raise input_error(
            f"{study.path}: safe.speed_rpm",
            f"must be above zero, got {_safe_rpm(study):g}",
            "Give the speed at which the engine orders act.",
        )


def _check_model(study: StructureStudy, command: Command, model: DiskModel) -> None:
    """Refuse a model that the command can do nothing with."""
    if command == "campbell" and model.rotating is None:
        raise input_error(
            f"{study.path}: campbell",
            "the model is matrices, which no speed changes",
            "Bring the mesh (a deck or an archive of one material) instead of matrices.",
        )
    if command == "safe" and model.sectors == 1:
        raise input_error(
            f"{study.path}: safe",
            "the model is a whole structure, not a sector",
            "An interference diagram needs cyclic symmetry; give the sector and the number of sectors.",
        )


def _safe_rpm(study: StructureStudy) -> float:
    """Return the speed of the interference diagram."""
    table = study.tables.safe
    own = None if table is None else table.speed_rpm
    return study.tables.rotation.speed_rpm if own is None else own


def _in_words(model: DiskModel, rpm: float | None) -> str:
    """Say which effects of rotation are in the numbers."""
    if model.rotating is None:
        return "matrices as read, unchanged by speed"
    if rpm == 0:
        return "at rest"
    speed = "at each speed" if rpm is None else f"{rpm:g} rpm"
    coriolis = "with" if model.rotation.coriolis else "without"
    return f"{speed}, {model.rotation.tangent} tangent, {coriolis} Coriolis forces"

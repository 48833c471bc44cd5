"""The tables [mistuning.NAME] as part of a model, their errors that can be found without a mesh, and parts that occur in single sectors only."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.contact import NEXT
from stickslip.assembly.model import Model
from stickslip.assembly.sides.deviations import blade_alone_hz
from stickslip.assembly.sides.mistuning import BladeMistuning, ContactMistuning, Mistuning, OwnSector, pattern
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.part import Part
from stickslip.model.readers.measured_columns import read_columns
from stickslip.study.file.model.mistuning import MOST_MODES, MistuningTable
from stickslip.study.file.model.parts import Lumped
from stickslip.study.file.tables import Tables, original
from stickslip.study.store.progress import LOG

FROM_ZERO = "Blades count from 0, not from 1: number them 0 to "
BLADE_COLUMNS = ("blade", "mode", "frequency_hz")


def mistuning_of(
    tables: Tables, home: Path, model: Model, parts: Mapping[str, Part], own_name: Any
) -> Mistuning | None:
    """Return the mistuning of a model; None for a study without [mistuning].

    Parameters
    ----------
    tables
        Tables of a case.
    home
        Folder to which file names are relative.
    model
        The wheel with equal sectors.
    parts
        All parts of the study, including spare parts.
    own_name
        Function that turns a name of the study into a name of the model.

    Raises
    ------
    InputError
        If a file cannot be read or does not fit the wheel.
    """
    if not tables.mistuning:
        return None
    blades, contacts, own = {}, {}, {}
    for name, table in tables.mistuning.items():
        if table.part is not None:
            assert table.sector is not None
            own[name] = OwnSector(sector=table.sector, part=table.part, by=parts[str(table.by)])
        elif table.contact is not None:
            quantity: Any = table.quantity
            contacts[name] = ContactMistuning(
                contact=table.contact, quantity=quantity, values=_values(table, model.sectors)
            )
        else:
            blades[name] = _blades(name, table, home, model, own_name(table.of))
    return Mistuning(blades=blades, contacts=contacts, own=own)


def _values(table: MistuningTable, sectors: int) -> FloatArray:
    given = table.deviations or table.gaps_m
    if given is not None:
        return np.tile(np.array(given), sectors // len(given))
    spread = table.standard_deviation_m or table.standard_deviation
    assert table.distribution is not None
    assert spread is not None
    return pattern(sectors, table.distribution, spread, table.seed)


def _blades(name: str, table: MistuningTable, home: Path, model: Model, of: str) -> BladeMistuning:
    key, modes = f"mistuning.{name}", None if table.modes == "all" else table.modes
    quantity: Any = table.quantity or "frequency"
    if table.file is None:
        try:
            return BladeMistuning(
                of=of,
                deviations=_values(table, model.sectors),
                modes=modes,
                quantity=quantity,
                beyond_radius=table.beyond_radius_m,
            )
        except InputError as error:
            raise error.at(key) from None
    measured = read_blades(home / table.file, model.sectors)
    alone = blade_alone_hz(model, of, measured.shape[1], f"{key}.of", table.beyond_radius_m)
    if alone.size < measured.shape[1]:
        raise input_error(
            f"{key}.file",
            f"has {measured.shape[1]} modes, and the model's blade has {alone.size}",
            "Leave the others out.",
        )
    LOG.info(f"{key}: {_means(table, measured.mean(axis=0), alone)}")
    reference = alone if table.relative_to == "model" else measured.mean(axis=0)
    try:
        return BladeMistuning(of=of, deviations=measured / reference - 1.0, beyond_radius=table.beyond_radius_m)
    except InputError as error:
        raise error.at(f"{key}.file") from None


def _means(table: MistuningTable, mean: FloatArray, alone: FloatArray) -> str:
    """Return a sentence on the difference of the measured mean frequency from the model, and whether it is used."""
    pairs = zip(mean, alone, strict=False)
    told = "; ".join(
        f"mode {m}: measured blades have a mean of {f:.6g} Hz, the model's blade {own:.6g} Hz"
        for m, (f, own) in enumerate(pairs, start=1)
    )
    if table.relative_to == "model":
        return f"{told}. Relative to the model, so the difference of the mean counts"
    return f'{told}. Relative to the mean, so the mean is left out; relative_to = "model" takes it'


def read_blades(path: Path, sectors: int) -> FloatArray:
    """Return measured frequencies (n_s, modes) in Hz of single blades, from a CSV file with the columns blade, mode, frequency_hz.

    Raises
    ------
    InputError
        If a blade or mode is missing or occurs twice.
    """
    columns = read_columns(path)
    missing = [n for n in BLADE_COLUMNS if n not in columns.names]
    if missing:
        raise input_error(
            f"{path}: line 1",
            f"has no column {missing[0]}",
            "The columns are blade (from 0), mode (from 1) and frequency_hz.",
        )
    blade, mode, hertz = (columns.numbers(n) for n in BLADE_COLUMNS)
    found = np.full((sectors, MOST_MODES), np.nan)
    for row, (b, m, f) in enumerate(zip(blade, mode, hertz, strict=True)):
        if b != int(b) or not 0 <= b < sectors:
            raise columns.wrong(row, "blade", f"is no blade of 0 to {sectors - 1}", f"{FROM_ZERO}{sectors - 1}.")
        if m != int(m) or m < 1:
            raise columns.wrong(row, "mode", "is no number of a mode", "The lowest mode is 1.")
        if m > MOST_MODES:
            raise columns.wrong(row, "mode", f"is above {MOST_MODES}, the most that are read", "Mend the line.")
        if f <= 0:
            raise columns.wrong(row, "frequency_hz", "is no frequency", "Mend the line.")
        if np.isfinite(found[int(b), int(m) - 1]):
            raise columns.wrong(row, "mode", f"stands there twice for blade {int(b)}", "Leave one out.")
        found[int(b), int(m) - 1] = f
    found = found[:, : int(mode.max())]
    lost = np.argwhere(np.isnan(found))
    if lost.size:
        raise input_error(
            str(path),
            f"has no frequency of blade {lost[0][0]}, mode {lost[0][1] + 1}, {len(lost)} missing in all",
            "Give every blade all modes that one blade has."
            + (f" {FROM_ZERO}{sectors - 1}." if blade.min() > 0 else ""),
        )
    return found


def spare_parts(tables: Tables) -> set[str]:
    """Return the parts that occur in single sectors only."""
    return {table.by for table in tables.mistuning.values() if table.by is not None}


def mistuning_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield errors in [mistuning] that can be found before meshing."""
    yield from _spare_refusals(tables)
    for name, table in tables.mistuning.items():
        key = f"mistuning.{name}"
        if sectors == 1:
            yield input_error(
                key,
                "is given, and the model is no sector of a wheel",
                "Give a part its number of sectors, or leave the table out.",
            )
        if table.contact is not None and table.contact not in tables.contact:
            known = list(tables.contact)
            yield input_error(
                f"{key}.contact", f"there is no contact {table.contact!r}", did_you_mean(table.contact, known)
            )
        yield from _own_refusals(tables, key, table)
        if table.of is not None and table.of.partition(".")[0] not in tables.part:
            head = table.of.partition(".")[0]
            known = list(tables.part)
            yield input_error(f"{key}.of", f"there is no part {head!r}", did_you_mean(head, known))
        if table.file is not None and not (home / table.file).is_file():
            yield input_error(
                f"{key}.file",
                f"there is no file {home / table.file}",
                "Check the name; it is relative to the study's folder.",
            )
        given = table.deviations or table.gaps_m or []
        if sectors is not None and given and sectors % len(given):
            yield input_error(
                f"{key}.{'gaps_m' if table.gaps_m else 'deviations'}",
                f"has {len(given)} values, and {sectors} sectors are no multiple of that",
                "Give each sector one, or a pattern that fits.",
            )


def _own_refusals(tables: Tables, key: str, table: MistuningTable) -> Iterator[InputError]:
    """Yield errors about the part of a single sector."""
    unknown = False
    for word in ("part", "by"):
        named = getattr(table, word)
        if named is not None and named not in tables.part:
            unknown = True
            yield input_error(f"{key}.{word}", f"there is no part {named!r}", did_you_mean(named, list(tables.part)))
    if table.part is None or table.by is None or unknown:
        return
    whole = {one.part for one in tables.mistuning.values() if one.part is not None}
    if table.by in whole:
        own = "the wheel's own part" if table.by == table.part else "a part of all sectors"
        yield input_error(
            f"{key}.by", f"is {table.by!r}, {own}", "Name another [part.NAME], which stands in this sector alone."
        )
    old, new = original(tables, table.part), original(tables, table.by)
    before, after = getattr(old, "sectors", None), getattr(new, "sectors", None)
    if before is not None and after is not None and before != after:
        yield input_error(
            f"{key}.by",
            f"is {table.by!r} of {after} sectors, and {table.part!r}, in whose place it stands, has {before}",
            f"Give both sectors = {before}.",
        )
    if isinstance(old, Lumped) and isinstance(new, Lumped) and _elsewhere(old, new):
        yield input_error(
            f"{key}.by",
            f"is {table.by!r} with the masses {', '.join(new.labels)}, and {table.part!r}, in whose place it stands, "
            f"has {', '.join(old.labels)}",
            "Give both the same masses in the same order.",
        )


def _elsewhere(old: Lumped, new: Lumped) -> bool:
    """Return whether a name common to both belongs to different masses; masses are matched by their order."""
    at = {name: i for i, name in enumerate(new.labels)}
    return any(at.get(name, i) != i for i, name in enumerate(old.labels))


def _spare_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield errors about surfaces of parts that occur in single sectors only."""
    spare = {one.by: one.part for one in tables.mistuning.values() if one.by and one.part}
    named = [
        *(
            (f"{kind}.{n}.between", w)
            for kind in ("contact", "join")
            for n, t in getattr(tables, kind).items()
            for w in t.between
        ),
        *((f"load.{n}.on", t.on) for n, t in tables.load.items()),
        *((f"output.points.{n}", t.on) for n, t in tables.output.points.items()),
        *((f"mistuning.{n}.of", t.of) for n, t in tables.mistuning.items() if t.of),
    ]
    for key, word in named:
        part = word.removeprefix(NEXT).partition(".")[0]
        if part in spare and part not in spare.values():
            yield input_error(
                key,
                f"names {word!r}, and {part!r} stands in a single sector alone",
                f"Name it of {spare[part]!r}, which is in all sectors.",
            )

"""From the tables [mistuning.NAME] to what a model holds of them."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.deviations import blade_alone_hz
from stickslip.assembly.mistuning import (
    BladeMistuning,
    ContactMistuning,
    Mistuning,
    OwnSector,
    pattern,
)
from stickslip.assembly.model import Model
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.part import Part
from stickslip.model.readers.measured_columns import read_columns
from stickslip.study.file.mistuning import MistuningTable
from stickslip.study.file.tables import Tables


def spare_parts(tables: Tables) -> set[str]:
    """Return the parts that stand in single sectors alone."""
    return {table.by for table in tables.mistuning.values() if table.by is not None}


def mistuning_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield what is wrong with [mistuning] before any mesh is made."""
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
                f"{key}.contact",
                f"there is no contact {table.contact!r}",
                did_you_mean(table.contact, known),
            )
        for word in ("part", "by"):
            named = getattr(table, word)
            if named is not None and named not in tables.part:
                known = list(tables.part)
                yield input_error(
                    f"{key}.{word}", f"there is no part {named!r}", did_you_mean(named, known)
                )
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


def mistuning_of(
    tables: Tables, home: Path, model: Model, parts: Mapping[str, Part], own_name: Any
) -> Mistuning | None:
    """Return what a model holds of [mistuning]; None where the study has none.

    Parameters
    ----------
    tables
        Of a case.
    home
        Folder that names of files are relative to.
    model
        The wheel with all sectors alike.
    parts
        All parts of the study, spare ones too.
    own_name
        From a name of the study to that of the model.

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
    reference = measured.mean(axis=0)
    if table.relative_to == "model":
        reference = blade_alone_hz(model, of, measured.shape[1], f"{key}.of", table.beyond_radius_m)
        if reference.size < measured.shape[1]:
            raise input_error(
                f"{key}.file",
                f"has {measured.shape[1]} modes, and the model's blade has {reference.size}",
                "Leave the others out.",
            )
    try:
        return BladeMistuning(
            of=of, deviations=measured / reference - 1.0, beyond_radius=table.beyond_radius_m
        )
    except InputError as error:
        raise error.at(f"{key}.file") from None


def read_blades(path: Path, sectors: int) -> FloatArray:
    """Return measured frequencies (n_s, modes) in Hz of blades by themselves, from a CSV file with columns blade, mode, frequency_hz.

    Raises
    ------
    InputError
        If a blade or mode is missing, or stands there twice.
    """
    columns = read_columns(path)
    missing = [n for n in ("blade", "mode", "frequency_hz") if n not in columns.names]
    if missing:
        raise input_error(
            f"{path}: line 1",
            f"has no column {missing[0]}",
            "The columns are blade (from 0), mode (from 1) and frequency_hz.",
        )
    blade, mode, hertz = (columns.numbers(n) for n in ("blade", "mode", "frequency_hz"))
    modes = int(mode.max())
    found = np.full((sectors, max(modes, 1)), np.nan)
    for row, (b, m, f) in enumerate(zip(blade, mode, hertz, strict=True)):
        if b != int(b) or not 0 <= b < sectors:
            raise columns.wrong(
                row, "blade", f"is no blade of 0 to {sectors - 1}", "Mend the line."
            )
        if m != int(m) or m < 1:
            raise columns.wrong(row, "mode", "is no number of a mode", "The lowest mode is 1.")
        if f <= 0:
            raise columns.wrong(row, "frequency_hz", "is no frequency", "Mend the line.")
        if np.isfinite(found[int(b), int(m) - 1]):
            raise columns.wrong(
                row, "mode", f"stands there twice for blade {int(b)}", "Leave one out."
            )
        found[int(b), int(m) - 1] = f
    lost = np.argwhere(np.isnan(found))
    if lost.size:
        raise input_error(
            str(path),
            f"has no frequency of blade {lost[0][0]}, mode {lost[0][1] + 1}, {len(lost)} missing in all",
            "Give every blade all modes that one blade has.",
        )
    return found

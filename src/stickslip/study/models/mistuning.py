"""The tables [mistuning.NAME] as part of a model."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.assembly.sides.deviations import blade_alone_hz
from stickslip.assembly.sides.mistuning import BladeMistuning, ContactMistuning, Mistuning, OwnSector, pattern
from stickslip.errors import InputError, input_error
from stickslip.model.part import Part
from stickslip.model.readers.measured_columns import read_columns
from stickslip.study.file.model.mistuning import MOST_MODES, MistuningTable
from stickslip.study.file.tables import Tables
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
        Function from a name in the study to the name in the model.

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

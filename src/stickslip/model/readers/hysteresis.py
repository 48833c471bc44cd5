"""Measured hysteresis loops from a CSV file."""

from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import did_you_mean, input_error
from stickslip.model.readers.measured_columns import FORCES, LENGTHS, read_columns

LOOP = "loop"  # column that tells recordings apart


def read_loops(path: str | Path) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Read displacement and force of hysteresis loops, in SI.

    The columns are ``displacement_m`` (or ``_mm``, ``_um``) and ``force_n`` (or ``_kn``), in the order of time. A column ``loop``
    tells recordings apart that do not follow on each other; other columns are passed over.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple
        For each recording the displacements (n,) in m and forces (n,) in N.

    Raises
    ------
    InputError
        If the file cannot be read; it names the line and the cell.
    """
    if not Path(path).is_file():
        near = [p.name for p in Path(path).parent.glob("*.csv")]
        raise input_error(
            str(path), "there is no such file", did_you_mean(Path(path).name, near) if near else "Check the path."
        )
    table = read_columns(Path(path))
    displacement = table.required("displacement", LENGTHS)
    force = table.required("force", FORCES)
    if LOOP not in table.names:
        return ((displacement, force),)
    at = table.names.index(LOOP)
    of = np.array([row[at] for row in table.rows])
    names = list(dict.fromkeys(of.tolist()))
    again = np.flatnonzero(of[1:] != of[:-1]) + 1
    if len(again) != len(names) - 1:
        row = next(int(i) for i in again if of[i] in of[:i])
        raise table.wrong(
            row, LOOP, "comes back to an earlier recording", "Give each recording in one piece, or another name."
        )
    return tuple((displacement[of == name], force[of == name]) for name in names)

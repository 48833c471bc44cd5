"""Modes of a mistuned wheel, next to the waves of the tuned one."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.records.bounds import localisation
from stickslip.analyses.waves.records.dataset import Variables
from stickslip.analyses.waves.solve import Question
from stickslip.assembly.sides.wheel_modes import wheel_modes
from stickslip.study.analysis import TextTable
from stickslip.study.store.netcdf import variable

NOTE = "mistuned"
MOST_ROWS = 40  # of modes on the screen


def solved(question: Question) -> dict[str, Any]:
    """Return the modes of the wheel as named arrays, as many a blade as the table asks for a wave."""
    model = question.model
    found = wheel_modes(model, question.n_modes * model.sectors, question.contacts)
    return {"mistuned_hz": found.frequencies_hz, "sector_share": found.sector_share, "wave_share": found.wave_share}


def variables(note: Mapping[str, Any] | None) -> Variables:
    """Return these modes as variables; none for a tuned wheel."""
    if not note:
        return {}
    hertz, sectors, waves = (np.asarray(note[n]) for n in ("mistuned_hz", "sector_share", "wave_share"))
    factors = [localisation(np.sqrt(np.maximum(row, 0.0))) for row in sectors]
    about = "share of the kinetic energy of a mode of the wheel"
    return {
        "mistuned_hz": variable("wheel_mode", hertz, "Hz", "natural frequency of the wheel whose sectors differ"),
        "sector_share": variable("wheel_mode blade", sectors, "1", f"{about} in each sector"),
        "wave_share": variable("wheel_mode wave_of_wheel", waves, "1", f"{about} in each wave number"),
        "mode_localisation": variable(
            "wheel_mode",
            np.array(factors),
            "1",
            "localisation factor: 0 where all blades move alike, 1 where one moves alone",
        ),
    }


def table(case: Any) -> list[TextTable]:
    """Return the terminal table of these modes."""
    if "mistuned_hz" not in case:
        return []
    share, waves = case["sector_share"].values, case["wave_share"].values
    n = share.shape[1]
    rows = []
    for i, hertz in enumerate(case["mistuned_hz"].values[:MOST_ROWS]):
        blade, k = int(np.argmax(share[i])), int(np.argmax(waves[i]))
        both = waves[i, k] + (waves[i, (n - k) % n] if 0 < 2 * k != n else 0.0)
        rows.append(
            (
                str(i + 1),
                f"{hertz:.7g}",
                f"{float(case['mode_localisation'][i]):.3f}",
                f"{blade} ({100 * share[i, blade]:.0f} %)",
                f"{min(k, n - k)} ({100 * both:.0f} %)",
            )
        )
    more = len(case["mistuned_hz"]) - len(rows)
    title = "Modes of the wheel, its sectors as they differ" + (f"; {more} more in the result" if more > 0 else "")
    head = ("mode", "Hz", "localisation", "largest blade", "nodal diameters")
    return [TextTable(title, head, tuple(rows))]

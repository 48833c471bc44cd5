"""The table that says whether motions are stable."""

import numpy as np

from stickslip.report.content import Table, Words
from stickslip.report.quantities import NONE, fixed, number
from stickslip.report.response import Response
from stickslip.response.stability.modulus import modulus_text
from stickslip.study.analyses.forced_response.stable_words import FEW, all_lines

BY_MOTION = ", the motion in time being "  # in the sentence of a point whose multipliers leave it undecided


def stability(response: Response) -> list[Table | Words]:
    """One row a point that was examined: verdict and multiplier."""
    names = [f"stability_{word}" for word in ("case", "frequency_hz", "verdict", "multiplier", "multiplier_error")]
    if not response.has(*names):
        return []
    case = response.integers(names[0])
    hz, size, error = (response.floats(name) for name in (names[1], *names[3:]))
    verdict = [str(text) for text in response.data[names[2]].values]
    told_each = response.has("stability_sentence")
    told = response.labels_of("stability_sentence") if told_each else [""] * len(verdict)
    by = ["motion in time" if BY_MOTION in text else "multiplier" for text in told]
    rows = [
        [
            response.cases[int(case[i])].short,
            fixed(float(hz[i]), 3),
            verdict[i],
            by[i] if verdict[i] in ("stable", "unstable") else NONE,
            modulus_text(float(size[i])) if np.isfinite(size[i]) else NONE,
            _error(float(error[i])),
        ]
        for i in range(len(verdict))
    ]
    text = (
        "Whether a small disturbance of the motion dies. Each is multiplied by so much in a period; above 1 by more "
        "than its error a machine does not stay there. Where the error reaches 1 the motion in time decides, or nothing does."
    )
    head = ["frequency (Hz)", "verdict", "decided by", "largest multiplier", "its error"]
    lines = all_lines(response.data, [c.label for c in response.cases]) if told_each else ()
    if len(rows) > FEW:
        every = response.table("", (), head, rows, folded=f"All {len(rows)} points")
        return [Words((text,), "Stability", lines), every]
    return [response.table("Stability", (text,), head, rows, items=lines)]


def _error(error: float) -> str:
    """Write the error of a multiplier; it has none where no force acts on more harmonics."""
    if not np.isfinite(error):
        return "not known"
    return number(error, 2) if error > 0.0 else "none"

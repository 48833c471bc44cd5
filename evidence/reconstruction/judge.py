"""What of the paper a candidate tests and shows: one word of the table a statement."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from evidence.models.two_blades import TwoBlades
from evidence.reconstruction.measure import (
    ALARM,
    ELEVEN,
    FIVE,
    HERTZ,
    JUDGED,
    RATIOS,
    Passage,
    actual,
    at_peak,
    in_time,
    moves,
    passage,
    predicted,
    static_loads,
)

ONE_PERCENT = 0.01
SMALL = 0.005  # from here to ALARM predicted and actual error are said to be alike
DIAGONAL = 0.25
LEAST = 0.25  # load of the line that carries less, over the other's
SHUT = 0.05  # share of the time for which a line that is said to be shut may open


@dataclass(frozen=True)
class Word:
    """A statement in a few words, and whether eleven harmonics or the motion in time are needed to judge it."""

    text: str
    costly: bool = False


WORDS = {
    "loads": Word("L1 and L2 both carry load"),
    "stuck": Word("fully stuck at 250"),
    "weak": Word("20: slips, and one harmonic is enough"),
    "strong": Word("5: alarms in one interval inside the range"),
    "strongest": Word("2: alarms in one interval inside the range"),
    "falls": Word("the resonance falls from 250 to 5 to 2"),
    "R slips": Word("5: R slips while L1 and L2 stay shut"),
    "lifts": Word("2: points slip and lift off"),
    "under": Word("2: one harmonic underestimates the resonance", costly=True),
    "above": Word("2: one harmonic puts it too high in frequency", costly=True),
    "safe": Word("no actual error above 5 % where less is predicted", costly=True),
    "diagonal": Word("0.5 to 5 %: predicted and actual error alike", costly=True),
    "periodic": Word("20, 5, 2: periodic motion in time at the resonance", costly=True),
    "in time 20": Word("20: five harmonics within 1 % of time", costly=True),
    "in time 5": Word("5: five harmonics within 1 % of time", costly=True),
    "in time 2": Word("2: five harmonics within 1 % of time", costly=True),
}


def cheap(blades: TwoBlades) -> dict[str, Any]:
    """Return what one harmonic and its predictions say: the words, and the numbers behind them."""
    loads = static_loads(blades)
    few = {r: passage(blades, r, 1) for r in RATIOS}
    error = {r: predicted(few[r]) for r in RATIOS}
    slip = {r: moves(few[r]) for r in RATIOS}
    lines = {r: at_peak(blades, few[r]) for r in (5.0, 2.0)}
    alarms = {r: _alarms(few[r], error[r]) for r in RATIOS}
    peaks = {r: few[r].peak for r in RATIOS}
    words = {
        "loads": min(loads[:2]) >= LEAST * max(loads[:2]),
        "stuck": not slip[250.0].any(),
        "weak": bool(slip[20.0].any()) and not alarms[20.0],
        "strong": _interval(few[5.0], alarms[5.0]),
        "strongest": _interval(few[2.0], alarms[2.0]),
        "falls": peaks[250.0] > peaks[5.0] > peaks[2.0],
        "R slips": lines[5.0][2][0] > 0.0 and all(o <= SHUT for _, o in lines[5.0][:2]),
        "lifts": any(o > 0.0 for _, o in lines[2.0]) and any(s > 0.0 for s, _ in lines[2.0]),
    }
    return {
        "words": words,
        "loads": loads,
        "alarms": {r: [min(a), max(a), len(a)] if a else [] for r, a in alarms.items()},
        "peaks": peaks,
        "largest": {r: float(e.max()) for r, e in error.items()},
        "lines": lines,
    }


def costly(blades: TwoBlades) -> dict[str, Any]:
    """Return what five and eleven harmonics and the motion in time say."""
    few, five, eleven = ({r: passage(blades, r, order) for r in JUDGED} for order in (1, FIVE, ELEVEN))
    pairs = np.concatenate([np.column_stack([predicted(few[r]), actual(few[r], five[r])]) for r in JUDGED])
    pairs = pairs[np.isfinite(pairs).all(axis=1)]
    band = pairs[(pairs[:, 0] >= SMALL) & (pairs[:, 0] <= ALARM)]
    times = {r: in_time(blades, five[r]) for r in JUDGED}
    error = {r: five[r].amplitude(five[r].peak) / times[r][1] - 1.0 for r in JUDGED}
    top = {r: max(eleven[r].amplitude(f) for f in eleven[r].points) for r in JUDGED}
    one = {r: few[r].amplitude(few[r].peak) / top[r] - 1.0 for r in JUDGED}
    shift = {r: few[r].peak - eleven[r].peak for r in JUDGED}
    words = {
        "under": one[2.0] < 0.0,
        "above": shift[2.0] > 0.0,
        "safe": not np.any((pairs[:, 0] <= ALARM) & (pairs[:, 1] > ALARM)),
        "diagonal": len(band) > 0 and bool(np.all(np.abs(band[:, 1] / band[:, 0] - 1) <= DIAGONAL)),
        "periodic": all(t[0] in {"periodic", "settled"} for t in times.values()),
        **{f"in time {r:g}": abs(error[r]) <= ONE_PERCENT for r in JUDGED},
    }
    return {
        "words": words,
        "one": one,
        "five": error,
        "shift": shift,
        "motion": {r: t[0] for r, t in times.items()},
        "band": len(band),
        "near": int(np.sum(np.abs(band[:, 1] / band[:, 0] - 1) <= DIAGONAL)),
        "missed": int(np.sum((pairs[:, 0] <= ALARM) & (pairs[:, 1] > ALARM))),
    }


def _alarms(few: Passage, error: np.ndarray) -> list[float]:
    return [f for f, e in zip(few.points, error, strict=True) if e > ALARM]


def _interval(few: Passage, alarms: list[float]) -> bool:
    """Return whether there are alarms, without a gap, and not at the ends of the range."""
    if not alarms:
        return False
    inside = [f for f in few.points if min(alarms) <= f <= max(alarms)]
    return len(inside) == len(alarms) and HERTZ[0] < min(alarms) and max(alarms) < HERTZ[1]

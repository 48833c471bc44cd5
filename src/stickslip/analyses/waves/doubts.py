"""Doubts about the results of a bladed disk: engine orders not judged, large displacements, inaccurate bases."""

import math
from collections.abc import Sequence

import numpy as np

from stickslip.analyses.waves.records.results import WaveBranches
from stickslip.arrays import FloatArray
from stickslip.assembly.statics import MOST_DISPLACEMENT, MOST_ROTATION, MOST_STRAIN, StaticState
from stickslip.response.rotating.safe import Safe
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM, millimetres

BASIS_ERROR = 1e-4  # relative, of frequencies in a Campbell diagram, above which there is a warning


def basis_doubts(waves: Sequence[WaveBranches]) -> tuple[Verdict, ...]:
    """Doubt a Campbell diagram whose reduced basis is too small."""
    remedy = "Ask for more campbell.modes, or for a narrower range of speeds."
    poor = [w for w in waves if not w.error <= BASIS_ERROR]
    said = [
        f"wave number {w.wave_number}: frequencies between the speeds of the basis are off by up to {w.error:.1e}, relative"
        for w in poor
    ]
    return tuple(Verdict("doubtful", why=why, remedy=remedy) for why in said)


def static_doubts(state: StaticState | None, *, contacts: bool = False) -> tuple[Verdict, ...]:
    """Doubt centrifugal displacements too large for linear statics; those restrained by `contacts` are included."""
    if state is None or not state.too_large:
        return ()
    alone = ", without what contacts hold back," if contacts else ""
    why = (
        f"the static displacement at {state.speed / RPM:g} rpm{alone} is too large for linear statics: up to {millimetres(state.displacement)} "
        f"at a radius of {millimetres(state.radius)}, strains up to {100 * state.strain:.3g} %, rotations up to "
        f"{state.rotation:.3g} rad (the limits are {100 * MOST_DISPLACEMENT:g} % of the radius, {100 * MOST_STRAIN:g} %, "
        f"{MOST_ROTATION:g} rad); frequencies at this speed are in doubt"
    )
    remedy = "Check the speed (rpm), the material (Young's modulus in Pa, density in kg/m3) and the supports."
    return (Verdict("doubtful", why=why, remedy=remedy),)


def safe_doubts(found: Safe) -> tuple[Verdict, ...]:
    """Doubt engine orders above the computed modes of their nodal diameters, and say how many modes are needed."""
    orders = found.not_judged
    if not orders:
        return ()
    sectors, per_order = found.frequencies.sectors, found.speed_range[1] / HZ
    highest = {m: float(found.frequencies.of_wave(m).max()) for m in orders}
    n_modes = found.frequencies.frequencies_hz.shape[1]
    ratio = max(m * per_order * (1 + found.allowed) / max(highest[m], 1e-300) for m in orders)
    diameters = {min(m % sectors, -m % sectors) for m in orders}
    excited = [m * per_order for m in orders]
    why = (
        f"engine orders {in_ranges(orders)} are not judged: they excite nodal diameters {in_ranges(diameters)} at "
        f"{_span(excited)} Hz, and with the margin that lies above the highest computed modes ({_span(list(highest.values()))} "
        "Hz), where other modes may be near"
    )
    remedy = f"Raise safe.modes, now {n_modes}, to {_more(n_modes, ratio)} or more."
    return (Verdict("doubtful", why=why, remedy=remedy),)


def campbell_doubts(
    unfollowed: Sequence[tuple[int, float]], unseen: Sequence[int], waves: Sequence[WaveBranches]
) -> tuple[Verdict, ...]:
    """Doubt engine orders above the followed modes, and those that excite nodal diameters left out.

    Parameters
    ----------
    unfollowed
        Engine order, and speed in rpm above which it lies over all followed modes that it excites.
    unseen
        Engine orders whose nodal diameter has no diagram.
    waves
        All waves with a diagram.
    """
    said = []
    if unfollowed:
        named = ", ".join(f"{m} (from {rpm:.4g} rpm)" for m, rpm in unfollowed)
        n_modes = waves[0].frequencies_hz.shape[1]
        why = (
            f"above the followed modes of the nodal diameters that they excite, engine orders are not judged: {named}; other "
            "modes may cross them there"
        )
        said.append((why, f"Raise campbell.modes, now {n_modes}."))
    if unseen:
        why = (
            f"engine orders {in_ranges(unseen)} have no crossings here, because campbell.nodal_diameters leaves out the nodal "
            "diameters that they excite"
        )
        said.append((why, "Add these, or leave the key out."))
    return tuple(Verdict("doubtful", why=why, remedy=remedy) for why, remedy in said)


def unfollowed_from(order: int, hertz: FloatArray, speeds: FloatArray) -> float | None:
    """Return the speed in rpm above which an engine order lies over all modes; None if there is none in the range.

    Parameters
    ----------
    order
        Engine order.
    hertz
        (s, m) frequencies of the wave that it excites.
    speeds
        (s,) in rad/s, ascending.
    """
    # squares of frequencies are nearly straight in the square of the speed
    above = (order * speeds / HZ) ** 2 - hertz.max(axis=1) ** 2
    where = np.flatnonzero(above > 0)
    if not where.size:
        return None
    first, squares = int(where[0]), (speeds / RPM) ** 2
    if first == 0:
        return float(np.sqrt(squares[0]))
    share = above[first - 1] / (above[first - 1] - above[first])
    return float(np.sqrt(squares[first - 1] + share * (squares[first] - squares[first - 1])))


def in_ranges(numbers: Sequence[int] | set[int]) -> str:
    """Write whole numbers with ranges for three or more in a row: 1, 2, 5-9."""
    runs: list[list[int]] = []
    for number in sorted(set(numbers)):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    words = []
    for run in runs:
        words += [f"{run[0]}-{run[-1]}"] if len(run) > 2 else [str(n) for n in run]
    return ", ".join(words)


def _more(n_modes: int, ratio: float) -> int:
    """Estimate how many modes reach `ratio` times as high: at most in proportion to frequency for blades."""
    return max(n_modes + 1, math.ceil(n_modes * min(ratio, 100.0)))


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.4g}", f"{max(values):.4g}"
    return low if low == high else f"{low} to {high}"

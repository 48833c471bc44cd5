"""Limit cycles on the page: damping and frequency over the amplitude, stability, and the dominant wave in time."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.limit_cycle.records import Cycle, CycleBranch, LimitCycles
from stickslip.analyses.limit_cycle.verdicts import grows
from stickslip.arrays import FloatArray
from stickslip.report.plot import INK, STABILITY_SYMBOLS, Plot, colour, log_ticks, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table, Words
from stickslip.units import HZ

_READING = "The curve gives the damping ratio of the motion at each amplitude. Below zero the motion grows, above zero it decays. Where the curve crosses zero the motion is a limit cycle. Upward crossings attract motions of the same wave. Downward crossings repel them, and friction cannot bound the motion beyond."
_JOINED = "Straight lines join the amplitudes computed and the limit cycles between them. Limit cycles have as many harmonics as they need."


class Cycles(CaseView[LimitCycles]):
    """One case."""

    kind = LimitCycles


def _with_cycles(branch: CycleBranch, motions: FloatArray, at_cycles: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return the amplitudes of a mode in rising order, limit cycles included, and a quantity at each of them.

    Parameters
    ----------
    branch
        The mode.
    motions
        (points,) the quantity at the examined amplitudes.
    at_cycles
        The quantity at its limit cycles.
    """
    known = np.isfinite(branch.amplitude)
    amplitude = np.append(branch.amplitude[known], [cycle.amplitude for cycle in branch.cycles])
    own = np.append(motions[known], at_cycles)
    order = np.argsort(amplitude, kind="stable")
    return amplitude[order], own[order]


def damping(view: Cycles) -> Plot | None:
    """Draw damping over amplitude; limit cycles are its zeros."""
    found = view.found
    if not found.branches:
        return None
    figure = _over_amplitude(found, [(100.0 * b.damping_ratio, [0.0] * len(b.cycles)) for b in found.branches])
    figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    _mark(found, figure, [0.0] * len(found.cycles))
    figure.update_yaxes(title_text="damping ratio of the motion (%)")
    return Plot(f"limit_cycles{view.key}", "Damping over the amplitude", _caption(found), figure)


def frequencies(view: Cycles) -> Plot | None:
    """Draw the frequency of the motions over amplitude."""
    found = view.found
    if not found.branches:
        return None
    own = [(b.motion_omega / HZ, [c.omega / HZ for c in b.cycles]) for b in found.branches]
    figure = _over_amplitude(found, own)
    _mark(found, figure, [cycle.omega / HZ for _, cycle in found.cycles])
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = (
        "As the amplitude grows, the frequency goes from the stuck mode's towards the frequency without friction. Limit cycles are "
        f"marked as above. {_JOINED}"
    )
    return Plot(f"limit_cycle_frequency{view.key}", "Frequency over the amplitude", caption, figure)


def waves_in_time(view: Cycles) -> Plot | None:
    """Draw the amplitudes of all waves in time after a mixed start of all unstable waves."""
    time, amplitude = view.found.time, view.found.wave_amplitude
    if time is None or amplitude is None or not amplitude.size:
        return None
    figure = go.Figure()
    scale = scale_for(amplitude, "m")
    largest = amplitude.max(axis=0)
    shown = [k for k in range(amplitude.shape[1]) if largest[k] > 1e-3 * largest.max()]
    for i, k in enumerate(shown):
        figure.add_scatter(
            x=time,
            y=scale.factor * amplitude[:, k],
            mode="lines",
            name=f"wave {k}",
            line={"color": colour(i), "width": 1.8},
            hovertemplate=f"wave {k}: %{{y:.4g}} {scale.unit} at %{{x:.4g}} s<extra></extra>",
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="time (s)")
    figure.update_yaxes(title_text=f"amplitude of each wave ({scale.unit})", rangemode="tozero")
    caption = f"Outcome of all sectors in time: **{view.found.outcome}**. The start mixes 30 % of the limit cycle of each unstable wave, or of its mode at the onset of slip. Waves are separated by the motion of all sectors at one time and by their direction. Another start may end elsewhere."
    return Plot(f"competing_waves{view.key}", "Competing waves in time", caption, figure)


def cycle_table(view: Cycles) -> Table | Words:
    """Return a table of limit cycles, and of modes without any."""
    found = view.found
    if not found.branches:
        told = f"No mode computed grows with contacts stuck; the least damping ratio is {number(100 * found.least_damping)} %."
        return Words((told,))
    head = ["mode", "amplitude", "frequency (Hz)", "harmonics", "stability", "multiplier", "in time"]
    lines = [_row(branch, cycle) for branch, cycle in found.cycles]
    return Table(head, lines, "Limit cycles", items=_without(found))


def _row(branch: CycleBranch, cycle: Cycle) -> list[str]:
    multiplier = f"{number(cycle.multiplier, 5)} ± {number(cycle.multiplier_error, 2)}"
    grown = grows(cycle)
    return [
        branch.name,
        quantity(cycle.amplitude, "m", 5),
        number(cycle.omega / HZ, 7),
        f"{cycle.harmonics}{'' if cycle.enough else ' (not enough)'}",
        f"**{cycle.stability}**{f'{grown} grows' if grown else ''}",
        multiplier if np.isfinite(cycle.multiplier) else NONE,
        _in_time(cycle),
    ]


def _in_time(cycle: Cycle) -> str:
    if cycle.time_amplitude is None or not np.isfinite(cycle.time_amplitude):
        return NONE
    off = 100 * (cycle.time_amplitude / cycle.amplitude - 1.0)
    told = f"{number(off, 2)} % off"
    if cycle.stability == "unstable":  # a motion that stays near an unstable cycle for a while confirms nothing
        told += "; unstable, no confirmation"
    return f"{quantity(cycle.time_amplitude, 'm', 5)} ({told})"


def _without(found: LimitCycles) -> list[str]:
    """Name the modes that friction cannot bound."""
    said = [f"{b.name} (at most {number(100 * b.largest_damping_ratio)} %)" for b in found.branches if b.unbounded]
    if not said:
        return []
    return [f"**Friction cannot bound** {joined(said)}: the damping is negative at every amplitude."]


def _over_amplitude(found: LimitCycles, own: Sequence[tuple[FloatArray, Sequence[float]]]) -> go.Figure:
    """Draw a quantity of each mode over the amplitude, from its values at the motions and at the limit cycles."""
    figure = go.Figure()
    every = np.concatenate([branch.amplitude for branch in found.branches])
    scale = scale_for(np.array([np.nanmedian(every)]), "m")
    for i, (branch, (motions, at_cycles)) in enumerate(zip(found.branches, own, strict=True)):
        amplitude, values = _with_cycles(branch, motions, at_cycles)
        figure.add_scatter(
            x=scale.factor * amplitude,
            y=values,
            mode="lines",
            name=branch.name,
            line={"color": colour(i), "width": 2},
            hovertemplate=f"{branch.name}: %{{y:.6g}} at %{{x:.5g}} {scale.unit}<extra></extra>",
        )
    styled(figure, 460)
    ticks = log_ticks(scale.factor * every[np.isfinite(every)])
    title = f"amplitude of {found.output} ({scale.unit})"
    figure.update_xaxes(type="log", title_text=title, **ticks)
    figure.update_layout(meta={"factor": scale.factor, "unit": scale.unit})
    return figure


def _mark(found: LimitCycles, figure: go.Figure, heights: Sequence[float]) -> None:
    """Mark limit cycles by their stability."""
    factor, unit = figure.layout.meta["factor"], figure.layout.meta["unit"]
    of_branch = [i for i, branch in enumerate(found.branches) for _ in branch.cycles]
    every = [(cycle, i, height) for (_, cycle), i, height in zip(found.cycles, of_branch, heights, strict=True)]
    for word, symbol in STABILITY_SYMBOLS.items():
        own = [(c, i, height) for c, i, height in every if c.stability == word]
        if not own:
            continue
        lines = [colour(i) for _, i, _ in own]
        figure.add_scatter(
            x=factor * np.array([c.amplitude for c, _, _ in own]),
            y=np.array([height for _, _, height in own]),
            mode="markers",
            name=word,
            marker={"symbol": symbol, "size": 11, "color": lines, "line": {"width": 2, "color": lines}},
            hovertemplate=f"{word} limit cycle: %{{x:.5g}} {unit}<extra></extra>",
        )


def _caption(found: LimitCycles) -> str:
    parts = [_READING]
    if found.cycles:
        words = [cycle.stability for _, cycle in found.cycles]
        counts = [counted(words.count(word), f"{word} limit cycle") for word in STABILITY_SYMBOLS if word in words]
        parts.append(f"There are {joined(counts)} (marked).")
    bounded = [
        f"{b.name} {number(100 * b.largest_damping_ratio)} %"
        for b in found.branches
        if np.isfinite(b.largest_damping_ratio)
    ]
    if bounded:
        parts.append(f"Most damping: {joined(bounded)}.")
    return " ".join(parts)


def linear_table(view: Cycles) -> Table | None:
    """Return a table of frequency and damping of the modes with contacts stuck."""
    waves, hertz, ratio = view.found.linear_wave, view.found.linear_frequency_hz, view.found.linear_damping_ratio
    if waves is None or hertz is None or ratio is None:
        return None
    head = ["wave", *(f"mode {m + 1}: Hz, damping %" for m in range(hertz.shape[1]))]
    lines = [
        ["–" if k < 0 else str(k), *(_small(float(f), float(z)) for f, z in zip(own, damped, strict=True))]
        for k, own, damped in zip(waves, hertz, ratio, strict=True)
    ]
    return Table(head, lines, "Modes with contacts stuck")


def _small(hertz: float, ratio: float) -> str:
    if not np.isfinite(hertz):
        return NONE
    text = f"{number(hertz, 5)}, {number(100 * ratio, 3)}"
    return f"**{text}**" if ratio < 0 else text


def _cards(view: Cycles) -> list[Card]:
    found = view.found
    if not found.branches:
        return [Card("0", "modes grow by themselves", "contacts stuck")]
    words = [cycle.stability for _, cycle in found.cycles]
    note = f"{words.count('unstable')} unstable, {counted(len(found.branches), 'mode')} followed"
    lost = sum(branch.unbounded for branch in found.branches)
    if lost:
        note += f"; friction cannot bound {counted(lost, 'mode')}"
    return [Card(str(words.count("stable")), "stable limit cycles", note, lost > 0)]


_BLOCK = Block(
    "limit-cycles", "Vibration that nothing drives", (damping, frequencies, cycle_table, waves_in_time, linear_table)
)
SECTION: Section = Section("limit_cycle", ("linear_damping_ratio",), Cycles, (_BLOCK,), by_case=True, cards=_cards)

"""The working range in words, for the page and the terminal."""

from collections.abc import Sequence

import xarray as xr

from stickslip.analyses.forced_response.verdicts.working_range import (
    HALF_POWER,
    CurvePeak,
    WorkingRange,
    working_ranges,
)
from stickslip.study.verdict import said

TITLE = "Where friction works"


def range_lines(data: xr.Dataset) -> tuple[str, ...]:
    """Say of each curve of a forced response where friction works; nothing where nothing can be judged."""
    return tuple(said(own.others, text) for own in working_ranges(data) for text in range_sentences(own))


def range_sentences(own: WorkingRange) -> tuple[str, ...]:
    """Say where all contacts stick, where friction works and where it lets go; and which cases were left out."""
    told = [_stuck_end(own), _middle(own), _loose_end(own)] if own.judged else [_unknown(own)]
    if own.left_out:
        them = "; ".join(own.left_out)
        told.append(f"Not judged, as the verdict is wrong or the peak no resonance: {them}.")
    return tuple(text for text in told if text)


def _unknown(own: WorkingRange) -> str:
    return (
        f"Where friction works cannot be told from these values of {own.key}: at neither end do all contacts stick, and their states "
        "do not tell which end is nearer to it. Add values beyond both ends."
    )


def _of(own: WorkingRange, peak: CurvePeak) -> str:
    return f"{own.key} = {peak.value:g}"


def _size(own: WorkingRange) -> str:
    return "peak per unit of force" if own.per_force else "peak"


def _stuck_end(own: WorkingRange) -> str:
    if own.stuck is None:
        side = "above" if own.falling else "below"
        return f"At no value do all contacts stick at the peak: that end of the curve lies {side} {_of(own, own.peaks[0])}."
    side = "up" if own.falling else "down"
    shut = all(p.contacts.sticking == 1.0 for p in own.of("stuck"))
    still = "all contacts stick" if shut else "no contact slips, opens or closes"
    first = own.stuck is own.peaks[0]
    where = f"At {_of(own, own.stuck)}, the first value," if first else f"From {_of(own, own.stuck)} {side}"
    return (
        f"{where} {still} at the peak: friction dissipates nothing, and the resonance is that of the stuck "
        f"system, at {own.stuck.hertz:.5g} Hz."
    )


def _middle(own: WorkingRange) -> str:
    best, stuck = own.smallest, own.stuck
    if not own.stretches:
        return "" if stuck is None else _hardly(own, stuck)
    where = " and ".join(_stretch(own, peaks) for peaks in own.stretches)
    if stuck is None:
        return (
            f"Friction works {where}: there the {_size(own)} lies within 3 dB of the smallest one, at {best.value:g}."
        )
    return (
        f"Friction works {where}: there the {_size(own)} lies 3 dB or more below that of the stuck system. It is smallest at "
        f"{best.value:g}, {_percent(best.size / stuck.size)} of the stuck one, at {best.hertz:.5g} Hz."
    )


def _stretch(own: WorkingRange, peaks: Sequence[CurvePeak]) -> str:
    """Return from where to where, in words."""
    first, last = peaks[0], peaks[-1]
    if first is last:
        return f"at {_of(own, first)}"
    return f"from {_of(own, first)} to {last.value:g}"


def _hardly(own: WorkingRange, stuck: CurvePeak) -> str:
    """Say of friction that never takes the peak 3 dB down how near it stays to full stick."""
    off = [p.size / stuck.size - 1 for p in own.peaks]
    if max(off) > 1 / HALF_POWER - 1:
        best, worst = own.smallest, max(own.peaks, key=lambda p: p.size)
        return (
            f"At no value does friction take the {_size(own)} 3 dB below that of the stuck system: it is smallest at {best.value:g}, "
            f"{_percent(best.size / stuck.size)} of the stuck one, and largest at {worst.value:g}, {_percent(worst.size / stuck.size)}."
        )
    word = "Down" if own.falling else "Up"
    return (
        f"{word} to {_of(own, own.peaks[-1])} the {_size(own)} stays within {_percent(max(map(abs, off)))} of that of the stuck system: "
        "the contacts stiffen but hardly damp."
    )


def _loose_end(own: WorkingRange) -> str:
    gone, best, last = own.loose, own.smallest, own.peaks[-1]
    if gone:
        side = "below" if own.falling else "above"
        held = own.peaks[own.peaks.index(gone[0]) - 1]
        return f"Out of the working range {side} {_of(own, held)}: {_gone(own, gone)}{_saturated(best, last)}."
    if not own.of("works"):
        return ""
    risen = f"{last.size / best.size:.3g} times the smallest" if last is not best else "the smallest computed"
    return f"The other end was not reached: at {_of(own, last)}, the last value, the {_size(own)} is {risen}."


def _gone(own: WorkingRange, gone: Sequence[CurvePeak]) -> str:
    worst, best = gone[-1], own.smallest
    risen = f"the {_size(own)} has risen again, to {worst.size / best.size:.3g} times the smallest at {worst.value:g}"
    if own.stuck is not None:
        risen += f" ({_percent(worst.size / own.stuck.size)} of the stuck one)"
    risen += f", at {worst.hertz:.5g} Hz"
    if not any(p.contacts.holding for p in gone):
        return f"{risen}, and no contact sticks throughout the cycle"
    return f"{risen}, and contacts stick {_percent(worst.contacts.sticking)} of the cycle"


def _saturated(best: CurvePeak, last: CurvePeak) -> str:
    """Say how the loss over the amplitude grows while the amplitude does: a sliding contact loses four limits a unit of amplitude at most."""
    if not (best.loss > 0.0 and last.loss > 0.0 and last is not best):
        return ""
    grown, loss = last.amplitude / best.amplitude, last.loss / last.amplitude
    more = loss * best.amplitude / best.loss
    if grown <= 1.0:
        return ""
    becomes = f"grows {more:.3g} times" if more >= 1.0 else f"falls to {_percent(more)}"
    return f"; while the amplitude grows {grown:.3g} times, the energy lost in a cycle over the amplitude {becomes}"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"

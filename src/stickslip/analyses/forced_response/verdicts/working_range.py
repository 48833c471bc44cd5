"""The working range of the friction along an optimisation curve: its limits from peaks and contact states, and its description."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby, takewhile
from typing import Literal, get_args

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.columns import CaseNumbers, PeakPeriod, Verdicts, holds, of_cases
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.arrays import IntArray
from stickslip.contact.law import OPEN, SLIP
from stickslip.response.forced.collected import LOSS_SEEN
from stickslip.study.coordinates import families, first_varied_number, naming_of
from stickslip.study.file.case_names import Naming
from stickslip.study.verdict import LEVELS, said, together

Regime = Literal["stuck", "stiffens", "works", "lets go"]
REGIMES: tuple[Regime, ...] = get_args(Regime)  # datasets store the index of a regime
HALF_POWER = 0.5**0.5  # 3 dB: a peak of half the energy
MIN_PEAKS = 3  # least number of peaks of a curve
HELD_BY = (
    "ratio",
    "friction_coefficient",
    "slip_limit_n",
    "slip_limit_pa",
    "preload_n",
    "preload_pa",
    "interference_m",
)  # keys that make contacts stick longer as they grow; ratio: pull over excitation
FORCE = "force_n"  # key of a load
APART = 0.25  # least difference of the sticking fractions of the cycle by which the stuck end is known
SLIDES_MORE = 2.0  # least ratio of the losses per amplitude at both ends, for the same purpose
SETTINGS = (
    "forced_response",
    "harmonics",
    "limits",
    "output",
    "reduction",
    "retention",
    "solver",
)  # numerical settings: varying them takes no joint from stick to slip


@dataclass(frozen=True)
class ContactsAtPeak:
    """Contact states in the cycle of a peak.

    Parameters
    ----------
    sticking
        Fraction of the cycle in stick, averaged over all contacts.
    linear
        Whether no contact slips, opens, closes or dissipates, so that the system is linear at the peak.
    holding
        Whether any contact sticks during the whole cycle.
    """

    sticking: float
    linear: bool
    holding: bool


def contacts_at_peak(state: IntArray) -> ContactsAtPeak:
    """Return the contact states of a peak from states (contact, tangent, sample): 0 stick, 1 slip, 2 open."""
    slips, opens = (np.any(state == s, axis=1) for s in (SLIP, OPEN))
    stays = ~np.any(slips | opens, axis=1)
    shut = np.all(opens, axis=1)
    return ContactsAtPeak(
        sticking=float(np.mean(~(slips | opens))),
        linear=bool(np.all((stays | shut) & ~np.any(slips, axis=1))),
        holding=bool(np.any(stays)),
    )


@dataclass(frozen=True)
class CurvePeak:
    """A point of an optimisation curve.

    Parameters
    ----------
    value
        Value of the varied key.
    size
        Largest amplitude, divided by the force if every case has one; m or m/N.
    hertz
        Frequency of the peak, Hz.
    contacts
        Contact states at the peak.
    amplitude
        Largest amplitude, m.
    loss
        Energy dissipated by the contacts in a cycle, J; zero for rounding, NaN if unknown.
    case
        Index along ``case``.
    force
        Amplitude of the excitation, N; NaN if unknown.
    """

    value: float
    size: float
    hertz: float
    contacts: ContactsAtPeak
    amplitude: float = float("nan")
    loss: float = float("nan")
    case: int = -1
    force: float = float("nan")


@dataclass(frozen=True)
class WorkingRange:
    """An optimisation curve and its regimes.

    Parameters
    ----------
    peaks
        Peaks from the end at which contacts stick to the other end; by rising values if that end is unknown.
    regimes
        One for each peak, none if the stuck end is unknown. ``stuck``: linear; ``stiffens``: less than 3 dB below the stuck peak;
        ``works``: more; ``lets go``: beyond the smallest peak, and 3 dB above it or less than 3 dB below the stuck one.
    naming
        Word and unit of the varied key.
    others
        Name of the curve: the other varied keys with their values; empty for none.
    per_force
        Whether sizes are divided by the force.
    left_out
        Labels of cases whose largest amplitude is no valid peak.
    """

    peaks: tuple[CurvePeak, ...]
    regimes: tuple[Regime, ...]
    naming: Naming = Naming("", "")  # noqa: RUF009  # frozen
    others: str = ""
    per_force: bool = True
    left_out: tuple[str, ...] = ()

    @property
    def judged(self) -> bool:
        """Whether the end at which contacts stick is known."""
        return bool(self.regimes)

    def of(self, *regimes: Regime) -> list[CurvePeak]:
        """Return the peaks in some regimes, from the stuck end on."""
        return [p for p, own in zip(self.peaks, self.regimes, strict=True) if own in regimes]

    @property
    def stretches(self) -> list[list[CurvePeak]]:
        """Runs of neighbouring peaks at which friction works."""
        pairs = zip(self.peaks, self.regimes, strict=True)
        runs = groupby(pairs, key=lambda pair: pair[1])
        return [[p for p, _ in run] for regime, run in runs if regime == "works"]

    @property
    def loose(self) -> list[CurvePeak]:
        """Peaks beyond the working range; empty if friction works to the end or contacts never let go."""
        backwards = zip(self.peaks[::-1], self.regimes[::-1], strict=True)
        gone = takewhile(lambda pair: pair[1] == "lets go", backwards)
        return [p for p, _ in gone][::-1]

    @property
    def smallest(self) -> CurvePeak:
        """The optimum among the values computed."""
        return min(self.peaks, key=lambda p: p.size)

    @property
    def stuck(self) -> CurvePeak | None:
        """The stuck peak next to the first slip; None if no computed value has all contacts stuck."""
        own = self.of("stuck")
        return own[-1] if own else None

    @property
    def falling(self) -> bool:
        """Whether contacts stick at large values."""
        return self.peaks[0].value > self.peaks[-1].value


def regimes_of(peaks: Sequence[CurvePeak]) -> tuple[Regime, ...]:
    """Return the regime of each peak of a curve that begins at the stuck end."""
    first = next((i for i, p in enumerate(peaks) if not p.contacts.linear), len(peaks))
    best = int(np.argmin([p.size for p in peaks]))
    least = peaks[best].size
    known = peaks[first - 1].size * HALF_POWER if first else np.inf
    bound = known if first else least / HALF_POWER
    found: list[Regime] = []
    for i, p in enumerate(peaks):
        if i < first:
            found.append("stuck")
        elif i > best and least <= known and p.size > min(known, least / HALF_POWER):
            found.append("lets go")
        else:
            found.append("works" if p.size <= bound else "stiffens")
    return tuple(found)


def sticks_at(peaks: Sequence[CurvePeak], key: str = "") -> Literal["low", "high"] | None:
    """Return the end of a curve of rising values at which contacts stick; None if unknown.

    Evidence in this order: a linear peak, with all contacts stuck at one end or all open at the other; the meaning of
    the varied key; `_by_contacts`.
    """
    low, high = peaks[0], peaks[-1]
    stuck = [p.contacts.linear and p.contacts.sticking > 0.0 for p in (low, high)]
    gone = [p.contacts.linear and p.contacts.sticking == 0.0 for p in (low, high)]
    if stuck[0] != stuck[1]:
        return "low" if stuck[0] else "high"
    if gone[0] != gone[1]:
        return "low" if gone[1] else "high"
    name = key.rpartition(".")[2]
    if low.value > 0.0 and name in HELD_BY:
        return "high"
    if low.value > 0.0 and name == FORCE and _excites(low, high):
        return "low"
    return _by_contacts(low, high)


def _excites(low: CurvePeak, high: CurvePeak) -> bool:
    """Whether the varied force is the excitation, not a static load, even one to which the excitation is proportional."""
    scaled = np.isclose(high.force * low.value, low.force * high.value, rtol=1e-9)
    return bool(scaled and not np.isclose(low.size, high.size, rtol=1e-3))


def _by_contacts(low: CurvePeak, high: CurvePeak) -> Literal["low", "high"] | None:
    """Return the end at which contacts stick for a much larger fraction of the cycle and dissipate less relative to the amplitude.

    A contact that opens also slips less, so small differences of the fraction prove nothing.
    """
    more = low.contacts.sticking - high.contacts.sticking
    holds, slides = (low, high) if more > 0.0 else (high, low)
    lost = [p.loss / p.amplitude for p in (holds, slides)]
    if abs(more) < APART or not lost[1] > SLIDES_MORE * lost[0]:
        return None
    return "low" if more > 0.0 else "high"


def working_range(peaks: Sequence[CurvePeak], key: str = "") -> WorkingRange | None:
    """Sort a curve over a key and judge it; None if there are too few peaks, or no friction."""
    rising = sorted(peaks, key=lambda p: p.value)
    if len(rising) < MIN_PEAKS or all(p.contacts.linear or p.loss == 0.0 for p in rising):
        return None
    end = sticks_at(rising, key)
    if end is None:
        return WorkingRange(tuple(rising), ())
    ordered = rising if end == "low" else rising[::-1]
    return WorkingRange(tuple(ordered), regimes_of(ordered))


def working_ranges(data: xr.Dataset) -> tuple[WorkingRange, ...]:
    """Return the curves of a forced response over the first varied number, one for each combination of the other values."""
    key, values = first_varied_number(data)
    if not key or key.split(".")[0] in SETTINGS or not holds(PeakPeriod, data):
        return ()
    force = [own.excitation_n for own in of_cases(CaseNumbers, data)]
    per_force = all(own > 0 for own in force)
    labels = [str(x) for x in data["case_label"].values]
    naming = naming_of(data, key)
    found = []
    for others, cases in families(data, key).items():
        known = {c: _peak(data, c, float(values[c]), force[c], per_force=per_force) for c in cases}
        own = working_range([p for p in known.values() if p is not None], key)
        if own is not None:
            out = tuple(labels[c] for c, p in known.items() if p is None)
            found.append(replace(own, naming=naming, others=others, per_force=per_force, left_out=out))
    return tuple(found)


def _peak(data: xr.Dataset, case: int, value: float, force: float, *, per_force: bool) -> CurvePeak | None:
    """Return the peak of a case; None if it is unknown, no resonance, or wrong."""
    curve = Curve(data, case)
    wrong = curve.read(Verdicts).case_verdict == LEVELS.index("wrong")
    if curve.peak < 0 or curve.at_the_end or curve.outside or wrong:
        return None
    amplitude = float(curve.amplitude[curve.peak])
    state = curve.read(PeakPeriod).peak_state
    if not np.isfinite(amplitude) or np.any(state < 0):
        return None
    contacts, loss = contacts_at_peak(state), loss_at_peak(curve)
    if loss > 0.0:  # some laws, such as dahl, dissipate before they slip
        contacts = replace(contacts, linear=False)
    size = amplitude / force if per_force else amplitude
    return CurvePeak(value, size, curve.peak_hz, contacts, amplitude, loss, case, force)


def loss_at_peak(curve: Curve) -> float:
    """Return the energy dissipated by contacts at a peak, J: zero for rounding, NaN if unknown."""
    if not curve.elastic > 0.0:
        return float("nan")
    loss = float(curve.dissipation[curve.peak])
    return loss if loss > LOSS_SEEN * curve.elastic else 0.0


def with_regimes(data: xr.Dataset) -> xr.Dataset:
    """Return the dataset of a forced response with the regime of each case; -1 if not judged."""
    ranges = [own for own in working_ranges(data) if own.judged]
    if not ranges:
        return data
    number = np.full(data.sizes["case"], -1)
    for own in ranges:
        for p, regime in zip(own.peaks, own.regimes, strict=True):
            number[p.case] = REGIMES.index(regime)
    about = "what friction does at the peak, -1 where it was not judged"
    flags = {"flag_values": np.arange(len(REGIMES)), "flag_meanings": " ".join(r.replace(" ", "_") for r in REGIMES)}
    named = xr.Variable("case", number, {"units": "1", "long_name": about} | flags)
    return data.assign(friction_regime=named)


TITLE = "Where friction works"
MOST_TOLD = 3  # curves described in sentences; with more curves, each gets one line


def range_lines(data: xr.Dataset) -> tuple[str, ...]:
    """State the working range of each curve of a forced response, curves that do the same in one line; empty if none can be judged."""
    found = working_ranges(data)
    if len(found) > MOST_TOLD:
        alike: dict[str, list[str]] = {}
        for own in found:
            alike.setdefault(range_line(own), []).append(own.others)
        return tuple(said(together(curves), line) for line, curves in alike.items())
    return tuple(said(own.others, text) for own in found for text in range_sentences(own))


def range_line(own: WorkingRange) -> str:
    """State the working range of a curve in one line: where it works, the smallest peak, and where contacts stick and let go."""
    if not own.judged:
        return f"cannot be told from these values of {own.naming.word}"
    works = " and ".join(_stretch(own, peaks) for peaks in own.stretches)
    by = "within 3 dB of the smallest peak" if own.stuck is None else "3 dB below the stuck system's peak"
    told = [f"friction works {works} ({by})" if works else "friction works nowhere"]
    told.append(f"the {_size(own)} is smallest at {_value(own, own.smallest)}")
    if own.stuck is not None:
        told.append(f"all contacts stick {'from' if own.falling else 'up to'} {_value(own, own.stuck)}")
    if own.loose:
        held = own.peaks[own.peaks.index(own.loose[0]) - 1]
        told.append(f"they let go {'below' if own.falling else 'above'} {_value(own, held)}")
    if own.left_out:
        told.append(f"not judged: {'; '.join(own.left_out)}")
    return ", ".join(told)


def range_sentences(own: WorkingRange) -> tuple[str, ...]:
    """State the values at which contacts stick, friction works and contacts let go, and the cases left out."""
    told = [_stuck_end(own), _middle(own), _loose_end(own)] if own.judged else [_unknown(own)]
    if own.left_out:
        them = "; ".join(own.left_out)
        told.append(f"Not judged, as the verdict is wrong or the peak no resonance: {them}.")
    return tuple(text for text in told if text)


def _unknown(own: WorkingRange) -> str:
    return f"Where friction works cannot be told from these values of {own.naming.word}: all contacts stick at neither end, and their states do not show which end is nearer to full stick. Add values beyond both ends."


def _of(own: WorkingRange, peak: CurvePeak) -> str:
    return own.naming.name(peak.value).strip()


def _value(own: WorkingRange, peak: CurvePeak) -> str:
    return own.naming.value(peak.value)


def _size(own: WorkingRange) -> str:
    return "peak per unit of force" if own.per_force else "peak"


def _stuck_end(own: WorkingRange) -> str:
    if own.stuck is None:
        side = "above" if own.falling else "below"
        return f"At no value do all contacts stick at the peak; the stuck end of the curve lies {side} {_of(own, own.peaks[0])}."
    side = "up" if own.falling else "down"
    shut = all(p.contacts.sticking == 1.0 for p in own.of("stuck"))
    still = "all contacts stick" if shut else "no contact slips, opens or closes"
    first = own.stuck is own.peaks[0]
    where = f"At {_of(own, own.stuck)}, the first value," if first else f"From {_of(own, own.stuck)} {side}"
    return f"{where} {still} at the peak: friction dissipates nothing, and the stuck system resonates at {own.stuck.hertz:.5g} Hz."


def _middle(own: WorkingRange) -> str:
    best, stuck = own.smallest, own.stuck
    if not own.stretches:
        return "" if stuck is None else _hardly(own, stuck)
    where = " and ".join(_stretch(own, peaks) for peaks in own.stretches)
    if stuck is None:
        return f"Friction works {where}: there the {_size(own)} lies within 3 dB of the smallest one, at {_value(own, best)}."
    return f"Friction works {where}: the {_size(own)} lies 3 dB or more below the stuck system there. It is smallest at {_value(own, best)}: {_percent(best.size / stuck.size)} of the stuck system's, at {best.hertz:.5g} Hz."


def _stretch(own: WorkingRange, peaks: Sequence[CurvePeak]) -> str:
    """Return a range in words."""
    first, last = peaks[0], peaks[-1]
    if first is last:
        return f"at {_of(own, first)}"
    return f"from {_of(own, first)} to {_value(own, last)}"


def _hardly(own: WorkingRange, stuck: CurvePeak) -> str:
    """State how near the peak stays to full stick if friction never reduces it by 3 dB."""
    off = [p.size / stuck.size - 1 for p in own.peaks]
    if max(off) > 1 / HALF_POWER - 1:
        best, worst = own.smallest, max(own.peaks, key=lambda p: p.size)
        return f"Friction never takes the {_size(own)} 3 dB below the stuck system. It is smallest at {_value(own, best)}, {_percent(best.size / stuck.size)} of the stuck system's, and largest at {_value(own, worst)}, {_percent(worst.size / stuck.size)}."
    word = "Down" if own.falling else "Up"
    return f"{word} to {_of(own, own.peaks[-1])} the {_size(own)} stays within {_percent(max(map(abs, off)))} of the stuck system's: the contacts stiffen but hardly damp."


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
    risen = (
        f"the {_size(own)} has risen again, to {worst.size / best.size:.3g} times the smallest at {_value(own, worst)}"
    )
    if own.stuck is not None:
        risen += f" ({_percent(worst.size / own.stuck.size)} of the stuck system's)"
    risen += f", at {worst.hertz:.5g} Hz"
    if not any(p.contacts.holding for p in gone):
        return f"{risen}. No contact sticks throughout the cycle"
    return f"{risen}. Contacts stick {_percent(worst.contacts.sticking)} of the cycle"


def _saturated(best: CurvePeak, last: CurvePeak) -> str:
    """Compare the growth of dissipation and amplitude: a sliding contact dissipates at most four friction limits a unit of amplitude."""
    if not (best.loss > 0.0 and last.loss > 0.0 and last is not best):
        return ""
    grown, loss = last.amplitude / best.amplitude, last.loss / last.amplitude
    more = loss * best.amplitude / best.loss
    if grown <= 1.0:
        return ""
    becomes = f"grows {more:.3g} times" if more >= 1.0 else f"falls to {_percent(more)}"
    return f". While the amplitude grows {grown:.3g} times, the energy lost in a cycle over the amplitude {becomes}"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"

"""The node ``/all_motions`` of a result."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.all_motions.verdicts import case_verdicts
from stickslip.analyses.collected import Variables, of_cases, rows
from stickslip.analyses.columns import variables as variables_of
from stickslip.analyses.facts import ModelFacts, facts_in
from stickslip.response.all_motions.basins import APERIODIC, DIVERGED, PERIODIC
from stickslip.response.all_motions.found import AllMotions, AtFrequency
from stickslip.study.analysis import Solved
from stickslip.study.store.netcdf import variable
from stickslip.units import HZ


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return what was found in all cases."""
    return of_cases(solved, _of_case, case_verdicts)


def _of_case(solved: Solved) -> Variables:
    """Return the variables of a case: those of its last note, which is written when the search is over."""
    model = solved.notes.get("model", {})
    found = solved.notes.get("found", {})
    variables = variables_of(ModelFacts(**facts_in(solved.notes))) | {
        "output": variable("", str(model.get("output", "")), "1", "output whose amplitude is given")
    }
    return variables | {
        name: variable(dims, found[name], *about) for name, (dims, *about) in ABOUT.items() if name in found
    }


ABOUT = {
    "frequency_hz": ("branch point", "Hz", "frequency along each branch"),
    "amplitude": ("branch point", "m", "amplitude of the output over the harmonics that the load drives"),
    "origin": ("branch", "1", "how a branch was found: sweep, deflation or time"),
    "end": ("branch", "1", "why it ends"),
    "isola": ("branch", "1", "1: it closes in itself, and no sweep meets it"),
    "peak_amplitude": ("branch", "m", "its largest amplitude"),
    "peak_hz": ("branch", "Hz", "frequency there"),
    "lowest_hz": ("branch", "Hz", "its lowest frequency"),
    "highest_hz": ("branch", "Hz", "its highest frequency"),
    "searched_hz": ("searched", "Hz", "frequencies that were searched"),
    "starts": ("searched", "1", "random states that were integrated in time"),
    "aperiodic": (
        "searched",
        "1",
        "those that end on no motion of the load's period, or on none in the periods allowed",
    ),
    "diverged": ("searched", "1", "those that grow without bound"),
    "searched_tries": ("searched", "1", "deflated solves at the frequency"),
    "searched_spent": ("searched", "1", "1: the budget ended the deflation or the starts there"),
    "unsolved": ("searched", "1", "those that end on a periodic motion which is no solution with the harmonics kept"),
    "motion_branch": ("searched motion", "1", "branch of each motion; -1 where there are no more"),
    "motion_amplitude": ("searched motion", "m", "its amplitude"),
    "motion_stability": ("searched motion", "1", "stable, unstable, undecided or not examined"),
    "motion_multiplier": ("searched motion", "1", "modulus of the multiplier that decides"),
    "motion_multiplier_error": ("searched motion", "1", "its error"),
    "motion_change": (
        "searched motion",
        "1",
        "what more harmonics would change in it, relative to its vibration; infinite where no motion with more is near",
    ),
    "motion_count": ("searched motion", "1", "starts that end on it; -1 where there is no motion"),
    "motion_share": ("searched motion", "1", "share of the starts that ends on it"),
    "motion_share_low": ("searched motion", "1", "lower end of its 95 % interval (Clopper and Pearson)"),
    "motion_share_high": ("searched motion", "1", "upper end"),
    "tries": ("", "1", "deflated solves"),
    "seconds": ("", "s", "what the search took"),
    "solves": ("", "1", "deflated solves, starts in time and points of branches together"),
    "budget_solves": ("", "1", "most of them"),
    "unmarched": ("", "1", "why nothing was started in time; empty where it was"),
    "spent": ("", "1", "1: the budget ended the search before all was tried that was asked for"),
}


def noted(found: AllMotions, budget: int) -> dict[str, Any]:
    """Return what was found as named arrays."""
    own = found.branches
    return {
        "frequency_hz": rows(own, "omega") / HZ,
        "amplitude": rows(own, "amplitude"),
        "origin": np.array([b.origin for b in own], dtype=str),
        "end": np.array([b.end for b in own], dtype=str),
        "isola": np.array([int(b.isola) for b in own]),
        "peak_amplitude": np.array([b.peak for b in own]),
        "peak_hz": np.array([b.peak_omega / HZ for b in own]),
        "lowest_hz": np.array([b.extent[0] / HZ for b in own]),
        "highest_hz": np.array([b.extent[1] / HZ for b in own]),
        **_at(found.at),
        "tries": found.tries,
        "seconds": found.seconds,
        "solves": found.solves,
        "budget_solves": budget,
        "spent": int(found.spent),
        "unmarched": found.unmarched,
    }


def _at(places: Sequence[AtFrequency]) -> Mapping[str, Any]:
    """Return what was found at the frequencies that were searched."""
    shape = (len(places), max((len(at.motions) for at in places), default=0))
    numbers = ("amplitude", "multiplier", "multiplier_error", "change", "share", "share_low", "share_high")
    out: dict[str, Any] = {f"motion_{n}": np.full(shape, np.nan) for n in numbers}
    out |= {"motion_branch": np.full(shape, -1), "motion_count": np.full(shape, -1)}
    words = [[""] * shape[1] for _ in places]
    for i, at in enumerate(places):
        for k, motion in enumerate(at.motions):
            words[i][k] = motion.stability
            low, high = at.basins.interval(k)
            told_of = {
                "branch": motion.branch,
                "amplitude": motion.amplitude,
                "multiplier": motion.multiplier,
                "multiplier_error": motion.error,
                "change": motion.change,
                "count": at.basins.count(k),
                "share": at.basins.share(k),
                "share_low": low,
                "share_high": high,
            }
            for name, value in told_of.items():
                out[f"motion_{name}"][i, k] = value
    return {
        **out,
        "motion_stability": np.array(words, dtype=str).reshape(shape),
        "searched_hz": np.array([at.omega / HZ for at in places]),
        "starts": np.array([len(at.basins.ends) for at in places]),
        "aperiodic": np.array([at.basins.count(APERIODIC) for at in places]),
        "diverged": np.array([at.basins.count(DIVERGED) for at in places]),
        "searched_tries": np.array([at.tries for at in places]),
        "searched_spent": np.array([int(at.spent) for at in places]),
        "unsolved": np.array([at.basins.count(PERIODIC) for at in places]),
    }

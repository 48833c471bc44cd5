"""Options of a forced response: names and limits, without what computes, so that a study file is judged at once."""

from typing import Literal

Passages = Literal["double", "single"]
RelativeTo = Literal["answer", "each"]
AmplitudeOf = Literal["first", "half_peak_to_peak", "rms"]
Rescue = Literal["all", "in_time", "off"]
Stage = Literal[
    "low", "high", "branch", "peak", "point", "audit", "trial", "found", "check", "in_time", "settled", "compared"
]
RUNGS = (5, 9, 15, 25, 41)  # highest harmonics that "auto" goes through
PUBLISHED = 5  # highest harmonic of the repeats in the papers
SELECTION = "guarded_alert"  # what chooses harmonics where nothing else is said

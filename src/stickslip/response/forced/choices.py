"""Names and limits of options of a forced response, free of solver imports, so that study files are checked quickly."""

from typing import Literal

Passages = Literal["double", "single"]
RelativeTo = Literal["answer", "each"]
AmplitudeOf = Literal["first", "half_peak_to_peak", "rms"]
Rescue = Literal["all", "in_time", "off"]
Stage = Literal[
    "low", "high", "branch", "peak", "point", "audit", "trial", "found", "check", "in_time", "settled", "compared"
]
RUNGS = (5, 9, 15, 25, 41)  # highest harmonic of each level of "auto"
PUBLISHED = 5  # highest harmonic of the repeats in the papers
SELECTION = "guarded_alert"  # default selection of harmonics

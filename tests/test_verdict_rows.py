"""Each rule of a verdict at and beside its threshold, and the word that comes out, on cases made of plain numbers."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from verdict_rows import INF, NAN, above, case_of, check

from stickslip.analyses.all_motions import verdicts as motions
from stickslip.analyses.all_motions.records import FoundMotions
from stickslip.analyses.columns import record_of
from stickslip.analyses.forced_response.verdicts.rules import coarse_steps
from stickslip.analyses.limit_cycle import verdicts as cycles
from stickslip.analyses.limit_cycle.records import LimitCycles
from stickslip.analyses.modal_synthesis import verdicts as synthesis
from stickslip.analyses.modal_synthesis.analysis import judged
from stickslip.analyses.modal_synthesis.records import ModalSynthesis
from stickslip.analyses.modal_synthesis.verdicts import percent
from stickslip.analyses.nonlinear_mode import verdicts as backbones
from stickslip.analyses.nonlinear_mode.records import NonlinearModes
from stickslip.analyses.quasi_periodic import verdicts as two_frequencies
from stickslip.analyses.quasi_periodic.records import QuasiPeriodic
from stickslip.analyses.residual_tractions import verdicts as tractions
from stickslip.analyses.residual_tractions.records import ResidualTractions
from stickslip.analyses.resonance import verdicts as resonances
from stickslip.analyses.resonance.records import Resonances
from stickslip.analyses.run_up import verdicts as running
from stickslip.analyses.run_up.records import RunUp
from stickslip.analyses.waves import verdicts as waves
from stickslip.analyses.waves.verdicts import energy_doubts, unstable, unstable_wheel
from stickslip.response.forced.collected import jumps
from stickslip.response.nonlinear_modes.single_mode_validity import Isolation
from stickslip.units import HZ, RPM

Row = tuple[dict[str, Any], list[tuple[str, ...]]]

TWO: dict[str, Any] = {
    "first_hz": [20.0],
    "kind": ["two loads"],
    "why": ["both are loads"],
    "unknown": [""],
    "left_out": [0.0],
    "slip": [0.0],
    "largest": [[1e-3]],
    "least": [[5e-4]],
    "time_largest": [[1e-3]],
    "time_least": [[5e-4]],
    "time_off": [0.0],
}
TWO_ROWS: list[Row] = [
    (dict.fromkeys(TWO), []),
    ({}, [("trusted", "1 motions", "at most 0 %", "compared with time integration")]),
    (
        {"kind": ["not found"], "why": ["it diverged."]},
        [("wrong", "20.00 Hz: no motion was found: it diverged.", "second_hz")],
    ),
    ({"kind": ["no second tone"]}, [("trusted", "there is no second tone: both are loads")]),
    (
        {"kind": ["no second tone"], "unknown": ["too large."]},
        [("doubtful", "other tones may grow (too large).", "--verify")],
    ),
    ({"left_out": [0.02]}, [("trusted", "at most 2 %")]),
    ({"left_out": [above(0.02)]}, [("doubtful", "would change the motion by 2 %", "most_harmonics")]),
    ({"left_out": [1e-4], "accuracy": 1e-4}, [("trusted", "at most 0.01 %")]),
    (
        {"left_out": [above(1e-4)], "accuracy": 1e-4},
        [("doubtful", "by 0.01 %, more than the 0.01 % that is asked for", "ask for less: accuracy_percent")],
    ),
    ({"left_out": [1e-2], "accuracy": 1e-4}, [("doubtful", "by 1 %, more than the 0.01 % that is asked for")]),
    ({"left_out": [0.02], "accuracy": 0.05}, [("trusted",)]),
    ({"left_out": [above(0.02)], "accuracy": 0.05}, [("doubtful", "would change the motion by 2 %")]),
    ({"slip": [5e-3]}, [("trusted",)]),
    ({"slip": [above(5e-3)]}, [("doubtful", "off by 0.005 rad a turn", "ratio")]),
    ({"time_off": [0.02]}, [("trusted",)]),
    ({"time_off": [above(0.02)]}, [("doubtful", "time integration is 2 % off", "accuracy_percent")]),
    ({"time_off": None, "time_largest": [[1.04e-3 - 1e-9]]}, [("trusted",)]),
    ({"time_off": [NAN], "time_largest": [[1.05e-3]]}, [("doubtful", "goes from 0.5 to 1.05 mm", "has 0.5 to 1 mm")]),
    ({"time_off": [NAN], "time_least": [[4.5e-4]]}, [("doubtful", "goes from 0.45 to 1 mm")]),
    ({"time_off": [NAN], "time_least": [[4.7e-4]]}, [("trusted",)]),
    ({"time_off": [0.0], "time_largest": [[1.05e-3]]}, [("trusted",)]),
    (
        {"time_largest": None, "time_least": None, "time_off": None},
        [("doubtful", "its stability was not examined", "in_time = true")],
    ),
    ({"time_largest": [[NAN]]}, [("doubtful", "time integration came to nothing", "but not to 1")]),
]

# two levels, both trusted; the wider range around the peak is that of the first
LEVELS: dict[str, Any] = {
    "level": [1.0, 2.0],
    "answer": ["trusted", "trusted"],
    "why": ["few slip", "more slip"],
    "foreign": [0.01, 0.02],
    "detached_peak_amplitude": [NAN, NAN],
    "alone_from_hz": [90.0, 95.0],
    "alone_to_hz": [110.0, 105.0],
}
DIRECT = {"direct_error": [0.01, -0.02], "along_error": [0.05, -0.03], "along_error_hz": [98.0, 99.0]}
PASSAGES: dict[str, Any] = {
    "passage_hz_per_s": [1.0, 4.0, 2.0],
    "passage_change": [[0.01, 0.05, 0.01], [0.02, 0.04, 0.05]],
    "passage_finished": [[1, 1, 1], [1, 1, 1]],
}
SOUND = (
    "trusted",
    "answers alone at levels 1 and 2: at 2 more slip",
    "from 95 to 105 Hz at level 2 and in a wider range at the others",
)
LEVEL_ROWS: list[Row] = [
    (dict.fromkeys(LEVELS), []),
    ({}, [SOUND]),
    ({"foreign": [0.03, 0.02]}, [("trusted", "levels 1 and 2: at 1 few slip")]),
    ({"foreign": [0.03, NAN]}, [("trusted", "levels 1 and 2: at 1 few slip")]),
    (
        {"alone_from_hz": [NAN, NAN]},
        [("trusted", "of the peaks: the rest of the curve may be off by more", "more than 5 %")],
    ),
    ({"alone_from_hz": [NAN, 95.0]}, [("trusted", "at level 2, and at level 1 not even at the peak")]),
    (
        {"answer": ["trusted", "doubtful"]},
        [
            ("trusted", "alone at level 1: few slip", "from 90 to 110 Hz"),
            ("doubtful", "at level 2 is doubtful: more slip", "direct = true"),
        ],
    ),
    (
        {"answer": ["trusted", "doubtful"], **DIRECT},
        [
            ("trusted",),
            ("doubtful", "more slip", "The direct solutions beside it"),
            ("trusted", "up to 2 %, at level 2"),
            ("trusted", "up to 5 %", "at level 1 and 98 Hz"),
        ],
    ),
    (
        {"answer": ["trusted", "refused"]},
        [("trusted",), ("doubtful", "refused, since the mode is not alone", "Ask for [forced_response] there.")],
    ),
    (
        {"answer": ["trusted", "beyond"]},
        [("trusted",), ("doubtful", "no peak at level 2", "Widen modal_synthesis.amplitude_mm")],
    ),
    ({"answer": ["refused", "beyond"]}, [("doubtful",), ("doubtful",), ("wrong", "nothing is left")]),
    ({"answer": ["doubtful", "beyond"]}, [("doubtful",), ("doubtful", "no peak")]),
    ({"detached_peak_amplitude": [NAN, 1e-3]}, [("trusted", "at level 1"), ("note", "at level 2", "[all_motions]")]),
    (DIRECT, [SOUND, ("trusted", "up to 2 %, at level 2"), ("trusted", "up to 5 %", "at level 1 and 98 Hz")]),
    (
        {**DIRECT, "direct_error": [0.01, above(0.02)]},
        [SOUND, ("doubtful", "at level 2", "Believe the direct ones."), ("trusted",)],
    ),
    (
        {**DIRECT, "along_error": [above(0.05), NAN]},
        [SOUND, ("trusted",), ("doubtful", "at level 1", "Believe the direct ones.")],
    ),
    ({**DIRECT, "direct_error": [NAN, NAN]}, [SOUND]),
    ({**DIRECT, "along_error": [NAN, NAN]}, [SOUND, ("trusted", "up to 2 %")]),
    (PASSAGES, [SOUND]),
    (
        {**PASSAGES, "passage_change": [[0.01, above(0.05), 0.01], [0.02, 0.04, 0.05]]},
        [SOUND, ("doubtful", "from 4 Hz/s on at level 1 ", "more than 5 %")],
    ),
    (
        {**PASSAGES, "passage_change": [[0.01, 0.06, 0.01], [0.02, 0.07, 0.06]]},
        [SOUND, ("doubtful", "from 2 Hz/s on at levels 1 and 2 ")],
    ),
    (
        {**PASSAGES, "passage_finished": [[1, 1, 1], [1, 1, 0]]},
        [SOUND, ("doubtful", "a passage at level 2 left the nonlinear mode", "amplitude_mm")],
    ),
    (
        {
            **PASSAGES,
            "passage_finished": [[1, 1, 1], [1, 1, 0]],
            "passage_change": [[0.01, 0.02, 0.03], [0.02, 0.04, NAN]],
        },
        [SOUND],
    ),
]

# one mode of wave 2 with one limit cycle
CYCLE: dict[str, Any] = {
    "linear_damping_ratio": [[-1e-3, 2e-3]],
    "linear_frequency_hz": [[100.0, 300.0]],
    "wave_number": [2],
    "mode": [1],
    "problem": [""],
    "mode_damping_ratio": [-1e-3],
    "lost_cycles": [0],
    "largest_damping_ratio": [4e-3],
    "cycle_branch": [0],
    "cycle_amplitude": [1e-3],
    "cycle_frequency_hz": [101.0],
    "cycle_slope": [1.0],
    "cycle_change": [0.01],
    "cycle_enough": [1],
    "cycle_stability": ["stable"],
    "cycle_reason": ["1.2 > 1"],
    "cycle_growing_wave": [-1],
    "cycle_growing_frequency_hz": [NAN],
}
CYCLE_ROWS: list[Row] = [
    ({"linear_damping_ratio": None}, []),
    (
        {**dict.fromkeys(CYCLE), "linear_frequency_hz": [[100.0, 300.0]], "linear_damping_ratio": [[1e-3, 2e-3]]},
        [("note", "the least damping ratio is 0.1 %", "no limit cycle")],
    ),
    ({}, []),
    ({"wave_number": [-1], "problem": ["it is lost."]}, [("doubtful", "mode 1: it is lost.")]),
    ({"problem": ["it is lost."]}, [("doubtful", "wave 2, mode 1: it is lost.")]),
    (
        {"linear_damping_ratio": [[-1e-3, -2e-3]]},
        [("note", "1 of 2 modes that grow", "-0.2 % at 300 Hz", "Leave limit_cycle.modes out")],
    ),
    ({"linear_damping_ratio": [[-1e-3, 0.0]]}, []),
    ({"lost_cycles": [2]}, [("doubtful", "has 2 more zeros", "limit_cycle.points")]),
    (
        {"largest_damping_ratio": [0.0]},
        [("warning", "friction cannot bound it", "-0.1 % with contacts stuck and 0 % at most")],
    ),
    ({"largest_damping_ratio": [1e-12]}, []),
    ({"largest_damping_ratio": [0.0], "mode_damping_ratio": [0.0], "linear_damping_ratio": [[0.0, 0.0]]}, []),
    (
        {"cycle_enough": [0]},
        [
            (
                "doubtful",
                "101.00 Hz: wave 2, mode 1: the limit cycle of 1 mm still moves by 1 % with twice",
                "most_harmonics",
            )
        ],
    ),
    ({"cycle_enough": [0], "cycle_change": [NAN]}, [("doubtful", "one set of harmonics alone")]),
    (
        {"cycle_stability": ["unstable"]},
        [("note", "but another motion grows: 1.2 > 1", "limit_cycle.in_time tells for what")],
    ),
    (
        {"cycle_stability": ["unstable"], "cycle_growing_wave": [0], "cycle_growing_frequency_hz": [77.0]},
        [("note", "wave 0 at 77 Hz grows")],
    ),
    (
        {"cycle_stability": ["unstable"], "cycle_growing_wave": [2], "cycle_growing_frequency_hz": [77.0]},
        [("note", "a modulation of it, by wave 2 itself at 77 Hz, grows")],
    ),
    ({"cycle_stability": ["unstable"], "cycle_time_amplitude": [2e-3]}, [("note", "time integration began beside it")]),
    ({"cycle_stability": ["unstable"], "cycle_slope": [0.0]}, []),
    ({"cycle_stability": ["undecided"]}, [("doubtful", "other disturbances are undecided: 1.2 > 1", "in_time")]),
    ({"cycle_stability": ["not examined"], "cycle_slope": [-1.0]}, []),
    ({"cycle_time_amplitude": [1e-3 * (1 + 9.9e-4)]}, []),
    (
        {"cycle_time_amplitude": [1e-3 * (1 + 1.1e-3)]},
        [("doubtful", "is 0.11 % off where time integration", "limit_cycle.periods")],
    ),
    ({"cycle_time_amplitude": [1e-3 * (1 - 1.1e-3)]}, [("doubtful", "is 0.11 % off")]),
    ({"cycle_time_amplitude": [NAN]}, []),
    (
        {"outcome": "wave 2 is left", "wave_amplitude": [[0.0, 0.0, 1e-3]]},
        [("note", "in time, wave 2 is left", "depend on the start")],
    ),
    (
        {"outcome": "wave 2 is left", "cycle_stability": ["unstable"], "wave_amplitude": [[0.0, 0.0, 1e-3]]},
        [("note", "The machine leaves it; from a mixed start"), ("note",)],
    ),
    (
        {"outcome": "not settled yet", "wave_amplitude": [[3e-3, 0, 0], [0, 0, 2e-3]]},
        [("doubtful", "(wave 2 has 2 mm; its stable limit cycle 1 mm)", "limit_cycle.periods")],
    ),
    ({"outcome": "not settled yet", "wave_amplitude": [[0, 0, 1], [0, 2e-3, 0]]}, [("doubtful", "(wave 1 has 2 mm)")]),
    (
        {"outcome": "", "outcome_missing": "it is too large"},
        [("doubtful", "not found in time: it is too large", "by itself")],
    ),
]

MODE: dict[str, Any] = {
    "wave_number": [-1],
    "mode": [3],
    "problem": [""],
    "end": ["amplitude reached"],
    "amplitude": [[1e-5, 1e-4, 1e-3]],
    "largest_damping_ratio": [0.02],
    "largest_damping_amplitude": [1e-4],
    "status": [[0, 0, 0]],
    "change": [[1e-4, 2e-4, 1e-3]],
    "accuracy": [1e-3],
}
FOLLOWED = ("trusted", "mode 3 followed from 0.01 to 1 mm: the largest damping ratio is 2 % at 0.1 mm")
MODE_ROWS: list[Row] = [
    (dict.fromkeys(MODE), []),
    ({}, [FOLLOWED]),
    ({"end": ["gross slip"]}, [FOLLOWED]),
    ({"end": ["lift-off at 1 mm"]}, [("note", "mode 3: lift-off at 1 mm", "Beyond it"), FOLLOWED]),
    ({"end": ["the step is too small"]}, [("doubtful", "the step is too small", "more points")]),
    (
        {"end": ["amplitude reached; internal resonance of harmonic 3 with mode 2 from 1 to 2 mm"]},
        [
            ("warning", "mode 3: internal resonance of harmonic 3 with mode 2 from 1 to 2 mm", "Several motions"),
            FOLLOWED,
        ],
    ),
    (
        {"end": ["amplitude reached; stepped over an internal resonance of harmonic 3 with mode 2 from 1 to 2 mm"]},
        [("doubtful", "stepped over an internal resonance", "amplitude_mm")],
    ),
    (
        {
            "end": ["amplitude reached; internal resonance of harmonic 3 with mode 2 from 0.9 to 1 mm"],
            "damping_ratio": [[0.01, 0.02, 0.09]],
            "resonant_harmonic": [[0, 0, 3]],
        },
        [("doubtful", "gives up to 9 % damping at 1 mm; elsewhere mode 3 has at most 2 % at 0.1 mm", "decaying")],
    ),
    (
        {
            "end": ["amplitude reached; internal resonance of harmonic 3 with mode 2 from 0.9 to 1 mm"],
            "damping_ratio": [[0.01, 0.02, 0.01]],
            "resonant_harmonic": [[0, 0, 3]],
        },
        [("warning", "internal resonance of harmonic 3 with mode 2", "Several motions"), FOLLOWED],
    ),
    ({"other_damping_ratio": [0.015]}, [("trusted", "2 % at 0.1 mm; decaying motions give 1.5 % there")]),
    ({"other_damping_ratio": [0.020001]}, [("trusted", "2 % at 0.1 mm.")]),
    ({"other_damping_ratio": [NAN]}, [("trusted", "2 % at 0.1 mm; no decaying motions are near")]),
    ({"end": ["amplitude reached, taken up again"]}, [("doubtful", "0 of its points are no motions", "another mode")]),
    ({"problem": ["mode 3: no such mode."]}, [("doubtful", "mode 3: no such mode.")]),
    ({"status": [[0, 1, 0]], "change": [[0.0, NAN, 0.0]]}, [("doubtful", "1 of its points are no motions")]),
    ({"status": [[0, 0, 1]], "change": [[0.0, 0.0, NAN]]}, [("trusted",)]),
    (
        {"change": [[0.0, 0.0, above(1e-3)]]},
        [("doubtful", "1 of its 3 motions still change by up to 0.1 %", "most_harmonics")],
    ),
    ({"change": [[0.0, 2e-3, INF]]}, [("doubtful", "2 of its 3 motions still change by up to 0.2 %")]),
    ({"change": [[0.0, 0.0, INF]]}, [("doubtful", "1 of its 3 motions still change by an unknown amount")]),
    ({"change": [[NAN, NAN, NAN]]}, [("doubtful", "one set of harmonics alone")]),
    ({"largest_damping_ratio": [1e-9]}, [("trusted", "without damping.")]),
    ({"largest_damping_ratio": [1.1e-9]}, [("trusted", "1.1e-07 % at 0.1 mm")]),
    ({"largest_damping_ratio": [-0.01]}, [("trusted", "is -1 % at")]),
]
# two modes: the second damps more, and is named
MODES = {name: value * 2 for name, value in MODE.items()} | {
    "mode": [3, 4],
    "largest_damping_ratio": [0.02, 0.03],
    "largest_damping_amplitude": [1e-4, 2e-4],
}
MODES_ROWS: list[Row] = [
    ({}, [("trusted", "2 of 2 modes followed", "3 % at 0.2 mm, of mode 4")]),
    (
        {"end": ["amplitude reached", "lost"]},
        [("doubtful", "mode 4: lost"), ("trusted", "1 of 2 modes followed", "2 % at 0.1 mm, of mode 3")],
    ),
]

# a branch of the sweep, one beside it; two frequencies, one motion each
FOUND: dict[str, Any] = {
    "origin": ["sweep", "time"],
    "end": ["it closes in itself", "it reaches the end of the range"],
    "isola": [0, 1],
    "peak_amplitude": [1e-3, 1e-3],
    "peak_hz": [50.0, 60.0],
    "solves": 55,
    "budget_solves": 90,
    "tries": 7,
    "spent": 0,
    "unmarched": "",
    "searched_hz": [55.0, 65.0],
    "searched_spent": [0, 0],
    "starts": [20, 20],
    "aperiodic": [0, 0],
    "diverged": [0, 0],
    "unsolved": [0, 0],
    "motion_branch": [[0, 1], [0, -1]],
    "motion_amplitude": [[1e-3, 8e-4], [1e-3, NAN]],
    "motion_stability": [["stable", "unstable"], ["stable", ""]],
    "motion_change": [[0.0, 0.0], [0.0, NAN]],
    "motion_count": [[20, 0], [20, -1]],
    "motion_share": [[1.0, 0.0], [1.0, NAN]],
    "motion_share_low": [[0.9, 0.0], [0.9, NAN]],
    "motion_share_high": [[1.0, 0.1], [1.0, NAN]],
}
ALL = ("trusted", "2 branches, 1 isola among them, by 7 deflated solves and 40 starts in time, 55 solves in all")
FOUND_ROWS: list[Row] = [
    (dict.fromkeys(FOUND), [("wrong", "not finished", "Run it again")]),
    ({"peak_amplitude": [1e-3, 1.001e-3 - 1e-12]}, [ALL]),
    ({"peak_amplitude": [1e-3, 1.002e-3]}, [("warning", "an isola reaches 1.002 mm at 60 Hz, 1 times"), ALL]),
    (
        {"peak_amplitude": [1e-3, 2e-3], "isola": [0, 0]},
        [("warning", "a branch that no sweep meets reaches 2 mm at 60 Hz, 2 times"), ("trusted", "0 isolas")],
    ),
    ({"origin": ["time", "time"], "peak_amplitude": [1e-3, 2e-3]}, [("warning",), ("warning",), ALL]),
    (
        {"spent": 1},
        [("doubtful", "the budget of 90 solves ended the search", "55 solves in all. Raise all_motions.solves")],
    ),
    ({"spent": 1, "searched_spent": [0, 1]}, [("doubtful", "at 1 of 2 frequencies (65 Hz) not all")]),
    (
        {"end": ["it closes in itself", "20 steps"]},
        [("doubtful", "branch 2 (time) is not known to its end: 20 steps", "all_motions.points")],
    ),
    ({"end": ["it closes in itself", "the budget is spent"]}, [ALL]),
    (
        {"motion_branch": [[0, 1], [-1, -1]], "motion_share": [[1.0, 0.0], [NAN, NAN]]},
        [("doubtful", "65.00 Hz: no motion is known")],
    ),
    ({"motion_branch": [[0, 1], [-1, -1]], "motion_share": [[1.0, 0.0], [NAN, NAN]], "searched_spent": [0, 1]}, [ALL]),
    ({"motion_change": [[0.03, 0.0], [0.0, NAN]]}, [ALL]),
    (
        {"motion_change": [[0.0, 0.0], [above(0.03), NAN]]},
        [("doubtful", "change 1 motion by up to 3 %, at 65 Hz", "harmonics")],
    ),
    ({"motion_change": [[0.04, 0.05], [0.0, NAN]]}, [("doubtful", "change 2 motions by up to 5 %, at 55 Hz")]),
    ({"motion_change": [[0.0, INF], [0.0, NAN]]}, [("doubtful", "1 motion with no motion", "it may not exist")]),
    ({"motion_change": [[INF, INF], [0.0, NAN]]}, [("doubtful", "2 motions with no motion", "they may not exist")]),
    ({"unmarched": "a contact is rigid"}, [("doubtful", "what attracts is not known: a contact is rigid")]),
    ({"unsolved": [1, 2]}, [("doubtful", "3 starts end on a periodic motion")]),
    ({"aperiodic": [0, 3]}, [("warning", "65.00 Hz: 3 of 20 starts end on no motion"), ALL]),
    ({"diverged": [2, 0]}, [("warning", "55.00 Hz: 2 of 20 starts grow"), ALL]),
    ({"aperiodic": [0, 3], "diverged": [2, 0], "starts": [0, 0]}, [("trusted", "and 0 starts")]),
    (
        {"motion_count": [[0, 20], [20, -1]], "motion_share": [[0.0, 1.0], [1.0, NAN]]},
        [
            ("note", "55.00 Hz: the largest stable motion, 1 mm, was reached by none of 20 starts", "below 1e+02 %"),
            ("warning", "100 % (0 to 10 %), amplitude 0.8 mm"),
            ALL,
        ],
    ),
    (
        {"motion_stability": [["unstable", "stable"], ["", ""]]},
        [("note", "0.8 mm, was reached by none", "below 10 %"), ALL],
    ),
]

# two peaks over three values
PEAKS: dict[str, Any] = {
    "maximum": [[1, 1, 1], [1, 1, 1]],
    "value": [[1.0, 2.0, 3.0]] * 2,
    "by": "phase",
    "below": [[0.0, 0.0, 0.01], [NAN, 0.0, 0.0]],
    "output": "tip.x",
    "parameter": "load.ratio",
}
OVER = {"overtaking_value": [1.5], "overtaking_before": [0], "overtaking_after": [1]}
MET = ("trusted", "2 peaks of tip.x over load.ratio", "followed from the first value")
PEAK_ROWS: list[tuple[dict[str, Any], dict[str, Any], list[tuple[str, ...]]]] = [
    (dict.fromkeys(PEAKS), {}, [("wrong", "no peak was found. Widen")]),
    (dict.fromkeys(PEAKS), {"last": {"problem": "is empty"}}, [("wrong", "no peak was found: the range is empty")]),
    ({}, {}, [MET]),
    (
        {"maximum": [[1, 1, 1]], "value": [[1.0, 1.0, 1.0]], "below": [[0.0] * 3]},
        {},
        [("trusted", "1 peak of", "and a maximum.")],
    ),
    ({"maximum": [[1, -1, 1], [1, 1, 1]]}, {}, [("doubtful", "peak 1 was not found at 2", "closer together")]),
    ({"maximum": [[1, 1, 1], [1, 1, 0]]}, {}, [("doubtful", "peak 2 is no maximum at 3")]),
    (
        {"maximum": [[1] * 5, [-1] * 5], "value": [[1.0, 2.0, 3.0, 4.0, 5.0]] * 2, "below": [[0.0] * 5] * 2},
        {},
        [("doubtful", "at 1, 2, 3 and 2 more")],
    ),
    (
        {"below": [[0.0, 0.0, above(0.01)], [NAN, 0.0, 0.0]]},
        {},
        [("doubtful", "by phase a peak lies 1 % below", "horizontal_tangent")],
    ),
    ({"below": [[0.0, 0.0, 0.5], [NAN, 0.0, 0.0]], "by": "horizontal_tangent"}, {}, [MET]),
    ({}, {"harmonics": {"change": 0.01, "order": 9, "value": 2.0}}, [MET]),
    (
        {},
        {"harmonics": {"change": -above(0.01), "order": 9, "value": 2.0}},
        [("doubtful", "the highest peak, at 2, changes by -1 % with 9 harmonics")],
    ),
    ({}, {"harmonics": {"change": NAN, "order": 9, "value": 2.0}}, [("doubtful", "was not found with 9 harmonics")]),
    (OVER, {}, [("warning", "peak 2 overtakes peak 1 at 1.5"), MET]),
    ({}, {"last": {"problem": "is empty"}}, [("doubtful", "whether the last value", "the range is empty")]),
    (
        {},
        {"unmet": {"peak": [1], "value": [2.0]}},
        [("doubtful", "peak 2 at 2 was followed back", "a sweep at this value was not")],
    ),
    (
        {},
        {"unmet": {"peak": [1, 1], "value": [2.0, 1.0]}},
        [("doubtful", "peak 2 at 2, 1 was", "sweeps at these values were not")],
    ),
]


RECORDS: dict[Any, type[Any]] = {  # what the rules of an analysis are given
    cycles: LimitCycles,
    backbones: NonlinearModes,
    synthesis: ModalSynthesis,
    two_frequencies: QuasiPeriodic,
    motions: FoundMotions,
}


@pytest.mark.parametrize(
    ("words", "base", "row"),
    [
        pytest.param(words, base, row, id=f"{words.__name__.split('.')[-2]}-{k}")
        for words, base, rows in (
            (two_frequencies, TWO, TWO_ROWS),
            (synthesis, LEVELS, LEVEL_ROWS),
            (cycles, CYCLE, CYCLE_ROWS),
            (backbones, MODE, MODE_ROWS),
            (backbones, MODES, MODES_ROWS),
            (motions, FOUND, FOUND_ROWS),
        )
        for k, row in enumerate(rows)
    ],
)
def test_a_case_is_told_as_it_is(words: Any, base: dict[str, Any], row: Row) -> None:
    changes, expected = row
    case = case_of(base, changes)
    check(words.case_verdicts("", record_of(RECORDS[words], case)), expected)


@pytest.mark.parametrize("row", PEAK_ROWS)
def test_peaks_are_told_as_they_are(row: Any) -> None:
    changes, notes, expected = row
    check(resonances.case_verdicts("", record_of(Resonances, case_of(PEAKS, changes)), notes, ()), expected)


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        ([1.0, 2.0, 3.0], []),
        ([1.0, 2.0, NAN], [("note", "peak 1 ends after 2: at 3 it has become one")]),
        ([1.0, NAN, NAN], [("note", "peak 1 ends after 1: at 2 ")]),
        ([NAN, NAN, 3.0], [("note", "peak 1 ends after 3: at 2 ")]),
    ],
)
def test_a_peak_that_joins_another_ends_where_it_was_last_seen(own: Any, expected: Any) -> None:
    case = case_of(PEAKS, {"maximum": [[1, 1, 1]], "value": [own], "below": [[0.0] * 3]})
    found = resonances.case_verdicts("", record_of(Resonances, case), {}, (1.0, 2.0, 3.0))
    check(found, [*expected, ("trusted",)])


BOUNDS: dict[str, Any] = {
    "resonance_amplitude": [1e-3, 1e-3, 1e-3],
    "resonance_hz": [50.0, 51.0, 52.0],
    "resonance_inside": [1, 1, 1],
    "branches": [1, 1],
    "failures": [0, 0],
    "solves": [4, 5],
    "multiplier": [[[0.5]], [[0.5]], [[0.5]]],
    "least_amplitude": [1e-3, 1e-3],
    "most_amplitude": [1e-3, 1e-3],
    "frequency_hz": [40.0, 60.0],
    "harmonics": 5,
    "resonance_harmonics_error": [0.0, 0.0, 0.0],
    "harmonics_error": [[0.0, 0.0, 0.0]] * 2,
}
SETTLED: dict[str, Any] = {
    "confirmed": [1, 1],
    "resolved_amplitude": [1e-3, 1e-3],
    "time_amplitude": [1e-3, 1e-3],
}
AS_IT_IS = ("trusted", "leave the resonance as it is, 1 mm at 50 Hz: what sticks does not change it.")
BOUND_ROWS: list[Row] = [
    ({name: None for name in BOUNDS if name.startswith("resonance")} | {"multiplier": None}, []),
    ({}, [AS_IT_IS]),
    ({"multiplier": [[[NAN]]] * 3}, [("trusted", "no contact sticks all the time")]),
    ({"resonance_amplitude": [1000.0, 999.0, 1000.0]}, [("trusted", "as it is, 1e+06 mm")]),
    (
        {"resonance_amplitude": [1.0, 0.9989, 1.0]},
        [("note", "998.9 mm at 51 Hz to 1000 mm at 52 Hz", "may be off by -0.11 % to +0 %", "Design with")],
    ),
    ({"resonance_amplitude": [1.0, 1.0, 1.01]}, [("note", "to 1010 mm", "may be off by +0 % to +1 %")]),
    ({"resonance_amplitude": [1.0, 1.0, above(1.01)]}, [("warning", "to 1010 mm")]),
    (
        {"most_amplitude": [1e-3, 1.0011e-3]},
        [("trusted", "does not change it; elsewhere in the range they leave up to 0.11 % open, at 60 Hz")],
    ),
    ({"most_amplitude": [1e-3, 1.0009e-3]}, [AS_IT_IS]),
    (
        {"resonance_inside": [1, 0, 1]},
        [AS_IT_IS, ("doubtful", "at the end of residual_tractions.frequency_hz", "Widen")],
    ),
    (
        {"branches": [1, 2]},
        [AS_IT_IS, ("doubtful", "60.00 Hz: at 60 Hz the model's own start has several motions, up to 2")],
    ),
    ({"branches": [3, 2]}, [AS_IT_IS, ("doubtful", "40.00 Hz: at 2 frequencies from 40 to 60 Hz", "up to 3")]),
    ({"failures": [0, 2]}, [AS_IT_IS, ("note", "from 2 starts of tractions no motion was found (9 were)")]),
    (SETTLED, [AS_IT_IS]),
    ({"resonance_harmonics_error": [0.0, 0.05, 0.05], "harmonics_error": [[0.0, 0.05, NAN]] * 2}, [AS_IT_IS]),
    (
        {"resonance_harmonics_error": [0.0, NAN, 0.05], "harmonics_error": [[0.0, 0.05, NAN]] * 2},
        [AS_IT_IS, ("doubtful", "the error of H = 5 is not known", "residual_tractions.harmonics")],
    ),
    (
        {"resonance_harmonics_error": [0.06, above(0.05), 0.05], "harmonics_error": [[0.0, 0.5, NAN]] * 2},
        [
            AS_IT_IS,
            (
                "doubtful",
                "50.00 Hz: more harmonics than 5 are predicted to change the resonance from the model's own start by 6 %",
            ),
        ],
    ),
    (
        {"resonance_harmonics_error": [0.0, above(0.05), 0.05], "harmonics_error": [[0.0, 0.5, NAN]] * 2},
        [
            AS_IT_IS,
            ("doubtful", "51.00 Hz: more harmonics than 5 are predicted to change the smallest resonance by 5 %"),
        ],
    ),
    (
        {"resonance_harmonics_error": [0.0, 0.0, 1.1], "harmonics_error": [[0.0, 0.0, 0.0]] * 2},
        [AS_IT_IS, ("doubtful", "52.00 Hz", "the largest resonance by over 100 %")],
    ),
    (
        {"resonance_harmonics_error": [0.0, 0.0, 1.0], "harmonics_error": [[0.0, 0.0, 0.0]] * 2},
        [AS_IT_IS, ("doubtful", "the largest resonance by 1e+02 %")],
    ),
    (
        {"resonance_harmonics_error": [0.0, 0.0, 0.0], "harmonics_error": [[0.0, 0.05, NAN], [0.0, NAN, 0.07]]},
        [
            AS_IT_IS,
            (
                "note",
                "60.00 Hz: more harmonics than 5 are predicted to change the bounds by 7 % there, and by more than 5 % at 1 of 2 frequencies",
            ),
        ],
    ),
    (
        {"resonance_harmonics_error": [0.0, 0.0, 0.0], "harmonics_error": [[0.0, 1.5, NAN], [0.0, NAN, 0.07]]},
        [AS_IT_IS, ("note", "40.00 Hz", "over 100 % there, and by more than 5 % at 2 of 2")],
    ),
    (
        SETTLED | {"confirmed": [0, 1], "resolved_amplitude": [1.0011e-3, 1e-3]},
        [AS_IT_IS, ("doubtful", "51.00 Hz: the smallest resonance was not found again", "more harmonics")],
    ),
    (
        SETTLED | {"confirmed": [1, 0], "resolved_amplitude": [NAN, NAN]},
        [AS_IT_IS, ("doubtful", "52.00 Hz: the largest resonance was not found again")],
    ),
    (
        SETTLED | {"confirmed": [1, 0], "time_amplitude": [1e-3, 2e-3]},
        [AS_IT_IS, ("note", "52.00 Hz: the largest resonance, 1 mm", "it goes to 2 mm")],
    ),
    (SETTLED | {"confirmed": [0, 1], "time_amplitude": [NAN, 1e-3]}, [AS_IT_IS, ("note", "it diverges")]),
]


@pytest.mark.parametrize("row", BOUND_ROWS)
def test_bounds_over_tractions_are_told_as_they_are(row: Row) -> None:
    changes, expected = row
    check(tractions.case_verdicts("", record_of(ResidualTractions, case_of(BOUNDS, changes))), expected)


# two engine orders; the peak of the first is the point 1, that of the second the point 4
RUN: dict[str, tuple[str, Any]] = {
    "engine_orders": ("line", [2, 3]),
    "peak_frequency_hz": ("line", [40.0, 60.0]),
    "peak_point": ("line", [1, 4]),
    "peak_inside": ("line", [1, 1]),
    "failed": ("line", [0, 0]),
    "speed_error": ("line", [0.0, 1e-5]),
    "points_order": ("point", [2, 2, 2, 3, 3, 3]),
    "error": ("point", [0.5, 0.01, 0.5, 0.5, 0.02, 0.5]),
    "harmonic": ("point", [1, 3, 1, 1, 5, 1]),
    "fast_order": ("fast", [3]),
    "fast_rate_rpm_per_s": ("fast", [500.0]),
    "fast_finished": ("fast", [1]),
    "fast_peak_speed_rpm": ("fast", [1100.0]),
    "fast_speed_rpm": ("fast step", [[1000.0, 1100.0, 1200.0, NAN]]),
    "fast_neglected": ("fast", [0.05]),
}
RUN_ROWS: list[Row] = [
    ({}, [("trusted", "change their peaks by 2 % at most")]),
    ({"peak_point": [1, -1]}, [("wrong", "engine order 3: no point has a solution")]),
    ({"failed": [2, 0]}, [("doubtful", "engine order 2: 2 of 3 points have no solution")]),
    (
        {"error": [0.5, 0.01, 0.5, 0.5, above(0.02), 0.5]},
        [("doubtful", "60.00 Hz: engine order 3: missing harmonics may change the peak by 2 %", "harmonics.high")],
    ),
    (
        {"error": [0.5, NAN, 0.5, 0.5, 0.02, 0.5]},
        [("doubtful", "40.00 Hz: engine order 2: whether more harmonics than H = 3", '"auto"')],
    ),
    ({"speed_error": [0.0, above(1e-5)]}, [("doubtful", "off by 1.0e-05", "run_up.tolerance")]),
    (
        {"peak_inside": [0, 1]},
        [("note", "40.00 Hz: engine order 2: the largest amplitude is at an end", "Widen speeds_rpm")],
    ),
    (
        {"fast_finished": [0]},
        [("doubtful", "engine order 3 at 500 rpm/s: the fast run-up was not followed to its end")],
    ),
    ({"fast_peak_speed_rpm": [1200.0]}, [("note", "is at an end of the range", "to see the peak")]),
    ({"fast_peak_speed_rpm": [1000.0], "fast_neglected": [0.1]}, [("note", "is at an end")]),
    (
        {"fast_peak_speed_rpm": [1000.0], "fast_finished": [0], "fast_neglected": [0.1]},
        [("doubtful", "not followed"), ("doubtful", "10 % of its change")],
    ),
    ({"fast_neglected": [above(0.05)]}, [("doubtful", "5 % of its change is left out", "slower rate")]),
    ({"fast_neglected": [NAN]}, [("trusted",)]),
]


@pytest.mark.parametrize("row", RUN_ROWS)
def test_a_run_up_is_told_as_it_is(row: Row) -> None:
    changes, expected = row
    case = xr.Dataset({n: (dims.split(), changes.get(n, value)) for n, (dims, value) in RUN.items()})
    found = replace(record_of(RunUp, case), limit=0.02)
    check([v for v in running.case_verdicts("", found) if v.why != running.UNKNOWN.why], expected)


def flutter_waves(*hertz: tuple[float, ...]) -> list[Any]:
    return [SimpleNamespace(wave_number=k, frequencies_hz=np.array(own)) for k, own in enumerate(hertz)]


@pytest.mark.parametrize(
    ("total", "expected"),
    [
        ([[0.02, 0.01], [0.01, 0.03]], []),
        (
            [[0.02, 0.0099], [0.01, 0.03]],
            [("warning", "mode 2 has less damping than the 1 % required: damping 0.99 % at 200 Hz.", "Add damping")],
        ),
        ([[0.0, 0.02], [0.02, 0.03]], [("warning", "mode 1 has less damping")]),
        (
            [[0.0, 0.02], [0.005, 0.03]],
            [("warning", "mode 1 has less", "; 2 waves have too little in all", "Add damping")],
        ),
        ([[0.0, 0.005], [0.02, 0.03]], [("warning", "mode 1 has less", "; 2 modes of 1 wave have too little in all")]),
        (
            [[-5e-324, 0.005], [0.0, 0.03]],
            [("warning", "mode 1 grows: damping -4.94", "at 100 Hz.", "The wheel flutters")],
        ),
        (
            [[0.02, -1e-6], [0.005, 0.03]],
            [("warning", "mode 2 grows: damping -0.0001 % at 200 Hz.", "The wheel flutters")],
        ),
        ([[-1e-3, 0.02], [-2e-3, 0.03]], [("warning", "mode 1 grows: damping -0.2 % at 110 Hz; 2 waves grow in all")]),
        ([[0.005, 0.006], [0.02, 0.03]], [("warning", "0.5 %", "; 2 modes of 1 wave have too little in all")]),
        ([[0.005, 0.006], [0.007, 0.03]], [("warning", "; 3 modes of 2 waves have too little in all")]),
    ],
)
def test_waves_that_flutter_are_told(total: Any, expected: Any) -> None:
    own = flutter_waves((100.0, 200.0), (110.0, 210.0))
    check(unstable(own, np.array(total), 7, SimpleNamespace(required_percent=1.0)), expected)


@pytest.mark.parametrize(
    ("damping", "expected"),
    [
        ([0.01, 0.02], []),
        ([0.0099, 0.02], [("warning", "of 0.99 % at 50 Hz: it has less than the 1 % required", "Add damping")]),
        ([0.0, 0.02], [("warning", "less than the 1 %")]),
        ([-0.01, -0.005, 0.02], [("warning", "of -1 % at 50 Hz: 2 of its modes grow", "flutters")]),
    ],
)
def test_a_wheel_that_flutters_is_told(damping: Any, expected: Any) -> None:
    share = np.array(damping)
    values = 50.0 * HZ / np.sqrt(1 - share**2) * (-share + 1j * np.sqrt(1 - share**2))
    check(unstable_wheel(values, SimpleNamespace(required_percent=1.0)), expected)


@pytest.mark.parametrize(
    ("off", "expected"),
    [(0.1, []), (above(0.1), [("doubtful", "differ by up to 10 % of critical", "trust the eigen")])],
)
def test_energy_and_eigenvalue_are_held_against_each_other(off: float, expected: Any) -> None:
    check(energy_doubts(np.array([[off, 1.0]]), np.array([[0.0, 1.0]])), expected)
    check(energy_doubts(np.array([[0.0, 1.0]]), np.array([[off, 1.0]])), expected)


def test_a_basis_of_a_campbell_diagram_is_doubted_beyond_its_error() -> None:
    branches: Any = [SimpleNamespace(wave_number=k, error=e) for k, e in enumerate((1e-4, above(1e-4), NAN))]
    expected = [("doubtful", f"wave number {k}: ", "campbell.modes") for k in (1, 2)]
    check(waves.basis_doubts(branches), expected)


@pytest.mark.parametrize(
    ("large", "contacts", "expected"),
    [
        (False, True, []),
        (
            True,
            True,
            [
                (
                    "doubtful",
                    "frequencies at 3000 rpm are in doubt, as the static displacement, without the restraint of contacts, is too large",
                    "up to 2 mm at a radius of 300 mm (limit ",
                    "strains up to 1.5 % (limit ",
                    "rotations up to 0.02 rad (limit ",
                )
            ],
        ),
        (
            True,
            False,
            [("doubtful", "at 3000 rpm are in doubt, as the static displacement is too large", "Check the speed")],
        ),
    ],
)
def test_large_static_displacements_are_told(large: bool, contacts: bool, expected: Any) -> None:
    state: Any = SimpleNamespace(
        too_large=large, speed=3000.0 * RPM, displacement=2e-3, radius=0.3, strain=0.015, rotation=0.02
    )
    check(waves.static_doubts(state, contacts=contacts), expected)
    assert waves.static_doubts(None) == ()


def safe_of(not_judged: tuple[int, ...]) -> Any:
    """Twelve sectors, two modes; engine order m is excited at 100 m Hz, and 5 % around it counts."""
    hertz = {m: np.array([50.0, 90.0 + m]) for m in range(30)}
    known = SimpleNamespace(sectors=12, of_wave=hertz.__getitem__, frequencies_hz=np.zeros((7, 2)))
    return SimpleNamespace(not_judged=not_judged, frequencies=known, speed_range=(90.0 * HZ, 100.0 * HZ), allowed=0.05)


@pytest.mark.parametrize(
    ("orders", "expected"),
    [
        ((), []),
        (
            (1,),
            [
                (
                    "doubtful",
                    "engine orders 1 are not judged; with the margin they excite nodal diameters 1 at 100 Hz",
                    "modes (91 Hz)",
                    "now 2, to 3 or more",
                )
            ],
        ),
        (
            (3, 14),
            [
                (
                    "doubtful",
                    "orders 3, 14 are",
                    "nodal diameters 2, 3 at 300 to 1400 Hz",
                    "(93 to 104 Hz)",
                    "now 2, to 29 or more",
                )
            ],
        ),
        ((9, 10, 11), [("doubtful", "orders 9-11 are", "diameters 1-3 at")]),
    ],
)
def test_engine_orders_above_the_modes_are_told(orders: Any, expected: Any) -> None:
    check(waves.safe_doubts(safe_of(orders)), expected)


def test_engine_orders_of_a_campbell_diagram_are_told() -> None:
    branches: Any = [SimpleNamespace(frequencies_hz=np.zeros((4, 6)))]
    check(waves.campbell_doubts((), (), branches), [])
    expected = [
        ("doubtful", "3 (from 1234 rpm), 4 (from 0 rpm); other", "now 6."),
        ("doubtful", "engine orders 1, 2, 5-7 have no crossings"),
    ]
    check(waves.campbell_doubts([(3, 1234.4), (4, 0.0)], [7, 6, 5, 2, 1], branches), expected)


@pytest.mark.parametrize(("order", "rpm"), [(4, None), (5, None), (6, 0.0), (7, 1500.0)])
def test_an_engine_order_leaves_the_modes_at_a_speed(order: int, rpm: float | None) -> None:
    """The highest mode has 155 and 170 Hz at 1500 and 2000 rpm; between, squares are straight."""
    speeds = np.array([1500.0, 2000.0]) * RPM
    found = waves.unfollowed_from(order, np.array([[10.0, 155.0], [20.0, 170.0]]), speeds)
    if order == 6:  # 150 Hz and 200 Hz
        share = (155.0**2 - 150.0**2) / (155.0**2 - 150.0**2 + 200.0**2 - 170.0**2)
        rpm = float(np.sqrt(1500.0**2 + share * (2000.0**2 - 1500.0**2)))
    assert found == (None if rpm is None else pytest.approx(rpm, rel=1e-12))


@pytest.mark.parametrize(
    ("amplitude", "few", "expected"),
    [
        ([1.0, 2.0, 2.0], [0, 0, 0], []),
        ([1.0, above(2.0), 2.0], [0, 0, 0], [(0, "amplitude 2 times")]),
        ([2.0, 2.0, 0.5], [0, 0, 0], [(1, "amplitude 4 times")]),
        ([1.0, 3.0, 3.0], [1, 1, 0], []),
        ([1.0, 3.0, 3.0], [1, 0, 0], [(0, "amplitude 3 times")]),
        ([1.0, 3.0, 3.0], [0, 1, 1], [(0, "amplitude 3 times")]),
    ],
)
def test_amplitudes_jump_beyond_twice(amplitude: Any, few: Any, expected: Any) -> None:
    found = jumps(np.array(amplitude), np.zeros(3), np.array(few, dtype=bool), 1.0)
    assert [(j.step, j.what) for j in found] == expected


@pytest.mark.parametrize(
    ("loss", "expected"),
    [
        ([1.0, 1.0, 10.0, 10.0], []),
        ([1.0, 1.0, 10.01, 10.01], [(1, "dissipation 10 times")]),
        ([20.0, 20.0, 1.0, 1.0], [(1, "dissipation 20 times")]),
        # four times the larger step beside it
        ([1.0, 1.0, 21.0, 26.0], []),
        ([1.0, 1.0, 21.1, 26.0], [(1, "dissipation 21.1 times")]),
        ([6.0, 1.0, 21.0, 21.0], []),
        ([5.9, 1.0, 21.0, 21.0], [(1, "dissipation 21 times")]),
        # a hundredth of the largest does not matter
        ([1.0, 1.0, 20.0, 20.0, 20.0, 2000.0], [(4, "dissipation 100 times")]),
        ([1.0, 1.0, 20.0, 20.0, 20.0, 1999.0], [(1, "dissipation 20 times"), (4, "dissipation 100 times")]),
        # rounding, a millionth of what the contacts store
        ([0.99e-4, 0.99e-4, 1.0, 1.0], []),
        ([1.1e-4, 1.1e-4, 1.0, 1.0], [(1, "dissipation 9.09e+03 times")]),
        ([-1.0, 0.0, 1.0, 1.0], []),
    ],
)
def test_dissipations_jump_beyond_ten_times(loss: Any, expected: Any) -> None:
    """The contacts store 100 J, amplitudes are alike."""
    n = len(loss)
    found = jumps(np.ones(n), np.array(loss), np.zeros(n, dtype=bool), 100.0)
    assert [(j.step, j.what) for j in found] == expected


ISOLATED = {
    "output": 0.01,
    "gaps": 0.005,
    "distance": 0.5,
    "overlap": 0.0,
    "growth": 0.0,
    "harmonics": 0.2,
    "linear": False,
}


@pytest.mark.parametrize(
    ("changes", "resolved", "changed", "answer", "why"),
    [
        ({}, 0.08, 0.02, "trusted", "the other modes move by 1 % of the mode, the next frequency is 50 % away"),
        ({"output": 0.02}, 0.0, 0.0, "trusted", "move by 2 % of the mode"),
        ({"output": above(0.02)}, 0.0, 0.0, "doubtful", "is 50 % away: the peak may be off by about 2 %"),
        (
            {"gaps": 0.05},
            0.0,
            0.0,
            "doubtful",
            "move by 5 % of the mode, the next frequency is 50 % away: the peak may be off by about 5 %",
        ),
        ({"gaps": above(0.05)}, 0.0, 0.0, "refused", "the peak would be off by about 5 %"),
        (
            {"overlap": 0.3},
            0.0,
            0.0,
            "refused",
            "move by 1 % of the mode, the next frequency is 50 % away: the peak would be off by about 10 %",
        ),
        ({"output": 0.04, "growth": 0.75}, 0.0, 0.0, "trusted", "move by 4 % of the mode"),
        ({}, above(0.08), 0.0, "doubtful", "without every second one the peak moves by 8 %"),
        ({"harmonics": above(0.2)}, 0.0, 0.0, "doubtful", "higher harmonics have 20 % of the first"),
        ({}, 0.0, NAN, "doubtful", "solved with one set of harmonics alone: raise modal_synthesis.most_harmonics"),
        ({}, 0.0, above(0.02), "doubtful", "by 2 %: raise modal_synthesis.most_harmonics"),
        ({"linear": True, "output": 1.0}, 1.0, NAN, "trusted", "nothing slips"),
        ({"distance": INF}, 0.0, 0.0, "trusted", "there is no other mode"),
        (
            {"distance": INF, "output": 0.03},
            0.0,
            0.0,
            "doubtful",
            "there is no other mode, nothing is near: the peak may be off by about 3 %",
        ),
    ],
)
def test_a_mode_that_is_not_alone_is_told(changes: Any, resolved: float, changed: float, answer: str, why: str) -> None:
    found = judged(Isolation(**(ISOLATED | changes)), resolved, changed)
    assert found[0] == answer
    assert why in found[1]


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (10.0, "1000 %"),
        (10.01, "over 1000 %"),
        (-10.0, "-1000 %"),
        (-10.01, "below -1000 %"),
        (0.1, "10 %"),
        (0.0994, "9.9 %"),
        (0.09951, "10 %"),
        (0.01234, "1.2 %"),
        (-0.01234, "-1.2 %"),
        (1.1e-5, "0.0011 %"),
        (0.9e-5, "< 0.001 %"),
        (0.0, "0 %"),
        (NAN, "-"),
        (INF, "-"),
        (0.02, "2 %"),
    ],
)
def test_shares_are_written_with_the_digits_that_count(share: float, text: str) -> None:
    assert percent(share) == text
    assert percent(share, unit=False) == text.removesuffix(" %")


@pytest.mark.parametrize(
    ("changed", "doubted"),
    [
        ({}, False),
        ({"hz": np.array([98.0, 99.0, above(100.0)])}, True),
        ({"hz": np.array([98.0, 99.0, 102.0]), "branch": np.array([0, 1])}, False),
        ({"hz": np.array([98.0, 102.0]), "stepped": False}, False),
        ({"hz": np.array([98.0, 102.0]), "range_key": "frequencies_hz"}, False),
        ({"hz": np.array([98.0, 102.0]), "range_key": "speed_rpm"}, True),
        ({"hz": np.array([98.0, 102.0]), "numbers": SimpleNamespace(peak_damping=NAN)}, False),
        ({"hz": np.array([98.0, 102.0]), "peak": -1}, False),
    ],
)
def test_steps_are_doubted_above_half_the_width_of_the_resonance(changed: dict[str, Any], doubted: bool) -> None:
    """At 100 Hz with a damping ratio of 1 % the width is 2 Hz."""
    case = {
        "peak": 1,
        "peak_hz": 100.0,
        "stepped": True,
        "range_key": "frequency_hz",
        "numbers": SimpleNamespace(peak_damping=0.01),
        "hz": np.array([98.0, 99.0, 100.0]),
    } | changed
    case.setdefault("branch", np.arange(case["hz"].size))
    found = list(coarse_steps(SimpleNamespace(**case)))  # type: ignore[arg-type]
    assert bool(found) == doubted
    if found:
        assert found[0].level == "doubtful"
        assert "2 Hz wide at half power" in found[0].why
        assert found[0].remedy.startswith("Give forced_response.frequencies = ")

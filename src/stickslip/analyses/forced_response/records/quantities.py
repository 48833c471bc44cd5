"""The variables of a response: dimensions, unit and meaning of each.

Complex numbers have a trailing dimension ``part = (re, im)``, flags are small integers, texts are variable-length strings: no
compound types, no booleans, nothing that needs this package to be read.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from stickslip.arrays import IntArray
from stickslip.response.forced.choices import Stage
from stickslip.solve.status import Status
from stickslip.study.verdict import LEVELS, POINT_LEVELS

STAGES = get_args(Stage)
MOTION = {"stable": 0, "unstable": 1, "undecided": 2, "not examined": 3, "neutral": 4}  # numbers of motion_stability


@dataclass(frozen=True)
class Quantity:
    """A variable of the dataset: dimensions, unit and meaning."""

    dims: tuple[str, ...]
    units: str
    about: str


_OF = {
    "case": {
        "excitation_n": ("N", "amplitude of the largest harmonic force, NaN without one"),
        "lowest_hz": ("Hz", "lowest frequency asked for"),
        "highest_hz": ("Hz", "highest frequency asked for"),
        "peak_amplitude": ("m", "largest amplitude of the report output"),
        "peak_frequency_hz": ("Hz", "frequency of the peak"),
        "peak_point": ("1", "index of the peak into point, -1 if none"),
        "unstable_peak_amplitude": (
            "m",
            "a larger amplitude whose motion is unstable, so that it is not the peak; NaN where there is none",
        ),
        "unstable_peak_frequency_hz": ("Hz", "its frequency"),
        "peak_damping": (
            "1",
            "equivalent damping ratio at the peak: work of the load in a cycle over 4π times the largest energy stored by structure and contacts; half the inverse of the quality factor",
        ),
        "points": ("1", "accepted points"),
        "points_low": ("1", "accepted points with the harmonics of the first passage"),
        "points_high": ("1", "accepted points with other harmonics"),
        "points_failed": ("1", "points that did not converge"),
        "unknowns_solved": ("1", "real unknowns of all solutions together, those not accepted included"),
        "newton_steps": ("1", "Newton iterations"),
        "seconds_contact": ("s", "time in contact forces"),
        "seconds_linear": ("s", "time in linear algebra"),
        "seconds_rest": ("s", "other time of the solver"),
        "choice_sentence": ("1", "where and why more harmonics were asked for, empty where nothing was decided"),
        "retention_peak_shift": ("1", "relative change of the peak amplitude with a tenth of the retention stiffness"),
        "retention_frequency_shift_hz": ("Hz", "change of the peak frequency with a tenth of the retention stiffness"),
        "reference_worst_percent": ("percent", "largest such change"),
        "reference_worst_hz": ("Hz", "where it is"),
        "reference_above": ("1", "solutions above the threshold"),
        "reference_sentence": ("1", "what the check says, in words"),
        "bifurcations_limits": ("1", "where bifurcations are not seen, and what looking for them took, in words"),
        "known_verdicts": ("1", "what only the model knew, verdicts as JSON"),
        "physics_verdicts": ("1", "what the modes say of the physics of the case, verdicts as JSON"),
        "peak_rotation_rad": (
            "rad",
            "largest rotation at the peak: of rigid bodies, of nodes that turn, and the mean slope of a meshed part from its clamp to an output; NaN where none is known",
        ),
        "peak_strain_rms": (
            "1",
            "root mean square of the strain of all elastic parts at the peak, by their strain energy, NaN where one has no mesh",
        ),
        "peak_slip_facets": (
            "1",
            "largest amplitude of a tangential gap at the peak over the side of a facet, NaN where contacts have no areas",
        ),
        "modes_peak_change": (
            "1",
            "relative change of the peak amplitude with half again as many modes in the reduction, NaN where parts keep all or it was not found",
        ),
        "modes_frequency_change_hz": ("Hz", "change of the peak frequency with half again as many modes"),
        "points_peak_change": (
            "1",
            "relative change of the peak amplitude with half the points of meshed contacts, NaN where there are none or it was not found",
        ),
        "points_frequency_change_hz": ("Hz", "change of the peak frequency with half the points of meshed contacts"),
        "points_left_out": ("1", "contact points that were left out for it"),
        "stiffness_peak_slope": (
            "1",
            "relative change of the peak amplitude over that of the stiffness of all contacts, by one linear solution at the peak; at listed frequencies and at an end of the range at that frequency; NaN where no contact has a stiffness, or one is rigid",
        ),
        "stiffness_frequency_slope_hz": (
            "Hz",
            "change of the peak frequency over the relative change of the stiffness of all contacts; NaN where no peak was resolved",
        ),
        "case_verdict": ("1", "whether the peak is to be trusted"),
        "largest_blade": ("1", "sector of the blade with the largest amplitude"),
        "tuned_peak_amplitude": ("m", "largest amplitude of the wheel with all sectors alike"),
        "tuned_peak_hz": ("Hz", "frequency of that peak"),
        "amplification": ("1", "largest amplitude of any blade over that of the wheel with all sectors alike"),
        "whitehead": (
            "1",
            "(1 + √n)/2, a bound of the amplification for one family of modes, equal damping of all waves and no friction only",
        ),
        "localisation": (
            "1",
            "localisation factor at the peak: 0 where all blades move alike, 1 where one moves alone",
        ),
    },
    "point": {
        "frequency_hz": (
            "Hz",
            "excitation frequency, in the order of the branch: it goes back where the branch folds, and up to a tenth of the range beyond lowest_hz and highest_hz; points added to resolve the peak stand last, as near to each other as its search came",
        ),
        "speed_rpm": ("1/min", "speed of rotation"),
        "point_case": ("1", "case"),
        "order": ("1", "highest harmonic kept"),
        "unknowns": ("1", "real unknowns of the accepted solution"),
        "status": ("1", "how the solver ended"),
        "indicator": (
            "1",
            "what the strategy compared with its threshold; of an error: at the first solution, else at the accepted one",
        ),
        "predicted_error_percent": (
            "percent",
            "error of the first solution that an alert predicted, NaN where the indicator is no error; where harmonics were raised along the branch (passages = auto) no first solution stands apart, and it is own_error_percent",
        ),
        "own_error_percent": (
            "percent",
            "error that is predicted of the accepted solution itself: 0 where no force acts on the harmonics left out, NaN where it was not judged",
        ),
        "audit_error_percent": (
            "percent",
            "difference of the accepted solution from one with more harmonics (an audit), NaN where none was made: not needed, or judged by prediction alone",
        ),
        "audit_error_of": ("1", "the output or dof that differs so much, empty where no audit was made"),
        "real_error_percent": (
            "percent",
            "difference of the first and the accepted solution where the frequency was solved again",
        ),
        "newton_iterations": ("1", "Newton iterations"),
        "seconds": ("s", "time of the point"),
        "refinement": ("1", "1 if the point was added to resolve the peak"),
        "motion_stability": ("1", "whether disturbances of the point's motion die"),
        "motion_stability_basis": (
            "1",
            "what that rests on: an examination of the point, of its neighbours, or the sign of the determinant of the Jacobian",
        ),
        "marched_sentence": (
            "1",
            "what the motion in time from rest did where the point was not found otherwise, empty elsewhere",
        ),
        "verdict": ("1", "whether the point is to be trusted"),
        "verdict_reason": ("1", "why not, empty where it is"),
        "reference_error_percent": (
            "percent",
            "change of the complex amplitude that the judging set of the most harmonics would make, NaN where unsolved",
        ),
    },
    "point harmonic": {"harmonic_kept": ("1", "1 if the solution keeps the harmonic")},
    "point output": {
        "amplitude": (
            "m",
            "amplitude as the attribute amplitude_of says: of the harmonics that loads drive (driven_harmonics), half of peak to peak, or rms",
        ),
        "amplitude_low": ("m", "the same with the harmonics of the first passage"),
    },
    "point driven output": {
        "driven_amplitude": (
            "m",
            "amplitude of each harmonic that the load drives, which on a wheel is an engine order",
        )
    },
    "point harmonic output part": {"output_displacement": ("m", "displacement of the outputs")},
    "point harmonic retained part": {
        "retained_displacement": ("m", "displacement of contact coordinates and free bodies, rotations in rad")
    },
    "point harmonic contact direction part": {
        "gap": ("m", "relative displacement at the contacts"),
        "contact_force": ("N", "contact force"),
    },
    "point contact": {"dissipated_energy": ("J", "energy dissipated in a cycle")},
    "case sample": {"peak_time": ("s", "time within the period at the peak")},
    "case contact direction sample": {
        "peak_gap": ("m", "contact gap at the peak"),
        "peak_force": ("N", "contact force at the peak"),
    },
    "case contact tangent sample": {"peak_state": ("1", "contact state at the peak, -1 if none")},
    "another": {
        "another_case": ("1", "case of a motion beside that of the response"),
        "another_frequency_hz": ("Hz", "where it was found"),
        "another_amplitude": ("m", "its amplitude"),
        "another_known": ("m", "amplitude of the response there"),
        "another_start": ("1", "what it was found from: vibration with contacts stuck or open, or rest"),
        "another_stability": ("1", "whether it is stable, in words"),
    },
    "attempt": {
        "attempt_case": ("1", "case of a solution"),
        "attempt_frequency_hz": ("Hz", "frequency of a solution"),
        "attempt_stage": ("1", "when it was made"),
        "attempt_unknowns": ("1", "real unknowns"),
        "attempt_indicator": ("1", "what the strategy compared with its threshold, NaN where it was not asked"),
        "attempt_repeated": ("1", "1 if it asked for more"),
        "attempt_status": ("1", "how it ended"),
        "attempt_newton_iterations": ("1", "Newton iterations"),
        "attempt_seconds": ("s", "time it took"),
    },
    "case blade": {
        "blade_peak_amplitude": ("m", "largest amplitude of each blade at any frequency"),
        "blade_peak_hz": ("Hz", "frequency of that"),
    },
    "case blade part": {"blade_motion": ("m", "motion of the blades at the peak, the lowest harmonic that is driven")},
    "case wave": {"wave_amplitude": ("m", "amplitude of each wave number in the motion of the blades at the peak")},
    "case blade mistuned": {"deviation": ("1", "deviation of each sector, relative; of gaps in m")},
    "tuned_point": {
        "tuned_case": ("1", "case of a point of the wheel with all sectors alike"),
        "tuned_frequency_hz": ("Hz", "its frequency"),
        "tuned_amplitude": ("m", "its amplitude"),
    },
    "attempt harmonic": {"attempt_kept": ("1", "1 if the solution keeps the harmonic")},
    "alert_point": {
        "alert_case": ("1", "case of a first solution that an alert was asked about"),
        "alert_frequency_hz": ("Hz", "frequency at which the alert was asked"),
        "alert_error_percent": ("percent", "error of the first solution that the alert predicted"),
        "alert_repeated": ("1", "1 if it asked for more"),
    },
    "check": {
        "verify_case": ("1", "case"),
        "verify_frequency_hz": ("Hz", "frequency"),
        "verify_transient": ("m", "amplitude by time integration"),
        "verify_balance": ("m", "amplitude by harmonic balance"),
        "verify_difference_percent": ("percent", "their difference"),
        "verify_settled": ("1", "1 if it became periodic"),
        "verify_periods": ("1", "periods integrated"),
        "verify_outputs_percent": (
            "percent",
            "largest difference of an output, with its phase, by the measure of errors",
        ),
        "verify_scatter": ("1", "scatter about the average of a motion that did not become periodic"),
        "verify_motion": (
            "1",
            "attained, left, not periodic or not settled: what the motion in time did that began with the balance's state",
        ),
        "verify_refined": ("m", "amplitude by harmonic balance with three times the harmonics"),
        "verify_sentence": ("1", "what happened, in words"),
    },
    "examined": {
        "stability_case": ("1", "case of a point whose stability was examined"),
        "stability_frequency_hz": ("Hz", "its frequency"),
        "stability_verdict": ("1", "stable, unstable, neutral, undecided or not examined"),
        "stability_multiplier": (
            "1",
            "modulus of the multiplier that decides, the largest as a rule; NaN where none is known",
        ),
        "stability_multiplier_error": ("1", "how far it may be from that of the motion with all harmonics"),
        "stability_sentence": ("1", "what was found and why, in words"),
    },
    "bifurcation": {
        "bifurcation_case": ("1", "case of a bifurcation on the branch"),
        "bifurcation_frequency_hz": ("Hz", "its frequency"),
        "bifurcation_frequency_error_hz": (
            "Hz",
            "how far that may be off: what the multiplier's error makes of it, of a fold the difference from more harmonics; infinite where that is not known",
        ),
        "bifurcation_amplitude": ("m", "amplitude of the report output there"),
        "bifurcation_kind": ("1", "fold, period doubling, Neimark-Sacker, branch point, or jump of multipliers"),
        "bifurcation_multiplier_error": (
            "1",
            "how far the multiplier may be from that of the motion with all harmonics",
        ),
        "bifurcation_certain": (
            "1",
            "1 if the multiplier lies on its side of the unit circle at both neighbouring points with its error",
        ),
        "bifurcation_outside": ("1", "multipliers outside of the unit circle behind it"),
        "bifurcation_sentence": ("1", "what was found, in words"),
    },
    "bifurcation part": {
        "bifurcation_multiplier": ("1", "multiplier that crosses the unit circle, of a fold that nearest to 1")
    },
    "side_branch": {
        "side_branch_case": ("1", "case of a branch that leaves the response"),
        "side_branch_frequency_hz": ("Hz", "where it leaves"),
        "side_branch_periods": ("1", "periods of the load in one of its motions"),
        "side_branch_sentence": ("1", "what became of it, in words"),
    },
    "side_point": {
        "side_point_case": ("1", "case of a point of such a branch"),
        "side_point_frequency_hz": ("Hz", "frequency of the load"),
        "side_point_branch": ("1", "number of the branch within its case, from 0"),
        "side_point_amplitude": (
            "m",
            "amplitude of the report output over the harmonics that the load drives; of a wheel in the sector where it is largest",
        ),
        "side_point_subharmonic": (
            "m",
            "its amplitude over all harmonics that are no multiples of the load's frequency",
        ),
        "side_point_localisation": ("1", "share of the vibration, by squares, of the sector with the largest one"),
    },
    "not_periodic": {
        "not_periodic_case": ("1", "case of a motion in time where no balance stands for it"),
        "not_periodic_frequency_hz": ("Hz", "its frequency of excitation"),
        "not_periodic_spread": ("1", "relative difference between windows of it"),
        "not_periodic_periods": ("1", "periods marched, of which the later half counts"),
        "not_periodic_seconds": ("s", "time that took"),
        "not_periodic_settled": ("1", "1 where its windows are alike"),
        "not_periodic_repeats": ("1", "1 where every period is like the one before"),
        "not_periodic_sentence": ("1", "what it is like, in words"),
    },
    "not_periodic output": {
        "not_periodic_largest": ("m", "largest amplitude of a period, half of peak to peak"),
        "not_periodic_least": ("m", "least amplitude of a period"),
        "not_periodic_mean": ("m", "mean"),
        "not_periodic_rms": ("m", "root mean square about the mean"),
        "not_periodic_extreme": ("m", "largest distance from the mean"),
    },
    "not_periodic line": {
        "not_periodic_line_hz": ("Hz", "frequencies of the largest peaks of the spectrum of the report output"),
        "not_periodic_line_amplitude": ("m", "their amplitudes"),
    },
    "not_periodic turn": {"not_periodic_amplitudes": ("m", "amplitude of the report output in the last periods")},
    "case mode": {
        "frequency_full_hz": ("Hz", "natural frequency, full model, contacts open"),
        "frequency_reduced_hz": ("Hz", "natural frequency, reduced model, contacts open"),
        "frequency_stuck_full_hz": ("Hz", "natural frequency, full model, contacts stuck"),
        "frequency_stuck_reduced_hz": ("Hz", "natural frequency, reduced model, contacts stuck"),
    },
    "case contact direction": {
        "static_gap": ("m", "contact gap under the static loads"),
        "static_force": ("N", "contact force under the static loads"),
    },
    "contact": {
        "contact_law": ("1", "law of the contact"),
        "contact_group": ("1", "name of the contact in the model"),
        "contact_area": ("m2", "area that belongs to the contact, NaN where nothing tells"),
    },
    "contact xyz": {"contact_position": ("m", "position of the contact points")},
    "contact xyz direction": {"contact_frame": ("1", "axes t, w, n of the contact frames")},
    "surface_node xyz": {"surface_point": ("m", "skin of the meshed parts")},
    "face corner": {"surface_triangle": ("1", "triangles of the skin")},
}
QUANTITIES: Mapping[str, Quantity] = {
    name: Quantity(tuple(dims.split()), *of) for dims, own in _OF.items() for name, of in own.items()
}


def flags(name: str) -> dict[str, IntArray | str]:
    """Return the netCDF attributes that explain coded values; none for a variable without codes."""
    meanings = {
        "status": {s.name.lower(): int(s) for s in Status},
        "attempt_status": {s.name.lower(): int(s) for s in Status},
        "attempt_stage": {stage: i for i, stage in enumerate(STAGES)},
        "peak_state": {"stick": 0, "slip": 1, "open": 2},
        "motion_stability": {word.replace(" ", "_"): i for word, i in MOTION.items()},
        "motion_stability_basis": {"not_examined": 0, "examined": 1, "carried": 2, "by_sign": 3},
        "verdict": {level: i for i, level in enumerate(POINT_LEVELS)},
        "case_verdict": {level: i for i, level in enumerate(LEVELS)},
    }.get(name)
    if meanings is None:
        return {}
    return {"flag_values": np.array(list(meanings.values()), dtype=np.int64), "flag_meanings": " ".join(meanings)}

"""The records of a forced response: all results of a job, each number with dimensions, unit and meaning.

Complex numbers have a trailing dimension ``part = (re, im)``, flags are small integers, texts are variable-length strings: no
compound types, no booleans, nothing that needs this package to be read.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, get_args

import numpy as np
import xarray as xr

from stickslip.analyses.columns import record_of
from stickslip.analyses.operation import Operating
from stickslip.arrays import FloatArray, IntArray, TextArray
from stickslip.column import Column, column, columns_of
from stickslip.response.forced.choices import Stage
from stickslip.solve.status import Status
from stickslip.study.verdict import LEVELS, POINT_LEVELS

Kind = TypeVar("Kind")
STAGES = get_args(Stage)
STRESS_AT = ("free", "contact", "joint", "support", "load")  # codes of stress_at
MOTION = {"stable": 0, "unstable": 1, "undecided": 2, "not examined": 3, "neutral": 4}  # codes of motion_stability


@dataclass(frozen=True, eq=False, kw_only=True)
class CaseNumbers:
    """The peak of a case, and the work to find it."""

    excitation_n: float = column("N", "amplitude of the largest harmonic force, NaN without one", along="case")
    lowest_hz: float = column("Hz", "lowest frequency asked for", along="case")
    highest_hz: float = column("Hz", "highest frequency asked for", along="case")
    peak_amplitude: float = column("m", "largest amplitude of the report output", along="case")
    peak_frequency_hz: float = column("Hz", "frequency of the peak", along="case")
    peak_point: int = column("1", "index of the peak into point, -1 if none", along="case")
    unstable_peak_amplitude: float = column(
        "m",
        "a larger amplitude whose motion is unstable, so that it is not the peak; NaN where there is none",
        along="case",
    )
    unstable_peak_frequency_hz: float = column("Hz", "its frequency", along="case")
    peak_damping: float = column(
        "1",
        "equivalent damping ratio at the peak: work of the load in a cycle over 4π times the largest energy stored by structure and contacts; half the inverse of the quality factor",
        along="case",
    )
    points: int = column("1", "accepted points", along="case")
    points_low: int = column("1", "accepted points with the harmonics of the first passage", along="case")
    points_high: int = column("1", "accepted points with other harmonics", along="case")
    points_failed: int = column("1", "points that did not converge", along="case")
    unknowns_solved: int = column(
        "1", "real unknowns of all solutions together, those not accepted included", along="case"
    )
    newton_steps: int = column("1", "Newton iterations", along="case")
    seconds_contact: float = column("s", "time in contact forces", along="case")
    seconds_linear: float = column("s", "time in linear algebra", along="case")
    seconds_rest: float = column("s", "other time of the solver", along="case")
    choice_sentence: str = column(
        "1", "where and why more harmonics were asked for, empty where nothing was decided", along="case"
    )
    retention_peak_shift: float = column(
        "1", "relative change of the peak amplitude with a tenth of the retention stiffness", along="case"
    )
    retention_frequency_shift_hz: float = column(
        "Hz", "change of the peak frequency with a tenth of the retention stiffness", along="case"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Points:
    """Accepted points."""

    frequency_hz: FloatArray = column(
        "Hz",
        "excitation frequency, in the order of the branch: it goes back where the branch folds, and up to a tenth of the range beyond lowest_hz and highest_hz; points added to resolve the peak stand last, as near to each other as its search came",
        along="point",
    )
    speed_rpm: FloatArray = column("1/min", "speed of rotation", along="point")
    point_case: IntArray | None = column("1", "case", along="point", default=None)
    order: IntArray = column("1", "highest harmonic kept", along="point")
    unknowns: IntArray = column("1", "real unknowns of the accepted solution", along="point")
    status: IntArray = column("1", "how the solver ended", along="point")
    indicator: FloatArray = column(
        "1",
        "indicator that the strategy compared with its threshold: an error at the first solution, other indicators at the accepted one",
        along="point",
    )
    predicted_error_percent: FloatArray = column(
        "percent",
        "error of the first solution that an alert predicted, NaN where the indicator is no error; where harmonics were raised along the branch (passages = auto) no first solution stands apart, and it is own_error_percent",
        along="point",
    )
    own_error_percent: FloatArray = column(
        "percent",
        "error that is predicted of the accepted solution itself: 0 where no force acts on the harmonics left out, NaN where it was not judged",
        along="point",
    )
    audit_error_percent: FloatArray = column(
        "percent",
        "difference of the accepted solution from one with more harmonics (an audit), NaN where none was made: not needed, or judged by prediction alone",
        along="point",
    )
    audit_error_of: TextArray = column(
        "1", "output or dof with this difference, empty where no audit was made", along="point"
    )
    real_error_percent: FloatArray = column(
        "percent",
        "difference of the first and the accepted solution where the frequency was solved again",
        along="point",
    )
    newton_iterations: IntArray = column("1", "Newton iterations", along="point")
    seconds: FloatArray = column("s", "time of the point", along="point")
    refinement: IntArray = column("1", "1 if the point was added to resolve the peak", along="point")
    marched_sentence: TextArray = column(
        "1",
        "what the motion in time from rest did where the point was not found otherwise, empty elsewhere",
        along="point",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class PointFields:
    """Harmonics, amplitudes and contact forces of each point."""

    harmonic_kept: IntArray = column("1", "1 if the solution keeps the harmonic", along="point harmonic")
    amplitude: FloatArray = column(
        "m",
        "amplitude as the attribute amplitude_of says: of the harmonics that loads drive (driven_harmonics), half of peak to peak, or rms",
        along="point output",
    )
    amplitude_low: FloatArray = column("m", "the same with the harmonics of the first passage", along="point output")
    driven_amplitude: FloatArray = column(
        "m",
        "amplitude of each harmonic that the load drives, which on a wheel is an engine order",
        along="point driven output",
    )
    output_displacement: FloatArray = column("m", "displacement of the outputs", along="point harmonic output part")
    retained_displacement: FloatArray = column(
        "m",
        "displacement of contact coordinates and free bodies, rotations in rad",
        along="point harmonic retained part",
    )
    gap: FloatArray = column(
        "m", "relative displacement at the contacts", along="point harmonic contact direction part"
    )
    contact_force: FloatArray = column("N", "contact force", along="point harmonic contact direction part")
    dissipated_energy: FloatArray = column("J", "energy dissipated in a cycle", along="point contact")


@dataclass(frozen=True, eq=False, kw_only=True)
class Shots:
    """Motions found by shooting (``method = "shooting"``), one row a point of its case."""

    shot_case: IntArray | None = column("1", "case of a motion found by shooting", along="shot", default=None)
    shot_frequency_hz: FloatArray = column("Hz", "its frequency", along="shot")
    shot_residual: FloatArray = column(
        "1", "distance of the state after a period from that before, relative to the vibration", along="shot"
    )
    shot_step_error_percent: FloatArray = column(
        "percent",
        "estimated error of the harmonics by the time step, of the largest: by twice as many steps, four times where a contact opens; NaN where no motion was found",
        along="shot",
    )
    shot_steps: IntArray = column("1", "time steps in a period", along="shot")
    shot_periods: IntArray = column("1", "periods integrated", along="shot")
    shot_corrections: IntArray = column("1", "of these with tangents: corrections by Newton's method", along="shot")


@dataclass(frozen=True, eq=False, kw_only=True)
class PeakPeriod:
    """The contacts over a period at the peak."""

    peak_time: FloatArray = column("s", "time within the period at the peak", along="case sample")
    peak_gap: FloatArray = column("m", "contact gap at the peak", along="case contact direction sample")
    peak_force: FloatArray = column("N", "contact force at the peak", along="case contact direction sample")
    peak_state: IntArray = column("1", "contact state at the peak, -1 if none", along="case contact tangent sample")
    peak_friction: FloatArray | None = column(
        "1", "friction coefficient of the contact, NaN if its law has none", along="case contact", default=None
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Attempts:
    """All solutions, and the first solutions judged by an alert."""

    attempt_case: IntArray | None = column("1", "case of a solution", along="attempt", default=None)
    attempt_frequency_hz: FloatArray = column("Hz", "frequency of a solution", along="attempt")
    attempt_stage: IntArray = column("1", "when it was made", along="attempt")
    attempt_unknowns: IntArray = column("1", "real unknowns", along="attempt")
    attempt_indicator: FloatArray = column(
        "1", "what the strategy compared with its threshold, NaN where it was not asked", along="attempt"
    )
    attempt_repeated: IntArray = column("1", "1 if it asked for more", along="attempt")
    attempt_status: IntArray = column("1", "how it ended", along="attempt")
    attempt_newton_iterations: IntArray = column("1", "Newton iterations", along="attempt")
    attempt_seconds: FloatArray = column("s", "time it took", along="attempt")
    attempt_kept: IntArray = column("1", "1 if the solution keeps the harmonic", along="attempt harmonic")
    alert_case: IntArray | None = column(
        "1", "case of a first solution that an alert was asked about", along="alert_point", default=None
    )
    alert_frequency_hz: FloatArray = column("Hz", "frequency at which the alert was asked", along="alert_point")
    alert_error_percent: FloatArray = column(
        "percent", "error of the first solution that the alert predicted", along="alert_point"
    )
    alert_repeated: IntArray = column("1", "1 if it asked for more", along="alert_point")


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelFacts:
    """Natural frequencies, contacts under the static loads, skin."""

    frequency_full_hz: FloatArray = column("Hz", "natural frequency, full model, contacts open", along="case mode")
    frequency_reduced_hz: FloatArray = column(
        "Hz", "natural frequency, reduced model, contacts open", along="case mode"
    )
    frequency_stuck_full_hz: FloatArray = column(
        "Hz", "natural frequency, full model, contacts stuck", along="case mode"
    )
    frequency_stuck_reduced_hz: FloatArray = column(
        "Hz", "natural frequency, reduced model, contacts stuck", along="case mode"
    )
    static_gap: FloatArray = column("m", "contact gap under the static loads", along="case contact direction")
    static_force: FloatArray = column("N", "contact force under the static loads", along="case contact direction")
    contact_law: Sequence[str] = column("1", "law of the contact", along="contact")
    contact_group: Sequence[str] = column("1", "name of the contact in the model", along="contact")
    contact_area: FloatArray = column(
        "m2", "area that belongs to the contact, NaN where nothing tells", along="contact"
    )
    contact_position: FloatArray = column("m", "position of the contact points", along="contact xyz")
    contact_frame: FloatArray = column("1", "axes t, w, n of the contact frames", along="contact xyz direction")
    surface_point: FloatArray | None = column("m", "skin of the meshed parts", along="surface_node xyz", default=None)
    surface_triangle: IntArray | None = column("1", "triangles of the skin", along="face corner", default=None)


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawn:
    """Geometry for pictures of the model, and its motion at the peak; empty for a mistuned wheel."""

    drawn_point: FloatArray = column(
        "m",
        "points of the surfaces in pictures: some nodes of meshes, rigid bodies, cubes at nodes without a mesh and at lumped masses, which stand in a row 1 m apart",
        along="case drawn_node xyz",
    )
    drawn_face_case: IntArray | None = column("1", "case of a triangle", along="drawn_face", default=None)
    drawn_triangle: IntArray | None = column("1", "triangles between them", along="drawn_face corner", default=None)
    drawn_part: TextArray | None = column("1", "part of each point", along="case drawn_node", default=None)
    drawn_kind: TextArray | None = column(
        "1", "what it is drawn from: mesh, section, contact faces, node or mass", along="case drawn_node", default=None
    )
    drawn_contact: FloatArray = column("m", "places of the contact points in pictures", along="contact xyz")
    drawn_load_case: IntArray | None = column("1", "case of such a load", along="drawn_load", default=None)
    drawn_load: TextArray | None = column("1", "name of a load with a place", along="drawn_load", default=None)
    drawn_load_harmonic: IntArray | None = column(
        "1", "its harmonic, 0 for a static load", along="drawn_load", default=None
    )
    drawn_load_point: FloatArray | None = column("m", "where it acts", along="drawn_load xyz", default=None)
    drawn_load_direction: FloatArray | None = column(
        "1", "unit vector of its direction", along="drawn_load xyz", default=None
    )
    drawn_support_case: IntArray | None = column("1", "case of such a point", along="drawn_support", default=None)
    drawn_support: FloatArray | None = column(
        "m", "points that are held, of those that are drawn", along="drawn_support xyz", default=None
    )
    peak_drawn_motion: FloatArray = column(
        "m",
        "displacement of the drawn points at the peak in the first harmonics from 1 on, without the mean; NaN where it was not recovered: above 60 000 degrees of freedom, without a peak",
        along="case drawn_harmonic drawn_node xyz part",
    )
    peak_contact_motion: FloatArray = column(
        "m",
        "the same of the contact points, each on its first surface",
        along="case drawn_harmonic contact xyz part",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class KnownVerdicts:
    """Verdicts that need the model; the job stores them."""

    known_verdicts: str = column("1", "what only the model knew, verdicts as JSON", along="case")


@dataclass(frozen=True, eq=False, kw_only=True)
class Verdicts:
    """Verdicts on cases and points, made from all other variables."""

    case_verdict: IntArray = column("1", "whether the peak is to be trusted", along="case")
    verdict: IntArray | None = column("1", "whether the point is to be trusted", along="point", default=None)
    verdict_reason: TextArray | None = column("1", "why not, empty where it is", along="point", default=None)


@dataclass(frozen=True, eq=False, kw_only=True)
class PointStability:
    """Stability of each point of the response."""

    motion_stability: IntArray = column("1", "whether disturbances of the point's motion die", along="point")
    motion_stability_basis: IntArray = column(
        "1",
        "what that rests on: an examination of the point, of its neighbours, or the sign of the determinant of the Jacobian",
        along="point",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class ExaminedRows:
    """Points whose stability was examined."""

    stability_case: IntArray | None = column(
        "1", "case of a point whose stability was examined", along="examined", default=None
    )
    stability_frequency_hz: FloatArray = column("Hz", "its frequency", along="examined")
    stability_verdict: TextArray = column("1", "stable, unstable, neutral, undecided or not examined", along="examined")
    stability_multiplier: FloatArray = column(
        "1", "modulus of the multiplier that decides, the largest as a rule; NaN where none is known", along="examined"
    )
    stability_multiplier_error: FloatArray = column(
        "1", "bound of its difference from the motion with all harmonics", along="examined"
    )
    stability_sentence: TextArray = column("1", "what was found and why, in words", along="examined")


@dataclass(frozen=True, eq=False, kw_only=True)
class OtherMotions:
    """Motions beside the response, at the same frequencies."""

    another_case: IntArray | None = column(
        "1", "case of another motion beside the response", along="another", default=None
    )
    another_frequency_hz: FloatArray = column("Hz", "where it was found", along="another")
    another_amplitude: FloatArray = column("m", "its amplitude", along="another")
    another_known: FloatArray = column("m", "amplitude of the response there", along="another")
    another_start: TextArray = column(
        "1", "start that led to it: vibration with contacts stuck or open, or rest", along="another"
    )
    another_stability: TextArray = column("1", "whether it is stable, in words", along="another")


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionsInTime:
    """Motions in time at points without a valid periodic solution."""

    not_periodic_case: IntArray | None = column(
        "1", "case of a motion in time where no balance stands for it", along="not_periodic", default=None
    )
    not_periodic_frequency_hz: FloatArray = column("Hz", "its frequency of excitation", along="not_periodic")
    not_periodic_spread: FloatArray = column("1", "relative difference between windows of it", along="not_periodic")
    not_periodic_periods: IntArray = column(
        "1", "periods marched, of which the later half counts", along="not_periodic"
    )
    not_periodic_seconds: FloatArray = column("s", "time that took", along="not_periodic")
    not_periodic_settled: IntArray = column("1", "1 where its windows are alike", along="not_periodic")
    not_periodic_repeats: IntArray = column("1", "1 where every period is like the one before", along="not_periodic")
    not_periodic_sentence: TextArray = column("1", "what it is like, in words", along="not_periodic")
    not_periodic_largest: FloatArray = column(
        "m", "largest amplitude of a period, half of peak to peak", along="not_periodic output"
    )
    not_periodic_least: FloatArray = column("m", "least amplitude of a period", along="not_periodic output")
    not_periodic_mean: FloatArray = column("m", "mean", along="not_periodic output")
    not_periodic_rms: FloatArray = column("m", "root mean square about the mean", along="not_periodic output")
    not_periodic_extreme: FloatArray = column("m", "largest distance from the mean", along="not_periodic output")
    not_periodic_line_hz: FloatArray = column(
        "Hz", "frequencies of the largest peaks of the spectrum of the report output", along="not_periodic line"
    )
    not_periodic_line_amplitude: FloatArray = column("m", "their amplitudes", along="not_periodic line")
    not_periodic_amplitudes: FloatArray = column(
        "m", "amplitude of the report output in the last periods", along="not_periodic turn"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class BifurcationSearch:
    """The search for bifurcations of a case."""

    bifurcations_limits: str = column(
        "1", "where bifurcations are not seen, and what looking for them took, in words", along="case"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class BifurcationRows:
    """Bifurcations of the branch."""

    bifurcation_case: IntArray | None = column(
        "1", "case of a bifurcation on the branch", along="bifurcation", default=None
    )
    bifurcation_frequency_hz: FloatArray = column("Hz", "its frequency", along="bifurcation")
    bifurcation_frequency_error_hz: FloatArray = column(
        "Hz",
        "how far that may be off: what the multiplier's error makes of it, of a fold the difference from more harmonics; infinite where that is not known",
        along="bifurcation",
    )
    bifurcation_amplitude: FloatArray = column("m", "amplitude of the report output there", along="bifurcation")
    bifurcation_kind: TextArray = column(
        "1", "fold, period doubling, Neimark-Sacker, branch point, or jump of multipliers", along="bifurcation"
    )
    bifurcation_multiplier_error: FloatArray = column(
        "1", "bound of its difference from the multiplier of the motion with all harmonics", along="bifurcation"
    )
    bifurcation_certain: IntArray = column(
        "1",
        "1 if the multiplier lies on its side of the unit circle at both neighbouring points with its error",
        along="bifurcation",
    )
    bifurcation_outside: IntArray = column("1", "multipliers outside of the unit circle behind it", along="bifurcation")
    bifurcation_sentence: TextArray = column("1", "what was found, in words", along="bifurcation")
    bifurcation_multiplier: FloatArray = column(
        "1", "multiplier that crosses the unit circle, of a fold that nearest to 1", along="bifurcation part"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class SideBranches:
    """Branches that leave the response at bifurcations."""

    side_branch_case: IntArray | None = column(
        "1", "case of a branch that leaves the response", along="side_branch", default=None
    )
    side_branch_frequency_hz: FloatArray = column("Hz", "where it leaves", along="side_branch")
    side_branch_periods: IntArray = column("1", "periods of the load in one of its motions", along="side_branch")
    side_branch_sentence: TextArray = column("1", "what became of it, in words", along="side_branch")


@dataclass(frozen=True, eq=False, kw_only=True)
class SidePoints:
    """Points of side branches."""

    side_point_case: IntArray | None = column("1", "case of a point of such a branch", along="side_point", default=None)
    side_point_frequency_hz: FloatArray = column("Hz", "frequency of the load", along="side_point")
    side_point_branch: IntArray = column("1", "number of the branch within its case, from 0", along="side_point")
    side_point_amplitude: FloatArray = column(
        "m",
        "amplitude of the report output over the harmonics that the load drives; of a wheel in the sector where it is largest",
        along="side_point",
    )
    side_point_subharmonic: FloatArray = column(
        "m", "its amplitude over all harmonics that are no multiples of the load's frequency", along="side_point"
    )
    side_point_localisation: FloatArray = column(
        "1", "share of the vibration, by squares, of the sector with the largest one", along="side_point"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeChecks:
    """Comparisons with time integration (``--verify``)."""

    verify_case: IntArray | None = column("1", "case", along="check", default=None)
    verify_frequency_hz: FloatArray = column("Hz", "frequency", along="check")
    verify_transient: FloatArray = column("m", "amplitude by time integration", along="check")
    verify_balance: FloatArray = column("m", "amplitude by harmonic balance", along="check")
    verify_difference_percent: FloatArray = column("percent", "their difference", along="check")
    verify_settled: IntArray = column("1", "1 if it became periodic", along="check")
    verify_periods: IntArray = column("1", "periods integrated", along="check")
    verify_outputs_percent: FloatArray = column(
        "percent", "largest difference of an output, with its phase, by the measure of errors", along="check"
    )
    verify_scatter: FloatArray = column(
        "1", "scatter about the average of a motion that did not become periodic", along="check"
    )
    verify_motion: TextArray = column(
        "1",
        "attained, next to it, left, not periodic or not settled: what the motion in time did that began with the balance's state",
        along="check",
    )
    verify_refined: FloatArray = column(
        "m", "amplitude by harmonic balance with three times the harmonics", along="check"
    )
    verify_sentence: TextArray = column("1", "what happened, in words", along="check")


@dataclass(frozen=True, eq=False, kw_only=True)
class MoreHarmonics:
    """Predicted change of the accepted solutions by more harmonics (``--verify-harmonics``)."""

    reference_worst_percent: float = column("percent", "largest such change", along="case")
    reference_worst_hz: float = column("Hz", "where it is", along="case")
    reference_above: int = column("1", "solutions above the threshold", along="case")
    reference_sentence: str = column("1", "what the check says, in words", along="case")
    reference_error_percent: FloatArray = column(
        "percent",
        "change of the complex amplitude that the judging set of the most harmonics would make, NaN where unsolved",
        along="point",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Jacobians:
    """Jacobians with few and with many harmonics (``harmonics.similarity``; Gastaldi and Berruti 2017, sections 4.1 and 6.2)."""

    jacobian_reference: int = column("1", "highest harmonic of the compared Jacobians", along="case")
    jacobian_rows: int = column("1", "rows of the compared Jacobians", along="case")
    neglected_frequency_hz: float = column(
        "Hz", "frequency of neglected_block_norm, where jacobian_change_percent is largest", along="case"
    )
    jacobian_change_percent: FloatArray = column(
        "percent",
        "ΔJ%: Frobenius norm of the difference of the Jacobians at the solutions with few and with many harmonics, over that with many (eq. 30); NaN where one solution is not found",
        along="point",
    )
    gamma_mean_diagonal: FloatArray = column(
        "1",
        "mean of the diagonal of Γ (eq. 31), 1 for equal Jacobians; times jacobian_rows it is the trace",
        along="point",
    )
    gamma_zero_percent: FloatArray = column(
        "percent", "share of the terms of Γ off its diagonal of at most 0.001", along="point"
    )
    jacobian_block_norm: FloatArray = column(
        "1",
        "largest singular value of each block of the Jacobian at the peak, with few harmonics; 1 is as stiff as structure and stuck contact of a coordinate",
        along="case force_harmonic motion_harmonic",
    )
    neglected_block_norm: FloatArray = column(
        "1",
        "the same of ΔJ (eq. 20), the blocks that few harmonics neglect, at neglected_frequency_hz",
        along="case force_harmonic motion_harmonic",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class OperatingRange:
    """Operating range of the machine, as frequencies of the excitation, and as speeds if these were given."""

    operating_lowest_hz: float = column(
        "Hz", "lowest operating frequency of the excitation, NaN without one", along="case"
    )
    operating_highest_hz: float = column("Hz", "highest operating frequency of the excitation", along="case")
    operating_lowest_rpm: float = column(
        "rpm", "lowest operating speed, NaN where frequencies were given", along="case"
    )
    operating_highest_rpm: float = column("rpm", "highest operating speed", along="case")

    @property
    def range(self) -> Operating:
        """The range as it was given."""
        if np.isfinite(self.operating_lowest_rpm):
            return Operating(self.operating_lowest_rpm, self.operating_highest_rpm, "rpm")
        return Operating(self.operating_lowest_hz, self.operating_highest_hz, "Hz")

    def shown(self, hertz: float) -> float:
        """Return a frequency of the excitation in the unit of the range."""
        return hertz * self.range.lowest / self.operating_lowest_hz


@dataclass(frozen=True, eq=False, kw_only=True)
class PhysicsVerdicts:
    """Verdicts on the physics of a case, which need the model."""

    physics_verdicts: str = column("1", "what the modes say of the physics of the case, verdicts as JSON", along="case")


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionAtPeak:
    """Size of the motion at the peak, and the limits of linear kinematics."""

    peak_rotation_rad: float = column(
        "rad",
        "largest rotation at the peak: of rigid bodies, of nodes that turn, and the mean slope of a meshed part from its clamp to an output; NaN where none is known",
        along="case",
    )
    peak_strain_rms: float = column(
        "1",
        "root mean square of the strain of all elastic parts at the peak, by their strain energy, NaN where one has no mesh",
        along="case",
    )
    peak_slip_facets: float = column(
        "1",
        "largest amplitude of a tangential gap at the peak over the side of a facet, NaN where contacts have no areas",
        along="case",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelChanges:
    """Change of the peak with more modes and with fewer contact points."""

    modes_peak_change: float = column(
        "1",
        "relative change of the peak amplitude with half again as many modes in the reduction, NaN where parts keep all or it was not found",
        along="case",
    )
    modes_frequency_change_hz: float = column(
        "Hz", "change of the peak frequency with half again as many modes", along="case"
    )
    points_peak_change: float = column(
        "1",
        "relative change of the peak amplitude with half the points of meshed contacts, NaN where there are none or it was not found",
        along="case",
    )
    points_frequency_change_hz: float = column(
        "Hz", "change of the peak frequency with half the points of meshed contacts", along="case"
    )
    points_left_out: int = column("1", "contact points that were left out for it", along="case")


@dataclass(frozen=True, eq=False, kw_only=True)
class StiffnessChange:
    """Change of the peak with the contact stiffness."""

    stiffness_peak_slope: float = column(
        "1",
        "relative change of the peak amplitude per relative change of all contact stiffnesses, by one linear solution at the peak; at listed frequencies and at an end of the range at that frequency; NaN where no contact has a stiffness, or one is rigid",
        along="case",
    )
    stiffness_frequency_slope_hz: float = column(
        "Hz",
        "change of the peak frequency over the relative change of the stiffness of all contacts; NaN where no peak was resolved",
        along="case",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class SurfaceStress:
    """Stress at the peak at the corner nodes of the surfaces of meshed parts, one sector, and its margin."""

    stress_point: FloatArray = column("m", "nodes of the surfaces", along="case stress_place xyz")
    stress_node: IntArray = column("1", "their numbers in the mesh", along="case stress_place")
    stress_part: TextArray = column("1", "their parts", along="case stress_place")
    stress_face_case: IntArray | None = column("1", "case of a triangle", along="stress_face", default=None)
    stress_triangle: IntArray | None = column("1", "triangles between them", along="stress_face corner", default=None)
    stress_at: IntArray = column(
        "1",
        "where elastic stress is singular: at a contact, a joint, a support or a loaded node; free elsewhere",
        along="case stress_place",
    )
    alternating_stress: FloatArray = column(
        "Pa", "largest equivalent stress (von Mises) of the vibration over its phase", along="case stress_place"
    )
    mean_stress: FloatArray = column(
        "Pa",
        "equivalent stress of the static state, with the sign of its largest principal stress; where asked for, after shakedown",
        along="case stress_place",
    )
    static_stress: FloatArray = column(
        "Pa", "stress of the static state, before shakedown", along="case stress_place component"
    )
    allowed_stress: FloatArray = column(
        "Pa",
        "alternating stress that the material endures at this mean stress, NaN with a criterion",
        along="case stress_place",
    )
    utilisation: FloatArray = column(
        "1",
        "alternating over allowed stress, or that of the criterion, beyond its thousand worst places an upper bound; NaN where the static stress is above yield",
        along="case stress_place",
    )
    stress_mesh_error: FloatArray = column(
        "1",
        "estimated error of the alternating stress by the mesh, in the energy norm around the node",
        along="case stress_place",
    )
    stress_correction: FloatArray = column(
        "1",
        "change of the alternating stress by the modes that the reduction left out, relative",
        along="case stress_place",
    )
    worst_place: IntArray = column(
        "1", "places with the largest utilisation away from singular ones, the worst first", along="case worst"
    )
    worst_stress: FloatArray = column(
        "Pa", "their stress xx, yy, zz, xy, yz, xz in each harmonic", along="case stress_harmonic worst component part"
    )
    stress_doubt: str = column("1", "what the margin leaves open, empty if nothing", along="case")
    stress_idle: str = column("1", "limits that have no effect, empty without any", along="case")
    stress_rule: str = column("1", "line of the Haigh diagram, or criterion, by which stress is judged", along="case")
    allowed_amplitude: float = column(
        "m",
        "amplitude of the report output at which the worst place reaches its limit, the vibration scaled at the static stress of the peak; NaN without a margin",
        along="case",
    )
    stress_slips: int = column(
        "1",
        "1 if a contact slips or opens at the peak or is a nonlinear spring, so that scaling is an estimate",
        along="case",
    )
    stress_shakedown: int = column("1", "1 if the mean stress is bounded by shakedown", along="case")
    fatigue_limit: float = column("Pa", "amplitude endured at R = -1", along="case")
    haigh_mean: FloatArray = column("Pa", "mean stress of the Haigh diagram", along="case haigh")
    haigh_amplitude: FloatArray = column(
        "Pa", "amplitude endured at that mean stress, NaN with a criterion", along="case haigh"
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Blades:
    """A mistuned wheel compared with the tuned one."""

    largest_blade: int = column("1", "sector of the blade with the largest amplitude", along="case")
    tuned_peak_amplitude: float = column("m", "largest amplitude of the wheel with all sectors alike", along="case")
    tuned_peak_hz: float = column("Hz", "frequency of that peak", along="case")
    amplification: float = column(
        "1", "largest amplitude of any blade over the amplitude of the wheel with all sectors alike", along="case"
    )
    whitehead: float = column(
        "1",
        "(1 + √n)/2, a bound of the amplification for one family of modes, equal damping of all waves and no friction only",
        along="case",
    )
    localisation: float = column(
        "1", "localisation factor at the peak: 0 where all blades move alike, 1 where one moves alone", along="case"
    )
    blade_peak_amplitude: FloatArray = column(
        "m", "largest amplitude of each blade at any frequency", along="case blade"
    )
    blade_peak_hz: FloatArray = column("Hz", "frequency of that", along="case blade")
    blade_motion: FloatArray = column(
        "m", "motion of the blades at the peak, the lowest harmonic that is driven", along="case blade part"
    )
    wave_amplitude: FloatArray = column(
        "m", "amplitude of each wave number in the motion of the blades at the peak", along="case wave"
    )
    deviation: FloatArray = column("1", "deviation of each sector, relative; of gaps in m", along="case blade mistuned")
    tuned_case: IntArray | None = column(
        "1", "case of a point of the wheel with all sectors alike", along="tuned_point", default=None
    )
    tuned_frequency_hz: FloatArray = column("Hz", "its frequency", along="tuned_point")
    tuned_amplitude: FloatArray = column("m", "its amplitude", along="tuned_point")


KINDS = (
    CaseNumbers,
    Points,
    PointFields,
    Shots,
    PeakPeriod,
    Attempts,
    ModelFacts,
    Drawn,
    KnownVerdicts,
    Verdicts,
    PointStability,
    ExaminedRows,
    OtherMotions,
    MotionsInTime,
    BifurcationSearch,
    BifurcationRows,
    SideBranches,
    SidePoints,
    TimeChecks,
    MoreHarmonics,
    Jacobians,
    OperatingRange,
    PhysicsVerdicts,
    MotionAtPeak,
    ModelChanges,
    StiffnessChange,
    SurfaceStress,
    Blades,
)
COLUMNS: Mapping[str, Column] = {name: own for kind in KINDS for name, own in columns_of(kind).items()}

# dimension of rows -> variable with the case of each row
OWNERS = {own.along[0]: name for name, own in COLUMNS.items() if name.endswith("_case")}


def read(kind: type[Kind], data: xr.Dataset, case: int | None = None) -> Kind:
    """Return the record of a kind from a result.

    Parameters
    ----------
    kind
        One of `KINDS`.
    data
        Dataset of `put_together`, of this or an earlier version. Missing variables become NaN, -1 or an empty text, one
        for each point or row.
    case
        Index along ``case``; the record then holds this case alone and lacks the dimension ``case``. None: all cases;
        numbers of a case become arrays.
    """
    columns = columns_of(kind)
    owners = {d: OWNERS[d] for own in columns.values() for d in own.along if OWNERS.get(d) in data}
    own = data[[*dict.fromkeys([*filter(data.__contains__, columns), *owners.values()])]]
    if case is not None:
        there = {d: rows_of_case(own[name].values, case) for d, name in owners.items()}
        own = own.isel({"case": case, **there}, missing_dims="ignore")
    record: Kind = record_of(kind, own, own.sizes)
    return record


def rows_of_case(owner: IntArray, case: int) -> slice | IntArray:
    """Return the rows of a case from the case of each row; neighbouring rows as a slice, which copies no values."""
    at = np.flatnonzero(owner == case)
    return slice(int(at[0]), int(at[-1]) + 1) if at.size and np.ptp(at) < at.size else at


def of_cases(kind: type[Kind], data: xr.Dataset) -> list[Kind]:
    """Return one record of a kind for each case."""
    return [read(kind, data, i) for i in range(data.sizes["case"])]


def holds(kind: type[Any], data: xr.Dataset) -> bool:
    """Whether a result has any variable of a kind."""
    return any(name in data for name in columns_of(kind))


def each(record: Kind) -> Iterator[Kind]:
    """Yield one record for each entry of a record whose fields all lie along the same dimension."""
    values = stored(record)
    for i in range(min(map(len, values.values()))):
        yield type(record)(**{name: value[i] for name, value in values.items()})


def stored(record: Any) -> dict[str, Any]:
    """Return the nonempty fields of a record by the names of their variables."""
    return {name: value for name, value in vars(record).items() if value is not None}


def flags(name: str) -> dict[str, IntArray | str]:
    """Return the netCDF attributes that explain coded values; none for a variable without codes."""
    meanings = {
        "status": {s.name.lower(): int(s) for s in Status},
        "attempt_status": {s.name.lower(): int(s) for s in Status},
        "attempt_stage": {stage: i for i, stage in enumerate(STAGES)},
        "peak_state": {"stick": 0, "slip": 1, "open": 2},
        "motion_stability": {word.replace(" ", "_"): i for word, i in MOTION.items()},
        "motion_stability_basis": {"not_examined": 0, "examined": 1, "carried": 2, "by_sign": 3},
        "stress_at": {place: i for i, place in enumerate(STRESS_AT)},
        "verdict": {level: i for i, level in enumerate(POINT_LEVELS)},
        "case_verdict": {level: i for i, level in enumerate(LEVELS)},
    }.get(name)
    if meanings is None:
        return {}
    return {"flag_values": np.array(list(meanings.values()), dtype=np.int64), "flag_meanings": " ".join(meanings)}

"""Results as one labelled dataset, written so that any netCDF-4 reader opens it.

Complex numbers have a trailing dimension ``part = (re, im)``, flags are small integers, texts are attributes or variable-length
strings: no compound types, no booleans, nothing that needs this package.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.recovery import Fields
from stickslip.study.attempts import alert_variables, attempt_variables, kept, status_flags
from stickslip.study.build import Case
from stickslip.study.chooser import Chooser
from stickslip.study.collect import HZ, Accepted, CaseResult, unknowns
from stickslip.study.netcdf import variable
from stickslip.study.reference_check import ReferenceDoubt, reference_variables
from stickslip.study.verify import Check

DIRECTIONS = ("t", "w", "n")
STATES = {"flag_values": np.array([0, 1, 2], dtype=np.int64), "flag_meanings": "stick slip open"}
CASE_QUANTITIES = {
    "load_ratio": ("1", "centrifugal load over excitation amplitude, F_CL/F_HE"),
    "excitation_n": ("N", "amplitude of the harmonic force"),
    "centrifugal_n": ("N", "centrifugal load on the damper"),
    "peak_amplitude": ("m", "largest first-harmonic amplitude of the report output"),
    "peak_frequency_hz": ("Hz", "frequency of the peak"),
    "peak_point": ("1", "index of the peak into point, -1 if none"),
    "points": ("1", "accepted points"),
    "points_low": ("1", "accepted points with the harmonics of the first passage"),
    "points_high": ("1", "accepted points with other harmonics"),
    "points_failed": ("1", "points that did not converge"),
    "unknowns_solved": (
        "1",
        "real unknowns of all solutions together, those not accepted included",
    ),
    "newton_steps": ("1", "Newton iterations"),
    "seconds_contact": ("s", "time in contact forces"),
    "seconds_linear": ("s", "time in linear algebra"),
    "seconds_rest": ("s", "other time of the solver"),
    "retention_peak_shift": (
        "1",
        "relative change of the peak amplitude with a tenth of the retention stiffness",
    ),
    "retention_frequency_shift_hz": (
        "Hz",
        "change of the peak frequency with a tenth of the retention stiffness",
    ),
}
POINT_QUANTITIES = {
    "frequency_hz": ("Hz", "excitation frequency"),
    "case": ("1", "load case"),
    "order": ("1", "highest harmonic kept"),
    "unknowns": ("1", "real unknowns of the accepted solution"),
    "status": ("1", "how the solver ended"),
    "indicator": (
        "1",
        "what the strategy compared with its threshold: of an error at the first solution of the frequency, else at the accepted one",
    ),
    "predicted_error_percent": (
        "percent",
        "error of the first solution that an alert predicted, NaN where the indicator is no error",
    ),
    "real_error_percent": (
        "percent",
        "difference of the first and the accepted solution where the frequency was solved again",
    ),
    "newton_iterations": ("1", "Newton iterations"),
    "seconds": ("s", "time of the point"),
    "refinement": ("1", "1 if the point was added to resolve the peak"),
}


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from: attributes of the dataset."""

    title: str
    study_toml: str
    stickslip_version: str
    versions: Mapping[str, str]
    created: str
    wall_seconds: float
    selection: Chooser
    samples: int
    evaluator: str
    alert_explanation: str
    warnings: Sequence[str]
    complete: bool

    def attributes(self) -> dict[str, Any]:
        """Return them as netCDF attributes: texts and numbers only."""
        return {
            "title": self.title,
            "study_toml": self.study_toml,
            "stickslip_version": self.stickslip_version,
            "versions": json.dumps(dict(self.versions)),
            "created": self.created,
            "wall_seconds": float(self.wall_seconds),
            "samples": self.samples,
            "evaluator": self.evaluator,
            "alert_explanation": self.alert_explanation,
            "warnings": json.dumps(list(self.warnings)),
            "complete": int(self.complete),
        } | self.selection.attributes()


def dataset(
    case: Case,
    results: Sequence[CaseResult],
    provenance: Provenance,
    checks: Sequence[Check] = (),
    doubts: Sequence[ReferenceDoubt] = (),
) -> xr.Dataset:
    """Assemble the dataset described in the design notes.

    Parameters
    ----------
    case
        The model.
    results
        Finished load cases.
    provenance
        Attributes.
    checks
        Comparisons with time integration; empty when none were asked for.
    doubts
        What more harmonics than the reference would change; empty when that was not asked for.
    """
    high = provenance.selection.high[-1]
    data = (
        _case_variables(case, results)
        | _point_variables(case, results, provenance.selection)
        | _peak_variables(case, results)
        | attempt_variables(results, high)
        | _model_variables(case)
    )
    if provenance.selection.is_error:
        data |= alert_variables(results)
    if checks:
        data |= _check_variables(checks)
    if doubts:
        data |= reference_variables(doubts)
    coordinates = {
        "output": list(case.output_labels),
        "retained": list(case.system.retained_labels),
        "contact": list(case.contacts.names),
        "harmonic": np.arange(high + 1),
        "direction": list(DIRECTIONS),
        "tangent": list(DIRECTIONS[:2]),
        "part": ["re", "im"],
        "xyz": ["x", "y", "z"],
    }
    attributes = provenance.attributes() | {"report_output": case.output_labels[case.report_output]}
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def _parts(values: ComplexArray) -> FloatArray:
    return np.stack([values.real, values.imag], axis=-1)


def _case_variables(case: Case, results: Sequence[CaseResult]) -> dict[str, xr.Variable]:
    first = np.cumsum([0, *(len(r.accepted) for r in results)])
    rows = [
        {
            "load_ratio": r.ratio,
            "excitation_n": r.excitation,
            "centrifugal_n": case.centrifugal,
            "peak_amplitude": r.peak_amplitude,
            "peak_frequency_hz": r.peak_frequency_hz,
            "peak_point": -1 if r.peak < 0 else int(first[i]) + r.peak,
            "points": len(r.accepted),
            "points_low": r.points_low,
            "points_high": len(r.accepted) - r.points_low,
            "points_failed": r.failed,
            "unknowns_solved": r.unknowns,
            "newton_steps": r.newton_steps,
            "seconds_contact": r.seconds[0],
            "seconds_linear": r.seconds[1],
            "seconds_rest": r.seconds[2],
            "retention_peak_shift": r.retention_shift[0],
            "retention_frequency_shift_hz": r.retention_shift[1],
        }
        for i, r in enumerate(results)
    ]
    return {
        name: variable("load_case", [row[name] for row in rows], units, about)
        for name, (units, about) in CASE_QUANTITIES.items()
    }


def _point_variables(
    case: Case, results: Sequence[CaseResult], selection: Chooser
) -> dict[str, xr.Variable]:
    high = selection.high[-1]
    pairs = [(i, a) for i, r in enumerate(results) for a in r.accepted]
    n_out = len(case.output_labels)
    rows = [_point_row(i, a, is_error=selection.is_error) for i, a in pairs]
    found = {
        name: variable("point", np.array([row[name] for row in rows]), units, about)
        for name, (units, about) in POINT_QUANTITIES.items()
    }
    found["status"].attrs |= status_flags()
    n_contacts, n_retained = len(case.contacts.names), case.system.retained.size
    every = [a for _, a in pairs]

    def block(shape: tuple[int, ...], name: str) -> FloatArray:
        return _parts(np.stack([_padded(_of(a.fields, name), high, shape) for a in every]))

    retained = [
        _padded(a.point.coefficients if a.fields else None, high, (n_retained,)) for a in every
    ]
    energy = [np.full(n_contacts, np.nan) if a.fields is None else a.fields.energy for a in every]
    contact = "point harmonic contact direction part"
    return found | {
        "harmonic_kept": kept([a.point for a in every], high, "point"),
        "amplitude": variable(
            "point output", [a.amplitudes(n_out) for a in every], "m", "first-harmonic amplitude"
        ),
        "amplitude_low": variable(
            "point output",
            [a.first_amplitudes(n_out, selection.low) for a in every],
            "m",
            "first-harmonic amplitude with the harmonics of the first passage",
        ),
        "output_displacement": variable(
            "point harmonic output part",
            block((n_out,), "outputs"),
            "m",
            "displacement of the outputs",
        ),
        "retained_displacement": variable(
            "point harmonic retained part",
            _parts(np.stack(retained)),
            "m",
            "displacement of contact and damper coordinates, rotations in rad",
        ),
        "gap": variable(
            contact, block((n_contacts, 3), "gaps"), "m", "relative displacement at the contacts"
        ),
        "contact_force": variable(contact, block((n_contacts, 3), "forces"), "N", "contact force"),
        "dissipated_energy": variable("point contact", energy, "J", "energy dissipated in a cycle"),
    }


def _point_row(load_case: int, accepted: Accepted, *, is_error: bool) -> dict[str, float | int]:
    point = accepted.point
    return {
        "frequency_hz": point.omega / HZ,
        "case": load_case,
        "order": point.order,
        "unknowns": unknowns(point),
        "status": int(point.status),
        "indicator": accepted.indicator if is_error else point.predicted_error,
        "predicted_error_percent": 100 * accepted.indicator if is_error else np.nan,
        "real_error_percent": 100 * accepted.real_error,
        "newton_iterations": point.iterations,
        "seconds": point.seconds_total,
        "refinement": int(accepted.point.stage == "peak"),
    }


def _of(found: Fields | None, name: str) -> ComplexArray | None:
    return None if found is None else getattr(found, name)


def _padded(values: ComplexArray | None, high: int, shape: tuple[int, ...]) -> ComplexArray:
    """Return harmonics 0..high: zero where they were not kept, NaN where there is no solution."""
    out = np.zeros((high + 1, *shape), dtype=complex)
    if values is None:
        out[:] = complex(np.nan, np.nan)
    else:
        out[: len(values)] = values
    return out


def _peak_variables(case: Case, results: Sequence[CaseResult]) -> dict[str, xr.Variable]:
    samples = max((r.signals.time.size for r in results if r.signals), default=0)
    n = len(case.contacts.names)
    time = np.full((len(results), samples), np.nan)
    gap, force = (np.full((len(results), n, 3, samples), np.nan) for _ in range(2))
    state = np.full((len(results), n, 2, samples), -1)
    for i, result in enumerate(results):
        if result.signals is not None:
            time[i], gap[i], force[i] = (
                result.signals.time,
                result.signals.gap,
                result.signals.force,
            )
            state[i] = result.signals.state
    found = {
        "peak_time": variable("load_case sample", time, "s", "time within the period at the peak"),
        "peak_gap": variable(
            "load_case contact direction sample", gap, "m", "contact gap at the peak"
        ),
        "peak_force": variable(
            "load_case contact direction sample", force, "N", "contact force at the peak"
        ),
        "peak_state": variable(
            "load_case contact tangent sample", state, "1", "contact state at the peak, -1 if none"
        ),
    }
    found["peak_state"].attrs |= STATES
    return found


def _model_variables(case: Case) -> dict[str, xr.Variable]:
    checked = case.blades.frequencies
    modes = {
        "frequency_full_hz": (checked.free_full, "natural frequency, full model, no damper"),
        "frequency_reduced_hz": (
            checked.free_reduced,
            "natural frequency, reduced model, no damper",
        ),
        "frequency_stuck_full_hz": (
            checked.stuck_full,
            "natural frequency, full model, contacts stuck",
        ),
        "frequency_stuck_reduced_hz": (
            checked.stuck_reduced,
            "natural frequency, reduced model, contacts stuck",
        ),
    }
    return {
        name: variable("mode", values, "Hz", about) for name, (values, about) in modes.items()
    } | {
        "static_gap": variable(
            "contact direction", case.static_gap, "m", "contact gap under the centrifugal load"
        ),
        "static_force": variable(
            "contact direction", case.static_force, "N", "contact force under the centrifugal load"
        ),
        "contact_law": variable("contact", list(case.law_names), "1", "law of the contact"),
        "contact_position": variable(
            "contact xyz", case.contacts.position, "m", "position of the contact points"
        ),
        "contact_frame": variable(
            "contact xyz direction", case.contacts.frame, "1", "axes t, w, n of the contact frames"
        ),
        "surface_point": variable(
            "surface_node xyz", case.blades.surface_point, "m", "skin of the meshed blades"
        ),
        "surface_triangle": variable(
            "face corner", case.blades.surface_triangle, "1", "triangles of the skin"
        ),
    }


def _check_variables(checks: Sequence[Check]) -> dict[str, xr.Variable]:
    columns = {
        "verify_case": ([c.load_case for c in checks], "1", "load case"),
        "verify_frequency_hz": ([c.frequency_hz for c in checks], "Hz", "frequency"),
        "verify_transient": (
            [c.transient for c in checks],
            "m",
            "first-harmonic amplitude by time integration",
        ),
        "verify_balance": (
            [c.balance for c in checks],
            "m",
            "first-harmonic amplitude by harmonic balance",
        ),
        "verify_difference_percent": (
            [c.difference_percent for c in checks],
            "percent",
            "their difference",
        ),
        "verify_settled": ([int(c.settled) for c in checks], "1", "1 if it became periodic"),
        "verify_periods": ([c.periods for c in checks], "1", "periods integrated"),
        "verify_scatter": (
            [c.scatter for c in checks],
            "1",
            "scatter about the average of a motion that did not become periodic",
        ),
        "verify_refined": (
            [c.refined for c in checks],
            "m",
            "amplitude by harmonic balance with three times the harmonics",
        ),
        "verify_sentence": ([c.sentence for c in checks], "1", "what happened, in words"),
    }
    return {name: variable("check", *column) for name, column in columns.items()}

"""Variables of a run-up, and the dataset of all cases."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.points import Accepted, Response, collect
from stickslip.analyses.run_up.fast import name_of
from stickslip.analyses.run_up.problem import DRAWN, Along, Question, RunUpPoint
from stickslip.response.forced.response import OF_PEAK
from stickslip.response.recovery import signals
from stickslip.study.analysis import Notes
from stickslip.study.store.netcdf import stacked, variable
from stickslip.units import HZ, RPM

Values = dict[str, Any]
SLIP, OPEN = 1, 2  # states of a contact
# name: dimensions, unit, meaning
NUMBERS = {
    "engine_orders": ("line", "1", "engine order followed"),
    "wave_number": ("line", "1", "wave number of its first harmonic; 0 for a single structure"),
    "peak_amplitude": ("line", "m", "largest amplitude of the reported output; NaN for none"),
    "peak_speed_rpm": ("line", "rpm", "speed of the largest amplitude"),
    "peak_frequency_hz": ("line", "Hz", "frequency of the largest amplitude"),
    "peak_point": ("line", "1", "index of the largest amplitude among the points, -1 for none"),
    "peak_inside": ("line", "1", "1 if the largest amplitude is not at an end of the range"),
    "failed": ("line", "1", "points without a solution"),
    "newton_steps": ("line", "1", "Newton steps of all points"),
    "speed_error": (
        "line",
        "1",
        "relative error of squares of frequencies and of the static load between the speeds of the model",
    ),
    "common_modes": (
        "line",
        "1",
        "1 where what the modes of three speeds span is kept at all, because at some speed another mode would take the place of one kept",
    ),
    "points_order": ("point", "1", "engine order of the point"),
    "speed_rpm": ("point", "rpm", "speed"),
    "frequency_hz": ("point", "Hz", "frequency: engine order times speed"),
    "amplitude": (
        "point output",
        "m",
        "amplitude of an output over the driven harmonics; NaN where there is no solution",
    ),
    "converged": ("point", "1", "1 where there is a solution"),
    "harmonic": ("point", "1", "highest harmonic kept"),
    "error": ("point", "1", "bound of the relative error by missing harmonics; NaN where nobody can tell"),
    "dissipated_w": ("point", "W", "power that all contacts dissipate; of a wheel, of one sector"),
    "slipping": ("point", "1", "share of contact points that slip at some instant of the period"),
    "opening": ("point", "1", "share of contact points that are open at some instant of the period"),
    "line_speed_rpm": ("line_speed", "rpm", "speeds of the natural frequencies"),
    "open_hz": (
        "line line_speed mode",
        "Hz",
        "natural frequencies of the wave that the engine order excites, contacts open",
    ),
    "stuck_hz": ("line line_speed mode", "Hz", "the same with all contacts stuck"),
    "static_speed_rpm": ("static_speed", "rpm", "speeds at which the model was assembled"),
    "static_normal_n": (
        "line static_speed",
        "N",
        "sum of the static normal forces of all contacts, pressure positive; of a wheel, of one sector",
    ),
    "fast_order": ("fast", "1", "engine order of a fast run-up"),
    "fast_rate_rpm_per_s": ("fast", "rpm/s", "rate of the speed of a fast run-up"),
    "fast_peak_amplitude": ("fast", "m", "largest amplitude of the reported output in a fast run-up"),
    "fast_peak_speed_rpm": ("fast", "rpm", "speed at which it is reached"),
    "fast_ratio": ("fast", "1", "largest amplitude over that of the steady motion"),
    "fast_shift_rpm": ("fast", "rpm", "speed of the largest amplitude less that of the steady motion"),
    "fast_harmonic": ("fast", "1", "highest harmonic kept"),
    "fast_finished": ("fast", "1", "1 if the fast run-up was followed to its end"),
    "fast_neglected": (
        "fast",
        "1",
        "second derivative of the amplitude over 2ω times the first around the peak: what slow amplitudes leave out",
    ),
    "fast_speed_rpm": ("fast fast_step", "rpm", "speed along a fast run-up"),
    "fast_amplitude": ("fast fast_step", "m", "amplitude of the reported output along a fast run-up"),
    "output_label": ("output", "1", "name of the output"),
    "report_output": ("", "1", "index of the output whose peak is resolved"),
    "sectors": ("", "1", "number of sectors of the wheel; 1 for a whole structure"),
    "rotation": ("", "1", "what of the rotation is in the numbers"),
}


def values_of(question: Question, points: Sequence[RunUpPoint], notes: Notes) -> Values:
    """Return all that the dataset holds of a case; fast run-ups are among the notes."""
    each, rows = [], []
    offset = 0
    for along in question.lines:
        own = [p for p in points if p.engine_order == along.order]
        response = collect(along.problem, own, along.model.peak_output)
        rows.append(_of_points(along, response))
        each.append(_of_order(along, response, offset))
        offset += len(response.accepted)
    first = question.lines[0]
    drawn = np.linspace(first.line.speeds[0], first.line.speeds[-1], DRAWN)
    hertz = {
        name: np.array([a.frequencies(drawn, question.modes, stuck) for a in question.lines])
        for name, stuck in (("open_hz", False), ("stuck_hz", True))
    }
    return {
        **{name: np.array([o[name] for o in each]) for name in each[0]},
        **{name: np.concatenate([r[name] for r in rows]) for name in rows[0]},
        **hertz,
        **_of_statics(question.lines),
        **_of_fast(question, each, notes),
        "line_speed_rpm": drawn / RPM,
        "output_label": np.array(first.model.output_labels),
        "report_output": first.model.peak_output,
        "sectors": question.facts["sectors"],
        "rotation": question.facts["rotation"],
    }


def _of_order(along: Along, response: Response, offset: int) -> Values:
    top = response.top
    speeds = [a.point.omega for a in response.accepted]
    inside = top is not None and min(speeds) < top.point.omega < max(speeds)
    return {
        "engine_orders": along.order,
        "wave_number": along.wave_number,
        "peak_amplitude": response.peak_amplitude,
        "peak_speed_rpm": response.peak_hz * HZ / along.order / RPM,
        "peak_frequency_hz": response.peak_hz,
        "peak_point": -1 if top is None else offset + _in_order(response).index(top),
        "peak_inside": int(inside),
        "failed": response.failed,
        "newton_steps": response.newton_steps,
        "speed_error": along.error,
        "common_modes": int(along.common),
    }


def _in_order(response: Response) -> list[Accepted]:
    """Return the points in the order of the speed; where the branch turns, along it, and points of its peak last."""
    branch = [a.point.omega for a in response.accepted if a.point.stage not in OF_PEAK]
    turns = bool(np.ptp(np.sign(np.diff(branch))) > 0) if len(branch) > 2 else False
    every = list(response.accepted)
    return every if turns else sorted(every, key=lambda a: a.point.omega)


def _of_points(along: Along, response: Response) -> Values:
    every = _in_order(response)
    outputs = len(along.model.output_labels)
    states = np.array([_states(along, a) for a in every]).reshape(-1, 3)
    omega = np.array([a.point.omega for a in every])
    return {
        "points_order": np.full(len(every), along.order),
        "speed_rpm": omega / along.order / RPM,
        "frequency_hz": omega / HZ,
        "amplitude": np.array([a.amplitudes(outputs) for a in every]).reshape(-1, outputs),
        "converged": np.array([int(a.point.converged) for a in every]),
        "harmonic": np.array([a.point.order for a in every]),
        # what was solved tells more than a prediction
        "error": np.array([a.own_error if np.isnan(a.audit_error) else a.audit_error for a in every]),
        "dissipated_w": states[:, 0],
        "slipping": states[:, 1],
        "opening": states[:, 2],
    }


def _states(along: Along, accepted: Accepted) -> tuple[float, float, float]:
    """Return the dissipated power, and the shares of contact points that slip and open."""
    if accepted.fields is None:
        return np.nan, np.nan, np.nan
    state = signals(along.problem, accepted.point).state
    slipping, opening = (np.any(state == s, axis=(1, 2)).mean() for s in (SLIP, OPEN))
    power = accepted.fields.energy.sum() * accepted.point.omega / (2 * np.pi)
    return float(power), float(slipping), float(opening)


def _of_statics(lines: Sequence[Along]) -> Values:
    """Return the static normal force at the speeds of the first line that all have."""
    most = max(len(a.line.speeds) for a in lines)
    widest = next(a for a in lines if len(a.line.speeds) == most)
    found = np.full((len(lines), most), np.nan)
    for i, along in enumerate(lines):
        force = -along.static_force[:, :, 2].sum(axis=1)
        found[i] = np.interp(widest.line.speeds, along.line.speeds, force, left=np.nan)
    return {"static_speed_rpm": widest.line.speeds / RPM, "static_normal_n": found}


def _of_fast(question: Question, each: Sequence[Values], notes: Notes) -> Values:
    """Return the fast run-ups beside the peaks of the steady motions."""
    found = []
    for along, steady in zip(question.lines, each, strict=True):
        for rate in question.rates:
            told = notes.get(name_of(along.order, rate))
            assert told is not None
            top = int(np.argmax(told["amplitude"]))
            peak, rpm = told["amplitude"][top], told["speed_rpm"][top]
            found.append(
                {
                    "order": along.order,
                    "rate_rpm_per_s": rate,
                    "peak_amplitude": peak,
                    "peak_speed_rpm": rpm,
                    "ratio": peak / steady["peak_amplitude"],
                    "shift_rpm": rpm - steady["peak_speed_rpm"],
                    **told,
                }
            )
    if not found:
        return {}
    longest = max(len(one["speed_rpm"]) for one in found)
    for one in found:
        for name in ("speed_rpm", "amplitude"):
            rest = longest - len(one[name])
            one[name] = np.pad(np.asarray(one[name], dtype=float), (0, rest), constant_values=np.nan)
    return {f"fast_{name}": np.array([one[name] for one in found]) for name in found[0]}


def dataset(cases: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Return the dataset of all cases; what one has more of is NaN, -1 or empty in the others."""
    told = [
        {n: variable(dims, c[n], unit, about) for n, (dims, unit, about) in NUMBERS.items() if n in c} for c in cases
    ]
    data = stacked(told)
    sizes = {dim: size for v in data.values() for dim, size in v.sizes.items()}
    return xr.Dataset(data, coords={"mode": np.arange(1, sizes.get("mode", 0) + 1)})

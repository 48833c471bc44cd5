"""Records of a run-up: engine orders, the points along them, fast run-ups, and the record of a case."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stickslip.analyses.operation import InOperation, asked_of, ends_of
from stickslip.analyses.run_up.problem import DRAWN, Along, Question, RunUpPoint
from stickslip.arrays import FloatArray
from stickslip.column import column, rows
from stickslip.response.forced.collected import Accepted, Response, collect
from stickslip.response.forced.response import OF_PEAK
from stickslip.response.recovery import signals
from stickslip.study.analysis import Solved
from stickslip.study.store.archive import from_flat
from stickslip.study.verdict import doubt, to_json
from stickslip.units import HZ, RPM

FOUND = "found"  # note with the record of a case, written when everything is solved
SLIP, OPEN = 1, 2  # states of a contact


@dataclass(frozen=True, eq=False, kw_only=True)
class Line:
    """An engine order that was followed."""

    engine_order: int = column("1", "engine order followed", "engine_orders")
    wave_number: int = column("1", "wave number of its first harmonic; 0 for a single structure")
    peak_amplitude: float = column("m", "largest amplitude of the reported output; NaN for none")
    peak_speed_rpm: float = column("rpm", "speed of the largest amplitude")
    peak_frequency_hz: float = column("Hz", "frequency of the largest amplitude")
    peak_point: int = column("1", "index of the largest amplitude among the points, -1 for none")
    peak_inside: bool = column("1", "1 if the largest amplitude is not at an end of the range")
    failed: int = column("1", "points without a solution")
    newton_steps: int = column("1", "Newton steps of all points")
    speed_error: float = column(
        "1", "relative error of squares of frequencies and of the static load between the speeds of the model"
    )
    common_modes: bool = column(
        "1",
        "1 where the span of the modes of three speeds is kept at all speeds, because modes change places between speeds",
    )
    open_hz: FloatArray = column(
        "Hz",
        "natural frequencies of the wave that the engine order excites, contacts open",
        along="line_speed mode",
    )
    stuck_hz: FloatArray = column("Hz", "the same with all contacts stuck", along="line_speed mode")
    static_normal_n: FloatArray = column(
        "N",
        "sum of the static normal forces of all contacts, pressure positive; of a wheel, of one sector",
        along="static_speed",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class LinePoint:
    """A point along an engine order."""

    engine_order: int = column("1", "engine order of the point", "points_order")
    speed_rpm: float = column("rpm", "speed")
    frequency_hz: float = column("Hz", "frequency: engine order times speed")
    amplitude: FloatArray = column(
        "m", "amplitude of an output over the driven harmonics; NaN where there is no solution", along="output"
    )
    converged: bool = column("1", "1 where there is a solution")
    harmonic: int = column("1", "highest harmonic kept")
    error: float = column("1", "bound of the relative error by missing harmonics; NaN where nobody can tell")
    dissipated_w: float = column("W", "power that all contacts dissipate; of a wheel, of one sector")
    slipping: float = column("1", "share of contact points that slip at some instant of the period")
    opening: float = column("1", "share of contact points that are open at some instant of the period")


@dataclass(frozen=True, eq=False, kw_only=True)
class FastRunUp:
    """A fast run-up along an engine order."""

    engine_order: int = column("1", "engine order of a fast run-up", "order")
    rate: float = column("rpm/s", "rate of the speed of a fast run-up", "rate_rpm_per_s")
    peak_amplitude: float = column("m", "largest amplitude of the reported output in a fast run-up")
    peak_speed_rpm: float = column("rpm", "speed at which it is reached")
    ratio: float = column("1", "largest amplitude over the largest steady amplitude")
    shift_rpm: float = column("rpm", "speed of the largest amplitude less the speed of the largest steady amplitude")
    harmonic: int = column("1", "highest harmonic kept")
    finished: bool = column("1", "1 if the fast run-up was followed to its end")
    neglected: float = column(
        "1",
        "second derivative of the amplitude over 2ω times the first around the peak: what slow amplitudes leave out",
    )
    speed_rpm: FloatArray = column("rpm", "speed along a fast run-up", along="fast_step")
    amplitude: FloatArray = column("m", "amplitude of the reported output along a fast run-up", along="fast_step")

    @property
    def peak_at_end(self) -> bool:
        """Whether the largest amplitude is at an end of the range."""
        return self.peak_speed_rpm in self.speed_rpm[np.isfinite(self.speed_rpm)][[0, -1]]


@dataclass(frozen=True, eq=False, kw_only=True)
class RunUp(InOperation):
    """Record of a case; without lines if its job was not finished.

    Attributes
    ----------
    doubts
        Verdicts on the models, as JSON; a result holds them among its verdicts.
    limit
        Change by more harmonics above which there is a doubt, a fraction; not in a result.
    """

    lines: tuple[Line, ...] = rows("line")
    points: tuple[LinePoint, ...] = rows("point")
    line_speed_rpm: FloatArray | None = column(
        "rpm", "speeds of the natural frequencies", along="line_speed", default=None
    )
    static_speed_rpm: FloatArray | None = column(
        "rpm", "speeds at which the model was assembled", along="static_speed", default=None
    )
    fast: tuple[FastRunUp, ...] = rows("fast", "fast_")
    output_label: Any = column("1", "name of the output", along="output", default=None)
    report_output: int | None = column("1", "index of the output whose peak is resolved", default=None)
    doubts: str = "[]"
    limit: float = np.nan

    def along(self, line: Line) -> list[LinePoint]:
        """Return the points along an engine order."""
        return [point for point in self.points if point.engine_order == line.engine_order]

    def peak(self, line: Line) -> LinePoint | None:
        """Return the point with the largest amplitude along an engine order; None if no point has a solution."""
        return self.points[line.peak_point] if line.peak_point >= 0 else None

    def largest_in_operation(self, line: Line) -> tuple[float, float]:
        """Return the largest amplitude (m) along an engine order in the operating range and its speed (rpm); NaN for none.

        Between two points at an end of the range the amplitude lies on the straight line.
        """
        own, order = self.operating, line.engine_order
        known = [point for point in self.along(line) if point.converged]
        rpm = np.array([point.speed_rpm for point in known])
        size = np.array([point.amplitude[self.report_output or 0] for point in known])
        unit = 1.0 if own.unit == "rpm" else own.at(1.0, order)
        low, high = own.lowest / unit, own.highest / unit
        found = list(zip(size, rpm, strict=True))
        for end in (low, high):
            crossed = np.flatnonzero((rpm[:-1] - end) * (rpm[1:] - end) < 0.0)
            share = (end - rpm[crossed]) / (rpm[crossed + 1] - rpm[crossed])
            found += [(y, end) for y in size[crossed] + share * (size[crossed + 1] - size[crossed])]
        inside = [(float(y), float(x)) for y, x in found if low <= x <= high and np.isfinite(y)]
        return max(inside, default=(np.nan, np.nan))


def answer(solved: Solved) -> RunUp:
    """Return the record of a case from the notes of its job."""
    found: RunUp = from_flat(solved.notes[FOUND], RunUp) if FOUND in solved.notes else RunUp()
    return replace(found, **ends_of(asked_of(solved.case)))


def steady_run_up(question: Question, points: Sequence[RunUpPoint]) -> RunUp:
    """Return the record of a run-up without fast ones."""
    first, lines, every = question.lines[0], list[Line](), list[LinePoint]()
    drawn = np.linspace(first.line.speeds[0], first.line.speeds[-1], DRAWN)
    speeds, forces = static_forces(question.lines)
    for along, force in zip(question.lines, forces, strict=True):
        own = [p for p in points if p.engine_order == along.order]
        response = collect(along.problem, own, along.model.peak_output)
        loose, stuck = (along.frequencies(drawn, question.modes, all_stuck) for all_stuck in (False, True))
        lines.append(line_of(along, response, len(every), loose, stuck, force))
        every += points_of(along, response)
    return RunUp(
        lines=tuple(lines),
        points=tuple(every),
        line_speed_rpm=drawn / RPM,
        static_speed_rpm=speeds / RPM,
        output_label=np.array(first.model.output_labels),
        report_output=first.model.peak_output,
        doubts=to_json(dict.fromkeys(doubt(text) for a in question.lines for text in a.model.warnings)),
        limit=question.limit,
    )


def line_of(
    along: Along, response: Response, offset: int, open_hz: FloatArray, stuck_hz: FloatArray, force: FloatArray
) -> Line:
    """Return the record of an engine order; `offset` is the index of its first point."""
    top = response.top
    speeds = [a.point.omega for a in response.accepted]
    return Line(
        engine_order=along.order,
        wave_number=along.wave_number,
        peak_amplitude=response.peak_amplitude,
        peak_speed_rpm=response.peak_hz * HZ / along.order / RPM,
        peak_frequency_hz=response.peak_hz,
        peak_point=-1 if top is None else offset + _in_order(response).index(top),
        peak_inside=top is not None and min(speeds) < top.point.omega < max(speeds),
        failed=response.failed,
        newton_steps=response.newton_steps,
        speed_error=along.error,
        common_modes=along.common,
        open_hz=open_hz,
        stuck_hz=stuck_hz,
        static_normal_n=force,
    )


def _in_order(response: Response) -> list[Accepted]:
    """Return the points by rising speed; if the branch turns, along the branch, with refinements of its peak last."""
    branch = [a.point.omega for a in response.accepted if a.point.stage not in OF_PEAK]
    turns = bool(np.ptp(np.sign(np.diff(branch))) > 0) if len(branch) > 2 else False
    every = list(response.accepted)
    return every if turns else sorted(every, key=lambda a: a.point.omega)


def points_of(along: Along, response: Response) -> list[LinePoint]:
    """Return the records of the points along an engine order."""
    found = []
    for accepted in _in_order(response):
        point = accepted.point
        dissipated, slipping, opening = _states(along, accepted)
        found.append(
            LinePoint(
                engine_order=along.order,
                speed_rpm=point.omega / along.order / RPM,
                frequency_hz=point.omega / HZ,
                amplitude=accepted.amplitudes(len(along.model.output_labels)),
                converged=point.converged,
                harmonic=point.order,
                # an audit is more reliable than a prediction
                error=accepted.own_error if np.isnan(accepted.audit_error) else accepted.audit_error,
                dissipated_w=dissipated,
                slipping=slipping,
                opening=opening,
            )
        )
    return found


def _states(along: Along, accepted: Accepted) -> tuple[float, float, float]:
    """Return the dissipated power, and the shares of contact points that slip and open."""
    if accepted.fields is None:
        return np.nan, np.nan, np.nan
    state = signals(along.problem, accepted.point).state
    slipping, opening = (np.any(state == s, axis=(1, 2)).mean() for s in (SLIP, OPEN))
    power = accepted.fields.energy.sum() * accepted.point.omega / (2 * np.pi)
    return float(power), float(slipping), float(opening)


def static_forces(lines: Sequence[Along]) -> tuple[FloatArray, FloatArray]:
    """Return (k,) speeds of the line with the most speeds, rad/s, and (lines, k) static normal forces at them, N."""
    most = max(len(a.line.speeds) for a in lines)
    widest = next(a for a in lines if len(a.line.speeds) == most).line.speeds
    found = np.full((len(lines), most), np.nan)
    for own, along in zip(found, lines, strict=True):
        force = -along.static_force[:, :, 2].sum(axis=1)
        own[:] = np.interp(widest, along.line.speeds, force, left=np.nan)
    return widest, found


def fast_run_up(
    steady: Line,
    rate: float,
    speed_rpm: FloatArray,
    amplitude: FloatArray,
    *,
    harmonic: int,
    finished: bool = False,
    neglected: float = np.nan,
) -> FastRunUp:
    """Return the record of a fast run-up beside the peak of the steady motions."""
    top = int(np.argmax(amplitude))
    peak, rpm = amplitude[top], speed_rpm[top]
    return FastRunUp(
        engine_order=steady.engine_order,
        rate=rate,
        peak_amplitude=peak,
        peak_speed_rpm=rpm,
        ratio=peak / steady.peak_amplitude,
        shift_rpm=rpm - steady.peak_speed_rpm,
        harmonic=harmonic,
        finished=finished,
        neglected=neglected,
        speed_rpm=speed_rpm,
        amplitude=amplitude,
    )

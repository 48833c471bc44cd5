"""Friction coefficient and tangential stiffness from measured hysteresis loops, by least squares.

The model of a loop is elastic Coulomb friction under a constant normal load. Besides stiffness and limit, each recording
has its own unknowns: the spring force at the first sample, the offset of the force sensor, and its drift. The friction
force is a piecewise linear function of all of them.

The fit returns their covariance, and warnings about parameters that the loops do not determine.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.law_steps import forces_along
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import input_error

RIGID_STIFFNESS = 1e6  # times the force range over the displacement range: a spring that slips almost at once
Loop = tuple[FloatArray, FloatArray]
MIN_LOOP_SAMPLES = 8  # smallest number of samples of a recording
CLEAR = 25.0  # least reduction of the sum of squares by slip, or stick, in variances of a sample
SURE = 5.0  # standard deviations beyond which the sign of a slope is certain
FLOOR = 1e-9  # relative to the force's swing; smaller residuals are rounding
KEPT = 1e-7  # singular value, relative to the largest, below which a combination of unknowns is undetermined
TOLD = 1e-3  # share of a parameter in such a combination above which the parameter is undetermined
# initial stiffnesses and limits, relative to those of the loop
TRIED = (np.geomspace(1.0, 300.0, 24), np.linspace(0.4, 1.0, 13))
FOLLOWS = 0.3  # correlation of neighbouring residuals above which they are not independent noise
MANY = 30  # samples below which a correlation has no meaning
DRIFTS = 5.0  # standard deviations above which a trend of the residuals is reported
NOISY = 0.5  # share of the residual above which noise of the displacement, times the stiffness, is reported
_FOURTH = math.sqrt(70.0)  # standard deviation of fourth differences of noise with standard deviation one


@dataclass(frozen=True, eq=False)
class LoopModel:
    """Measured recordings and their unknown offsets and drifts.

    Parameters
    ----------
    loops
        Displacements (n,) in m and forces (n,) in N of each recording.
    offset, drift
        Whether each recording's force has an unknown offset, and a drift that is linear in time.
    """

    loops: tuple[Loop, ...]
    offset: bool
    drift: bool

    @cached_property
    def measured(self) -> FloatArray:
        """(samples,) forces of all recordings."""
        return np.concatenate([force for _, force in self.loops])

    @cached_property
    def swing(self) -> float:
        """Half of the largest range of the force of a recording, N."""
        return max(float(np.ptp(force)) for _, force in self.loops) / 2

    @cached_property
    def stroke(self) -> float:
        """Half of the largest range of the displacement, m."""
        return max(float(np.ptp(x)) for x, _ in self.loops) / 2

    @property
    def stuck(self) -> float:
        """Stiffness of a straight line between the ends of the loop, N/m: the scale of stiffnesses."""
        return self.swing / self.stroke

    @cached_property
    def sensor(self) -> FloatArray:
        """(samples, k) contributions of offsets and drifts to the forces, each of size one."""
        columns = []
        for j, (x, _) in enumerate(self.loops):
            rising = np.linspace(-1.0, 1.0, x.size)
            shapes = [np.ones(x.size)] * self.offset + [rising] * self.drift
            columns += [self._only(j, shape) for shape in shapes]
        return np.stack(columns, axis=1) if columns else np.zeros((self.measured.size, 0))

    @cached_property
    def first(self) -> IntArray:
        """Positions of the first sample of each recording."""
        return np.cumsum([0, *(x.size for x, _ in self.loops[:-1])])

    @cached_property
    def signs(self) -> FloatArray:
        """(samples,) forces of a rigid contact with limit one: 1 if the last motion was forward, -1 if backward."""
        ahead = [np.argmax(np.diff(x) != 0.0) for x, _ in self.loops]  # the first sample that moves
        held = [np.sign(np.diff(x)[i]) for (x, _), i in zip(self.loops, ahead, strict=True)]
        return np.sign(self.friction(RIGID_STIFFNESS * self.stuck, 1.0, held)[0])

    def friction(
        self, stiffness: float, limit: float, held: Sequence[float] | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the friction forces (samples,) and 1 where a sample slips forward, -1 backward, 0 where it sticks.

        Parameters
        ----------
        stiffness, limit
            Tangential stiffness, N/m, and friction limit, N.
        held
            Force of the spring at the first sample of each recording, N.
        """
        law = ElasticCoulomb(k_t=stiffness, k_w=0.0, k_n=0.0, mu=limit, preload=1.0)
        forces, slips = [], []
        for (x, _), at_first in zip(self.loops, held, strict=True):
            gap = np.zeros((x.size, 3))
            gap[:, 0] = x
            force, state = forces_along(law, gap, np.array([x[0] - at_first / stiffness, 0.0]))
            forces.append(force[:, 0])
            slips.append(np.sign(force[:, 0]) * state[:, 0])
        return np.concatenate(forces), np.concatenate(slips)

    def both_ways(self, slips: FloatArray) -> bool:
        """Whether a recording slips both forward and backward, given the signs (samples,) of slip."""
        return any({-1.0, 1.0} <= set(part.tolist()) for part in np.split(slips, self.first[1:]))

    def line(self) -> "Line":
        """Fit a contact that never slips; the first value is the stiffness."""
        moved = np.concatenate([x - x.mean() for x, _ in self.loops])
        intercepts = [self._only(j, np.ones(x.size)) for j, (x, _) in enumerate(self.loops)]
        drifts = (
            [self.sensor[:, 1 + 2 * j] if self.offset else self.sensor[:, j] for j in range(len(self.loops))]
            if self.drift
            else []
        )
        return _line(np.stack([moved / self.stroke, *intercepts, *drifts], axis=1), self.measured, self.stroke)

    def direction(self) -> "Line":
        """Fit a contact that always slips; the first value is the limit.

        First samples are left out, because their direction of slip is unknown.
        """
        columns = np.column_stack([self.signs, self.sensor])
        known = np.delete(np.arange(self.signs.size), self.first)
        fit = _line(columns[known], self.measured[known])
        return replace(fit, fitted=columns @ fit.values)

    def _only(self, recording: int, shape: FloatArray) -> FloatArray:
        """Return a shape along one recording, zero along the others."""
        whole = np.zeros(self.measured.size)
        at = sum(x.size for x, _ in self.loops[:recording])
        whole[at : at + shape.size] = shape
        return whole


@dataclass(frozen=True, eq=False)
class Line:
    """A linear fit.

    Its fields are the values, the standard deviation of the first value, whether the loops determine this value, the
    sum of squares, and the fitted forces.
    """

    values: FloatArray
    deviation: float
    whole: bool
    squares: float
    fitted: FloatArray


def _line(columns: FloatArray, measured: FloatArray, unit: float = 1.0) -> Line:
    """Fit by least squares; the first column is divided by `unit`."""
    inverse = np.linalg.pinv(columns, rcond=1e-10)
    values = inverse @ measured
    fitted = columns @ values
    squares = float(np.sum((measured - fitted) ** 2))
    rank = int(np.linalg.matrix_rank(columns, tol=1e-8))
    variance = squares / max(measured.size - rank, 1) * float(inverse[0] @ inverse[0])
    values[0] /= unit
    # an exact fit up to rounding does not mean certainty
    deviation = max(math.sqrt(variance) / unit, 1e-12 * abs(float(values[0])), 1e-300)
    return Line(values, deviation, rank == columns.shape[1], squares, fitted)


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopFit:
    """Parameters of elastic Coulomb friction from measured loops; NaN for parameters that the loops do not determine.

    Parameters
    ----------
    k_t
        Tangential stiffness, N/m, without the compliance of the machine if that was given.
    limit
        Friction force in full slip, N.
    covariance
        (2, 2) covariance of `k_t` and `limit`.
    normal_load, normal_load_deviation
        Constant normal force and its standard deviation, N; None if unknown.
    least
        Lower bounds of stiffness and limit; NaN where the loops determine the value.
    residual
        Standard deviation of the measured force about the fitted one, N.
    loops
        Displacements and forces of each recording.
    fitted
        (n,) fitted forces of each recording, offset and drift included.
    notes
        Parameters that the loops do not determine, and doubtful estimates.
    """

    k_t: float
    limit: float
    covariance: FloatArray
    normal_load: float | None
    normal_load_deviation: float
    least: tuple[float, float]
    residual: float
    loops: tuple[Loop, ...] = field(repr=False)
    fitted: tuple[FloatArray, ...] = field(repr=False)
    notes: tuple[str, ...]

    @property
    def mu(self) -> float:
        """Friction coefficient; NaN without a normal load or without slip."""
        return self.limit / self.normal_load if self.normal_load else math.nan

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of `k_t`, `limit` and `mu`."""
        of_k, of_limit = (float(s) for s in np.sqrt(np.diag(self.covariance)))
        of_load = self.normal_load_deviation / self.normal_load if self.normal_load else math.nan
        of_mu = self.mu * math.hypot(of_limit / self.limit, of_load)
        return {"k_t": of_k, "limit": of_limit, "mu": of_mu}

    @property
    def law(self) -> ElasticCoulomb | None:
        """The law of one point under the constant load; None if the loops do not determine all parameters."""
        if not (math.isfinite(self.k_t) and math.isfinite(self.limit)):
            return None
        load = self.normal_load or 1.0
        return ElasticCoulomb(k_t=self.k_t, k_w=0.0, k_n=0.0, mu=self.limit / load, preload=load)


@dataclass(frozen=True, eq=False)
class _Found:
    """A fit in the quantities of the measurement."""

    stiffness: float
    limit: float
    covariance: FloatArray
    squares: float
    unknowns: int
    fitted: FloatArray
    slips: FloatArray  # (samples,) 1 forward, -1 backward, 0 sticks


def fit_loops(
    loops: Sequence[Loop],
    *,
    normal_load: float | None = None,
    normal_load_deviation: float = 0.0,
    machine_stiffness: float | None = None,
    offset: bool = True,
    drift: bool = False,
) -> LoopFit:
    """Fit tangential stiffness and friction coefficient to hysteresis loops of force over displacement.

    The law is `ElasticCoulomb` under a constant normal load, evaluated along the measured displacements. The first step
    is to decide whether the loops show slip and stick at all: each must reduce the sum of squares by 25 variances.

    Parameters
    ----------
    loops
        Recordings: displacements (n,) in m and forces (n,) in N, in the order of time, as `read_loops` returns them.
    normal_load, normal_load_deviation
        Normal force in N, the same in all recordings, and its standard deviation; without a load only the limit force
        is found.
    machine_stiffness
        Stiffness in N/m of the machine in series with the contact, between the points of the displacement measurement;
        None: rigid.
    offset, drift
        Whether the force of each recording has an unknown offset, and a drift linear in time.

    Returns
    -------
    LoopFit
        Estimates with their covariance, assuming independent and equally large errors of the forces.

    Raises
    ------
    InputError
        If there is nothing to fit, or a number is out of its range.
    """
    model = LoopModel(_checked(loops), offset, drift)
    _check_numbers(normal_load, normal_load_deviation, machine_stiffness)
    found = _simplest(model)
    least = _least(model, found)
    variance = found.squares / max(model.measured.size - found.unknowns, 1)
    k_t, covariance = _without_machine(found, machine_stiffness)
    told = _doubts(model, found.fitted, found.slips, k_t=found.stiffness, limit=found.limit, least=least)
    return LoopFit(
        k_t=k_t,
        limit=found.limit,
        covariance=covariance,
        normal_load=normal_load,
        normal_load_deviation=normal_load_deviation,
        least=least,
        residual=math.sqrt(variance),
        loops=model.loops,
        fitted=tuple(np.split(found.fitted, model.first[1:])),
        notes=(*told, *_of_setup(normal_load, machine_stiffness, found)),
    )


def _checked(loops: Sequence[Loop]) -> tuple[Loop, ...]:
    """Return the recordings as arrays; refuse recordings to which no contact can be fitted."""
    found = []
    for j, loop in enumerate(loops):
        x, force = (np.asarray(values, dtype=float) for values in loop)
        place = f"fit_loops: loops[{j}]"
        if x.ndim != 1 or x.shape != force.shape:
            problem = f"displacements have the shape {x.shape}, forces {force.shape}"
            raise input_error(place, problem, "Give two arrays of one length.")
        if x.size < MIN_LOOP_SAMPLES:
            problem = f"has {x.size} samples"
            raise input_error(place, problem, f"Give {MIN_LOOP_SAMPLES} at least, better a hundred a cycle.")
        for what, values in (("displacement", x), ("force", force)):
            if not np.isfinite(values).all():
                raise input_error(place, f"a {what} is not finite", "Leave such samples out.")
            if np.ptp(values) == 0.0:
                problem = f"the {what} is {values[0]:g} at every sample"
                raise input_error(place, problem, "Give a loop in which both change.")
        found.append((x, force))
    if not found:
        raise input_error("fit_loops: loops", "is empty", "Give one recording or more.")
    return tuple(found)


def _check_numbers(load: float | None, deviation: float, machine: float | None) -> None:
    for name, value in (("normal_load", load), ("machine_stiffness", machine)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise input_error(
                f"fit_loops: {name}", f"must be positive, got {value:g}", "Leave it out where it is not known."
            )
    if not (math.isfinite(deviation) and deviation >= 0):
        raise input_error(
            "fit_loops: normal_load_deviation",
            f"must not be negative, got {deviation:g}",
            "Give the standard deviation in N.",
        )


def _simplest(model: LoopModel) -> _Found:
    """Return the fit of a contact that only sticks or only slips, unless the loops show both."""
    line, always = _stuck(model), _slipping(model)
    stiff, moving = (one.values[0] / one.deviation for one in (model.line(), model.direction()))
    if min(stiff, moving) < -SURE and max(stiff, moving) < SURE:
        raise input_error(
            "fit_loops: loops",
            "the force falls while the contact moves forward: it would give energy",
            "Change the sign of the force, or of the displacement.",
        )
    both = _both(model)
    floor = (FLOOR * model.swing) ** 2
    variance = max(both.squares / max(model.measured.size - both.unknowns, 1), floor)
    slips, sticks = (one.squares - both.squares > CLEAR * variance for one in (line, always))
    if slips and sticks:
        return both
    return always if slips or (not sticks and stiff < SURE) else line


def _least(model: LoopModel, found: _Found) -> tuple[float, float]:
    """Return lower bounds of stiffness and limit if the loop does not determine them."""
    if not found.slips.any():
        return math.nan, found.stiffness * model.stroke
    return (_least_stiffness(model, found) if math.isnan(found.stiffness) else math.nan), math.nan


def _stuck(model: LoopModel) -> _Found:
    fit = model.line()
    covariance = np.diag([fit.deviation**2, math.nan])
    slips = np.zeros(fit.fitted.size)
    return _Found(float(fit.values[0]), math.nan, covariance, fit.squares, fit.values.size, fit.fitted, slips)


def _slipping(model: LoopModel) -> _Found:
    fit = model.direction()
    told = fit.whole and fit.values[0] > 0
    limit = float(fit.values[0]) if told else math.nan
    covariance = np.diag([math.nan, fit.deviation**2 if told else math.nan])
    unknowns = fit.values.size + len(model.loops)  # first samples are not fitted
    return _Found(math.nan, limit, covariance, fit.squares, unknowns, fit.fitted, model.signs)


def _both(model: LoopModel) -> _Found:
    """Fit a contact that sticks and slips."""
    n, k_unit, unit = len(model.loops), model.stuck, model.swing

    def friction(z: FloatArray) -> FloatArray:
        return model.friction(z[0] * k_unit, z[1] * unit, unit * z[2 : 2 + n])[0]

    def residual(z: FloatArray) -> FloatArray:
        away: FloatArray = friction(z) / unit + model.sensor @ z[2 + n :] - model.measured / unit
        return away

    start = _start(model)
    lowest = np.full(start.size, -np.inf)
    lowest[:2] = 1e-6
    solved = least_squares(
        residual, start, jac="3-point", bounds=(lowest, np.inf), x_scale=1.0, xtol=1e-12, ftol=1e-12, gtol=1e-12
    )
    z = solved.x
    units = np.array([k_unit, unit])
    freedom = max(model.measured.size - z.size, 1)
    own = 2 * solved.cost / freedom * _covariance(solved.jac) * np.outer(units, units)
    slips = model.friction(z[0] * k_unit, z[1] * unit, unit * z[2 : 2 + n])[1]
    slips[model.first] = 0.0  # the state at a first sample is unknown
    if model.offset and not model.both_ways(slips):
        own[1, :], own[:, 1] = math.nan, math.nan
    values = np.where(np.isfinite(np.diag(own)), z[:2] * units, math.nan)
    fitted = unit * (residual(z) + model.measured / unit)
    squares = 2 * solved.cost * unit**2
    return _Found(float(values[0]), float(values[1]), own, squares, z.size, fitted, slips)


def _start(model: LoopModel) -> FloatArray:
    """Return the best-fitting unknowns from a grid of stiffnesses and limits."""
    unit = model.swing
    middle = [(f.max() + f.min()) / 2 if model.offset else 0.0 for _, f in model.loops]
    held = np.array([f[0] - m for (_, f), m in zip(model.loops, middle, strict=True)])
    best, smallest = np.zeros(0), np.inf
    project = np.linalg.pinv(model.sensor) if model.sensor.shape[1] else model.sensor.T
    for k in TRIED[0]:
        for limit in TRIED[1]:
            force, _ = model.friction(k * model.stuck, limit * unit, held)
            sensor = project @ (model.measured - force)
            squares = float(np.sum((model.measured - force - model.sensor @ sensor) ** 2))
            if squares < smallest:
                best, smallest = np.array([k, limit, *(held / unit), *(sensor / unit)]), squares
    return best


def _covariance(jac: FloatArray) -> FloatArray:
    """Return the (2, 2) covariance of the first two unknowns for residuals of variance one; NaN for undetermined ones."""
    sizes = np.linalg.norm(jac, axis=0)
    sizes[sizes == 0.0] = 1.0
    _, values, right = np.linalg.svd(jac / sizes, full_matrices=False)
    good = values > KEPT * values[0]
    own = (right[good, :2] / values[good, None]) / sizes[:2]
    found: FloatArray = own.T @ own
    lost = np.linalg.norm(right[~good, :2], axis=0) > TOLD
    found[lost, :] = math.nan
    found[:, lost] = math.nan
    return found


def _least_stiffness(model: LoopModel, found: _Found) -> float:
    """Return the smallest stiffness whose sum of squares is worse by at most four variances.

    These are two standard deviations.
    """
    size = model.measured.size
    variance = max(found.squares / max(size - found.unknowns, 1), (FLOOR * model.swing) ** 2)
    if math.isnan(found.limit) or not model.both_ways(found.slips):
        return math.nan
    sensor = found.fitted - found.slips * found.limit
    low, high = model.stuck, RIGID_STIFFNESS * model.stuck
    known = np.delete(np.arange(size), model.first)
    for _ in range(40):
        middle = math.sqrt(low * high)
        held = found.limit * found.slips[model.first]
        force = model.friction(middle, found.limit, held)[0] + sensor
        worse = float(np.sum((model.measured - force)[known] ** 2)) - found.squares
        low, high = (low, middle) if worse < 4 * variance else (middle, high)
    return high


def _without_machine(found: _Found, machine: float | None) -> tuple[float, FloatArray]:
    """Subtract the compliance in series from the fitted stiffness."""
    if machine is None or math.isnan(found.stiffness):
        return found.stiffness, found.covariance
    if found.stiffness >= machine:
        raise input_error(
            "fit_loops: machine_stiffness",
            f"is {machine:.4g} N/m, not above the {found.stiffness:.4g} N/m of machine and contact in series",
            "Give the stiffness of the machine alone, or measure the displacement nearer to the contact.",
        )
    share = machine / (machine - found.stiffness)
    slope = np.array([share**2, 1.0])  # derivatives by the fitted values
    return found.stiffness * share, found.covariance * np.outer(slope, slope)


def _of_setup(load: float | None, machine: float | None, found: _Found) -> list[str]:
    """Return sentences about quantities that no loop determines."""
    told = []
    if load is None and math.isfinite(found.limit):
        told.append("The normal load is not given: the limit force is told, the friction coefficient is not")
    if machine is None and math.isfinite(found.stiffness):
        told.append(
            "The stiffness includes everything between the two places whose relative displacement was measured. A loop cannot separate the contact from the machine in series with it"
        )
    return told


def _doubts(
    model: LoopModel, fitted: FloatArray, slips: FloatArray, *, k_t: float, limit: float, least: tuple[float, float]
) -> list[str]:
    """Return a sentence for each parameter that the loops do not determine and for each doubtful estimate.

    Parameters
    ----------
    model
        The recordings.
    fitted
        (samples,) fitted forces.
    slips
        (samples,) 1 where the fitted contact slips forward, -1 backward, 0 where it sticks.
    k_t, limit
        Fitted values; NaN where the loops do not determine them.
    least
        Lower bounds of both, where the loops do not determine them.
    """
    away = model.measured - fitted
    return [
        *_untold(slips, k_t, limit, least),
        *_correlated(model, away),
        *_trend(model, away),
        *_noisy(model, away, k_t),
    ]


def _untold(slips: FloatArray, k_t: float, limit: float, least: tuple[float, float]) -> list[str]:
    told = []
    if math.isnan(limit) and not slips.any():
        told.append(
            f"No slip can be seen: the loops tell no friction coefficient. The limit force is at least {least[1]:.4g} N; move further, or "
            "press less"
        )
    elif math.isnan(limit):
        told.append(
            "The contact slips in one direction only: the limit force cannot be told from an offset of the force. Go back and forth, or, "
            "where the zero of the force is right, fit without an offset"
        )
    if math.isnan(k_t) and not math.isnan(least[0]):
        told.append(
            f"The contact slips from the first sample on: the loops tell no stiffness. It is at least {least[0]:.4g} N/m; take more "
            "samples where the motion turns"
        )
    elif math.isnan(k_t):
        told.append(
            "The contact slips from the first sample on and does not turn: the loops tell no stiffness. Go back and forth"
        )
    return told


def _parts(model: LoopModel, values: FloatArray) -> list[FloatArray]:
    return np.split(values, model.first[1:])


def _correlation(model: LoopModel, away: FloatArray) -> float:
    """Return the correlation of neighbouring residuals; 0 if they are only rounding."""
    parts = _parts(model, away)
    size = sum(float(np.sum(part**2)) for part in parts)
    if size <= (1e-9 * model.swing) ** 2 * away.size:
        return 0.0
    return sum(float(np.sum(part[1:] * part[:-1])) for part in parts) / size


def _inflation(correlation: float) -> float:
    """Return the factor by which correlated residuals make standard deviations too small."""
    held = min(max(correlation, 0.0), 0.999)
    return math.sqrt((1 + held) / (1 - held))


def _correlated(model: LoopModel, away: FloatArray) -> list[str]:
    correlation = _correlation(model, away)
    if away.size < MANY or correlation < FOLLOWS:
        return []
    told = (
        f"Neighbouring residuals follow each other (correlation {correlation:.2f}): the law does not quite fit the loop, or the force was filtered. The standard deviations are too small by a factor of about {_inflation(correlation):.1f}, and say nothing of "
        "what the law leaves out"
    )
    return [told]


def _trend(model: LoopModel, away: FloatArray) -> list[str]:
    if model.drift or away.size < MANY:
        return []
    grow = _inflation(_correlation(model, away))
    for j, part in enumerate(_parts(model, away)):
        t = np.linspace(-1.0, 1.0, part.size)
        slope = float(t @ part / (t @ t))
        noise = float(np.std(part - slope * t)) / math.sqrt(float(t @ t))
        if abs(slope) > DRIFTS * grow * noise and abs(slope) > 1e-9 * model.swing:
            of = f" of recording {j + 1}" * (len(model.loops) > 1)
            return [f"The force{of} drifts by {2 * slope:.3g} N from its first to its last sample: fit with a drift"]
    return []


def _noisy(model: LoopModel, away: FloatArray, k_t: float) -> list[str]:
    """Return a warning if the noise of the displacement, which the fit neglects, is comparable to the residual."""
    if math.isnan(k_t):
        return []
    rough = [np.diff(x, 4) / _FOURTH for x, _ in model.loops]
    noise = float(np.sqrt(np.mean(np.concatenate(rough) ** 2)))
    rms = float(np.sqrt(np.mean(away**2)))
    if k_t * noise < NOISY * rms or k_t * noise < 1e-3 * model.swing:
        return []
    told = (
        f"The displacement jumps by some {noise:.2g} m from sample to sample, which the stiffness makes {k_t * noise:.2g} N of: least "
        "squares take the displacement for exact. Average over cycles, or filter both signals alike"
    )
    return [told]

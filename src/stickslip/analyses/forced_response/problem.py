"""The problem of a job of the forced response, picklable, and the sweep that its table becomes."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.chooser import Chooser, chooser_of
from stickslip.analyses.forced_response.estimate import check_limits, estimate, within_limits
from stickslip.analyses.forced_response.shooting import require_in_time, require_shooting, shooting_sweep, stepping_of
from stickslip.analyses.forced_response.stability.examination import examines_every_wave
from stickslip.analyses.forced_response.table import ForcedResponse
from stickslip.arrays import FloatArray
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.assembling import assemble, more_modes
from stickslip.assembly.build import static_state
from stickslip.assembly.extent import Extent, extent_of
from stickslip.assembly.forces import ANSWER
from stickslip.assembly.model import Model
from stickslip.assembly.scene import Scene, scene_of
from stickslip.assembly.sides.unreduced import KEPT, refuse_whole
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, did_you_mean, input_error, together
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import is_full, named
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.model.strength import StrengthCard
from stickslip.response.equilibrium import frozen_sliders
from stickslip.response.forced.choices import RUNGS, RelativeTo
from stickslip.response.forced.compared_jacobians import MAX_COMPARED_ROWS
from stickslip.response.forced.response import ForcedProblem, Sweep, forced_problem
from stickslip.response.self_excited.modes import natural_frequencies
from stickslip.response.system import System
from stickslip.response.time.sectors import sectors_in_time
from stickslip.response.time.transient import TimeStepping
from stickslip.solve.newton_method import Newton
from stickslip.study.analysis import Case
from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.model.strength import Stress
from stickslip.study.verdict import said
from stickslip.units import HZ, RPM

MULTIPLE = 3  # multiple of the highest driven harmonic in which friction responds
SINGLE_FREQUENCY_MARGIN = 1e-3  # relative half-width of the range of a single frequency


def sweep_of(settings: Any, engine_order: int | None, driven: Iterable[int] = (1,)) -> Sweep:
    """Return the sweep defined by a study's tables.

    Parameters
    ----------
    settings
        Settings with the tables ``forced_response``, ``harmonics`` and ``solver``.
    engine_order
        Engine order of the excitation, for a response over speed; None: the loads have none.
    driven
        Harmonics of the loads.

    Raises
    ------
    InputError
        If a response over speed is requested and no load has an engine order.
    """
    table = settings.forced_response
    sweep = sweep_through(settings, table, _range(table, engine_order), driven)
    own = tuple(HZ * f for f in table.frequencies_hz or ())
    sweep = replace(sweep, at=own, frequencies=table.frequencies or 0)
    return shooting_sweep(settings, sweep, driven) if table.method == "shooting" else sweep


def sweep_through(settings: Any, table: Any, omega_range: tuple[float, float], driven: Iterable[int]) -> Sweep:
    """Return the sweep of a table with ``direction``, ``points`` and ``peak_points``; harmonics and solver from the study.

    Parameters
    ----------
    settings
        Settings with the tables ``harmonics`` and ``solver``.
    table
        Table of the response.
    omega_range
        Lowest and highest frequency, rad/s.
    driven
        Harmonics of the loads.
    """
    h = settings.harmonics
    low = h.beginning(driven)
    return Sweep(
        omega_range=omega_range,
        direction=table.direction,
        low=low,
        high="auto" if h.high == "auto" else h.high_harmonics,
        samples=h.samples,
        newton=Newton(globalisation=settings.solver.globalisation),
        evaluator=settings.solver.evaluator,
        rescue=settings.solver.rescue,
        cap=max(min(RUNGS[-1] * math.gcd(*low), HIGHEST), MULTIPLE * low[-1]),
        threshold=h.alert_threshold_percent / 100,
        selection=h.chooser,
        passages=h.passages,
        error_harmonics=h.alert_harmonics,
        points=table.points,
        peak_points=table.peak_points,
    )


def measured(sweep: Sweep, model: Model) -> Sweep:
    """Return a sweep with the amplitude and the error norm of a model; the norm is as published if the model names places."""
    relative_to: RelativeTo = "answer" if model.alert_over in ANSWER else "each"
    return replace(sweep, amplitude_of=model.amplitude_of, relative_to=relative_to)


def _range(table: ForcedResponse, engine_order: int | None) -> tuple[float, float]:
    """Return the lowest and the highest excitation frequency, rad/s."""
    if table.speed_rpm is not None:
        if not engine_order:
            raise input_error(
                "forced_response.over",
                "is speed, and no load has an engine order",
                "Give the loads engine_order, or a range frequency_hz.",
            )
        lowest, highest = (engine_order * RPM * n for n in table.speed_rpm)
        return lowest, highest
    given = table.frequency_hz or table.frequencies_hz or []
    lowest, highest = HZ * given[0], HZ * given[-1]
    if lowest == highest:
        return lowest * (1 - SINGLE_FREQUENCY_MARGIN), highest * (1 + SINGLE_FREQUENCY_MARGIN)
    return lowest, highest


IN_TIME, HARMONICS = "verify", "verify_harmonics"  # checks that a run may ask for
STRESS = "stress"  # note that a study may ask for
STILL_HZ = 5e-3  # lower frequencies are those of rigid motions
STABLE = "stability"  # check of every run, unless the study turns it off
RIGID = "rigid_coulomb"  # the law that the balance solves without springs
TOO_MANY = "are more than"  # part of the sentence on a motion that was not integrated
ALONE = "of what contacts, loads and outputs keep alone"  # part of the same sentence, if fewer modes do not help
MOST_IN_TIME = 600  # coordinates of all sectors: half a second a period, hundreds of periods
MORE_THAN_LOW = 'Give harmonics.selection = "guarded_alert" or "always_high", or a larger harmonics.low'


@dataclass(frozen=True, eq=False)
class StressAsked:
    """The model whose stress is asked for.

    Parameters
    ----------
    model
        The model before its assembly.
    orders
        Highest harmonics with which its assembly is tried, until the outputs agree.
    """

    model: Model
    orders: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Question:
    """The forced response of one case.

    Parameters
    ----------
    label
        Label of the case; empty for a study without [vary].
    model
        The assembled model; the first output defines the peak.
    sweep
        Range, harmonics and solver of the response.
    limit
        Change by more harmonics above which there is a warning, a fraction.
    facts
        Facts about the model for the result, see `facts_of`.
    key
        Key of the table for the range: ``speed_rpm`` for a response over speed.
    checks
        Additional checks of this run.
    first
        Whether this is the first case, which also stores the variables common to all cases.
    examine
        Points whose stability is examined: ``auto``, ``peak``, ``all`` or ``off``.
    stability_s
        Estimated time of an examination, s, above which none is begun.
    bifurcations
        Bifurcations located along the branch: ``off``, ``folds``, ``all``, or ``branches``: all, and their side branches are followed.
    not_periodic_s
        Work allowed for a time integration at a point without a stable periodic motion, in seconds of 4e9 operations; 0: none.
    not_periodic_points
        Largest number of such points.
    rpm
        Speed of rotation, 1/min.
    richer
        Model and load with 50 % more modes; None if there are no more modes, or the check is off.
    extent
        Size and stiffness of its bodies; None if the check is off.
    similarity
        Whether Jacobians with few and with many harmonics are compared at every point.
    scene
        Geometry for pictures of the model; None without pictures.
    stepping
        Time steps of a response by shooting; None: by harmonic balance.
    stress
        Model whose stress at the peak is computed; None: it is not asked for.
    """

    label: str
    model: Assembled
    sweep: Sweep
    limit: float
    facts: Mapping[str, Any] = field(default_factory=dict)
    key: str = "frequency_hz"
    checks: frozenset[str] = frozenset()
    first: bool = True
    examine: Literal["auto", "peak", "off", "all"] = "auto"
    stability_s: float = 60.0
    bifurcations: Literal["off", "folds", "all", "branches"] = "off"
    not_periodic_s: float = 0.0
    not_periodic_points: int = 2
    rpm: float = 0.0
    richer: tuple[System, HarmonicLoad] | None = None
    extent: Extent | None = None
    similarity: bool = False
    scene: Scene | None = None
    stepping: TimeStepping | None = None
    stress: StressAsked | None = None

    @property
    def over_speed(self) -> bool:
        """Whether the response is over speed."""
        return self.key == "speed_rpm"

    @cached_property
    def problem(self) -> ForcedProblem:
        """The problem of the sweep."""
        return forced_problem(self.model.system, self.model.load, self.sweep)

    @property
    def driven(self) -> tuple[int, ...]:
        """Harmonics of the load."""
        forces = self.model.load.harmonics
        return tuple(h for h in sorted(forces) if np.any(forces[h])) or (1,)

    @property
    def driven_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency of the first of these harmonics, Hz."""
        lowest, highest = (self.driven[0] * omega / HZ for omega in self.sweep.omega_range)
        return lowest, highest

    @property
    def natural_hz(self) -> FloatArray:
        """Natural frequencies with open and with stuck contacts, Hz."""
        return np.concatenate(self.natural_states)

    @cached_property
    def natural_states(self) -> tuple[FloatArray, FloatArray]:
        """Natural frequencies with open and with stuck contacts, Hz; with Coriolis forces where a reduced model has them."""
        model = self.model if self.model.blades is None else self.model.blades.tuned
        known, harmonic = (model.frequencies.free_reduced, model.frequencies.stuck_reduced), self.driven[0]
        if not model.system.structure.reduced:
            return known
        system = model.system.at(0.5 * sum(self.sweep.omega_range))
        if not system.structure.of_harmonic(harmonic).turns:
            return known
        stuck = system.springs.stuck_stiffness()
        bodies = 0 if system.free is None else system.free.size
        free, held = (
            natural_frequencies(system, own.size + bodies, springs, harmonic)
            for own, springs in zip(known, (0.0 * stuck, stuck), strict=True)
        )
        return free[free > STILL_HZ][: known[0].size], held[: known[1].size]

    @property
    def driven_names(self) -> tuple[str, ...]:
        """Names of these harmonics: engine orders on a wheel."""
        orders = self.model.orders
        return tuple(f"engine order {orders[h]}" if h in orders else f"harmonic {h}" for h in self.driven)

    @property
    def orders_lines(self) -> tuple[str, ...]:
        """Meaning of the frequency if several engine orders act at once, in words."""
        base, orders = self.model.engine_order, self.model.orders
        if len(orders) < 2 or not base:
            return ()
        waves = [f"{m} in harmonic {h} as wave {m % self.model.sectors}" for h, m in orders.items()]
        range_of = "speeds belong to the wheel" if self.over_speed else f"{self.key} is {base} times the speed"
        return (f"engine orders: {', '.join(waves)}; {range_of}",)

    @property
    def chooser(self) -> Chooser:
        """The selection of harmonics."""
        return chooser_of(self.sweep, self.model.error_labels, self.driven)

    def said(self, text: str) -> str:
        """Return a sentence about the case, preceded by its label."""
        return said(self.label, text)


def too_large(question: Question) -> str:
    """Return the reason why a model has too many coordinates for time integration; empty if it has not."""
    system = question.model.system
    if not system.structure.reduced:
        return f"a reduced model is needed, and {KEPT}"
    sectors = sectors_in_time(system)
    size, kept = sectors * system.structure.n, sectors * len(system.retained_labels)
    if size <= MOST_IN_TIME:
        return ""
    return f"{size} coordinates {TOO_MANY} {MOST_IN_TIME}" + f", {kept} {ALONE}" * (kept > MOST_IN_TIME)


def peak_first(model: Assembled) -> Assembled:
    """Return the model with the output of the peak in first place; the solver resolves the peak of the first output."""
    first = model.peak_output
    if first == 0:
        return model
    order = [first, *(i for i in range(len(model.output_labels)) if i != first)]
    labels = tuple(model.output_labels[i] for i in order)
    system, bare = (replace(s, outputs=s.outputs[order]) for s in (model.system, model.bare))
    return replace(model, system=system, bare=bare, output_labels=labels, peak_output=0)


def with_comparisons(question: Question, case: Case, model: Model) -> Question:
    """Return the question with the models for the checks of its peak and its pictures: more modes, the extent of its bodies, its scene."""
    order = question.sweep.high_harmonics[-1]
    more = more_modes(model, order, case.store)
    more = None if more is None else peak_first(more)
    richer = None if more is None else (more.system, more.load)
    # pictures show one sector, but a mistuned wheel has the contacts of all sectors
    scene = scene_of(model, order) if model.mistuning is None else None
    stress = _stress_of(case, model, question.sweep)
    return replace(question, richer=richer, extent=extent_of(model, order), scene=scene, stress=stress)


def _stress_of(case: Case, model: Model, sweep: Sweep) -> StressAsked | None:
    if not strength_of(case).asked:
        return None
    highest = int(sweep.high_harmonics[-1])
    return StressAsked(model, (JUDGED_MULTIPLE * highest, highest))


def strength_of(case: Case) -> Stress:
    """Return the table [stress] of a case; an empty one for a case whose tables lack it."""
    found: Stress = getattr(case.settings, "stress", None) or Stress()
    return found


def asked_beside(case: Case) -> frozenset[str]:
    """Return the note that a case asks for beside its records: the stress at its peak."""
    return frozenset({STRESS} if strength_of(case).asked else ())


def _refuse_stress(case: Case, model: Model) -> None:
    """Refuse the stress of a model that has none, and cards that do not fit its parts."""
    table = strength_of(case)
    if not table.asked:
        return
    key = "stress.fatigue_limit_pa"
    if model.mistuning is not None:
        raise input_error(
            key, "asks for the stress of a mistuned wheel, which is not computed", "Leave [mistuning] out."
        )
    if model.stages is not None:
        raise input_error(key, "asks for the stress of several coupled wheels, which is not computed", "Ask one wheel.")
    solids = {name: part.solid for name, part in model.parts.items() if part.solid is not None}
    if not solids:
        raise input_error(
            key,
            "asks for stress, and no part has elements and a material",
            "Give the deck with its elements instead of matrices, or remove [stress].",
        )
    for name in table.card:
        if name not in solids:
            raise no_solid(name, list(solids))
    for name, solid in solids.items():
        card_of(table, name, np.array([np.nan]) if solid.temperature is None else solid.temperature.values)


def no_solid(name: str, solids: list[str]) -> InputError:
    """Return the refusal of limits of a part that has no stress."""
    return input_error(f"stress.card.{name}", "is no part with elements and a material", did_you_mean(name, solids))


def card_of(table: Stress, part: str, temperature: FloatArray) -> StrengthCard:
    """Return the strength of a part at the temperatures (k,) of its nodes, NaN without any.

    Raises
    ------
    InputError
        If the part has no limits, or limits over temperature and no temperature, or one above the last of the card.
    """
    own = table.table_of(part)
    if own is None:
        raise input_error(
            "stress",
            f"has no limits of the part {part!r}",
            f"Add [stress.card.{part}], or give the limits of all other parts in [stress].",
        )
    card = own.strength()
    if card.temperatures and np.isnan(temperature).any():
        raise input_error(
            "stress.over_temperature",
            f"needs temperatures of the part {part!r}, and it has none",
            "Give [temperature], and a material that depends on it (over_temperature, expansion_per_k); or limits at one temperature.",
        )
    try:
        return card.at(temperature)
    except InputError as error:
        raise input_error("stress.over_temperature", f"{error.problem} (part {part!r})", error.remedy) from None


def question_of(case: Case, model: Model) -> Question:
    """Return the question of a job; raise all refusals before any long computation.

    Raises
    ------
    InputError
        If the sweep is empty, harmonics of the loads are not kept, a check does not apply to the model, or the estimated cost
        exceeds the study's limits.
    """
    settings = case.settings
    sweep = within_limits(model, sweep_of(settings, model.engine_order, model.driven.values()), settings.limits)
    sweep = measured(sweep, model)
    stepping = stepping_of(settings, sweep)
    _refuse_beforehand(case, model, sweep, stepping)
    # solutions are judged with up to three times the kept harmonics
    harmonics = JUDGED_MULTIPLE * sweep.high_harmonics[-1]
    if IN_TIME in case.checks:
        harmonics = max(harmonics, model.sectors // 2)  # to excite all waves of a wheel
    assembled = assemble(model, harmonics, case.store, linear=True)
    asked = settings.forced_response
    examined = asked.stability != "off" or asked.bifurcations in ("all", "branches")
    if examined and examines_every_wave(assembled.system):
        assembled = assemble(model, harmonics, case.store, every_wave=True, linear=True)
    if IN_TIME in case.checks:
        _require_sectors(model, assembled)
    if (share := settings.forced_response.static_friction_share) is not None:
        assembled = _with_frozen_sliders(assembled, share)
    _refuse_assembled(case, assembled, sweep, stepping)
    try:
        forced_problem(assembled.system, assembled.load, sweep)
    except InputError as error:
        place = _driving(settings.load)
        raise error.at(f"{place} ({case.label})" if case.label else place) from None
    counts = {name: assembled.counts[name] for name in ("reduced", "retained")}
    return Question(
        label=case.label,
        model=peak_first(assembled),
        sweep=sweep,
        limit=sweep.threshold,
        facts=facts_of(model, model.speed / RPM) | counts,
        key=settings.forced_response.range_key,
        checks=case.checks,
        first=case.index == 0,
        examine=settings.forced_response.stability,
        stability_s=settings.forced_response.stability_s,
        bifurcations=settings.forced_response.bifurcations,
        not_periodic_s=(
            settings.forced_response.not_periodic_s if settings.forced_response.not_periodic == "in_time" else 0.0
        ),
        not_periodic_points=settings.forced_response.not_periodic_points,
        rpm=model.speed / RPM,
        similarity=settings.harmonics.similarity,
        stepping=stepping,
    )


def _refuse_beforehand(case: Case, model: Model, sweep: Sweep, stepping: TimeStepping | None) -> None:
    """Refuse what the model cannot answer, before it is assembled; `stepping`: time steps of a response by shooting."""
    settings = case.settings
    _refuse_stress(case, model)
    if stepping is not None:
        require_shooting(settings, model, case.checks)
        return
    _require_driven(model, sweep)
    if IN_TIME in case.checks:
        refuse_whole("--verify", model, "run without --verify")
        _require_integrable(model)
    _refuse_for_rigid(model, sweep, case.checks, settings.harmonics.similarity)
    check_limits(settings.limits, estimate(model, sweep))


def _refuse_assembled(case: Case, assembled: Assembled, sweep: Sweep, stepping: TimeStepping | None) -> None:
    """Refuse what the assembled model cannot answer."""
    _require_coefficients(assembled, sweep)
    if stepping is not None:
        require_in_time(assembled, sweep, stepping)
    if case.settings.harmonics.similarity:
        _require_comparable(assembled, sweep)


def _require_coefficients(model: Assembled, sweep: Sweep) -> None:
    """Refuse aerodynamic coefficients that do not cover all harmonics that may be kept."""
    force = model.system.structure.feedback_of(1)
    if force is None:
        return
    first = sweep.first_harmonics
    most = (first if always_kept(sweep.strategy) is not None else sweep.high_harmonics)[-1]
    low, high = sweep.omega_range
    what = f"a response with harmonics up to {most}"
    force.influence.require(min(h for h in first if h) * low, most * high, what)


def _require_comparable(model: Assembled, sweep: Sweep) -> None:
    """Refuse a comparison of Jacobians with equal harmonics, or of more rows than dense matrices should have."""
    few, many = sweep.low_harmonics, sweep.supports[:2][-1] if sweep.auto else sweep.high_harmonics
    if few == many:
        raise input_error(
            "harmonics.similarity",
            f"compares Jacobians with few and with many harmonics, and low and high are both {named(few)}",
            'Give high = "auto" or a higher harmonic, or a lower low.',
        )
    rows = (2 * len(many) - 1) * model.system.retained.size
    if rows > MAX_COMPARED_ROWS:
        raise input_error(
            "harmonics.similarity",
            f"compares dense matrices of up to {MAX_COMPARED_ROWS} rows, and H = {named(many)} has {rows}",
            "Remove it, lower harmonics.high, or give the contacts fewer points.",
        )


def _with_frozen_sliders(model: Assembled, share: float) -> Assembled:
    """Return the model whose sliders start from the static state under a fraction of the friction, and that state."""
    try:
        system = frozen_sliders(model.system, model.load.static, share)
    except InputError as error:
        raise error.at(f"forced_response.static_friction_share: {error.place}") from None
    gap, force = static_state(system, model.load.static)
    bare = replace(model.bare, interface=system.interface)
    return replace(model, system=system, bare=bare, static_gap=gap, static_force=force)


def _driving(loads: Mapping[str, Any]) -> str:
    """Return the key of the only harmonic load; for several loads the table."""
    driven = {name: table for name, table in loads.items() if table.harmonic > 0}
    if len(driven) != 1:
        return "load"
    (name, table), *_ = driven.items()
    return f"load.{name}.{'ratio' if table.ratio_of else 'force_n'}"


def _require_driven(model: Model, sweep: Sweep) -> None:
    for name, harmonic in model.driven.items():
        if harmonic not in sweep.low_harmonics:
            raise input_error(
                "harmonics.low",
                f"must hold harmonic {harmonic}, which load.{name} drives, got {named(sweep.low_harmonics)}",
                f"Add it, for example low = {sorted({*sweep.low_harmonics[1:], harmonic})}, or leave low out.",
            )


def _require_integrable(model: Model) -> None:
    """Refuse a check by time integration of a model that it does not support."""
    for name, part in model.parts.items():
        if part.structure.loss is not None or (part.damping and part.damping.loss_factor):
            raise input_error(
                f"part.{name}.damping.loss_factor",
                "--verify integrates in time, and structural damping is defined for vibration at one frequency",
                "Run without --verify, or take a modal ratio of half the loss factor, which is the same at resonance.",
            )
    found = [
        input_error(
            f"contact.{name}.law",
            f"--verify integrates in time, and {RIGID} has no stiffness: its force is no function of the gap",
            "Run without --verify, or give a law with stiffnesses, such as elastic_coulomb.",
        )
        for name, contact in model.contacts.items()
        if law_name(contact.law) == RIGID
    ]
    if found:
        raise together(found)


def _require_sectors(model: Model, assembled: Assembled) -> None:
    """Refuse a wheel whose sectors have too many coordinates for time integration."""
    side = assembled.system.structure
    if side.wheel is None:
        if assembled.blades is not None and side.n > MOST_IN_TIME:
            raise input_error(
                "mistuning",
                f"--verify integrates all sectors, {side.n} coordinates, more than {MOST_IN_TIME}",
                "Keep fewer modes, or verify a wheel of fewer sectors.",
            )
        return
    place = f"part.{next(name for name, part in model.parts.items() if part.sectors > 1)}.sectors"
    size = sectors_in_time(assembled.system) * side.n
    if size > MOST_IN_TIME:
        raise input_error(
            place,
            f"--verify integrates all sectors that may do different things, {size} coordinates, more than {MOST_IN_TIME}",
            "Run without --verify; --verify-harmonics works.",
        )


def _refuse_for_rigid(model: Model, sweep: Sweep, checks: frozenset[str], similarity: bool) -> None:
    """Refuse features that need contact forces as functions of the gaps, in a model with rigid contacts."""
    found = [name for name, contact in model.contacts.items() if law_name(contact.law) == RIGID]
    if not found:
        return
    because = f"and contact.{found[0]} is {RIGID}, whose force is no function of the gap"
    if always_kept(sweep.strategy) is None:
        raise input_error(
            "harmonics.selection",
            f"is {sweep.selection!r}, which predicts from contact forces what harmonics would change, {because}",
            'Give selection = "always_high": harmonics up to high are kept at every frequency.',
        )
    for key, own in (("low", sweep.low_harmonics), ("high", sweep.high_harmonics)):
        if not is_full(own):
            raise input_error(
                f"harmonics.{key}",
                f"leaves harmonics out, got {named(own)}, {because}",
                f"Give {own[-1]}: all harmonics up to it.",
            )
    if similarity:
        raise input_error(
            "harmonics.similarity",
            f"compares derivatives of contact forces, {because}",
            "Remove it, or give the contact a law with stiffnesses, such as elastic_coulomb.",
        )
    if HARMONICS in checks:
        raise input_error(
            f"contact.{found[0]}.law",
            f"--verify-harmonics predicts from contact forces what more harmonics would change, {because}",
            "Run without it, and compare with a larger harmonics.high.",
        )

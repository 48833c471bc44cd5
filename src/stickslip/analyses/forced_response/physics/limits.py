"""Physical limits of a case: damping that is missing, parts that contacts alone hold, dampers that cannot slip, small motions."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import MotionAtPeak, PhysicsVerdicts, stored
from stickslip.analyses.forced_response.records.values import Values
from stickslip.assembly.assembled import Assembled
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws import is_of_a_user
from stickslip.response.damper_statics import ANGLES_DEG, DamperStatics, FlankLimits, flanks_of, statics_of
from stickslip.response.damping_of_modes import UNDAMPED_RATIO, ModesInRange, Range, RangeMode, modes_in_range
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.recovery import damped_share, equivalent_damping, rotation_and_strain, signals
from stickslip.study.verdict import Verdict, to_json
from stickslip.units import HZ


def statics_of_dampers(model: Assembled) -> list[DamperStatics]:
    """Return the statics of all rigid dampers whose flanks are all pressed at rest."""
    tuned = model if model.blades is None else model.blades.tuned
    flanks = flanks_of(tuned.system, tuned.contacts.groups, tuned.static_force)
    found = [statics_of(name, own) for name, own in flanks.items()]
    return [one for one in found if one is not None]


def damper_lines(every: Sequence[DamperStatics]) -> Iterator[str]:
    """Yield lines on each damper and its flanks."""
    for one in every:
        held = " and ".join(f"{f.flank.name} with {f.flank.normal:.3g} N" for f in one.flanks)
        yield f"{one.name}: a pull of {one.pull:.4g} N presses {held}"
        for limits in one.flanks:
            yield f"{one.name}: {slip_sentence(limits)}"
            angles = angle_sentence(limits)
            if angles:
                yield f"{one.name}: {angles}"


def of_statics(model: Assembled) -> Iterator[Verdict]:
    """Yield a note on the flanks of each damper: which can slip, and at which platform angles they cannot."""
    for one in statics_of_dampers(model):
        why = "; ".join(_alike(one.flanks, slip_sentence))
        angles = _alike(one.flanks, angle_sentence)
        remedy = " ".join(f"{text[:1].upper()}{text[1:]}." for text in angles)
        yield Verdict("trusted", why=f"{one.name} in static equilibrium: {why}", remedy=remedy)


def _alike(flanks: Sequence[FlankLimits], told: Callable[[FlankLimits], str]) -> list[str]:
    """Return the sentences about flanks; flanks of which the same is said share one."""
    names: dict[str, list[str]] = {}
    for limits in flanks:
        if text := told(limits):
            names.setdefault(text.removeprefix(limits.flank.name), []).append(limits.flank.name)
    found = []
    for text, own in names.items():
        several = text if len(own) == 1 else text.replace(" is ", " are ", 1).replace("; it ", "; they ")
        found.append(f"{' and '.join(own)}{several}")
    return found


def slip_sentence(limits: FlankLimits) -> str:
    """Return whether a flank can slip, with the largest T/N in equilibrium."""
    flank, least = limits.flank, min(limits.most)
    if limits.slips:
        return f"{flank.name} can slip to and fro, T/N reaches the friction coefficient {flank.friction:.2g}"
    return f"{flank.name} cannot slip to and fro, T/N reaches only {least:.2g} of {flank.friction:.2g}"


def angle_sentence(limits: FlankLimits) -> str:
    """Return the platform angles at which a flank could not slip; empty for a flank that is not plane."""
    if not np.isfinite(limits.angle_deg):
        return ""
    own = f"{limits.flank.name} is inclined by {limits.angle_deg:.0f} degrees (0 is square to the pull)"
    ranges = [_range(low, high) for low, high in limits.held_deg]
    return f"{own}; it cannot slip {' and '.join(ranges)}" if ranges else f"{own}; it slips at any angle"


def _range(low: float, high: float) -> str:
    first, last = float(ANGLES_DEG[0]), float(ANGLES_DEG[-1])
    if low <= first and high >= last:
        return "at any angle"
    if low <= first:
        return f"below {high:.0f} degrees"
    return f"above {low:.0f} degrees" if high >= last else f"from {low:.0f} to {high:.0f} degrees"


PHYSICS = "physics"  # name of a note of the job
BESIDE = 0.01  # largest relative distance of a resonance from the frequency of its mode
# half the range of a normal force over its mean, above which the estimate of friction damping does not hold
STEADY = 0.5
NAMED_MODES = 3  # modes that a sentence lists
ESTIMATE = "this estimate holds within a factor of 1.5, for steady normal forces, at the one best amplitude"
GIVE_DAMPING = "Give the parts their damping ([damping] or part.NAME.damping: a ratio, a loss factor; or aerodynamic coefficients)."


def physics_of(question: Question) -> ModesInRange | None:
    """Return the excited modes of a case, see `modes_in_range`; a mistuned wheel is replaced by the tuned one."""
    model = question.model if question.model.blades is None else question.model.blades.tuned
    within = Range(*sorted(question.sweep.omega_range))
    return modes_in_range(model.system, model.load, within, model.static_gap, model.static_force)


def beforehand(physics: ModesInRange) -> Iterator[Verdict]:
    """Yield the verdicts of ``stickslip check`` on a case before its solution.

    Parameters
    ----------
    physics
        Properties of its modes.
    """
    if physics.undamped:
        slip = "only slip bounds it" if physics.friction.any else "nothing bounds it"
        stick, still = _where(physics, " while contacts stick"), _where(physics, " where nothing slips")
        why = f"nothing damps {_modes(physics.undamped)}{stick}: {slip}, and a peak{still} has no finite value"
        yield Verdict("doubtful", why=why, remedy=GIVE_DAMPING)
    yield from _of_bounds(physics)
    yield from _of_bodies(physics)
    yield from _of_dampers(physics)


def _where(physics: ModesInRange, text: str) -> str:
    """Return words about contacts; empty without contacts."""
    return text if physics.touching else ""


def driven_line(physics: ModesInRange) -> list[str]:
    """Name the mode in the range with the largest excitation, pressed contacts stuck."""
    top = physics.driven
    if top is None:
        return []
    others = [m for m in physics.stuck if m.force > 0.0 and m is not top]
    beside = f"; it drives {_modes(others)} less" if others else ""
    return [
        f"the load drives the mode at {top.hz:.2f} Hz most{_where(physics, ' (pressed contacts stuck): the resonance while nothing slips')}{beside}"
    ]


def afterwards(question: Question, physics: ModesInRange, response: Response) -> Iterator[Verdict]:
    """Yield the verdicts on a solved case: from the energy balance at its peak, and from its modes.

    Parameters
    ----------
    question, physics
        The case and the properties of its modes.
    response
        The response of the case.
    """
    yield from _of_energy(question, physics, response)
    yield from _of_bounds(physics)
    yield from _of_bodies(physics)
    yield from _of_dampers(physics, _loads_move(question, response), response.peak_hz)
    yield from of_statics(question.model)


def of_physics(question: Question, response: Response) -> Values:
    """Return the variables of a case about its physics."""
    physics = physics_of(question)
    told = () if physics is None else afterwards(question, physics, response)
    return stored(PhysicsVerdicts(physics_verdicts=to_json(told)))


def _of_energy(question: Question, physics: ModesInRange, response: Response) -> Iterator[Verdict]:
    """Yield a verdict on an undamped resonance without any dissipation."""
    top = response.top
    if top is None or not physics.undamped:
        return
    known = _damping(question, top)
    if known < UNDAMPED_RATIO and _decided_by_damping(question, top):
        idle = _where(
            physics,
            f" while contacts stick, and at the peak nothing slips enough to (equivalent damping {_plain(known)} of critical)",
        )
        why = f"nothing damps {_modes(physics.undamped)}{idle}: the peak has no finite value, the number tells how near to it a frequency was solved"
        yield Verdict("doubtful" if question.sweep.grid.size else "wrong", why=why, remedy=GIVE_DAMPING)
        return
    for mode in physics.undamped:
        low, high = sorted((physics.ends(mode), mode.omega))
        low, high = low * (1 - BESIDE), high * (1 + BESIDE)
        near = [a for a in response.accepted if a.fields and low <= a.point.omega <= high]
        if not near:
            continue
        most = max(near, key=response.amplitude)
        # peaks may be missed between listed frequencies, on a followed branch only those limited by damping alone
        missed = question.sweep.grid.size > 0 or _decided_by_damping(question, most)
        if missed and _damping(question, most) < UNDAMPED_RATIO:
            idle = _where(physics, " while contacts stick, and nothing slips where it was solved")
            why = f"nothing damps the mode at {mode.hz:.2f} Hz{idle}: a larger peak may stand there"
            remedy = f"{GIVE_DAMPING} Or give more forced_response.points, which find where it slips."
            yield Verdict("doubtful", why=why, remedy=remedy)


def _damping(question: Question, accepted: Accepted) -> float:
    return equivalent_damping(question.problem, accepted.point)


def _decided_by_damping(question: Question, accepted: Accepted) -> bool:
    """Return whether a negligible damping would change a motion by more than the threshold; else stiffness and inertia decide its size."""
    share = damped_share(question.problem, accepted.point, UNDAMPED_RATIO)
    return not share <= question.limit


def _of_bounds(physics: ModesInRange) -> Iterator[Verdict]:
    """Yield a verdict on a load that exceeds the bound on friction."""
    if physics.unbounded:
        mode, excess = max(physics.unbounded, key=lambda own: own[1])
        why = (
            f"nothing bounds the resonance at {mode.hz:.2f} Hz (contacts sliding): the mode has no damping, and the load on it is {_plain(excess)} "
            "times what friction bounds, 4/π of its limit"
        )
        yield Verdict("wrong", why=why, remedy=f"{GIVE_DAMPING} Or raise the friction.")


def _of_bodies(physics: ModesInRange) -> Iterator[Verdict]:
    """Yield a verdict on a part that vibrates alone on its contact springs inside the range."""
    every = [m for m in physics.stuck if m.on_contacts]
    if every:
        mode = every[0]
        why = (
            f"the mode at {mode.hz:.2f} Hz is {mode.part} alone on the springs of its contacts ({100 * mode.kinetic:.4g} % of the kinetic and "
            f"{100 * mode.strain:.4g} % of the strain energy): contacts are far stiffer and such bodies far lighter, as a rule"
        )
        remedy = f"Check the units of the contact stiffnesses and of the mass of {mode.part}: one of them may be a thousand times off."
        yield Verdict("doubtful", why=why, remedy=remedy)


def _of_dampers(physics: ModesInRange, moving: str = "", peak_hz: float = np.nan) -> Iterator[Verdict]:
    """Yield a note on the effect of friction on the modes near peaks, or the reason why there is no estimate."""
    if not physics.damped:
        return
    if moving:
        why = f"the damping by friction was not estimated, as {moving}"
        yield Verdict("trusted", why=why, remedy="stickslip check estimates it for steady normal forces.")
        return
    shown = physics.damped[:NAMED_MODES]
    if np.isfinite(peak_hz):
        shown = (min(physics.damped, key=lambda d: d.apart(peak_hz * HZ)),)
    first, *others = (text for d in shown for text in d.sentences)
    why = ". ".join([first, *(f"{text[:1].upper()}{text[1:]}" for text in others)])
    yield Verdict("trusted", why=why, remedy=f"{ESTIMATE[:1].upper()}{ESTIMATE[1:]}.")


def _loads_move(question: Question, response: Response) -> str:
    """Return the reason why normal forces at the peak vary too much for an estimate; empty if they do not."""
    if response.top is None:
        return "there is no peak"
    laws = question.model.system.springs.laws
    follows = np.array([_rubs_by_normal_force(law) for law in laws], dtype=bool)
    if not follows.any():
        return ""
    normal = -signals(question.problem, response.top.point).force[follows, 2]
    mean = normal.mean(axis=1)
    pressed = normal[mean > 0.0]
    if not len(pressed):
        return "no contact is pressed at the peak"
    swing = 0.5 * (pressed.max(axis=1) - pressed.min(axis=1)) / pressed.mean(axis=1)
    opened = np.any(pressed <= 0.0, axis=1)
    if opened.any():
        return f"{opened.sum()} of {len(pressed)} pressed contact points open at the peak"
    most = float(np.average(swing, weights=pressed.mean(axis=1)))
    return f"normal forces at the peak swing by {100 * most:.0f} % of their mean" if most > STEADY else ""


def _rubs_by_normal_force(law: ContactLaw) -> bool:
    """Whether the friction of a law follows the normal force; of a law of one's own: whether it has a normal stiffness."""
    return hasattr(law, "mu") or (is_of_a_user(law) and float(law.stuck_stiffness()[2]) != 0.0)


def _modes(every: list[RangeMode]) -> str:
    """Name modes by their frequencies."""
    named = ", ".join(f"{m.hz:.2f}" for m in every[:NAMED_MODES])
    more = f" and {len(every) - NAMED_MODES} more" if len(every) > NAMED_MODES else ""
    return f"the mode{'s' * (len(every) > 1)} at {named} Hz{more}"


def _plain(value: float) -> str:
    return f"{value:.2g}" if abs(value) > 1e-12 else "0"


def motion_at_peak(question: Question, response: Response) -> Values:
    """Return rotations and strains of the motion at the peak, which limit linear kinematics; NaN if unknown.

    Rotations belong to rigid bodies and nodes with rotational dofs. A meshed part counts with its mean slope from the
    clamp to an output; its steepest slope is larger. The strain is the root mean square over the elastic parts; the
    largest strain is larger.
    """
    rotation = strain = slipped = np.nan
    top = response.top
    if top is not None and top.point.converged:
        away, volume = np.zeros(0), np.nan
        if (extent := question.extent) is not None:
            known = dict(zip(extent.labels, extent.from_clamp, strict=True))
            away = np.array([known.get(name, np.nan) for name in question.model.output_labels])
            volume = extent.stiff_volume
        rotation, strain = rotation_and_strain(question.problem, top.point, away, volume)
        facet = np.sqrt(question.model.contacts.area)
        if np.any(np.isfinite(facet)):
            gap = signals(question.problem, top.point).gap[:, :2]
            slip = 0.5 * np.hypot(*(np.ptp(gap[:, k], axis=1) for k in range(2)))
            slipped = float(np.nanmax(slip / facet[: len(slip)]))
    return stored(MotionAtPeak(peak_rotation_rad=rotation, peak_strain_rms=strain, peak_slip_facets=slipped))

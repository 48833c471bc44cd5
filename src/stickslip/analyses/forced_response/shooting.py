"""``[forced_response] method = "shooting"``: frequencies, time steps, refusals, lines of ``stickslip check``."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from stickslip.analyses.forced_response.table import STEPS
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, input_error
from stickslip.harmonic.linear import one_structure
from stickslip.response.forced.sweep import Sweep
from stickslip.response.time.shooting import TOLERANCE
from stickslip.response.time.stepping.marcher import prepared
from stickslip.response.time.transient import TimeStepping

REPORTED = 25  # highest stored harmonic of a motion, if the study sets none
DRIVEN_MULTIPLE = 3  # least ratio of the highest stored to the highest driven harmonic
MAX_PERIODS = 1000  # limit at a frequency: warm-up, corrections, and plain periods if corrections fail
MAX_COORDINATES = 600  # half a second a period
METHOD, BALANCE = "forced_response.method", 'give method = "balance"'
WITHOUT_HARMONICS = (  # keys of [harmonics] that choose or judge harmonics of a balance
    "low",
    "selection",
    "passages",
    "strategy_threshold",
    "per_dof",
    "repeats",
    "similarity",
    "alert_over",
    "alert_harmonics",
)


def shooting_sweep(settings: Any, sweep: Sweep, driven: Iterable[int]) -> Sweep:
    """Return the sweep by shooting: listed or equally spaced frequencies, and the harmonics that are stored of each motion."""
    given = settings.harmonics.high
    order = given if isinstance(given, int) else max(REPORTED, DRIVEN_MULTIPLE * max(driven, default=1))
    count = 0 if sweep.at else sweep.frequencies or sweep.points
    return replace(
        sweep,
        low=order,
        high=order,
        selection="always_high",
        passages="double",
        error_harmonics=None,
        frequencies=count,
    )


def stepping_of(settings: Any, sweep: Sweep) -> TimeStepping | None:
    """Return the time steps of a response by shooting; None for one by harmonic balance."""
    table = settings.forced_response
    if table.method != "shooting":
        return None
    steps, order = table.steps_per_period or STEPS, sweep.high_harmonics[-1]
    if 2 * order >= steps:
        raise input_error(
            "forced_response.steps_per_period",
            f"must be more than twice the highest harmonic, {order}, got {steps}",
            f"Give at least {4 * order}, or a lower harmonics.high.",
        )
    return TimeStepping(steps_per_period=steps, max_periods=MAX_PERIODS, tolerance=TOLERANCE, harmonics=order)


def require_shooting(settings: Any, model: Model, checks: frozenset[str]) -> None:
    """Refuse keys, checks and models that do not apply to shooting, before anything is assembled.

    Raises
    ------
    InputError
        Naming the key, its value, and the remedy.
    """
    if checks:
        option = sorted(checks)[0].replace("_", "-")
        raise input_error(METHOD, f"is shooting, and --{option} checks a balance", f"Run without --{option}.")
    if isinstance(settings.harmonics.high, list):
        raise input_error(
            "harmonics.high",
            f"is the list {settings.harmonics.high}, and shooting leaves no harmonics out",
            "Give the highest harmonic to store, or leave it out.",
        )
    for table, keys in (("harmonics", WITHOUT_HARMONICS), ("solver", ("globalisation", "rescue"))):
        own = getattr(settings, table)
        given = [key for key in keys if key in own.model_fields_set and getattr(own, key) != _default(own, key)]
        if given:
            value = getattr(own, given[0])
            raise input_error(
                f"{table}.{given[0]}",
                f'is {value!r}, and forced_response.method = "shooting" solves no balance',
                f"Remove it, or {BALANCE}.",
            )
    refuse_whole(METHOD, model, BALANCE)
    _refuse_for_model(model)


def _refuse_for_model(model: Model) -> None:
    if not model.pairs.names:
        raise input_error(METHOD, "is shooting, and the model has no contact", f"Give a contact, or {BALANCE}.")
    for name, part in model.parts.items():
        if part.sectors > 1:
            raise input_error(
                f"part.{name}.sectors",
                f"is {part.sectors}, and shooting integrates no wheels",
                f"Remove method, or {BALANCE}; --verify integrates all sectors of a wheel.",
            )
        if part.structure.loss is not None or (part.damping and part.damping.loss_factor):
            raise input_error(
                f"part.{name}.damping.loss_factor",
                "is structural damping, which is defined for vibration at one frequency, and shooting integrates in time",
                f"Take a modal ratio of half the loss factor, or {BALANCE}.",
            )
    for name, contact in model.contacts.items():
        if law_name(contact.law) == "rigid_coulomb":
            raise input_error(
                f"contact.{name}.law",
                "is rigid_coulomb, whose force is no function of the gap, and shooting integrates in time",
                f"Give a law with stiffnesses, such as elastic_coulomb, or {BALANCE}.",
            )


def _default(table: Any, key: str) -> Any:
    return type(table).model_fields[key].get_default(call_default_factory=True)


def require_in_time(model: Assembled, sweep: Sweep, stepping: TimeStepping) -> None:
    """Refuse an assembled model that cannot be integrated in time, or has too many coordinates for it."""
    system = model.system
    if system.structure.n > MAX_COORDINATES:
        raise input_error(
            METHOD,
            f"is shooting, which integrates {system.structure.n} coordinates, more than {MAX_COORDINATES}",
            f"Keep fewer modes ([reduction]), or {BALANCE}.",
        )
    if system.structure.feedback_of(1) is not None:
        raise input_error(
            METHOD, "is shooting, and forces of the flow are defined by frequency", f"Remove [aero], or {BALANCE}."
        )
    try:
        at = system.at(sweep.ends[0])
        structure, own = one_structure(at.structure, "shooting"), at.interface
        omega, steps = sweep.ends[0], stepping.steps_per_period
        prepared(structure, own.gap_operator, own.laws, model.load, omega, steps, own.weights, "shooting")
    except InputError as error:
        raise input_error(
            METHOD, f"is shooting: {error.place} {error.problem}", f"{error.remedy} Or {BALANCE}."
        ) from None


def shooting_lines(model: Assembled, sweep: Sweep, stepping: TimeStepping) -> tuple[str, ...]:
    """Return the lines of ``stickslip check`` on a response by shooting."""
    rows, steps = 2 * model.system.structure.n, stepping.steps_per_period
    return (
        f"shooting: {sweep.grid.size} frequencies, {steps} steps a period, {rows} states beside the contacts'",
        f"shooting: the first {sweep.high_harmonics[-1]} harmonics of each motion are stored",
        f"shooting: up to {MAX_PERIODS} periods a frequency, some 20 as a rule",
    )

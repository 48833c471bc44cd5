"""Estimated cost of a stability examination, and the decision to begin it; all sectors of a wheel count."""

from stickslip.assembly.sides.unreduced import KEPT
from stickslip.response.stability.flow_map.contact_states import is_located
from stickslip.response.stability.hill_method.hill import MAX_HILL_HARMONICS, MAX_ROWS
from stickslip.response.stability.hill_method.hill_segment import NODES
from stickslip.response.system import System
from stickslip.response.time.sectors import different_sectors

INTERVALS = 12  # intervals between transitions for each contact: 2 to 18 at the peaks of the two blades
PRODUCTS = 20  # matrix products for each interval
FLOPS = 2e10  # operations of matrix products a second on one core
MOST_S = 60.0  # largest estimated time of one examination, unless a study allows another
MOST_WHEEL = 4 * FLOPS  # the same for a forced motion of a wheel, whose other waves are reduced for this purpose alone
MOST_HILL = 300 * FLOPS  # the same for Hill's method, whose estimate is an upper bound: few contacts slip
MOTIONS = 2.0  # motions examined at a point: as solved, and with more harmonics


def examination_work(system: System) -> float:
    """Return the operations of one examination of two motions; on a wheel all sectors count.

    A travelling motion repeats itself in other sectors, so a fraction of the period suffices. Modes and multipliers of all
    coordinates are needed in any case and cost about as much as one interval.
    """
    side, sectors, shares = system.structure, 1, 1
    if side.wheel is not None:
        sectors, shares = side.wheel.sectors, different_sectors(side.wheel)[0]
    rows = 2 * sectors * side.n
    intervals = max(1.0, INTERVALS * sectors * system.interface.n_contacts / shares)
    return 2.0 * intervals * PRODUCTS * 2.0 * rows**3


def too_long(system: System, *, forced: bool, most_s: float = MOST_S, key: str = "") -> str:
    """Return the reason why an examination would take too long, by the size of the model; empty if it would not.

    The cost does not depend on the waves that the harmonics excite, because all sectors are integrated.

    Parameters
    ----------
    system
        The vibrating system.
    forced
        Whether a load drives it.
    most_s, key
        Largest estimated time allowed, s, except for forced motions of a wheel; the key of the study that sets it.
    """
    if not system.structure.reduced:
        return f"a reduced model is needed, and {KEPT}"
    side, work = system.structure, examination_work(system)
    wheel = side.wheel
    most = MOST_WHEEL if forced and wheel is not None else most_s * FLOPS
    if work <= most:
        return ""
    would = f"would take about {_lasting(work / FLOPS)} a motion, more than {most / FLOPS:.3g} s"
    if wheel is not None:
        return (
            f"against every wave all {wheel.sectors} sectors count, {wheel.sectors * side.n} coordinates with "
            f"{wheel.sectors * system.interface.n_contacts} contacts, which {would}"
        )
    return f"{side.n} coordinates with {system.interface.n_contacts} contacts {would}{f' ({key})' * bool(key)}"


def hill_work(system: System) -> float:
    """Return the largest number of operations of an examination by Hill's method, sector by sector."""
    side = system.structure
    sectors = 1 if side.wheel is None else side.wheel.sectors
    rows = min(MAX_ROWS, (2 * MAX_HILL_HARMONICS + 1) * 3 * system.interface.n_contacts)
    each = 8.0 * rows**3 / 3.0 + (2 * MAX_HILL_HARMONICS + 1) * 4.0 * float(side.n) ** 3
    return MOTIONS * 2.0 * sectors / 2.0 * NODES * each


def by_hill(system: System) -> bool:
    """Return whether forced motions are examined by Hill's method: on a wheel too large for its multipliers, and with structural damping."""
    interface, side = system.interface, system.structure
    large = side.wheel is not None and bool(too_long(system, forced=True))
    return (
        side.reduced
        and (large or side.of_harmonic(1).loss is not None)
        and not interface.rigid
        and all(is_located(law) for law in interface.laws)
        and hill_work(system) <= MOST_HILL
    )


def examines_every_wave(system: System) -> bool:
    """Return whether the stability of forced motions of a tuned wheel is examined for every wave."""
    if system.structure.wheel is None:
        return False
    return not too_long(system, forced=True) or by_hill(system)


def _lasting(seconds: float) -> str:
    """Write a long time in seconds, hours or days."""
    for name, unit in (("days", 86400.0), ("hours", 3600.0)):
        if seconds > 2 * unit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds:.0f} s"

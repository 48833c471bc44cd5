"""Check of a user's contact law against finite differences."""

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.law import FULLY_COUPLED, OPEN, PAIRS, STICK, ContactLaw, check_law_members
from stickslip.errors import InputError, input_error

ALLOWED = (5, 7, 9)
RELATIVE_STEP = 1e-6
PART = 1e-3  # distance of the two gaps whose pressures are compared, relative to the displacements
ROUNDING = 1e-12  # relative to the largest stiffness; smaller ones are zero
# difference of the one-sided differences, relative to the largest output, above which the point is at a kink and not
# checked
KINK = 1e-3
WRONG = 1e-4  # largest error, relative to the largest output; curvature contributes a hundredth of this


def check_law(law: ContactLaw, size: float = 1.0, rate: float = 1.0, steps: int = 200, seed: int = 0) -> None:
    """Check a law along a random path: derivatives by finite differences, sign of the normal stiffness, stuck stiffness.

    A positive normal gap is open, so the pressure ``N = -force[2]`` must not grow with it. A law that never opens, such
    as a spring of negative stiffness, may pull the other way if its `stuck_stiffness` says so. Preload and gap are not
    checked: they need the fields ``preload`` and ``k_n``.

    Parameters
    ----------
    law
        A contact law.
    size, rate
        Typical displacement, m, and velocity, m/s: large enough that all states of the law occur.
    steps
        Number of steps of the path.
    seed
        Seed of the random path.

    Raises
    ------
    InputError
        If `pairs` is not 5, 7 or 9 or omits a nonzero block, an output is not filled, a derivative is wrong, the
        pressure grows as the bodies separate, `stuck_stiffness` differs from the stiffness of the sticking law, or
        every point was at a kink; the message names the entry and both numbers.
    """
    if _tried(law, size, rate, steps, seed) == 0:
        raise _refused(law, "each point of the path is next to a kink", "Give another `size` or `rate`.")


def law_fault(law: ContactLaw, size: float, rate: float) -> str:
    """Return what `check_law` finds wrong with a law, as a sentence; empty for a sound law and where every point is at a kink."""
    try:
        _tried(law, size, rate, steps=200, seed=0)
    except InputError as error:
        return str(error.problem)
    return ""


def _tried(law: ContactLaw, size: float, rate: float, steps: int, seed: int) -> int:
    """Check a law along a random path, and return the number of compared derivatives."""
    check_law_members(type(law).__name__, law)
    if law.pairs not in ALLOWED:
        raise _refused(law, f"pairs is {law.pairs}", "Give 5, 7 or 9 (see ContactLaw).")
    rng = np.random.default_rng(seed)
    state = np.asarray(law.initial_state(), dtype=float)
    path = []
    for _ in range(steps):
        point = np.concatenate([size * rng.standard_normal(3), rate * rng.standard_normal(3), state])
        out, jac, _ = _step(law, point)
        if not np.any(np.isnan(state)):
            path.append((point, out, jac))
        state = out[3:]
    out_scale = np.concatenate(
        [np.full(3, np.max([np.abs(o[:3]) for _, o, _ in path])), np.max([np.abs(o[3:]) for _, o, _ in path], axis=0)]
    )
    out_scale[out_scale == 0.0] = 1.0
    in_scale = np.concatenate([np.full(3, size), np.full(3, rate), out_scale[3:]])
    compared = sum(_compare(law, *stop, out_scale, in_scale) for stop in path)
    stops = [point for point, _, _ in path] + _at_rest(law, size)
    _check_normal(law, stops, size)
    _check_stuck(law, stops)
    return compared


def _at_rest(law: ContactLaw, size: float) -> list[FloatArray]:
    """Return two points without velocity, with zero displacement and pressed, after one step from the initial state."""
    stops = []
    for gap in (0.0, -size):
        point = np.concatenate([[0.0, 0.0, gap, 0.0, 0.0, 0.0], law.initial_state()])
        point[6:] = _step(law, point)[0][3:]
        stops.append(point)
    return stops


def _check_normal(law: ContactLaw, stops: list[FloatArray], size: float) -> None:
    """Refuse a pressure that grows as the bodies separate, at the closed point with the smallest gap."""
    seen = [(abs(point[2]), i, _step(law, point)) for i, point in enumerate(stops)]
    closed = [(gap, i) for gap, i, (_, _, status) in seen if not np.any(status == OPEN)]
    springs = len(closed) == len(stops) and law.stuck_stiffness()[2] < 0.0  # on purpose
    if not closed or springs:
        return
    near = stops[min(closed)[1]]
    apart = near.copy()
    apart[2] += PART * size
    before, after = -_step(law, near)[0][2], -_step(law, apart)[0][2]
    if after - before > WRONG * PART * max(float(np.abs(out[2])) for _, _, (out, _, _) in seen):
        raise _refused(
            law,
            f"the pressure grows as the bodies part: N = -force[2] is {before:.6g} N at a normal gap of {near[2]:.6g} m, "
            f"{after:.6g} N at {apart[2]:.6g} m",
            "A positive normal gap is open: N = preload - k_n * displacement[2], force[2] = -N, jac[2, 2] = k_n.",
        )


def _check_stuck(law: ContactLaw, stops: list[FloatArray]) -> None:
    """Refuse a stuck stiffness outside the range of the law's stiffnesses where it sticks.

    A linear law has only one.
    """
    own = np.asarray(law.stuck_stiffness(), dtype=float)
    if own.shape != (3,):
        raise _refused(law, f"stuck_stiffness has the shape {own.shape}", "Return t, w, n.")
    seen: list[list[float]] = [[], [], []]
    for point in stops:
        _, jac, status = _step(law, point)
        for d in range(3):
            if np.all(status != OPEN) if d == 2 else status[d] == STICK:
                seen[d].append(jac[d, d])
    largest = max((abs(k) for along in seen for k in along), default=0.0)
    for d, along in enumerate(seen):
        if not along:
            continue
        low, high = min(along), max(along)
        room = WRONG * max(abs(low), abs(high)) + ROUNDING * largest
        if not low - room <= own[d] <= high + room:
            has = f"{low:.6g}" if high - low <= room else f"{low:.6g} to {high:.6g}"
            raise _refused(
                law,
                f"stuck_stiffness[{d}] is {own[d]:.6g} N/m, and jac[{d}, {d}] is {has} N/m where the contact "
                f"{'is closed' if d == 2 else 'sticks'}",
                "Return the stiffnesses along t, w, n of the contact that neither slips nor opens.",
            )


def _step(law: ContactLaw, point: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return force and new state, their derivatives, and the status of each tangent, at one sample."""
    n = point.size - 6
    force, new_state = np.full(3, np.nan), np.full(n, np.nan)
    jac, status = np.zeros((3 + n, 6 + n)), np.full(2, -1, dtype=np.int64)
    law.kernel(point[:3], point[3:6], point[6:], law.parameters(), force, new_state, jac, status)
    out = np.concatenate([force, new_state])
    if np.any(status < 0) or np.any(np.isnan(out)):
        names = ["status"] if np.any(status < 0) else []
        names += [_output(int(i)) for i in np.flatnonzero(np.isnan(out))]
        raise _refused(law, f"the step does not fill {', '.join(names)}", "Fill every output in every branch.")
    return out, jac, status


def _compare(
    law: ContactLaw, point: FloatArray, out: FloatArray, jac: FloatArray, out_scale: FloatArray, in_scale: FloatArray
) -> int:
    """Compare all derivatives at one point and return the number of columns that were not at a kink."""
    for pair in PAIRS[law.pairs : FULLY_COUPLED]:
        if jac[pair] != 0.0:
            raise _refused(
                law,
                f"pairs = {law.pairs} leaves out jac{list(pair)}, which is {jac[pair]:.6g}",
                "Give 7 if the tangents feel each other, 9 if the normal force feels them, too.",
            )
    compared = 0
    for column in range(point.size):
        h = RELATIVE_STEP * in_scale[column]
        ahead, behind = point.copy(), point.copy()
        ahead[column] += h
        behind[column] -= h
        right = (_step(law, ahead)[0] - out) / h
        left = (out - _step(law, behind)[0]) / h
        unit = in_scale[column] / out_scale
        if np.max(np.abs(right - left) * unit) > KINK:
            continue
        compared += 1
        middle = 0.5 * (right + left)
        row = int(np.argmax(np.abs(middle - jac[:, column]) * unit))
        if abs(middle[row] - jac[row, column]) * unit[row] > WRONG:
            raise _refused(
                law,
                f"jac[{row}, {column}], {_output(row)} by {_input(column)}, is {jac[row, column]:.6g}, differences give "
                f"{middle[row]:.6g}, at displacement {point[:3]}, velocity {point[3:6]} and state {point[6:]}",
                "Mend the derivative: Newton's method and the Jacobian Alert live on it.",
            )
    return compared


def _output(row: int) -> str:
    return f"force[{row}]" if row < 3 else f"new_state[{row - 3}]"


def _input(column: int) -> str:
    names = (("displacement", 0), ("velocity", 3), ("state", 6))
    name, first = names[min(column // 3, 2)]
    return f"{name}[{column - first}]"


def _refused(law: ContactLaw, problem: str, remedy: str) -> InputError:
    return input_error(type(law).__name__, problem, remedy)

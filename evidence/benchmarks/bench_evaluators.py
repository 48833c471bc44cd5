"""One evaluation of 100 elastic Coulomb contacts, forces and full derivatives: the three evaluators, and marches written by hand.

The evaluators are timed as Newton's method calls them, by `contact_forces`, which includes the sampling of the gaps where there is any. ``march`` serves any law and pays for that; a ratio to it alone would flatter the others. Next to it stand marches
that know nothing but the elastic Coulomb law, in the two forms one would write them: a loop over samples that adds to the derivative blocks
as it goes, and one that stores derivative rows and leaves the blocks to BLAS. All give the same answer, which is checked.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time
from typing import Any

import numba
import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.compiled import CompiledContacts, compile_contacts
from stickslip.contact.law import OPEN
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.aft import contact_forces

CONTACTS = 100
# harmonics, samples, goal of march over intervals, goal of march over events
CASES = ((5, 512, 4.0, 5.0), (15, 1024, 9.0, 5.0))
ROUNDS = 15
NUMPY_ROUNDS = 3
EQUAL = 1e-10  # of the largest block
SAMPLES = (128, 256, 512, 1024, 2048, 4096)
Blocks = tuple[FloatArray, FloatArray]  # coefficients (m, 3 n), blocks (n, 5, m, m)


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts in all states and the coefficients of their gaps."""

    laws: list[ElasticCoulomb]
    gap: FloatArray  # (2 order + 1, 3 n), m

    def compiled(self, evaluator: Any) -> CompiledContacts:
        return compile_contacts(self.laws, evaluator=evaluator)

    def rows(self) -> FloatArray:
        """(n, 5) k_t, k_w, k_n, mu, preload."""
        return np.array([law.parameters()[:5] for law in self.laws])


def contacts(order: int, n: int = CONTACTS) -> Contacts:
    """Draw contacts that stick, slip and lift off."""
    rng = np.random.default_rng(0)
    decay = np.repeat(1.0 / np.maximum(np.arange(order + 1), 1) ** 1.5, 2)[1:, None, None]
    gap = 1e-5 * decay * rng.standard_normal((2 * order + 1, n, 3))
    gap[:, :, :2] *= 10.0 ** rng.uniform(-0.5, 1.0, (n, 2))
    laws = [ElasticCoulomb(k_t=1e7, k_w=1.5e7, k_n=2e7, mu=0.5, preload=200.0 * p) for p in rng.uniform(0.0, 4.0, n)]
    return Contacts(laws, gap.reshape(2 * order + 1, 3 * n))


def fourier(order: int, samples: int) -> FloatArray:
    """(samples, 2 order + 1) basis 1, cos, sin, cos 2, ..."""
    angles = np.outer(2.0 * np.pi * np.arange(samples) / samples, np.arange(1, order + 1))
    out = np.ones((samples, 2 * order + 1))
    out[:, 1::2], out[:, 2::2] = np.cos(angles), np.sin(angles)
    return out


# ---- marches written by hand for this law; not kept on disk, so that they owe nothing to another run --------------------


@numba.njit
def _spring(x, pressure, slider, row):  # type: ignore[no-untyped-def]
    """Return force, slopes by own displacement and normal gap, and the slider's place, of `row` = k, k_n, mu."""
    k, k_n, mu = row
    if pressure < 0.0:
        return 0.0, 0.0, 0.0, x
    force, limit = k * (x - slider), mu * pressure
    if abs(force) <= limit:
        return force, k, 0.0, slider
    sign = 1.0 if force > 0.0 else -1.0
    return sign * limit, 0.0, -sign * mu * k_n, x - sign * limit / k


@numba.njit
def _add_outer(b, weights, factor, row, block):  # type: ignore[no-untyped-def]
    """Add one sample to a block."""
    for p in range(b.size):
        share = factor * weights[p] * b[p]
        for q in range(b.size):
            block[p, q] += share * row[q]


@numba.njit
def _tangent(x, pressure, row, basis, weights, rows, out):  # type: ignore[no-untyped-def]
    """March one spring two periods. Blocks of the last one are added up or, if there are no `weights`, its rows stored.

    The slider's derivatives change only where the contact slips or is open: nothing is carried while it sticks.
    """
    n, m = basis.shape
    force, by_x, by_n = out
    rows[:] = 0.0
    slider_x, slider_n, row_x, row_n = rows
    k, slider = row[0], 0.0
    for step in range(2 * n):
        i = step % n
        b = basis[i]
        f, slope_x, slope_n, slider = _spring(x[i], pressure[i], slider, row)
        if slope_x == 0.0:
            for p in range(m):
                slider_x[p] = b[p]
                slider_n[p] = -slope_n / k * b[p]
        if step < n:
            continue
        force[i] = f
        if weights.size == 0:
            for p in range(m):
                by_x[i, p] = slope_x * (b[p] - slider_x[p])
                by_n[i, p] = slope_n * b[p] - slope_x * slider_n[p]
        elif slope_x != 0.0:
            for p in range(m):
                row_x[p] = slope_x * (b[p] - slider_x[p])
                row_n[p] = -slope_x * slider_n[p]
            _add_outer(b, weights, 1.0, row_x, by_x)
            _add_outer(b, weights, 1.0, row_n, by_n)
        elif slope_n != 0.0:
            _add_outer(b, weights, slope_n, b, by_n)


@numba.njit
def _loop(gap, rows, basis, weights, force, blocks):  # type: ignore[no-untyped-def]
    """March all contacts; derivative blocks grow sample by sample."""
    n, m = basis.shape
    work, pressure = np.empty((4, m)), np.empty(n)
    blocks[:] = 0.0
    for c in range(gap.shape[0]):
        k_n, mu, preload = rows[c, 2], rows[c, 3], rows[c, 4]
        for i in range(n):
            pressure[i] = preload - k_n * gap[c, 2, i]
            force[c, 2, i] = -max(pressure[i], 0.0)
            if pressure[i] >= 0.0:
                _add_outer(basis[i], weights, k_n, basis[i], blocks[c, 2])
        for d in range(2):
            out = (force[c, d], blocks[c, d], blocks[c, 3 + d])
            _tangent(gap[c, d], pressure, (rows[c, d], k_n, mu), basis, weights, work, out)


@numba.njit
def _stored(gap, rows, basis, analysis, force, blocks):  # type: ignore[no-untyped-def]
    """March all contacts; derivative rows are stored, and BLAS makes blocks of them."""
    n, m = basis.shape
    work, pressure = np.empty((4, m)), np.empty(n)
    by_x, by_n = np.empty((n, m)), np.empty((n, m))
    nothing = np.empty(0)
    for c in range(gap.shape[0]):
        k_n, mu, preload = rows[c, 2], rows[c, 3], rows[c, 4]
        for i in range(n):
            pressure[i] = preload - k_n * gap[c, 2, i]
            force[c, 2, i] = -max(pressure[i], 0.0)
            slope = k_n if pressure[i] >= 0.0 else 0.0
            for p in range(m):
                by_x[i, p] = slope * basis[i, p]
        np.dot(analysis, by_x, blocks[c, 2])
        for d in range(2):
            out = (force[c, d], by_x, by_n)
            _tangent(gap[c, d], pressure, (rows[c, d], k_n, mu), basis, nothing, work, out)
            np.dot(analysis, by_x, blocks[c, d])
            np.dot(analysis, by_n, blocks[c, 3 + d])


def by_hand(case: Contacts, samples: int, blas: bool) -> Callable[[], Blocks]:
    """Return a march written for the elastic Coulomb law, with its tables made beforehand."""
    m, width = case.gap.shape
    basis = fourier((m - 1) // 2, samples)
    weights = np.full(m, 2.0 / samples)
    weights[0] = 1.0 / samples
    analysis = np.ascontiguousarray((basis * weights).T)
    rows = case.rows()

    def evaluate() -> Blocks:
        gap = np.ascontiguousarray((basis @ case.gap).T).reshape(-1, 3, samples)
        force = np.empty_like(gap)
        blocks = np.empty((width // 3, 5, m, m))
        if blas:
            _stored(gap, rows, basis, analysis, force, blocks)
        else:
            _loop(gap, rows, basis, weights, force, blocks)
        return analysis @ force.reshape(width, samples).T, blocks

    return evaluate


def by_numpy(case: Contacts, samples: int) -> Callable[[], Blocks]:
    """Return a march in NumPy: a loop over samples, each of which treats all contacts at once."""
    m, width = case.gap.shape
    basis = fourier((m - 1) // 2, samples)
    analysis = basis * (2.0 / samples)
    analysis[:, 0] *= 0.5
    k, k_n, mu, preload = case.rows()[:, :2], *case.rows().T[2:]

    def evaluate() -> Blocks:
        n = width // 3
        gap = (basis @ case.gap).reshape(samples, n, 3)
        pressure = preload - k_n * gap[:, :, 2]
        closed = pressure >= 0.0
        limit = mu * pressure
        slider = np.zeros((n, 2))
        slider_rows = np.zeros((n, 2, 2, m))  # by own displacement and by the normal gap
        force = np.empty((samples, n, 3))
        force[:, :, 2] = -np.where(closed, pressure, 0.0)
        rows = np.empty((samples, n, 2, 2, m))
        for step in range(2 * samples):
            i = step % samples
            x, b, is_closed = gap[i, :, :2], basis[i], closed[i, :, None]
            trial = k * (x - slider)
            slip = is_closed & (np.abs(trial) > limit[i, :, None])
            f = np.where(slip, np.sign(trial) * limit[i, :, None], np.where(is_closed, trial, 0.0))
            slope = np.where(slip, -np.sign(trial) * (mu * k_n)[:, None], 0.0)
            stick = np.where(is_closed & ~slip, k, 0.0)
            rows[i, :, :, 0] = stick[:, :, None] * (b - slider_rows[:, :, 0])
            rows[i, :, :, 1] = slope[:, :, None] * b - stick[:, :, None] * slider_rows[:, :, 1]
            moved = stick == 0.0
            slider = np.where(moved, x - f / k, slider)
            slider_rows[:, :, 0] = np.where(moved[:, :, None], b, slider_rows[:, :, 0])
            slider_rows[:, :, 1] = np.where(moved[:, :, None], -(slope / k)[:, :, None] * b, slider_rows[:, :, 1])
            force[i, :, :2] = f
        blocks = np.empty((n, 5, m, m))
        tangents = analysis.T @ rows.reshape(samples, -1)
        blocks[:, [[0, 3], [1, 4]]] = tangents.reshape(m, n, 2, 2, m).transpose(1, 2, 3, 0, 4)
        normal = (closed * k_n)[:, :, None] * basis[:, None, :]
        blocks[:, 2] = (analysis.T @ normal.reshape(samples, -1)).reshape(m, n, m).swapaxes(0, 1)
        return analysis.T @ force.reshape(samples, width), blocks

    return evaluate


# ---- records ------------------------------------------------------------------------------------------------------------


def evaluated(case: Contacts, samples: int, evaluator: str) -> Callable[[], Blocks]:
    """Return the evaluation as a user calls it."""
    compiled = case.compiled(evaluator)

    def evaluate() -> Blocks:
        period = contact_forces(case.gap, compiled, samples, history=False)
        return period.coefficients, period.blocks

    return evaluate


def medians(actions: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """CPU seconds of each action, the median of rounds in which they take turns; the first call compiles and is not timed.

    The fastest round would favour short actions on a busy machine: they fit between two disturbances.
    """
    for action in actions.values():
        action()
    seconds: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(rounds):
        for name, action in actions.items():
            began = process_time()
            action()
            seconds[name].append(process_time() - began)
    return {name: float(np.median(times)) for name, times in seconds.items()}


def ratios(order: int, samples: int, goals: dict[str, float]) -> list[dict[str, Any]]:
    """Time all evaluators on the same contacts, and compare their answers."""
    case = contacts(order)
    actions: dict[str, Callable[[], Any]] = {
        name: evaluated(case, samples, name) for name in ("march", "intervals", "events")
    }
    actions["loop"] = by_hand(case, samples, blas=False)
    actions["blas"] = by_hand(case, samples, blas=True)
    twin = by_numpy(case, samples)
    reference = actions["intervals"]()
    size = [np.max(np.abs(part)) for part in reference]
    off = max(
        float(np.max(np.abs(part - want)) / s)
        for found in (actions["march"](), actions["loop"](), actions["blas"](), twin())
        for part, want, s in zip(found, reference, size, strict=True)
    )
    seconds = medians(actions, ROUNDS)
    slow = medians({"numpy": twin, "march": actions["march"]}, NUMPY_ROUNDS)
    state = contact_forces(case.gap, case.compiled("intervals"), samples).state
    shares = ", ".join(f"{np.mean(state == s):.0%} {word}" for s, word in enumerate(("stuck", "slipping", "open")))
    where = f"{CONTACTS} contacts, H = {order}, {samples} samples, {shares}"
    took = ", ".join(f"{name} {1e3 * t:.2f}" for name, t in seconds.items())
    own = min(seconds["loop"], seconds["blas"])
    records = []
    for name, goal in goals.items():
        for rival, label in (("march", "march"), ("loop", "loop_by_hand"), ("blas", "blas_by_hand")):
            ratio = seconds[rival] / seconds[name]
            records.append(
                {
                    "name": f"evaluators/{label}_over_{name}_H{order}",
                    "value": ratio,
                    "goal": f">= {goal:g}" if rival != "blas" else "none",
                    "holds": rival == "blas" or ratio >= goal,
                    "note": f"CPU time of forces and blocks; {where}; ms: {took}",
                }
            )
    records += [
        {
            "name": f"evaluators/march_over_by_hand_H{order}",
            "value": seconds["march"] / own,
            "goal": "none",
            "holds": True,
            "note": "what generality costs: the march of any law over the faster march written for this one",
        },
        {
            "name": f"evaluators/numpy_over_march_H{order}",
            "value": slow["numpy"] / slow["march"],
            "goal": "none",
            "holds": True,
            "note": f"NumPy, vectorised over contacts: {1e3 * slow['numpy']:.0f} ms",
        },
        {
            "name": f"evaluators/difference_H{order}",
            "value": off,
            "goal": f"<= {EQUAL:g}",
            "holds": off <= EQUAL,
            "note": "of march, both marches by hand and NumPy from intervals; coefficients and blocks, of the largest entry",
        },
    ]
    return records


def convergence(order: int = 5) -> list[dict[str, Any]]:
    """Show at which order in the step of the samples the sampled evaluators approach the exact one.

    A contact that closes into stick takes its slider along from a sample instead of from the time of closing; that costs one order.
    """
    case = contacts(order)
    exact = evaluated(case, 8, "events")()
    states = contact_forces(case.gap, case.compiled("events"), 4096).state
    lifts = np.any(states == OPEN, axis=(1, 2))
    errors = np.array([_errors(case, n, exact, chosen) for n in SAMPLES for chosen in (~lifts, lifts)])
    slopes = -np.polyfit(np.log(SAMPLES), np.log(errors.reshape(len(SAMPLES), 4)), 1)[0]
    records = []
    for j, (what, wanted) in enumerate(
        (("forces", 2), ("blocks", 1), ("forces_with_lift_off", 1), ("blocks_with_lift_off", 0))
    ):
        listed = ", ".join(f"{e:.1e}" for e in errors.reshape(len(SAMPLES), 4)[:, j])
        records.append(
            {
                "name": f"evaluators/order_of_{what}",
                "value": float(slopes[j]),
                "goal": f"{wanted} +- 0.25",
                "holds": bool(abs(slopes[j] - wanted) <= 0.25),
                "note": f"{np.count_nonzero(lifts if j > 1 else ~lifts)} contacts, H = {order}; root mean square distance of intervals from "
                f"events with {list(SAMPLES)} samples, as a share: {listed}",
            }
        )
    return records


def _errors(case: Contacts, samples: int, exact: Blocks, chosen: Any) -> list[float]:
    """Return the relative root mean square distance of coefficients and blocks of some contacts from `exact`."""
    coefficients, blocks = evaluated(case, samples, "intervals")()
    directions = np.repeat(chosen, 3)
    pairs = ((coefficients[:, directions], exact[0][:, directions]), (blocks[chosen], exact[1][chosen]))
    return [float(np.linalg.norm(found - want) / np.linalg.norm(want)) for found, want in pairs]


def run() -> list[dict[str, Any]]:
    """Compare the evaluators in time and answer, and show how sampled ones approach the exact one."""
    records: list[dict[str, Any]] = []
    for order, samples, by_intervals, by_events in CASES:
        records += ratios(order, samples, {"intervals": by_intervals, "events": by_events})
    return records + convergence()

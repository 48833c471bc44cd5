"""Estimated cost of a case."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.assembly.forces import output_labels
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import kept_whole
from stickslip.harmonic.harmonic_set import named
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.model.part import Part
from stickslip.response.forced.response import Sweep
from stickslip.solve.linear import MAX_ARRAY_UNKNOWNS
from stickslip.study.file.model.loads import Limits
from stickslip.study.models.cost import SECONDS_A_NODE, above, memory_gb

POINTS = 1.7  # points of a branch for each requested point: more are taken where the response turns
# repeats and failed attempts included: 1 to 19 in a case of the two blades, 6 over all its cases, 11 for four masses
NEWTON_A_POINT = 6
FACTORISED = 500  # unknowns above which the time of a Newton step no longer grows with their cube
AT_THE_CAP = 0.1  # share of points that "auto" solves with the highest harmonics allowed
SOME = 15  # harmonics that most points with slip are content with
REPEATED = 0.6  # share of points that a strategy solves with many harmonics
FEWEST_A_POINT = 2  # Newton steps if hardly a contact slips: two wheels took 1.6 to 3
SECONDS_A_STEP = 1.5e-3  # of a Newton step, even with few unknowns
# if hardly a contact slips, a step takes 10 ms with 190 to 300 unknowns, 12 to 30 ms with 440 to 570, 20 ms with 1900
SECONDS_AN_UNKNOWN = 3e-5
# without condensation: 32 µs with 2000 contacts, 27 with 5000, with a new factorisation; 13 with a reused one in gross slip
SECONDS_A_WHOLE_UNKNOWN = 4e-5
BYTES_A_WHOLE_UNKNOWN = 2.5e3  # the sparse factor and the vectors of the Krylov method, 1000 to 5000 contacts, H = 5
SECONDS_OF_DOUBTS = (
    120.0  # estimated seconds, from counted steps, of integrating motions beside the peak in time; the bound of a case
)
FLOPS = 2e9  # of a Newton step: a small dense factorisation on one core, and the contacts


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of a case.

    Parameters
    ----------
    nodes
        Number of nodes of all parts.
    unknowns
        Number of unknowns with all harmonics.
    memory_gb
        Largest memory, GB.
    newton_steps
        Largest number of Newton steps over all points.
    model_seconds
        Time on one core to mesh and reduce the parts and find their frequencies, s; cases with the same parts share it.
    least_seconds, most_seconds
        Time on one core to solve the response, s. Least: contacts hardly slip, and the fewest harmonics suffice at every point. Most:
        contacts slip at every point, and the largest plausible number of points needs all harmonics. Stability, audits and time
        integration are not counted.
    most
        Assumption on harmonics behind `most_seconds`, in words; empty if their number is fixed.
    some_seconds
        Time on one core if the points that need many harmonics need `SOME` only, s.
    slips
        Largest tangential force of a contact over its limit at the resonance with stuck contacts; NaN if unknown.
    """

    nodes: int
    unknowns: int
    memory_gb: float
    newton_steps: int
    model_seconds: float
    least_seconds: float
    most_seconds: float
    most: str = ""
    some_seconds: float = 0.0
    slips: float = float("nan")

    @property
    def likely_seconds(self) -> float:
        """Time to solve the case: the least where contacts stick at the resonance, else with `SOME` harmonics, s."""
        return self.least_seconds if self.slips < 1.0 else self.some_seconds

    @property
    def upper_seconds(self) -> float:
        """Upper bound: three times the least where contacts stick at the resonance, else `most_seconds`, s."""
        few = NEWTON_A_POINT / FEWEST_A_POINT * self.least_seconds
        return min(few, self.most_seconds) if self.slips < 1.0 else self.most_seconds

    @property
    def _some(self) -> str:
        return f", here H = {SOME}" if self.some_seconds < self.most_seconds else ""

    @property
    def seconds(self) -> float:
        """Time compared with ``limits.work_s``: model and largest time of the response, s."""
        return self.model_seconds + self.most_seconds

    @property
    def lines(self) -> tuple[str, ...]:
        """The estimate in sentences, one a line."""
        likely, upper = map(lasting, (self.likely_seconds, self.upper_seconds))
        harmonics = self.most and not self.slips < 1.0
        return (
            f"estimate: about {self.model_seconds:.0f} s for the parts, once, then {likely} to solve this case, at most {upper}",
            f"estimate: {_of_slip(self.slips)}",
            *[f"estimate: harmonics are uncertain{self._some}, at most {self.most}"] * bool(harmonics),
            f"estimate: at most {self.newton_steps} Newton steps, {self.unknowns} unknowns, {self.memory_gb:.1f} GB of memory",
            f"estimate: stability, audits and time integration come on top; doubted points take up to {SECONDS_OF_DOUBTS:.0f} s a case",
            f"estimate: limits.work_s is compared with {self.seconds:.0f} s",
        )


GROSS_SLIP = 10  # times the limit of friction, above which the number says no more


def lasting(seconds: float) -> str:
    """Return a time in words, short ones with one digit."""
    return (
        f"{seconds / 60:.0f} min" if seconds >= 120.0 else f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.1g} s"
    )


def _of_slip(ratio: float) -> str:
    """Describe contacts at the resonance, which decide the cost."""
    if ratio < 1.0:
        return f"contacts stick at the resonance (friction forces up to {100 * ratio:.2g} % of their limit)"
    if ratio >= 1.0:
        size = f"{ratio:.2g}" if ratio < GROSS_SLIP else f"more than {GROSS_SLIP}"
        return f"contacts slip at the resonance (stuck, a friction force would be {size} times its limit)"
    return "whether contacts slip is not known without a resonance in the range"


def estimate(model: Model, sweep: Sweep) -> Estimate:
    """Estimate memory and time for the response of a model before assembly, when the number of slipping points is still unknown."""
    sectors = 1 if model.mistuning is None else model.sectors
    whole = kept_whole(model)
    nodes, coordinates = nodes_of(model), whole or sectors * retained_of(model)
    low, high = ((2 * len(own) - 1) * coordinates for own in (sweep.low_harmonics, sweep.high_harmonics))
    grid = sweep.grid.size or (sweep.points if sweep.single else POINTS * sweep.points)
    points = grid + sweep.peak_points
    kept = always_kept(sweep.strategy)
    some = AT_THE_CAP if sweep.auto else REPEATED
    share_high = {"low": 0.0, "high": 1.0}.get(kept or "", some)
    # each strategy evaluates the balance with all harmonics about once a point
    judged = 0 if kept else points * some if sweep.auto else points
    steps_high = points * share_high * NEWTON_A_POINT
    steps_low = 0 if kept == "high" else points * NEWTON_A_POINT
    of_low, of_high = (
        (SECONDS_A_WHOLE_UNKNOWN * n if whole else _flops(n) / FLOPS) + SECONDS_A_STEP for n in (low, high)
    )
    most_seconds = steps_low * of_low + (steps_high + judged) * of_high
    # strategies without a budget evaluate the balance with all harmonics at every point
    easy_low, easy_high = (SECONDS_AN_UNKNOWN * n + SECONDS_A_STEP for n in (low, high))
    easy = FEWEST_A_POINT * points * (easy_high if kept == "high" else easy_low)
    least_seconds = min(easy + (0 if sweep.auto else judged * easy_high), most_seconds)
    harmonics = f"H = {named(sweep.high_harmonics)} at {100 * share_high:.0f} % of {points:.0f} points"
    each = 1 if whole else 10  # numbers a harmonic and coordinate: contacts are few among all dofs
    stored = points * (sweep.high_harmonics[-1] + 1) * each * coordinates * 16 / 1e9
    solving = BYTES_A_WHOLE_UNKNOWN * high if whole else 8 * _numbers(sectors, coordinates, high)
    memory = memory_gb(nodes) + stored + solving / 1e9
    return Estimate(
        nodes=nodes,
        unknowns=high,
        memory_gb=memory,
        newton_steps=round(steps_low + steps_high),
        model_seconds=nodes * SECONDS_A_NODE * (sectors // 2 + 1),
        least_seconds=least_seconds,
        most_seconds=most_seconds,
        most="" if kept else harmonics,
        some_seconds=_with_some(model, sweep, most_seconds),
    )


def _with_some(model: Model, sweep: Sweep, most: float) -> float:
    """Return the largest time with `SOME` harmonics at the points that need many, s; `most` if no more are allowed."""
    if not sweep.auto or sweep.high_harmonics[-1] <= SOME or sweep.low_harmonics[-1] > SOME:
        return most
    return estimate(model, replace(sweep, cap=SOME)).most_seconds


def _numbers(sectors: int, coordinates: int, unknowns: int) -> int:
    """Return the number of values that a Newton step stores at once."""
    if sectors > 1:  # a factor of each harmonic and the wheel's matrices
        return 12 * (unknowns + 4 * coordinates) * coordinates
    if unknowns <= MAX_ARRAY_UNKNOWNS:  # an array of all harmonics together, and its factors
        return 6 * unknowns**2
    # the structure's matrices and a factor of each harmonic at most; 2.1 GB with 1000 contacts and H = 5, reduction included
    return 8 * coordinates**2 + unknowns * coordinates


def within_limits(model: Model, sweep: Sweep, limits: Limits) -> Sweep:
    """Return the sweep with the cap of ``auto`` lowered to the study's limits, but not below its second level; `check_limits` refuses the rest."""
    if not sweep.auto:
        return sweep
    for support in reversed(sweep.supports[1:] or sweep.supports):
        capped = replace(sweep, cap=support[-1])
        cost = estimate(model, capped)
        if above(limits, "", cost.memory_gb, cost.seconds) is None:
            return capped
    return capped


def _flops(unknowns: int) -> int:
    """Return the operations of a Newton step; large systems are solved by a Krylov method, harmonic by harmonic."""
    return 4 * unknowns * min(unknowns, FACTORISED) ** 2


def check_limits(limits: Limits, cost: Estimate) -> None:
    """Refuse a case whose estimate exceeds the study's limits.

    Raises
    ------
    InputError
        Naming the limit.
    """
    what = (
        f"a case of the forced response ({cost.nodes} nodes, {cost.unknowns} unknowns, {cost.newton_steps} Newton steps) is "
        "estimated"
    )
    refusal = above(limits, what, cost.memory_gb, cost.seconds)
    if refusal is not None:
        raise refusal


def nodes_of(model: Model) -> int:
    """Return the number of nodes of all reduced parts; copies share the reduction of their original."""
    return sum(_nodes(part) for part in model.parts.values() if part.template is None)


def retained_of(model: Model) -> int:
    """Return the number of retained coordinates: free rigid bodies, and contact dofs or contact motions if these are fewer.

    Without contacts the outputs are retained.
    """
    if not model.pairs.names:
        return int(output_labels(model.places, model.outputs, model.loads).dofs.size)
    bodies = np.zeros(model.places.n, dtype=bool)
    bodies[model.places.bodies()] = True
    both = scipy.sparse.hstack([model.pairs.own, model.pairs.following], format="csr")
    both = both @ scipy.sparse.diags_array(np.tile(~bodies, 2).astype(float))
    both.eliminate_zeros()
    dofs = np.unique(both.indices % model.places.n).size
    return int(bodies.sum()) + min(dofs, int(np.count_nonzero(np.diff(both.indptr))))


def _nodes(part: Part) -> int:
    return len(part.mesh.points) if part.mesh is not None else -(-part.structure.n // 3)

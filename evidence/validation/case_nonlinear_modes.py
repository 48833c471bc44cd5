"""B4, B10 and B13: nonlinear modes of one mass on a friction spring and of a beam that rubs, at the printed amplitudes.

The printed modal amplitude is that of the first harmonic with the whole mass; it is met by the secant method on the amplitude that is followed.
Where the source sums samples of a period it does not say when the period begins, on which its digits depend: 4e-4 of the damping ratio just
beyond the onset of slip. Its numbers have to lie among ours for beginnings spread over one sample.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from evidence.models.lumped import griffin
from evidence.validation import case_b13_flutter
from evidence.validation.compare import Record, bound, digits
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.bordered import PeriodicProblem
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import modal_damping
from stickslip.model.fe.beam import Beam, beam
from stickslip.model.fe.solid import Material
from stickslip.model.modes import normal_modes, with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.response.continuation.branch import Followed, Judged
from stickslip.response.nonlinear_modes.backbone import ModePoint, mode_point
from stickslip.response.nonlinear_modes.harmonic_levels import ModeCurve, Phase, by_energy
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.self_excited.problem import self_excited_motions
from stickslip.response.system import System
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Newton
from stickslip.units import HZ

EXACT = Newton(tolerance=1e-12)
B4, B10, B13 = (f"literature benchmark B{n}" for n in (4, 10, 13))
ONE_MASS = (  # A / xc, then w and zeta at one harmonic, at 21, and the third one over xc
    (1.0, "1.2247448714", "0.0081649658", "1.2247448714", "0.0081649658", "0"),
    (1.25, "1.1953287226", "0.0440106353", "1.19575580", "0.04348765", "0.003673"),
    (2.0, "1.1180339887", "0.0726062491", "1.11842485", "0.07252442", "0.010590"),
    (3.0, "1.0704651806", "0.0710711995", "1.07043262", "0.07131654", "0.015420"),
    (5.0, "1.0349827269", "0.0572068935", "1.03475210", "0.05744283", "0.019794"),
    (10.0, "1.0129274454", "0.0377936963", "1.01277361", "0.03788073", "0.023251"),
)
RUBBING = (  # log10 a, then f, zeta and the tip, 7 harmonics and 256 samples
    (-4.8, "80.367800", "0.010000", None),
    (-4.7, "80.142848", "0.01928928", "1.004820e-5"),
    (-4.5, "76.055449", "0.05773276", "1.576369e-5"),
    (-4.3, "72.414370", "0.06465032", "2.476583e-5"),
    (-4.1, "70.364147", "0.05460820", "3.906393e-5"),
    (-3.9, "69.258413", "0.04269223", "6.175534e-5"),
    (-3.5, "68.290043", "0.02601120", "1.547815e-4"),
    (-3.1, "68.041358", "0.01778795", "3.885744e-4"),
)
MANY = (  # 21 harmonics, 2048 samples
    (-4.7, "80.145249", "0.01916806", None),
    (-4.3, "72.400737", "0.06482954", None),
    (-3.5, "68.289095", "0.02601847", None),
)
WHOLE = ((-4.3, "72.414233", "0.06464752", None), (-3.5, "68.290028", "0.02600955", None))
LINEAR = (  # reduced or whole, stuck or free, Hz
    (False, False, ("67.960197", "425.902892", "1192.610574")),
    (False, True, ("80.367484", "452.784717", "1204.175376")),
    (True, False, ("67.960454", "426.628855")),
    (True, True, ("80.367800", "453.633122", "1228.571934")),
)
BEGINNINGS = 32  # of the period, spread over one sample
RUBS, K_T, LIMIT = 4, 1e7, 15.0  # deflection of node 6 among those beyond the clamped one


class _Begun(ModeCurve):
    """A mode whose periods begin later, by an angle."""

    angle = 0.0

    @cached_property
    def equations(self) -> tuple[PeriodicProblem, ...]:
        """The equation of each level."""
        conditions = (by_energy(p) for p in self.problems)
        later = ((size, Phase(np.exp(1j * self.angle) * phase.row)) for size, phase in conditions)
        return tuple(p.over_amplitude(held=c) for p, c in zip(self.problems, later, strict=True))


def at_modal_amplitudes(
    system: System, mode: StuckMode, dof: int, how: Discretisation, wanted: list[float], angle: float = 0.0
) -> list[ModePoint]:
    """Return the motions of growing modal amplitudes, kg^0.5 m, whose period begins by an `angle` later."""
    problem = self_excited_motions(system, HarmonicLoad(np.zeros(system.structure.n)), mode, dof, how)
    curve = _Begun.of(problem, (1.0, 2.0), 1)
    object.__setattr__(curve, "angle", angle)
    share, near, found = float(np.log(abs(mode.shape[dof]))), [], []
    for a in wanted:
        p, shift = np.log(a) + share, 0.0
        for _ in range(30):
            solution = curve.fresh(0, p + shift, near, effort=1.0)
            at = Followed("point", 0, 0, Point(solution.x, p + shift, np.zeros(0), 0.0, solution, 0.0), Judged(), 0.0)
            made = mode_point(curve, at)
            off = float(np.log(made.modal_amplitude / a))
            shift, near = shift - off, [at]
            if abs(off) < 1e-12:
                break
        found.append(made)
    return found


def one_mass() -> list[Record]:
    """Compare the table of B4."""
    system, _ = griffin(0.1)
    mode = stuck_modes(system, 1)[0]
    records = []
    for order, columns in ((1, (1, 2)), (21, (3, 4, 5))):
        how = Discretisation(order=order, newton=EXACT)
        if order > 1:
            how = replace(how, samples=4096, evaluator="intervals")
        for row in ONE_MASS:
            found = at_modal_amplitudes(system, mode, 0, how, [0.2 * row[0]])[0]
            ours = [found.omega, found.ratio]
            if order > 1:
                ours.append(float(abs(found.coefficients[3, 0])) / 0.2)
            names = ("w", "zeta", "third harmonic")
            records += [
                digits("B4 one mass", f"A = {row[0]:g} xc, H = {order}: {name}", own, str(row[c]), B4)
                for name, own, c in zip(names, ours, columns, strict=False)
            ]
    return records


def without_damping() -> list[Record]:
    """Compare B13: at the printed amplitudes of its limit cycles the mode has no damping, and the printed frequency."""
    records = []
    for rows, how in (
        (case_b13_flutter.ONE, case_b13_flutter.PLAIN),
        (case_b13_flutter.MANY, case_b13_flutter.SAMPLED),
    ):
        for c, *printed in rows:
            system, _ = case_b13_flutter.oscillator(c)
            mode = stuck_modes(system, 1)[0]
            for amplitude, omega in (printed[:2], printed[2:]):
                found = at_modal_amplitudes(system, mode, 0, how, [float(amplitude)])[0]
                place = f"c = {c:g}, A = {amplitude}, H = {how.order}"
                records.append(digits("B13 mode", f"{place}: w", found.omega, omega, B13))
                # half a unit of the last digit of the amplitude, over which the damping ratio changes by less than 0.3 a unit of ln A
                off = 0.5 * 10.0 ** -len(amplitude.partition(".")[2]) / float(amplitude)
                records.append(bound("B13 mode", f"{place}: damping ratio", found.ratio, off, B13))
    return records


def rubbing_beam(*, reduced: bool) -> tuple[System, np.ndarray]:
    """Return the beam of B10 with its friction spring, and the row that makes the tip's deflection of its coordinates."""
    section = Beam(
        length=0.71,
        area=0.05 * 0.06,
        second_moment=0.06 * 0.05**3 / 12.0,
        material=Material(young_modulus=0.6725 * 210e9),
    )
    whole = beam(section, 14)
    at, tip = whole.sets["deflection"][RUBS], whole.sets["tip"][0]
    own: Structure = craig_bampton(whole, np.array([at]), 3) if reduced else whole
    rows = np.eye(whole.n)[[at, tip]]
    if reduced:
        assert own.basis is not None
        rows = np.asarray(own.basis)[[at, tip]]
    gap = np.zeros((3, own.n))
    gap[0] = rows[0]
    contact = Interface(("rub",), (Jenkins(k_t=K_T, limit=LIMIT),), gap)
    stuck = with_springs(own, contact.gap_operator, contact.stuck_stiffness())
    own = replace(own, damping=modal_damping(stuck, 0.01).damping)
    return System(own, contact, np.array([0 if reduced else tip])), rows[1]


def rub(order: int, samples: int, rows: tuple[tuple, ...], *, reduced: bool) -> list[Record]:  # type: ignore[type-arg]
    """Compare rows of B10 with the range of our numbers over the beginnings of the period."""
    system, tip = rubbing_beam(reduced=reduced)
    how = Discretisation(order=order, samples=samples, evaluator="intervals", newton=EXACT)
    mode, dof = stuck_modes(system, 1)[0], int(system.outputs[0])
    wanted = [10.0 ** row[0] for row in rows]
    made = [
        at_modal_amplitudes(system, mode, dof, how, wanted, 2.0 * np.pi / samples * share)
        for share in np.arange(BEGINNINGS) / BEGINNINGS
    ]
    model = "reduced" if reduced else "28 dofs"
    records = []
    for each, (log, *printed) in zip(zip(*made, strict=True), rows, strict=True):
        place = f"log10 a = {log:g}, H = {order}, {model}"
        ours = np.array([[p.omega / HZ, p.ratio, abs(tip @ p.coefficients[1])] for p in each])
        for name, own, theirs in zip(("Hz", "zeta", "tip"), ours.T, printed, strict=True):
            if theirs is not None:
                nearest = float(np.clip(float(theirs), own.min(), own.max()))
                records.append(digits("B10 beam", f"{place}: {name}", nearest, theirs, B10))
                spread = float(np.ptp(own)) / float(theirs)
                records.append(bound("B10 beam", f"{place}: {name}, spread of ours", spread, 1e-3, B10))
    return records


def linear() -> list[Record]:
    """Compare the frequencies of B10."""
    records = []
    for reduced, stuck, printed in LINEAR:
        system, _ = rubbing_beam(reduced=reduced)
        own = system.stuck_structure() if stuck else system.plain_structure
        found = np.sqrt(normal_modes(own, len(printed)).squares) / HZ
        names = f"{'reduced' if reduced else '28 dofs'}, {'stuck' if stuck else 'free'}"
        records += [
            digits("B10 beam", f"{names}: mode {i + 1}, Hz", float(one), theirs, B10)
            for i, (one, theirs) in enumerate(zip(found, printed, strict=True))
        ]
    return records


def run() -> list[Record]:
    """Compare both tables."""
    return [
        *one_mass(),
        *without_damping(),
        *linear(),
        *rub(7, 256, RUBBING, reduced=True),
        *rub(21, 2048, MANY, reduced=True),
        *rub(7, 256, WHOLE, reduced=False),
    ]

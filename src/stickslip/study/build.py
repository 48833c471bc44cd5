"""From a study to a model that can be solved: mesh, reduction, damper, contacts, loads."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.mesh.blade_mesh import check_on_undersides
from stickslip.model.rigid.damper import ContactPoints, FlatCurvedDamper
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import preload
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.study.assembly import join_damper
from stickslip.study.blades import ReducedBlades, reduced_blades
from stickslip.study.error_places import AXES, OUTPUT_LABELS, dofs_of, error_labels
from stickslip.study.estimate import check_limits, estimate
from stickslip.study.journal import Journal
from stickslip.study.schema import Study, StudyTables


@dataclass(frozen=True, eq=False)
class Case:
    """A study as a model.

    Parameters
    ----------
    blades
        The reduced blade pair, and how well it stands for the full one.
    system, bare_system
        Blades, damper and contacts, with and without the retention.
    contacts
        Where the contact points are.
    sweep
        How the response is computed.
    ratios
        F_CL/F_HE of each load case.
    centrifugal
        Static load on the damper, N.
    retention
        Stiffness that holds the damper's mean position, N/m.
    force_dof
        Where the harmonic force acts.
    output_labels
        Names of the outputs.
    error_labels
        Names of the dofs over which the error of missing harmonics is taken.
    law_names
        Name of the law of each contact.
    static_gap, static_force
        (n_contacts, 3) gaps (m) and forces (N) under the centrifugal load alone.
    """

    blades: ReducedBlades
    system: System
    bare_system: System
    contacts: ContactPoints
    sweep: Sweep
    ratios: tuple[float, ...]
    centrifugal: float
    retention: float
    force_dof: int
    output_labels: tuple[str, ...]
    error_labels: tuple[str, ...]
    law_names: tuple[str, ...]
    static_gap: FloatArray
    static_force: FloatArray
    report_output: int = 0  # the first output is the one whose peak the solver resolves

    def with_retention(self, stiffness: float) -> System:
        """Return the system with another retention stiffness, N/m."""
        return self.bare_system.with_retention(stiffness)

    def load(self, ratio: float) -> HarmonicLoad:
        """Return the loads of the load case with F_CL/F_HE = `ratio`."""
        n = self.system.structure.n
        force = np.zeros(n, dtype=complex)
        force[self.force_dof] = self.centrifugal / ratio
        return HarmonicLoad(static_load(self.system, self.centrifugal), {1: force})


def case_of(study: Study, journal: Journal | None, say: Callable[[str], None]) -> Case:
    """Build the model of a study; the reduced blades are kept in the journal.

    Parameters
    ----------
    study
        The study.
    journal
        Where the reduced blades of an earlier start are found and kept; None: built anew and kept nowhere.
    say
        Takes a line of progress.

    Raises
    ------
    InputError
        If the parts do not fit together, or the estimated cost exceeds the study's limits.
    SingularError
        If the centrifugal load does not press the damper into an equilibrium.
    """
    damper = _checked_damper(study)
    try:
        blades = reduced_blades(study, damper, journal, say)
    except InputError as error:
        raise _of_the_parts(study, error) from None
    return make_case(study.tables, blades, damper)


def check_before_meshing(study: Study) -> None:
    """Refuse whatever can be refused without a mesh, before the results folder is touched.

    Raises
    ------
    InputError
        If damper and blades do not fit, labels or the sweep are wrong, or the estimated cost exceeds the study's limits.
    """
    _checked_damper(study)
    try:
        sweep_of(study.tables)
    except InputError as error:
        raise error.inside(str(study.path)) from None
    check_limits(study, estimate(study, round(study.tables.blades.nodes())))


def _checked_damper(study: Study) -> FlatCurvedDamper:
    """Return the damper of a study whose labels are known."""
    try:
        geometry = study.tables.blades.library()
        damper = study.tables.damper.library(geometry)
        check_on_undersides(geometry, damper.contact_points())
    except InputError as error:
        raise _of_the_parts(study, error) from None
    try:
        error_labels(study.tables, damper.contact_points())
    except InputError as error:
        raise error.inside(str(study.path)) from None
    return damper


def _of_the_parts(study: Study, error: InputError) -> InputError:
    """Return a complaint about blades and damper that names the study."""
    if str(study.path) in error.place:
        return error
    return error.inside(f"{study.path}: [blades] with [damper]")


def make_case(tables: StudyTables, blades: ReducedBlades, damper: FlatCurvedDamper) -> Case:
    """Join reduced blades and damper, and place the damper under its static load."""
    contacts = damper.contact_points()
    system, labels = system_of(tables, blades.structure, damper)
    held = system.with_retention(tables.retention.stiffness_n_per_m)
    displacement = preload(held, static_load(held, tables.loads.centrifugal_n))
    gap = (system.interface.gap_operator[:, held.retained] @ displacement).reshape(-1, 3)
    axis = AXES.index(tables.loads.excitation_direction)
    return Case(
        blades=blades,
        system=held,
        bare_system=system,
        contacts=contacts,
        sweep=sweep_of(tables),
        ratios=tuple(tables.loads.ratios),
        centrifugal=tables.loads.centrifugal_n,
        retention=tables.retention.stiffness_n_per_m,
        force_dof=int(system.plain_structure.dof_set("blades.force")[axis]),
        output_labels=labels,
        error_labels=error_labels(tables, contacts),
        law_names=tuple(tables.contact.of_side(side).law for side in contacts.side),
        static_gap=gap,
        static_force=static_contact_force(system.interface, gap),
    )


def sweep_of(tables: StudyTables) -> Sweep:
    """Return the sweep of a study."""
    lowest, highest = (2 * np.pi * f for f in tables.sweep.frequency_hz)
    h = tables.harmonics
    return Sweep(
        omega_range=(lowest, highest),
        low=h.low,
        high=h.high,
        samples=h.samples,
        evaluator=tables.solver.evaluator,
        threshold=h.alert_threshold_percent / 100,
        selection=h.chooser,
        passages=h.passages,
        error_harmonics=h.alert_harmonics,
        points=tables.sweep.points,
        frequencies=tables.sweep.frequencies or 0,
        peak_points=tables.sweep.peak_points,
    )


def system_of(
    tables: StudyTables, blades: Structure, damper: FlatCurvedDamper
) -> tuple[System, tuple[str, ...]]:
    """Return the system of blades and damper, without retention, and the labels of its outputs."""
    joined, interface = join_damper(tables, blades, damper)
    outputs = joined.dof_set("blades.output")
    points = damper.contact_points()
    over = dofs_of(joined, points, error_labels(tables, points))
    system = System(joined, interface, outputs, alert_dofs=over, free=joined.dof_set("damper"))
    return system, OUTPUT_LABELS


def static_load(system: System, centrifugal: float) -> FloatArray:
    """Return the (n,) static forces: the centrifugal load on the damper, outward (+z)."""
    force = np.zeros(system.structure.n)
    force[system.plain_structure.dof_set("damper")[2]] = centrifugal
    return force


def static_contact_force(interface: Interface, gap: FloatArray) -> FloatArray:
    """Return the (n_contacts, 3) forces t, w, n of contacts loaded once from rest to `gap`."""
    coefficients = gap.reshape(1, -1)
    return contact_forces(coefficients, interface.compiled(), samples=1).force[:, :, 0]

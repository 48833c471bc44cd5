"""stickslip: vibration of bladed disks coupled by friction joints.

The public names below can be imported from here; their modules are loaded when a name is first used (PEP 562), so
that ``import stickslip`` loads neither numba nor a mesher, and ``stickslip --help`` answers at once.
"""

import importlib
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from stickslip.contact.compiled import compile_contacts
    from stickslip.contact.interface import Interface
    from stickslip.contact.law import law_kernel
    from stickslip.contact.law_check import check_law
    from stickslip.contact.laws.bonded import Bonded
    from stickslip.contact.laws.bouc_wen import BoucWen
    from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
    from stickslip.contact.laws.cubic_spring import CubicSpring
    from stickslip.contact.laws.dahl import Dahl
    from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
    from stickslip.contact.laws.iwan import Iwan
    from stickslip.contact.laws.iwan_populations import FirstLoading, FourParameter, UniformBand
    from stickslip.contact.laws.jenkins import Jenkins
    from stickslip.contact.laws.polynomial_spring import PolynomialSpring
    from stickslip.contact.laws.regularised_coulomb import RegularisedCoulomb
    from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
    from stickslip.contact.laws.unilateral_spring import UnilateralSpring
    from stickslip.contact.neighbours import neighbour_gaps, neighbour_interface
    from stickslip.contact.pairing import (
        Pairing,
        node_to_node,
        node_to_segment,
        paired_interface,
        segment_to_segment,
    )
    from stickslip.contact.surface import Surface, nodal_surface, rigid_surface, structure_surface
    from stickslip.errors import InputError, SingularError, StickslipError
    from stickslip.harmonic.aft import contact_forces
    from stickslip.harmonic.balance import harmonic_balance
    from stickslip.harmonic.compliance import ComplianceForm
    from stickslip.harmonic.dlft import dynamic_lagrangian
    from stickslip.harmonic.dynamic_stiffness import condense
    from stickslip.harmonic.excitation import HarmonicLoad
    from stickslip.harmonic.selection.goal_oriented import GoalOriented
    from stickslip.harmonic.selection.grolet import Grolet
    from stickslip.harmonic.selection.guarded_alert import GuardedAlert
    from stickslip.harmonic.selection.jacobian_alert import JacobianAlert
    from stickslip.harmonic.selection.jaumouille import Jaumouille
    from stickslip.harmonic.selection.laxalde import Laxalde
    from stickslip.harmonic.selection.maple import Maple
    from stickslip.harmonic.selection.similarity import (
        JacobianSimilarity,
        harmonic_block_norms,
        jacobian_similarity,
    )
    from stickslip.harmonic.selection.strategy import ErrorMeasure, Step, Strategy, Verdict
    from stickslip.harmonic.selection.suess_jacobian import SuessJacobian
    from stickslip.harmonic.selection.suess_spectral import SuessSpectral
    from stickslip.model.annulus import annular_sector
    from stickslip.model.axis import Axis
    from stickslip.model.damping import modal_damping, rayleigh_damping, structural_damping
    from stickslip.model.deck import CalculixRun, write_deck
    from stickslip.model.dofs import Dofs
    from stickslip.model.fe.beam import Beam, beam, rotating_beam
    from stickslip.model.fe.elements import Quadrature
    from stickslip.model.fe.rotation import RotatingSolid, SpeedPolynomial, rotating_solid
    from stickslip.model.fe.solid import Material, assemble_solid
    from stickslip.model.gyroscopic import GyroscopicModes, gyroscopic_modes
    from stickslip.model.matrices import chain, lumped
    from stickslip.model.mesh.blade_mesh import mesh_blade_pair
    from stickslip.model.mesh.blade_pair import BladePair
    from stickslip.model.mesh.sector import BladedSector
    from stickslip.model.mesh.sector_mesh import mesh_sector
    from stickslip.model.mesh.sector_parts import Airfoil, DiskProfile, Platform, Shroud
    from stickslip.model.mesh.solid_mesh import SolidMesh, write_mesh
    from stickslip.model.modes import Modes, natural_frequencies, normal_modes, with_springs
    from stickslip.model.readers.abaqus import read_abaqus_matrices
    from stickslip.model.readers.ansys import read_ansys_full
    from stickslip.model.readers.ansys_archive import read_ansys_archive, read_ansys_materials
    from stickslip.model.readers.ansys_results import AnsysResults, read_ansys_results
    from stickslip.model.readers.calculix import read_calculix_matrices
    from stickslip.model.readers.calculix_deck import Deck, assemble_deck, read_deck
    from stickslip.model.readers.frd import FrdResults, NodalField, read_frd
    from stickslip.model.readers.matrix_files import read_matrix_files
    from stickslip.model.readers.nastran import NastranResults, read_nastran_op2, read_nastran_op4
    from stickslip.model.readers.nastran_dmig import read_nastran_dmig
    from stickslip.model.readers.open_model import model_summary, read_model
    from stickslip.model.readers.summary import ModelSummary
    from stickslip.model.readers.units import Units
    from stickslip.model.rigid.body import RigidBody
    from stickslip.model.rigid.damper import ContactPoints, FlatCurvedDamper, gap_operator
    from stickslip.model.structure import Structure, join
    from stickslip.model.structure_file import load_structure, save_structure
    from stickslip.reduction.cache import cached
    from stickslip.reduction.cyclic import CyclicSector, cyclic_sector, travelling_wave
    from stickslip.reduction.fixed_interface import craig_bampton
    from stickslip.reduction.free_interface import rubin
    from stickslip.reduction.full_wheel import wheel, wheel_shape
    from stickslip.reduction.interface_modes import reduce_interface
    from stickslip.reduction.lumped_disks import blade_ring, blisk_with_ring, mistuned_blade_ring
    from stickslip.reduction.relative import in_relative_coordinates
    from stickslip.reduction.truncation import (
        FrequencyError,
        FrequencyErrors,
        ModesBelow,
        frequency_errors,
    )
    from stickslip.reduction.tuned import TunedWheel, tuned_wheel
    from stickslip.reduction.waves import Wave, excited_wave, to_sectors, to_waves, wave
    from stickslip.reduction.whole_wheel import ReducedWheel, reduced_wheel
    from stickslip.report.page import write_report
    from stickslip.response.contributions import HarmonicContributions, harmonic_contributions
    from stickslip.response.equilibrium import preload
    from stickslip.response.forced.accepted import accepted_points
    from stickslip.response.forced.response import forced_response
    from stickslip.response.forced.sweep import ForcedPoint, ForcedProblem, Sweep, forced_problem
    from stickslip.response.free_motion import Drift, drift
    from stickslip.response.parameter import Discretisation, ParameterPoint, branch_in_parameter
    from stickslip.response.recovery import Fields, Signals, fields, signals
    from stickslip.response.rigid import RigidPoint, rigid_response
    from stickslip.response.rotating.campbell import Campbell, Crossing, campbell
    from stickslip.response.rotating.cyclic_campbell import cyclic_campbell
    from stickslip.response.rotating.nodal_diameters import NodalDiameterMap, nodal_diameter_map
    from stickslip.response.rotating.safe import Interference, Safe, safe
    from stickslip.response.system import System
    from stickslip.response.time.floquet import Floquet
    from stickslip.response.time.shooting import ShootingResult, shoot
    from stickslip.response.time.transient import (
        TimeStepping,
        TransientResult,
        TransientStart,
        integrate,
        start_from_harmonics,
    )
    from stickslip.response.tracking import PeakPoint, smallest_peak, track_peak
    from stickslip.response.verification import ReferenceCheck, verify_reference
    from stickslip.solve.newton_method import Newton, newton
    from stickslip.solve.status import Status
    from stickslip.study.run import run_study
    from stickslip.study.schema import Study, read_study

_MODULES = {
    "stickslip.contact.law_check": ("check_law",),
    "stickslip.contact.compiled": ("compile_contacts",),
    "stickslip.contact.interface": ("Interface",),
    "stickslip.contact.law": ("law_kernel",),
    "stickslip.contact.laws.bonded": ("Bonded",),
    "stickslip.contact.laws.bouc_wen": ("BoucWen",),
    "stickslip.contact.laws.coupled_coulomb": ("CoupledCoulomb",),
    "stickslip.contact.laws.cubic_spring": ("CubicSpring",),
    "stickslip.contact.laws.dahl": ("Dahl",),
    "stickslip.contact.laws.elastic_coulomb": ("ElasticCoulomb",),
    "stickslip.contact.laws.iwan": ("Iwan",),
    "stickslip.contact.laws.iwan_populations": ("FirstLoading", "FourParameter", "UniformBand"),
    "stickslip.contact.laws.jenkins": ("Jenkins",),
    "stickslip.contact.laws.polynomial_spring": ("PolynomialSpring",),
    "stickslip.contact.laws.regularised_coulomb": ("RegularisedCoulomb",),
    "stickslip.contact.laws.rigid_coulomb": ("RigidCoulomb",),
    "stickslip.contact.laws.unilateral_spring": ("UnilateralSpring",),
    "stickslip.contact.neighbours": ("neighbour_gaps", "neighbour_interface"),
    "stickslip.contact.pairing": (
        "Pairing",
        "node_to_node",
        "node_to_segment",
        "paired_interface",
        "segment_to_segment",
    ),
    "stickslip.contact.surface": ("Surface", "nodal_surface", "rigid_surface", "structure_surface"),
    "stickslip.errors": ("InputError", "SingularError", "StickslipError"),
    "stickslip.harmonic.aft": ("contact_forces",),
    "stickslip.harmonic.balance": ("harmonic_balance",),
    "stickslip.harmonic.compliance": ("ComplianceForm",),
    "stickslip.harmonic.dlft": ("dynamic_lagrangian",),
    "stickslip.harmonic.dynamic_stiffness": ("condense",),
    "stickslip.harmonic.excitation": ("HarmonicLoad",),
    "stickslip.harmonic.selection.goal_oriented": ("GoalOriented",),
    "stickslip.harmonic.selection.grolet": ("Grolet",),
    "stickslip.harmonic.selection.guarded_alert": ("GuardedAlert",),
    "stickslip.harmonic.selection.jacobian_alert": ("JacobianAlert",),
    "stickslip.harmonic.selection.jaumouille": ("Jaumouille",),
    "stickslip.harmonic.selection.laxalde": ("Laxalde",),
    "stickslip.harmonic.selection.maple": ("Maple",),
    "stickslip.harmonic.selection.similarity": (
        "JacobianSimilarity",
        "harmonic_block_norms",
        "jacobian_similarity",
    ),
    "stickslip.harmonic.selection.strategy": ("ErrorMeasure", "Step", "Strategy", "Verdict"),
    "stickslip.harmonic.selection.suess_jacobian": ("SuessJacobian",),
    "stickslip.harmonic.selection.suess_spectral": ("SuessSpectral",),
    "stickslip.model.annulus": ("annular_sector",),
    "stickslip.model.axis": ("Axis",),
    "stickslip.model.fe.beam": ("Beam", "beam", "rotating_beam"),
    "stickslip.model.mesh.blade_mesh": ("mesh_blade_pair",),
    "stickslip.model.mesh.blade_pair": ("BladePair",),
    "stickslip.model.rigid.damper": ("ContactPoints", "FlatCurvedDamper", "gap_operator"),
    "stickslip.model.damping": ("modal_damping", "rayleigh_damping", "structural_damping"),
    "stickslip.model.deck": ("CalculixRun", "write_deck"),
    "stickslip.model.dofs": ("Dofs",),
    "stickslip.model.fe.elements": ("Quadrature",),
    "stickslip.model.gyroscopic": ("GyroscopicModes", "gyroscopic_modes"),
    "stickslip.model.matrices": ("chain", "lumped"),
    "stickslip.model.mesh.solid_mesh": ("SolidMesh", "write_mesh"),
    "stickslip.model.modes": ("Modes", "natural_frequencies", "normal_modes", "with_springs"),
    "stickslip.model.readers.abaqus": ("read_abaqus_matrices",),
    "stickslip.model.readers.ansys": ("read_ansys_full",),
    "stickslip.model.readers.ansys_archive": ("read_ansys_archive", "read_ansys_materials"),
    "stickslip.model.readers.ansys_results": ("AnsysResults", "read_ansys_results"),
    "stickslip.model.readers.calculix": ("read_calculix_matrices",),
    "stickslip.model.readers.calculix_deck": ("Deck", "assemble_deck", "read_deck"),
    "stickslip.model.readers.frd": ("FrdResults", "NodalField", "read_frd"),
    "stickslip.model.readers.matrix_files": ("read_matrix_files",),
    "stickslip.model.readers.nastran": ("NastranResults", "read_nastran_op2", "read_nastran_op4"),
    "stickslip.model.readers.nastran_dmig": ("read_nastran_dmig",),
    "stickslip.model.readers.open_model": ("model_summary", "read_model"),
    "stickslip.model.readers.summary": ("ModelSummary",),
    "stickslip.model.readers.units": ("Units",),
    "stickslip.model.rigid.body": ("RigidBody",),
    "stickslip.model.fe.rotation": ("RotatingSolid", "SpeedPolynomial", "rotating_solid"),
    "stickslip.model.mesh.sector": ("BladedSector",),
    "stickslip.model.mesh.sector_mesh": ("mesh_sector",),
    "stickslip.model.mesh.sector_parts": ("Airfoil", "DiskProfile", "Platform", "Shroud"),
    "stickslip.model.fe.solid": ("Material", "assemble_solid"),
    "stickslip.model.structure": ("Structure", "join"),
    "stickslip.model.structure_file": ("load_structure", "save_structure"),
    "stickslip.reduction.cache": ("cached",),
    "stickslip.reduction.fixed_interface": ("craig_bampton",),
    "stickslip.reduction.cyclic": ("CyclicSector", "cyclic_sector", "travelling_wave"),
    "stickslip.reduction.interface_modes": ("reduce_interface",),
    "stickslip.reduction.lumped_disks": ("blade_ring", "blisk_with_ring", "mistuned_blade_ring"),
    "stickslip.reduction.whole_wheel": ("ReducedWheel", "reduced_wheel"),
    "stickslip.reduction.relative": ("in_relative_coordinates",),
    "stickslip.reduction.free_interface": ("rubin",),
    "stickslip.reduction.truncation": (
        "FrequencyError",
        "FrequencyErrors",
        "ModesBelow",
        "frequency_errors",
    ),
    "stickslip.reduction.tuned": ("TunedWheel", "tuned_wheel"),
    "stickslip.reduction.waves": ("Wave", "excited_wave", "to_sectors", "to_waves", "wave"),
    "stickslip.reduction.full_wheel": ("wheel", "wheel_shape"),
    "stickslip.report.page": ("write_report",),
    "stickslip.response.forced.accepted": ("accepted_points",),
    "stickslip.response.rotating.campbell": ("Campbell", "Crossing", "campbell"),
    "stickslip.response.contributions": ("HarmonicContributions", "harmonic_contributions"),
    "stickslip.response.rotating.cyclic_campbell": ("cyclic_campbell",),
    "stickslip.response.free_motion": ("Drift", "drift"),
    "stickslip.response.recovery": ("Fields", "Signals", "fields", "signals"),
    "stickslip.response.time.floquet": ("Floquet",),
    "stickslip.response.forced.response": ("forced_response",),
    "stickslip.response.rotating.nodal_diameters": ("NodalDiameterMap", "nodal_diameter_map"),
    "stickslip.response.parameter": ("Discretisation", "ParameterPoint", "branch_in_parameter"),
    "stickslip.response.equilibrium": ("preload",),
    "stickslip.response.rigid": ("RigidPoint", "rigid_response"),
    "stickslip.response.rotating.safe": ("Interference", "Safe", "safe"),
    "stickslip.response.time.shooting": ("ShootingResult", "shoot"),
    "stickslip.response.forced.sweep": (
        "ForcedPoint",
        "ForcedProblem",
        "Sweep",
        "forced_problem",
    ),
    "stickslip.response.system": ("System",),
    "stickslip.response.tracking": ("PeakPoint", "smallest_peak", "track_peak"),
    "stickslip.response.time.transient": (
        "TimeStepping",
        "TransientResult",
        "TransientStart",
        "integrate",
        "start_from_harmonics",
    ),
    "stickslip.response.verification": ("ReferenceCheck", "verify_reference"),
    "stickslip.solve.newton_method": ("Newton", "newton"),
    "stickslip.solve.status": ("Status",),
    "stickslip.study.run": ("run_study",),
    "stickslip.study.schema": ("Study", "read_study"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

# fmt: off
__all__ = [
    "Airfoil", "AnsysResults", "Axis", "Beam", "BladePair", "BladedSector", "Bonded", "BoucWen",
    "CalculixRun", "Campbell", "ComplianceForm", "ContactPoints", "CoupledCoulomb", "Crossing",
    "CubicSpring", "CyclicSector", "Dahl", "Deck", "Discretisation", "DiskProfile", "Dofs", "Drift",
    "ElasticCoulomb", "ErrorMeasure", "Fields", "FirstLoading", "FlatCurvedDamper", "Floquet",
    "ForcedPoint", "ForcedProblem", "FourParameter", "FrdResults", "FrequencyError",
    "FrequencyErrors", "GoalOriented", "Grolet", "GuardedAlert", "GyroscopicModes", "HarmonicContributions", "HarmonicLoad", "InputError", "Interface",
    "Interference", "Iwan", "JacobianAlert", "JacobianSimilarity", "Jaumouille", "Jenkins",
    "Laxalde", "Maple", "Material", "ModelSummary", "Modes", "ModesBelow", "NastranResults",
    "Newton", "NodalDiameterMap", "NodalField", "Pairing", "ParameterPoint", "PeakPoint",
    "Platform", "PolynomialSpring", "Quadrature", "ReducedWheel", "ReferenceCheck",
    "RegularisedCoulomb", "RigidBody", "RigidCoulomb", "RigidPoint", "RotatingSolid", "Safe",
    "ShootingResult", "Shroud", "Signals", "SingularError", "SolidMesh", "SpeedPolynomial",
    "Status", "Step", "StickslipError", "Strategy", "Structure", "Study", "SuessJacobian",
    "SuessSpectral", "Surface", "Sweep", "System", "TimeStepping", "TransientResult",
    "TransientStart", "TunedWheel",
    "UniformBand", "UnilateralSpring", "Units", "Verdict", "Wave", "__version__", "accepted_points",
    "annular_sector", "assemble_deck", "assemble_solid", "beam", "blade_ring", "blisk_with_ring",
    "branch_in_parameter", "cached", "campbell", "chain", "check_law", "compile_contacts",
    "condense", "contact_forces", "craig_bampton", "cyclic_campbell", "cyclic_sector", "drift",
    "dynamic_lagrangian", "excited_wave", "fields", "forced_problem", "forced_response",
    "frequency_errors", "gap_operator", "gyroscopic_modes", "harmonic_balance",
    "harmonic_block_norms", "harmonic_contributions", "in_relative_coordinates", "integrate", "jacobian_similarity", "join",
    "law_kernel", "load_structure", "lumped", "mesh_blade_pair", "mesh_sector",
    "mistuned_blade_ring", "modal_damping", "model_summary", "natural_frequencies",
    "neighbour_gaps", "neighbour_interface", "newton", "nodal_diameter_map", "nodal_surface",
    "node_to_node", "node_to_segment", "normal_modes", "paired_interface", "preload",
    "rayleigh_damping", "read_abaqus_matrices", "read_ansys_archive", "read_ansys_full",
    "read_ansys_materials", "read_ansys_results", "read_calculix_matrices", "read_deck", "read_frd",
    "read_matrix_files", "read_model", "read_nastran_dmig", "read_nastran_op2", "read_nastran_op4",
    "read_study", "reduce_interface", "reduced_wheel", "rigid_response", "rigid_surface",
    "rotating_beam", "rotating_solid", "rubin", "run_study", "safe", "save_structure",
    "segment_to_segment", "shoot", "signals", "smallest_peak", "start_from_harmonics",
    "structural_damping",
    "structure_surface", "to_sectors", "to_waves", "track_peak", "travelling_wave", "tuned_wheel",
    "verify_reference", "wave", "wheel", "wheel_shape", "with_springs", "write_deck", "write_mesh",
    "write_report",
]
# fmt: on


def __getattr__(name: str) -> object:
    """Load the module of a public name when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'stickslip' has no attribute {name!r}")
    value: object = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

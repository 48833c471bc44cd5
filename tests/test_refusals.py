"""Refusals whose words no other test reads: place, problem and remedy of each."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
import scipy.sparse
import xarray as xr
from small_v2 import changed, write_four_masses
from synthetic_result import tree_of
from test_clear_answers import LOAD, free_dofs, sweep, system
from test_readers_deck import CUBE, deck_of

import stickslip as ss
from stickslip.analyses.resonance.problem import question_of
from stickslip.api.export import Wanted
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.fluid.pressure import PressureField
from stickslip.assembly.forces import Load
from stickslip.assembly.joints.pairs import refuse_itself
from stickslip.assembly.sides.deviations import _of_one_blade
from stickslip.assembly.sides.mistuning import BladeMistuning, ContactMistuning
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.iwan import FirstLoading, FourParameter, UniformBand
from stickslip.contact.loop_fit import fit_loops
from stickslip.errors import InputError
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.matrices import real_symmetric
from stickslip.harmonic.selection.goal_oriented import GoalOriented
from stickslip.harmonic.selection.guarded_alert import GuardedAlert
from stickslip.harmonic.selection.strategy import check_strategy
from stickslip.harmonic.travelling import condense_waves
from stickslip.model.axis import Axis
from stickslip.model.damping import modal_damping
from stickslip.model.fe.beam import Beam, rotating_beam
from stickslip.model.fe.material import (
    ByTemperature,
    ElasticMaterial,
    Expansion,
    Material,
    Orientation,
    elastic_material,
)
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.matrices import chain, lumped
from stickslip.model.mesh.sector import Platform, Shroud
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.npz import read_npz, write_npz
from stickslip.model.part import BodyPoints
from stickslip.model.readers import measured_columns
from stickslip.model.readers.ansys_equations import _couplings
from stickslip.model.readers.nastran_bulk import _axes
from stickslip.model.readers.nastran_bulk import real_symmetric as of_nastran
from stickslip.model.rigid.dampers import WedgeDamper
from stickslip.model.structure import Structure
from stickslip.model.structure_file import load_structure, save_structure
from stickslip.reduction import InfluenceCoefficients
from stickslip.reduction.choice import Reduction
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.reduction.coupled_stages import Flange, multistage
from stickslip.reduction.cyclic import CyclicSector
from stickslip.report.paper.figure import draw, inches, write_figure
from stickslip.response.all_motions.found import MotionSearch
from stickslip.response.bifurcations.locate import bifurcations
from stickslip.response.forced.response import forced_problem
from stickslip.response.nonlinear_modes.sdof_oscillator import modal_oscillator
from stickslip.response.residual_tractions.bounds import resonance_bounds, traction_bounds
from stickslip.response.resonances.first import first_peaks
from stickslip.response.rotating.campbell import campbell
from stickslip.response.rotating.envelope import envelope
from stickslip.response.rotating.safe import safe
from stickslip.response.time.transient import TimeStepping, check_outputs
from stickslip.study.file.model.strength import StrengthTable
from stickslip.study.models.checks import stage_refusals
from stickslip.study.models.cost import above
from stickslip.study.models.spares import _own_refusals
from stickslip.study.models.study import read_study


def coefficients(**more: Any) -> InfluenceCoefficients:
    """Return one blade's own coefficient at one frequency."""
    own = {"distances": [0], "values": np.zeros((1, 1, 1, 1, 1), complex), "frequencies": [1.0]} | more
    return InfluenceCoefficients(**own)


def fluid(**more: Any) -> Aerodynamics:
    return Aerodynamics(**({"influence": coefficients(), "reference": 1.0, "modes": (1,)} | more))


def loop(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.linspace(0.0, 1e-3, force.size), force


def own_places() -> BodyPoints:
    return BodyPoints(("a",), np.zeros((2, 3)), np.zeros((1, 3, 3)))


STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
BEAM = Beam(length=1.0, area=1e-4, second_moment=1e-8, material=STEEL)
TETRAHEDRON = SolidMesh(np.vstack([np.zeros(3), np.eye(3)]), np.arange(4)[None, :], {"root": np.arange(3)})
MAP = ss.response.NodalDiameterMap(6, np.arange(4), np.ones((4, 1)), np.ones((4, 1)))


LINE = go.Figure(go.Scatter(x=[1.0], y=[1.0]))
RIGID: Any = SimpleNamespace(interface=SimpleNamespace(rigid=(0,)))
LIMITS: Any = SimpleNamespace(memory_gb=1.0, work_s=10.0)


def of_no_kind(thing: Any) -> Any:
    """Return what has another type than the one that is asked for."""
    return thing


def raised(*found: InputError | None) -> None:
    for error in filter(None, found):
        raise error


def sparse(values: np.ndarray) -> Any:
    return scipy.sparse.csr_array(values)


def output_system(kind: int, long: float) -> np.ndarray:
    """Return the rows of a grid in pyYeti's table; its axes are `long`."""
    rows = np.vstack([np.zeros((3, 3)), long * np.eye(3)])
    rows[1, 1] = kind
    return rows


def strategy(**more: Any) -> Any:
    return SimpleNamespace(judge=lambda _: None, verifies=True, **more)


def varied(parameter: str) -> Any:
    return SimpleNamespace(
        settings=SimpleNamespace(resonance=SimpleNamespace(parameter=parameter)), values={parameter: 1.0}
    )


def side(name: str, *dofs: int) -> Any:
    return SimpleNamespace(name=name, dofs=np.array(dofs))


def spare(by: str, sectors: int) -> Any:
    """Return the tables of a wheel in one sector of which another part stands, the key of that table, and itself."""
    parts = {name: SimpleNamespace(sectors=sectors, like=None) for name in ("blade", "disc")}
    own = SimpleNamespace(part="blade", by=by, sector=2)
    whole = SimpleNamespace(part="disc")
    return SimpleNamespace(part=parts, mistuning={"m": own, "w": whole}), "mistuning.m", own


def large() -> Structure:
    """Return masses on springs, more than a full matrix may have."""
    one = scipy.sparse.eye_array(5002, format="csr")
    return Structure(one, 0 * one, one, free_dofs(5002))


def table(row: tuple[float, ...]) -> ByTemperature:
    return ByTemperature((row,))


def two_faces(axis: Axis | None) -> CyclicSector:
    return CyclicSector(chain(4, 1.0, 1.0), 6, np.array([0]), np.array([1]), axis=axis)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: lumped(np.eye(2), np.eye(2), names=("a", "a")),
            "lumped: names: need 2 different names, got ['a', 'a']. Name each coordinate.",
        ),
        (
            lambda: FirstLoading(displacement=(1.0, 2.0), force=(1.0,)),
            "FirstLoading: got 2 displacements and 1 forces. Give two corners or more, with finite numbers.",
        ),
        (
            lambda: FirstLoading(displacement=(1.0, np.inf), force=(1.0, 2.0)),
            "FirstLoading: got 2 displacements and 2 forces. Give two corners",
        ),
        (lambda: fit_loops([]), "fit_loops: loops: is empty. Give one recording or more."),
        (
            lambda: fit_loops([loop(np.full(200, 3.0))]),
            "the force is 3 at every sample. Give a loop in which both change.",
        ),
        (
            own_places,
            "BodyPoints: 1 names, positions (2, 3), frames (1, 3, 3). Give (p, 3) positions and (p, 3, 3) frames.",
        ),
        (
            lambda: coefficients(frequencies=[1.0, 2.0]),
            "has shape (1, 1, 1, 1, 1) for (1, 2, 1) speeds, frequencies and distances. Give (speeds,",
        ),
        (
            lambda: coefficients(distances=[1, 1], values=np.zeros((1, 1, 2, 1, 1))),
            "InfluenceCoefficients.distances: has a neighbour twice: [1, 1]. Give each once.",
        ),
        (
            lambda: coefficients(frequencies=[2.0, 1.0], values=np.zeros((1, 2, 1, 1, 1))),
            "InfluenceCoefficients.frequencies: do not ascend from zero on. Sort them.",
        ),
        (
            lambda: coefficients(speeds=[-1.0]),
            "InfluenceCoefficients.speeds: do not ascend from zero on. Sort them.",
        ),
        (lambda: fluid(modes=(1, 2)), "has coefficients between 1 and names 2 modes or points. Give as many."),
        (lambda: fluid(reference=0.0), "Aerodynamics.reference: is 0.0. Give rad/s."),
        (lambda: fluid(largest_displacement=-1.0), "Aerodynamics.largest_displacement: is -1.0. Give metres."),
        (lambda: fluid(modes=(0,)), "Aerodynamics.modes: are (0,). The lowest is 1."),
        (
            lambda: PressureField(np.zeros((3, 3)), np.zeros(4, complex)),
            "pressure: has (3, 3) points for (4,) pressures. Give (n, 3) and (n,), n from 3 on.",
        ),
        (
            lambda: MotionSearch(omega_range=(1.0, 2.0), spread=0.0),
            "MotionSearch.spread: is 0.0. Give a factor above zero.",
        ),
        (
            lambda: MotionSearch(omega_range=(1.0, 2.0), at=(2.5,)),
            "MotionSearch.at: leaves the range 1 to 2 rad/s. Widen omega_range.",
        ),
        (lambda: MotionSearch(omega_range=(1.0, 2.0), modes=0), "MotionSearch.modes: is 0. Give a count from 1 on."),
        (
            lambda: list(traction_bounds(system(), LOAD, [0.0])),
            "omegas: are [0.0]. Give frequencies above zero, rad/s.",
        ),
        (lambda: list(traction_bounds(system(), LOAD, [5.0], 1)), "output: is 1, of 1 outputs. Give 0 to 0."),
        (
            lambda: list(traction_bounds(system(), LOAD, [])),
            "omegas: are []. Give frequencies above zero, rad/s.",
        ),
        (
            lambda: campbell(lambda _: chain(2, 1.0, 1.0), [2.0, 1.0], 1),
            "campbell: speeds: must ascend from 0 or more, got [2.0, 1.0]. Give rad/s.",
        ),
        (
            lambda: check_outputs(np.array([2]), 2, "march"),
            "march: outputs: got [2] for 2 dofs. Give indices from 0 to 1.",
        ),
        (
            lambda: real_symmetric(Structure(np.eye(2), np.eye(2), (1 + 0.1j) * np.eye(2), free_dofs(2)), "stiffness"),
            "Structure.stiffness: is complex. Give structural damping as Structure.loss",
        ),
        (
            lambda: forced_problem(system(), ss.HarmonicLoad(np.zeros(3), {1: np.ones(3)}), sweep()),
            "3 entries for 2 dofs. Give one a dof.",
        ),
        (
            lambda: ss.Result(tree_of(modes=xr.Dataset())).to_dataframe("modes"),
            "to_dataframe('modes'): holds no variables. Look at result.data.",
        ),
        (
            lambda: Wanted(to="vtu", units="mm-t-s"),
            "export: units: is mm-t-s, and only frd takes other units. Leave it out",
        ),
        (
            lambda: ss.Result(tree_of(modes=xr.Dataset({"frequency_hz": ("mode", [1.0])}))).to_dataframe(
                "modes", of="hz"
            ),
            "to_dataframe('modes', of='hz'): is no variable of it. Known: frequency_hz.",
        ),
        (lambda: Load(on="a", newton=math.nan), "Load: has nan N and a phase of 0.0 rad. Give finite numbers."),
        (
            lambda: Load(on="a", newton=1.0, harmonic=0, omega=5.0),
            "Load.omega: is 5.0 rad/s and omega_ratio None, for a load in harmonic 0. Give one of the two, above zero",
        ),
        (
            lambda: Load(on="a", newton=1.0, omega=5.0, omega_ratio=2.0),
            "Load.omega: is 5.0 rad/s and omega_ratio 2.0, for a load in harmonic 1. Give one of the two, above zero",
        ),
        (
            lambda: BladeMistuning(of="blade", deviations=np.array([0.0, np.nan])),
            "BladeMistuning.deviations: must be finite, one number a blade or a row of modes a blade, got [0.0, nan].",
        ),
        (
            lambda: BladeMistuning(of="blade", deviations=np.array([2.0, 0.1])),
            "goes up to 2, and a blade deviates by at most 0.5. Deviations are relative: 0.01 is one per cent.",
        ),
        (
            lambda: BladeMistuning(of="blade", deviations=np.zeros((4, 2)), modes=3),
            "BladeMistuning.modes: is 3, and the deviations are of 2 modes. Leave it out.",
        ),
        (
            lambda: ContactMistuning(contact="c", quantity="preload", values=np.array([np.inf])),
            "ContactMistuning.values: must be finite, one number a sector, got [inf]. Give a list of numbers.",
        ),
        (lambda: GoalOriented(left_out=1.5), "GoalOriented.left_out: must lie from 0 to 1, got 1.5. 0.2 is usual."),
        (lambda: GuardedAlert(quick=-0.1), "GuardedAlert.quick: must lie from 0 to 1, got -0.1. 0.5 is usual."),
        (
            lambda: modal_damping(large(), 0.01),
            "modal_damping: 5002 dofs would need a full matrix. Reduce the structure first.",
        ),
        (
            lambda: condense(large(), np.array([0]), ss.HarmonicLoad(np.zeros(5002), {})),
            "condense: 5001 interior dofs. Reduce the structure first (craig_bampton).",
        ),
        (
            lambda: condense_waves((chain(2, 1.0, 1.0),) * 2, np.array([0]), ss.HarmonicLoad(np.zeros(3), {})),
            "condense_waves: a load of 3 entries for waves of [2] dofs. Give the load in the coordinates of the waves",
        ),
        (
            lambda: rotating_beam(BEAM, 2, math.inf),
            "rotating_beam: got hub radius 0.0 and speed inf. In m and rad/s.",
        ),
        (
            lambda: elastic_material(np.eye(3), 1.0),
            "elastic_material: matrix: has the shape (3, 3). Give six rows of six numbers.",
        ),
        (
            lambda: ElasticMaterial(elastic=table((1.0, 2.0, 3.0)), density_table=table((1.0,))),
            "ElasticMaterial.elastic: has 3 numbers a row. Give 2 (isotropic) or 36 (a matrix).",
        ),
        (
            lambda: Orientation.of_axes((1, 0, 0), (2, 0, 0)),
            "Orientation.of_axes: [1.0, 0.0, 0.0] and [2.0, 0.0, 0.0] span no plane. Give two vectors of different",
        ),
        (
            lambda: ByTemperature(((1.0,), (2.0,)), (300.0, 20.0)),
            "ByTemperature.temperatures: must rise, got [300.0, 20.0]. Give the lowest first.",
        ),
        (
            lambda: Expansion(coefficients=table((1.0, 2.0))),
            "Expansion.coefficients: has no rows of 1, 3 or 6 numbers. Give 1/K for each axis.",
        ),
        (
            lambda: MotionSearch(omega_range=(1.0, 2.0), steps=8, harmonics=5, periods=1),
            "MotionSearch.steps: is 8, too few for 5 harmonics over periods = 1. Give more than 10.",
        ),
        (
            lambda: bifurcations(forced_problem(system(), LOAD, sweep()), [], tolerance=0.0),
            "bifurcations: tolerance: must be between 0 and 1, got 0. 1e-6 is usual.",
        ),
        (lambda: sweep(threshold=math.nan), "Sweep.threshold: is not a number. 0.05 is 5 %."),
        (lambda: safe(MAP, (3.0, 2.0), [1]), "safe: speed: needs 0 < lowest <= highest, got (3.0, 2.0). Give rad/s."),
        (
            lambda: CyclicSector(chain(4, 1.0, 1.0), 6, np.array([0]), np.array([1, 2])),
            "CyclicSector: low, high: have shapes (1,) and (2,). Give each dof of one face and its partner on the other",
        ),
        (
            lambda: multistage({"fan": two_faces(None)}, [Flange(("fan", "disc"), (np.array([2]),) * 2, (0,))]),
            "multistage: fan: has no axis. Give the sector of a model with geometry.",
        ),
        (
            lambda: multistage({"fan": two_faces(Axis())}, [Flange(("drum", "fan"), (np.array([2]),) * 2, (0,))]),
            "multistage: there is no stage 'drum'. There are fan.",
        ),
        (
            lambda: multistage({"fan": two_faces(Axis())}, [Flange(("fan", "disc"), (np.array([1]),) * 2, (0,))]),
            "multistage: fan: has no free node on the flange. Name the nodes of the flange.",
        ),
        (
            lambda: WedgeDamper(
                left_angle=math.pi / 2, right_angle=math.pi / 2, top_width=0.0, height=0.01, length=1.0, mass=0.1
            ),
            "WedgeDamper.right_angle: is upright like the left side: the two never meet. Incline one.",
        ),
        (lambda: Axis((1.0, 0.0)), "Axis.direction: needs three numbers, got (1.0, 0.0). Give x, y, z."),
        (lambda: Axis((1.0, 0.0, 0.0, 0.0)), "Axis.direction: needs three numbers, got (1.0, 0.0, 0.0, 0.0). Give x,"),
        (lambda: Axis((1.0, 0.0, math.inf)), "Axis.direction: needs three numbers, got (1.0, 0.0, inf). Give x, y, z."),
        (lambda: Axis(origin=(1.0,)), "Axis.origin: needs three numbers, got (1.0,). Give x, y, z."),
        (
            lambda: Axis(origin=(0.0, math.nan, 0.0)),
            "Axis.origin: needs three numbers, got (0.0, nan, 0.0). Give x, y,",
        ),
        (lambda: Axis((0.0, 0.0, 0.0)), "Axis.direction: has no length. The z axis is (0, 0, 1)."),
        (
            lambda: rotating_solid(TETRAHEDRON, STEEL).at_speed(1.0, tangent="textbok"),
            "RotatingSolid.at_speed: there is no tangent 'textbok'. Did you mean 'textbook'?",
        ),
        (lambda: Wanted(to=of_no_kind("pdf")), "export: to: is 'pdf'. Give one of vtu, frd, uff, csv."),
        (lambda: Wanted(to="vtu", steps=0), "export: steps: is 0. Give 1 to 1000 instants."),
        (lambda: Wanted(to="vtu", steps=1001), "export: steps: is 1001. Give 1 to 1000 instants."),
        (lambda: rotating_beam(BEAM, 0, 0.0), "rotating_beam: elements: is 0. Give 1 or more."),
        (
            lambda: rotating_beam(BEAM, 2, 0.0, bending=of_no_kind("x")),
            "rotating_beam: bending: is 'x'. Give one of y, z, both.",
        ),
        (
            lambda: rotating_beam(BEAM, 2, 0.0, coriolis=True),
            "coriolis: acts between deflection and stretching, and the beam does not stretch. Give axial=True.",
        ),
        (
            lambda: Orientation(of_no_kind(np.diag([2.0, 1.0, 1.0]))),
            "are no perpendicular unit vectors, got [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]. Give an orthogonal",
        ),
        (
            lambda: Reduction(method=of_no_kind("guyan")),
            "Reduction.method: is 'guyan'. Give craig_bampton or rubin.",
        ),
        (
            lambda: fit_loops([loop(np.arange(9.0)), (np.zeros(3), np.zeros(4))]),
            "fit_loops: loops[1]: displacements have the shape (3,), forces (4,). Give two arrays of one length.",
        ),
        (
            lambda: fit_loops([loop(np.arange(7.0))]),
            "fit_loops: loops[0]: has 7 samples. Give 8 at least, better a hundred a cycle.",
        ),
        (lambda: inches("85"), "figure: width: is '85'. Give 20mm to 1000mm, such as 85mm, 8.5cm, 3.35in or 242pt."),
        (lambda: inches("19mm"), "figure: width: is '19mm'. Give 20mm to 1000mm"),
        (
            lambda: draw(go.Figure(), "response", None),
            "plot('response'): shows nothing. Take another figure: result.plots names them.",
        ),
        (
            lambda: draw(LINE, "response", []),
            "has 0 pairs of axes. Give one pair of axes, in the order of reading: `plt.subplots` makes them. Or leave",
        ),
        (lambda: draw(LINE, "response", "ax"), "holds a str. Give one pair of axes of matplotlib: `figure, ax = plt"),
        (lambda: of_nastran(sparse(np.ones((2, 3))), "a.op4: KAA"), "a.op4: KAA: is 2 x 3. Give square matrices."),
        (
            lambda: of_nastran(sparse(1j * np.eye(2)), "a.op4: KAA"),
            "KAA: is complex. Structural damping is an operation on the real stiffness here: write it without.",
        ),
        (
            lambda: _axes(output_system(9, 1.0), 7, "a.bdf"),
            "a.bdf: grid 7 has an output system of kind 9. Use CORD2R, C or S.",
        ),
        (
            lambda: _axes(output_system(1, 2.0), 7, "a.bdf"),
            "a.bdf: the output system of grid 7 is not orthogonal. Give its axes right angles.",
        ),
        (
            lambda: _couplings(of_no_kind(SimpleNamespace(commands=[("a.cdb: line 3", ["CP", "1"])])), cyclic=False),
            "a.cdb: line 3: couples 1. Write number, label, nodes.",
        ),
        (
            lambda: own_motions(chain(4, 1.0, 1.0), np.array([0])),
            "TunedWheel: has forces of constraints among its motions. Put them behind these.",
        ),
        (
            lambda: modal_oscillator(of_no_kind(SimpleNamespace(points=[])), LOAD),
            "the backbone has 0 points that converged, and 4 are the fewest. Follow it over more amplitudes, or with more",
        ),
        (
            lambda: resonance_bounds(system(), LOAD, [], "most"),
            "resonance_bounds: known: holds no bounds that converged. Give those of `traction_bounds`.",
        ),
        (lambda: first_peaks(of_no_kind(None), math.nan), "values: are empty or hold nan. Give finite numbers."),
        (
            lambda: check_strategy(strategy()),
            "SimpleNamespace.threshold: is missing. Give it the indicator above which more harmonics are asked for",
        ),
        (lambda: check_strategy(strategy(threshold=None)), "SimpleNamespace.threshold: is None. Give it the indicator"),
        (lambda: check_strategy(strategy(threshold=math.nan)), "SimpleNamespace.threshold: is nan. Give it the"),
        (
            lambda: question_of(of_no_kind(varied("a.b")), of_no_kind(None)),
            "is a.b, which [vary] varies too: every case would follow the same peaks. Drop it from [vary], or give",
        ),
        (
            lambda: refuse_itself("contact.c.between", side("a", 1), side("a", 2)),
            "contact.c.between: pairs 'a' with itself, where nothing moves relative to anything. Name the other side",
        ),
        (
            lambda: refuse_itself("contact.c.between", side("a", 1, 2), side("b", 3, 2)),
            "contact.c.between: pairs a dof that is both in 'a' and in 'b' with itself, where nothing moves",
        ),
        (
            lambda: raised(above(LIMITS, "it would be", 1.01, 10.0)),
            "limits.memory_gb: it would be at 1.0 GB, the limit is 1 GB. Take a coarser mesh",
        ),
        (
            lambda: raised(above(LIMITS, "it would take", 1.0, 11.0)),
            "limits.work_s: it would take at 11 s, the limit is 10 s. Take a coarser mesh",
        ),
        (
            lambda: raised(*_own_refusals(*spare("blade", 6))),
            "mistuning.m.by: is 'blade', the wheel's own part. Name another [part.NAME], which stands in this sector alone.",
        ),
        (
            lambda: raised(*_own_refusals(*spare("disc", 6))),
            "mistuning.m.by: is 'disc', a part of all sectors. Name another [part.NAME]",
        ),
        (
            lambda: _of_one_blade(of_no_kind(SimpleNamespace(shared=np.array([1]))), np.array([1, 2]), "axis", "m.of"),
            "m.of: 'axis' has dofs that all sectors share. Leave the axis or the hub out.",
        ),
        (
            lambda: next(envelope(of_no_kind(RIGID), LOAD, of_no_kind(None))),
            "envelope: needs contact forces that follow from gaps. Give the contacts a stiffness.",
        ),
        (
            lambda: write_figure(go.Figure(), "response", Path("a.gif"), "1-column"),
            "figure: a.gif: ends with '.gif'. Give one of .pdf",
        ),
    ],
)
def test_arguments_are_refused_by_name_with_the_remedy(make: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError) as told:
        make()
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("make", "inside", "outside"),
    [
        (lambda v: TimeStepping(tolerance=v), (1e-300, 0.999), (0.0, 1.0)),
        (lambda v: TimeStepping(rings=v), (0.0, 0.999), (-1e-9, 1.0)),
        (lambda v: TimeStepping(steps_per_period=v), (16, 10_000_000), (15, 10_000_001)),
        (lambda v: TimeStepping(max_periods=v), (2,), (1,)),
        (lambda v: TimeStepping(harmonics=v), (1, 511), (0, 512)),
        (lambda v: TimeStepping(min_periods=v), (1,), (0,)),
        (lambda v: Material(poisson_ratio=v), (0.0, 0.499), (-1e-9, 0.5)),
        (lambda v: Shroud(span=v), (1e-9, 1.0), (0.0, 1.001)),
        (lambda v: Shroud(face_angle=math.radians(v)), (-75.0, 75.0), (-75.1, 75.1)),
        (lambda v: Platform(underside_angle=math.radians(v)), (0.0, 75.0), (-0.1, 75.1)),
        (lambda v: BoucWen(k_t=1.0, beta=2.0, gamma=1.0, alpha=v), (0.0, 1.0), (-1e-9, 1.001)),
        (lambda v: BoucWen(k_t=1.0, beta=2.0, gamma=1.0, exponent=v), (1.0, 20.0), (0.999, 20.1)),
        (lambda v: UniformBand(half_width=v), (1e-9, 1.0), (0.0, 1.001)),
        (lambda v: UniformBand(elastic_share=v), (0.0, 0.999), (-1e-9, 1.0)),
        (lambda v: FourParameter(chi=v, beta=0.0), (-0.999, 0.0), (-1.0, 1e-9)),
    ],
)
def test_numbers_are_accepted_up_to_their_bounds(
    make: Callable[[float], object], inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    for value in inside:
        make(value)
    for value in outside:
        with pytest.raises(InputError):
            make(value)


def test_files_of_structures_are_refused_by_path_with_the_remedy(tmp_path: Path) -> None:
    structure = chain(2, 1.0, 1.0)
    with pytest.raises(InputError, match=r"^save_structure: set 'a': holds float64 values\. Give dof indices\.$"):
        save_structure(
            Structure(structure.mass, structure.damping, structure.stiffness, structure.dofs, {"a": np.array([0.0])}),
            tmp_path / "a.npz",
        )
    with pytest.raises(InputError, match=r"a\.mat: unknown file format '\.mat'\. Name it \.npz\.$"):
        write_npz(tmp_path / "a.mat", {})
    (tmp_path / "text.npz").write_text("mass, stiffness")
    with pytest.raises(InputError, match=r"text\.npz: is no \.npz file \(File is not a zip file\)"):
        read_npz(tmp_path / "text.npz")
    save_structure(structure, tmp_path / "b.npz")
    write_npz(tmp_path / "c.npz", read_npz(tmp_path / "b.npz") | {"version": np.array(99)})
    said = r"c\.npz: has version 99 of the format, this program reads \d\. Use the newest stickslip, or write the file"
    with pytest.raises(InputError, match=said):
        load_structure(tmp_path / "c.npz")


TWICE = "[[vary]]\nload.shaker.force_n = [1.0, 2.0]\n[[vary]]\nload.shaker.force_n = [3.0]\n"
MANY = f"[[vary]]\nload.shaker.force_n = {list(range(1, 41))}\n[[vary]]\npart.chain.masses_kg = {[[m] * 4 for m in range(1, 31)]}\n"
LOOSE = (
    "\n[part.body]\nshape = 'rigid_body'\nmass_kg = 1.0\ninertia_kg_m2 = [1.0, 1.0, 1.0]\ncentre_m = [0.0, 0.0, 0.0]\n"
)
FACE = "[part.body.surfaces.face]\npoints_m = [[0.0, 0.0, 0.0]]\n"


@pytest.mark.parametrize(
    ("changes", "more", "said"),
    [
        (
            {"part.chain.springs_n_per_m": '[["ground", 1, 4e4], [1, 2]]'},
            "",
            'must be [end, end, value], got [1, 2]. Ends are "ground", names of masses or their numbers from 1',
        ),
        (
            {"part.chain.names": '["a", "b"]'},
            "",
            "part.chain.names: has 2 names for 4 masses. Name every mass, or leave names out.",
        ),
        ({}, TWICE, "vary.load.shaker.force_n: is varied twice. Give one list."),
        ({}, MANY, "vary: spans 1200 cases, more than 1000. Vary fewer values."),
        (
            {},
            LOOSE + FACE,
            "part.body.surfaces.face.normal: is missing. Give normal for all points alike, or normals, one a point.",
        ),
        (
            {},
            "[mistuning.other]\npart = 'chain'\n",
            "mistuning.other.sector: is missing beside part. Say which sector, and what stands there.",
        ),
        (
            {},
            "[quasi_periodic]\nfrequencies_hz = [9.0, 8.0]\n",
            "quasi_periodic.frequencies_hz: must grow. Sort them, and give each once.",
        ),
        (
            {"vary.load.shaker.force_n": "[]"},
            "",
            "vary.load.shaker.force_n: is an empty list: there is nothing to compute. Give one value or more.",
        ),
        (
            {"vary.load.shaker.force_n": "3.0"},
            "",
            "vary.load.shaker.force_n: must be a list of values, got 3.0. For example [vary] with",
        ),
        (
            {},
            "[run_up]\nspeeds_rpm = [100.0, 100.0]\nengine_orders = [2]\n",
            "run_up.speeds_rpm: begins and ends at 100. Give the lower speed first, then a higher one.",
        ),
        (
            {},
            "[run_up]\nspeeds_rpm = [100.0, 200.0]\nengine_orders = [2, 2]\n",
            "run_up.engine_orders: holds an entry twice, got [2, 2]. Give every one once.",
        ),
        (
            {},
            "[mistuning.m]\nof = 'chain'\ndistribution = 'normal'\nstandard_deviation_m = 0.1\nseed = 1\n",
            "standard_deviation_m: is 0.1 beside quantity = 'frequency'. Give standard_deviation instead: gaps scatter by",
        ),
        (
            {},
            "[quasi_periodic]\nfrequency_hz = [8.0, 9.0]\nharmonics = 5\nmost_harmonics = 3\n",
            "quasi_periodic.most_harmonics: is less than harmonics. Raise it.",
        ),
    ],
)
def test_keys_are_refused_by_name_with_the_remedy(
    changes: Mapping[str, str], more: str, said: str, tmp_path: Path
) -> None:
    path = write_four_masses(tmp_path)
    path.write_text(changed(path.read_text(encoding="utf-8"), changes) + more, encoding="utf-8")
    with pytest.raises(InputError) as told:
        read_study(path)
    assert said in str(told.value)


def test_a_list_of_frequencies_that_falls_is_refused(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8").replace("frequency_hz = [8.0, 16.0]", "frequencies_hz = [9.0, 8.0]")
    path.write_text(text.replace("points = 10\n", "").replace("peak_points = 2\n", ""), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"forced_response\.frequencies_hz: must grow\. Sort them, and give each once\."
    ):
        read_study(path)


CYCLIC = "*CYCLIC SYMMETRY MODEL, N={}\n0.,0.,0.,0.,0.,1.\n"
SPEED = "*DLOAD\nEALL, CENTRIF, {}0.,0.,0., 0.,0.,1.\n"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "*NSET, NSET=BOTTOM",
            "*ELEMENT, TYPE=C3D8\n1, 8, 7, 6, 5, 4, 3, 2, 1\n*NSET, NSET=BOTTOM",
            "element 1 twice. Give it once.",
        ),
        ("*MATERIAL, NAME=Steel\n", "", "line 25, *ELASTIC: belongs to no *MATERIAL. Put it below its material."),
        ("2.1e11, 0.3\n", "2.1e11\n", "line 27: needs 2 numbers, got 1. Check the line."),
        ("BOTTOM, 1, 3\n", "BOTTOM\n", "line 32: names no direction. Write node, first, last."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 3, 1\n", "line 32: directions 3 to 1. They count from 1 to 3."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 0, 1\n", "line 32: directions 0 to 1. They count from 1 to 3."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 1, 3\n" + SPEED.format("-4., "), "line 34: speed² is -4. It cannot be negative."),
        (
            "BOTTOM, 1, 3\n",
            "BOTTOM, 1, 3\n" + SPEED.format(""),
            "line 34: CENTRIF with 8 fields. Give speed², a point and",
        ),
        ("BOTTOM, 1, 3\n", "BOTTOM, 1, 3\n" + CYCLIC.format(4) + CYCLIC.format(5), "N=5 after N=4. Give one."),
    ],
)
def test_decks_are_refused_by_line_with_the_remedy(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert CUBE.count(old) == 1
    with pytest.raises(InputError) as told:
        deck_of(tmp_path, CUBE.replace(old, new))
    assert said in str(told.value)


def test_stages_are_refused_by_each_key_that_they_do_not_have() -> None:
    joins = {"a": SimpleNamespace(pairing="spatial_harmonics"), "b": SimpleNamespace(pairing="node_to_node")}
    tables: Any = SimpleNamespace(join=joins, contact={"c": None}, rotation=SimpleNamespace(speed_rpm=9.0), safe=1)
    found = [str(error) for error in stage_refusals(tables)]
    assert [text.partition(". Ask for [modes], at rest and without contacts;")[0] for text in found] == [
        "safe: is no question for stages, which a join by spatial_harmonics couples",
        "join.b.pairing: is node_to_node beside joins by spatial_harmonics",
        "contact.c: touches stages, which a join couples",
        "rotation.speed_rpm: gives stages a prestress that crosses their flanges",
    ]
    still: Any = SimpleNamespace(join={"a": joins["a"]}, contact={}, rotation=SimpleNamespace(speed_rpm=0.0), modes=1)
    assert list(stage_refusals(still)) == []
    assert list(stage_refusals(SimpleNamespace(**vars(tables) | {"join": {"b": joins["b"]}}))) == []


def test_a_table_of_too_many_lines_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured_columns, "MAX_ROWS", 3)
    path = tmp_path / "a.csv"
    path.write_text("value,amplitude_m\n1,1\n2,2\n", encoding="utf-8")
    measured_columns.read_columns(path)
    path.write_text("value,amplitude_m\n1,1\n2,2\n3,3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.csv: has over 3 lines\. Cut or thin it out\.$"):
        measured_columns.read_columns(path)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([{}, {}], "has temperatures and no limit. Give limits in each row."),
        ([{"yield_pa": 1e9}, {}], "lacks yield_pa at 30 °C. Give it in each row, or once for all."),
    ],
)
def test_limits_over_temperature_are_refused_with_the_remedy(rows: list[dict[str, float]], said: str) -> None:
    given = [{"temperature_c": t, **row} for t, row in zip((20.0, 30.0), rows, strict=True)]
    with pytest.raises(ValueError, match=said.replace(".", r"\.")):
        StrengthTable.model_validate({"over_temperature": given})

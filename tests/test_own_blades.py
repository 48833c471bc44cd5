"""J2: two blades from one deck and a wedge damper, through the command line and against the same model put together by hand."""

import math
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_v2 import EXAMPLES, changed
from test_cli import done

from stickslip.api.result import Result
from stickslip.assembly.assembling import assemble
from stickslip.assembly.forces import first_nodes
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.axis import Axis
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import facets_of
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Structure, join
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.recovery import fields
from stickslip.response.system import System
from stickslip.study.check import axis_doubts, check_study
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

EXAMPLE = EXAMPLES / "own_blades"
PULL, RATIO, APEX, DEG = 2000.0, 200.0, 0.3186346, math.pi / 180
SECTIONS = (-0.0131, 0.0012, 0.0127)  # no point lies on an edge of a facet, where either neighbour would do
FEW = {
    "vary.load.shaker.ratio": "[2000]",
    "forced_response.frequency_hz": "[165.0, 176.0]",
    "forced_response.points": "6",
    "forced_response.peak_points": "4",
    "reduction.fixed_interface_modes": "4",
    # four points a side, and one node shaken: 300 coordinates in place of 700
    "part.damper.left_distances_m": "[0.0065, 0.0165]",
    "part.damper.right_distances_m": "[0.0065, 0.0165]",
    "part.damper.sections_m": "[-0.0131, 0.0127]",
    "load.shaker.on": '"left.node37"',  # of the tip
}


def write(folder: Path, changes: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(EXAMPLE / "blade.inp", folder)
    path = folder / "study.toml"
    path.write_text(changed((EXAMPLE / "study.toml").read_text(), changes))
    return path


def about_y(degrees: float) -> np.ndarray:
    return Axis(direction=(0.0, 1.0, 0.0)).rotation(degrees * DEG)


def test_the_study_finds_the_stuck_resonance_and_forces_that_balance_the_pull(tmp_path: Path) -> None:
    path = write(tmp_path, FEW)
    done("run", str(path), "--no-report")
    data = Result.from_file(tmp_path / "results").data
    response = data["forced_response"]
    stuck = natural_frequencies(read_study(path).model().at(0.0, 0, "stuck"), 1)[0]
    assert float(response["peak_frequency_hz"][0]) == pytest.approx(stuck, rel=1e-3)
    frame, force = (response[name].values for name in ("contact_frame", "static_force"))
    if force.ndim == 3:
        force = force[0]
    # forces (T_t, T_w, -N) on the damper, along t, w, n of frames in the axes of the model
    total = np.einsum("pij,pj->i", frame, force)
    np.testing.assert_allclose(total, -PULL * about_y(5.0) @ [0, 0, 1], rtol=0.02, atol=0.02 * PULL)
    assert np.all(force[:, 2] < 0)


def touched(points: np.ndarray, corners: np.ndarray, at: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the straight-sided facet (f, 6) of `corners` that holds a point of its plane, and the six shape functions there."""
    for i, facet in enumerate(corners):
        a, b, c = points[facet[:3]]
        share = np.linalg.lstsq(np.column_stack([b - a, c - a]), at - a, rcond=None)[0]
        areas = np.array([1 - share.sum(), *share])
        if areas.min() >= -1e-9:
            edges = [4 * areas[j] * areas[(j + 1) % 3] for j in range(3)]
            return i, np.concatenate([areas * (2 * areas - 1), edges])
    raise AssertionError("off the surface")


def turned(structure: Structure, turn: np.ndarray) -> Structure:
    """Turn the nodes of a reduced structure by hand; its modes stay."""
    nodes = int(np.count_nonzero(structure.dofs.node >= 0)) // 3
    whole = np.eye(structure.n)
    whole[: 3 * nodes, : 3 * nodes] = np.kron(np.eye(nodes), turn)
    own = (whole @ m @ whole.T for m in (structure.mass, structure.damping, structure.stiffness))
    return Structure(*own, structure.dofs)


def hands() -> tuple[Structure, np.ndarray, tuple[ElasticCoulomb, ...], np.ndarray, np.ndarray]:
    """Return structure, gap operator, laws, static and harmonic force, put together without assembly and study."""
    mesh = read_deck(EXAMPLE / "blade.inp").mesh
    blade = assemble_solid(mesh, Material(), clamped=("root",))
    blade = rayleigh_damping(blade, 0.005, (150.0, 300.0))
    place = {(n, c): i for i, (n, c) in enumerate(zip(blade.dofs.node, blade.dofs.component, strict=True))}

    frames, shapes, positions = [], [], []
    top, base = (0.002 * math.sqrt(2), 0.014 * math.sqrt(2))  # distances of the side's ends from the apex
    for side, sign in (("UNDER_RIGHT", -1.0), ("UNDER_LEFT", 1.0)):
        facets = facets_of(mesh, mesh.node_sets[side])
        normal = np.array([sign, 0.0, 1.0]) / math.sqrt(2)
        t = np.array([-sign, 0.0, 1.0]) / math.sqrt(2)
        for line in (1, 3, 5):
            for y in SECTIONS:
                own = np.array([0, y, APEX]) - (top + line / 6 * (base - top)) * t
                there = about_y(5.0) @ own
                back = there if sign < 0 else about_y(-10.0) @ there  # as the deck has the blade
                i, shape = touched(mesh.points, facets, back)
                shapes.append((facets[i], shape))
                positions.append(there)
                frames.append(about_y(5.0) @ np.column_stack([t, np.cross(normal, t), normal]))
    tip = mesh.node_sets["TIP"]
    nodes = np.unique(np.concatenate([tip, *(facet for facet, _ in shapes)]))
    keep = np.sort([place[int(mesh.numbers[n]), c] for n in nodes for c in "xyz"])
    left = craig_bampton(blade, keep, 25)
    mass = 7850.0 * (0.004 + 0.028) / 2 * 0.012 * 0.040
    depth = 0.002 + 0.012 / 3 * (0.004 + 2 * 0.028) / (0.004 + 0.028)
    zz = 0.012**2 / 18 * (1 + 2 * 0.004 * 0.028 / 0.032**2)
    xx = (0.004**2 + 0.028**2) / 24
    along = 0.04**2 / 12
    body = RigidBody(
        mass=mass, inertia=(mass * (zz + along), mass * (xx + zz), mass * (xx + along)), centre=(0.0, 0.0, APEX - depth)
    ).moved(about_y(5.0), np.zeros(3))
    both = join(left=left, right=turned(left, about_y(10.0)), damper=body.structure())
    at = {n: i for i, n in enumerate(dict.fromkeys(left.dofs.node[left.dofs.node >= 0].tolist()))}
    gaps = np.zeros((54, both.n))
    motion = body.displacement_operator(np.array(positions))
    for p, (facet, shape) in enumerate(shapes):
        first = 0 if p < 9 else left.n
        for node, share in zip(mesh.numbers[facet], shape, strict=True):
            columns = first + 3 * at[int(node)] + np.arange(3)
            gaps[3 * p : 3 * p + 3, columns] += share * frames[p].T
        gaps[3 * p : 3 * p + 3, -6:] -= frames[p].T @ motion[p]
    # three lines in the middles of equal strips; along the damper, 40 mm long, each point has what is nearest to it
    borders = np.array([-0.02, *(np.array(SECTIONS[1:]) + SECTIONS[:-1]) / 2, 0.02])
    shares = np.tile(np.diff(borders) / 0.04 / 3, 6)
    laws = tuple(ElasticCoulomb(k_t=4e7 * s, k_w=4e7 * s, k_n=5e7 * s, mu=0.5) for s in shares)
    static, force = np.zeros(both.n), np.zeros(both.n, dtype=complex)
    pull = np.array([0.0871557, 0.0, 0.9961947])
    static[-6:-3] = PULL * pull / np.linalg.norm(pull)
    for n in mesh.numbers[tip]:
        force[3 * at[int(n)]] += PULL / RATIO / len(tip)
    return both, gaps, laws, static, force


@pytest.mark.validation
def test_the_study_is_the_model_put_together_by_hand(tmp_path: Path) -> None:
    """Matrices, gaps, loads and a point in slip; the study writes them in the motion of contact points, a change of basis."""
    own = {"vary.load.shaker.ratio": f"[{RATIO}]", "part.damper.sections_m": str(list(SECTIONS))}
    path = write(tmp_path, own)
    found = assemble(read_study(path).model(), 3)
    structure, gaps, laws, static, force = hands()
    way = found.bare.structure.basis

    def same(mine: np.ndarray, theirs: np.ndarray, tolerance: float = 1e-12) -> None:
        assert np.abs(mine - theirs).max() <= tolerance * np.abs(theirs).max()

    for name in ("mass", "damping", "stiffness"):
        same(getattr(found.bare.structure, name), way.T @ getattr(structure, name) @ way)
    same(found.bare.interface.gap_operator, gaps @ way, 5e-12)  # a projection ends at steps of 1e-12
    same(found.load.static, way.T @ static)
    same(found.load.harmonics[1], way.T @ force)
    for mine, theirs in zip(found.bare.interface.laws, laws, strict=True):
        np.testing.assert_allclose(mine.parameters(), theirs.parameters(), rtol=1e-14)

    names = found.bare.interface.names
    free = np.arange(structure.n - 6, structure.n)
    hand = System(structure, Interface(names, laws, gaps), free[:3], free=free).with_retention(5e4)
    sweep = Sweep(
        omega_range=(2 * math.pi * 168, 2 * math.pi * 169),
        low=3,
        high=3,
        selection="always_low",
        frequencies=2,
        peak_points=0,
    )
    answers = []
    for system, load in ((found.system, found.load), (hand, HarmonicLoad(static, {1: force}))):
        problem = forced_problem(system, load, sweep)
        point = next(iter(forced_response(system, load, sweep)))
        assert point.converged
        answers.append(fields(problem, point))
    assert answers[1].energy.max() > 1e-5  # it slips
    at = [i for i, name in enumerate(found.output_labels) if name in ("damper.x", "damper.y", "damper.z")]
    # near a resonance, both to the tolerance of Newton's method
    same(answers[0].outputs[:, at], answers[1].outputs, 1e-7)
    same(answers[0].forces, answers[1].forces, 1e-7)


@pytest.mark.parametrize(("angle", "tilted"), [(43.0, None), (41.0, "4")])
def test_a_wedge_of_another_angle_than_its_undersides_is_warned_of(
    tmp_path: Path, angle: float, tilted: str | None
) -> None:
    own = {"part.damper.left_angle_deg": str(angle), "part.damper.right_angle_deg": "45.0"}
    warnings = read_study(write(tmp_path, own)).model().warnings
    found = [text for text in warnings if "is tilted by" in text]
    assert len(found) == (0 if tilted is None else 1)
    for text in found:
        assert text.startswith(f"contact.left: damper.left is tilted by {tilted}° against left.")
        assert "left_angle_deg" in text


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"between": '["left.under_right", "damper.left"]'},
            'between = ["damper.left", "left.UNDER_RIGHT"], with pairing = "node_to_segment"',
        ),
        (
            {"pairing": '"segment_to_segment"'},
            'facets, as segment_to_segment needs them there. Give pairing = "node_to_segment"',
        ),
        ({"pairing": '"node_to_node"'}, 'and 4 more. Give pairing = "node_to_segment": each point'),
    ],
)
def test_points_that_meet_facets_are_told_the_pairing_and_the_order(
    tmp_path: Path, changes: dict[str, str], message: str
) -> None:
    own = {f"contact.left.{key}": value for key, value in changes.items()}
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        _ = read_study(write(tmp_path, own)).model().pairs
    assert "contact.left" in str(refused.value)


def test_a_point_beyond_the_rim_is_told_so_and_how_much_the_tolerance_has_to_be(tmp_path: Path) -> None:
    along = '[{ move_m = [0.0, 0.0125, 0.3186346] }, { turn_deg = 5.0, axis = "y" }]'
    with pytest.raises(InputError) as error:
        check_study(read_study(write(tmp_path, {"part.damper.placed": along})))
    told = str(error.value)
    assert "they stand beyond its rim: node 2 at" in told
    assert re.search(r" 0\.00183 m off\. Give tolerance_m = ten times the largest", told)
    wide = {f"contact.{side}.tolerance_m": "0.0184" for side in ("left", "right")}
    wide["part.damper.placed"] = along
    model = read_study(write(tmp_path / "wide", FEW | wide)).model()
    assert len(model.pairs.names) == 8
    # of two outputs on sets of nodes the first node, which a user has to be told; a body has no others
    left, right = first_nodes(model.places, model.outputs)
    first = model.parts["left"].mesh.points[model.parts["left"].mesh.node_sets["TIP"][0]]
    assert left == f"output left: the first of the 35 nodes of left.TIP, at ({', '.join(f'{x:.6g}' for x in first)}) m"
    assert right.startswith("output right: ")


def test_a_damper_far_from_its_blades_is_told_how_far(tmp_path: Path) -> None:
    away = '[{ move_m = [0.3, 0.0, 0.3186346] }, { turn_deg = 5.0, axis = "y" }]'
    study = read_study(write(tmp_path, {"part.damper.placed": away}))
    with pytest.raises(InputError) as error:
        check_study(study)
    told = str(error.value)
    assert "contact.left (side A: damper.left" in told
    assert re.search(r"; the nearest nodes or points of both lie 0\.2\d+ m apart\.", told)
    assert "raise tolerance_m" in told


def test_an_axis_that_no_blade_turns_about_is_doubted(tmp_path: Path) -> None:
    """The blade of the deck stands at the top of a wheel about y; without a key a model turns about z, along the blade."""
    blade = read_study(write(tmp_path, FEW)).model().parts["left"]
    y, apart = (
        (0.0, 1.0, 0.0),
        r"does not lie below left: from its clamped nodes to its centre of mass it reaches along \(0\.0\d+, 0, 1\)",
    )
    for axis, said in (
        (Axis(y), None),
        (Axis((0.3, 1.0, 0.1)), None),
        (Axis(), apart),
        (Axis(y, (0.0, 0.0, 1.0)), r"the centrifugal load acts along \([-.\d]+, 0, -1\)"),
        (Axis(y, (0.0, 0.0, -300.0)), "Check the units of left and of part.left.axis_origin_m"),
    ):
        told = list(axis_doubts(SimpleNamespace(parts={"left": replace(blade, axis=axis)})))
        assert [bool(re.search(said or "", one)) for one in told] == [True] * bool(said), told


def test_a_disk_and_a_shaft_may_turn_about_their_own_axes() -> None:
    """Both are clamped at one end of the axis, and a beam that hangs on a wheel turns about an axis below it alone."""
    ring, along = np.linspace(0.0, 2 * np.pi, 12, endpoint=False), np.linspace(0.0, 1.0, 5)
    shaft = np.array([(math.cos(a), math.sin(a), 10 * z) for z in along for a in ring])
    plank = shaft * (0.2, 1.0, 1.0)
    for points, count in ((shaft, 0), (plank, 1)):
        numbers = np.arange(len(points))
        part = SimpleNamespace(
            mesh=SimpleNamespace(points=points, numbers=numbers),
            structure=SimpleNamespace(dofs=SimpleNamespace(node=numbers[12:])),
            axis=Axis(),
            sectors=1,
            template=None,
            memo={"facts": SimpleNamespace(centre=points.mean(axis=0))},
        )
        assert len(list(axis_doubts(SimpleNamespace(parts={"shaft": part})))) == count


def test_nodes_held_by_the_file_and_by_the_study_are_told_apart(tmp_path: Path) -> None:
    deck = (Path(__file__).parents[1] / "examples" / "own_blades" / "blade.inp").read_text().upper()
    fixed = re.findall(r"\d+", re.split(r"\*NSET, *NSET=ROOT[^\n]*\n", deck)[1].split("*")[0])
    plain = read_study(write(tmp_path, FEW)).model().parts["left"]
    assert plain.supports == f"part.left: nodes held are {len(set(fixed))} by its file"
    assert plain.mesh is not None
    tip = plain.mesh.node_sets["TIP"].size
    more = read_study(write(tmp_path / "more", FEW | {"part.left.clamped": '["TIP"]'}))
    told = more.model().parts["left"].supports
    assert told == f"{plain.supports}, {tip} more by part.left.clamped"

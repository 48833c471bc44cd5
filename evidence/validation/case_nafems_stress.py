"""Stress by displacement and by temperature: two benchmarks of NAFEMS and a rotating disk, on meshes made finer.

LE10, thick plate under pressure: σ_yy = -5.38 MPa at D. LE11, solid cylinder, taper and sphere under temperature: σ_zz = -105 MPa at A.
Source: NAFEMS, The Standard NAFEMS Benchmarks, TNSB Rev. 3, 1990; the geometry of LE11 from its key points in radius and height.
"""

from collections.abc import Callable

import numpy as np

from evidence.models.annulus import filled_grid
from evidence.validation.compare import Record, bound, record
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.factorisation import factorise
from stickslip.model.fe.material import ByTemperature, ElasticMaterial, Expansion, Material
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.fe.stress import nodal_stress
from stickslip.model.mesh import facets
from stickslip.model.mesh.solid_mesh import SolidMesh, facets_of
from stickslip.model.readers.calculix_deck import QUADRATURES

SOURCE = "NAFEMS, The Standard NAFEMS Benchmarks, 1990"
YOUNG, POISSON = 210e9, 0.3
STEEL = Material(young_modulus=YOUNG, poisson_ratio=POISSON, density=7850.0)
HOT = ElasticMaterial(
    elastic=ByTemperature(((YOUNG, POISSON),)),
    density_table=ByTemperature(((7850.0,),)),
    expansion=Expansion(coefficients=ByTemperature(((2.3e-4,),))),
)
KINDS = {"C3D20R": 20, "C3D20": 20, "C3D10": 10, "C3D15": 15}
PRESSURE = 1e6
INNER, OUTER, DEPTH = (2.0, 1.0), (3.25, 2.75), 0.6  # semi-axes and thickness of LE10, m
Grid = tuple[SolidMesh, FloatArray]  # mesh, and places (n, 3) from 0 to 1 in the grid


def mapped(divisions: tuple[int, int, int], cell: int, place_of: Callable[[FloatArray], FloatArray]) -> Grid:
    """Return a mesh of a grid whose places from 0 to 1 are mapped into space."""
    steps, cells = filled_grid(divisions, cell)
    places = steps / (2 * np.array(divisions))
    return SolidMesh(place_of(places), cells, {}), places


def plate(places: FloatArray) -> FloatArray:
    """LE10: a quarter between two ellipses; along the first direction outward, along the second from D to the y axis."""
    s, angle, z = places[:, 0], np.pi / 2 * places[:, 1], DEPTH * (places[:, 2] - 0.5)
    axes = [(1 - s) * a + s * b for a, b in zip(INNER, OUTER, strict=True)]
    return np.column_stack([axes[0] * np.cos(angle), axes[1] * np.sin(angle), z])


def tapered(places: FloatArray) -> FloatArray:
    """LE11: its section in four pieces along the third direction, turned by a quarter along the second."""
    t, angle = 4 * places[:, 2], np.pi / 2 * places[:, 1]
    low, high, middle = np.sqrt(0.5), 1.79, (np.sqrt(0.5) + 1.79) / 2
    bow = np.pi / 8 * np.minimum(t, 2.0)
    inner_z = np.interp(t, [2, 3, 4], [low, middle, high])
    inner = np.where(t < 2, np.vstack([np.cos(bow), np.sin(bow)]), np.vstack([np.full_like(t, low), inner_z]))
    bow = np.pi / 6 * np.minimum(t, 1.0)
    end = 1.4 * np.array([np.cos(np.pi / 6), 0.5])
    straight = np.vstack([np.interp(t, [1, 3, 4], [end[0], 1.0, 1.0]), np.interp(t, [1, 3, 4], [end[1], 1.39, high])])
    outer = np.where(t < 1, 1.4 * np.vstack([np.cos(bow), np.sin(bow)]), straight)
    r, z = (1 - places[:, 0]) * inner + places[:, 0] * outer
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


def on_facets(points: FloatArray, rows: IntArray) -> FloatArray:
    """Return ∫ N dA (nodes,) of plane facets of one kind."""
    kind = int(facets.kinds_of(rows)[0])
    rows = rows[:, :kind]
    x, w = np.polynomial.legendre.leggauss(3)
    at = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(w, w).ravel()
    if kind in (3, 6):  # the square collapsed to the triangle
        a, b = (1 + at.T) / 2
        at, weights = np.column_stack([a, b * (1 - a)]), weights / 4 * (1 - a)
    slopes = facets.shape_gradients(kind, at)
    tangents = np.einsum("qrk,mkx->mqrx", slopes, points[rows])
    area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2)
    share = np.einsum("mq,q,qk->mk", area, weights, facets.shape_functions(kind, at))
    return np.asarray(np.bincount(rows.ravel(), share.ravel(), minlength=len(points)), dtype=float)


def thick_plate(kind: str, n: int) -> tuple[RotatingSolid, FloatArray, IntArray]:
    """Return LE10: solid, displacement (nodes, 3) and the node D."""
    mesh, places = mapped((2 * n, 3 * n, 2 * (n // 2)), KINDS[kind], plate)
    held = np.zeros_like(mesh.points, dtype=bool)
    held[places[:, 1] == 0, 1] = held[places[:, 1] == 1, 0] = True
    held[places[:, 0] == 1, :2] = True
    held[(places[:, 0] == 1) & (places[:, 2] == 0.5), 2] = True
    solid = rotating_solid(mesh, STEEL, held=held, quadrature=QUADRATURES[kind])
    force = np.zeros_like(mesh.points)
    force[:, 2] = -PRESSURE * on_facets(mesh.points, facets_of(mesh, np.flatnonzero(places[:, 2] == 1)))
    moved = factorise(solid.structure.stiffness)(np.asarray(solid.onto.T @ force.ravel()))
    return solid, solid.at_nodes(moved), np.flatnonzero((places == [0, 0, 1]).all(axis=1))


def hot_cylinder(kind: str, n: int) -> tuple[RotatingSolid, FloatArray, IntArray]:
    """Return LE11: solid, displacement (nodes, 3) and the nodes on the circle through A."""
    mesh, places = mapped((2 * n, 3 * n, 8 * n), KINDS[kind], tapered)
    held = np.zeros_like(mesh.points, dtype=bool)
    held[places[:, 1] == 0, 1] = held[places[:, 1] == 1, 0] = True
    held[(places[:, 2] == 0) | (places[:, 2] == 1), 2] = True
    x, y, z = mesh.points.T
    heat = Temperature(np.hypot(x, y) + z, np.zeros(len(x)))
    solid = rotating_solid(mesh, HOT, held=held, quadrature=QUADRATURES[kind], temperature=heat)
    return solid, solid.at_nodes(solid.displacement(0.0)), np.flatnonzero((places[:, [0, 2]] == 0).all(axis=1))


RING, SPEED = (0.05, 0.15, 0.02), 1000.0  # radii and thickness in m, rad/s


def rotating_ring(kind: str, n: int) -> float:
    """Return the largest error at nodes, over the largest stress, of a quarter of a rotating ring between rigid planes.

    Closed form of plane strain: Timoshenko and Goodier, Theory of Elasticity, section 32.
    """
    inner, outer, depth = RING

    def place_of(places: FloatArray) -> FloatArray:
        r, angle = inner + (outer - inner) * places[:, 0], np.pi / 2 * places[:, 1]
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), depth * places[:, 2]])

    mesh, places = mapped((n, n, 1), KINDS[kind], place_of)
    held = np.zeros_like(mesh.points, dtype=bool)
    held[:, 2] = held[places[:, 1] == 0, 1] = held[places[:, 1] == 1, 0] = True
    r = inner + (outer - inner) * places[:, 0]
    load = STEEL.density * SPEED**2 / (8 * (1 - POISSON))
    radial = load * (3 - 2 * POISSON) * (inner**2 + outer**2 - (inner * outer / r) ** 2 - r**2)
    hoop = load * ((3 - 2 * POISSON) * (inner**2 + outer**2 + (inner * outer / r) ** 2) - (1 + 2 * POISSON) * r**2)
    found = stress_at_speed(mesh, STEEL, held, kind)
    c, s = np.cos(np.pi / 2 * places[:, 1]), np.sin(np.pi / 2 * places[:, 1])
    ours = np.column_stack(
        [
            found[:, 0] * c**2 + found[:, 1] * s**2 + 2 * found[:, 3] * c * s,
            found[:, 0] * s**2 + found[:, 1] * c**2 - 2 * found[:, 3] * c * s,
            found[:, 2],
        ]
    )
    exact = np.column_stack([radial, hoop, POISSON * (radial + hoop)])
    return float(np.abs(ours - exact).max() / np.abs(exact).max())


def rotating_bar(kind: str, n: int) -> float:
    """Return the largest error at nodes, over the largest stress, of a bar that stretches along its radius: ``ρ Ω² (L² − x²) / 2``."""
    rod = Material(young_modulus=YOUNG, poisson_ratio=0.0, density=7850.0)
    mesh, _ = mapped((n, 1, 1), KINDS[kind], lambda places: places * [0.1, 0.01, 0.01])
    held = np.tile([False, True, True], (len(mesh.points), 1))
    held[mesh.points[:, 0] == 0] = True
    exact = rod.density * SPEED**2 * (0.1**2 - mesh.points[:, 0] ** 2) / 2
    return float(np.abs(stress_at_speed(mesh, rod, held, kind)[:, 0] - exact).max() / exact.max())


def stress_at_speed(mesh: SolidMesh, material: Material, held: BoolArray, kind: str) -> FloatArray:
    """Return the stress at nodes (nodes, 6) of a solid that rotates about the z axis."""
    solid = rotating_solid(mesh, material, held=held, quadrature=QUADRATURES[kind])
    return np.asarray(nodal_stress(solid, solid.at_nodes(solid.displacement(SPEED))[None])[0])


# element, fineness, relative tolerance: the coarser tetrahedra have their own
PLATES = (("C3D20R", 8, 0.01), ("C3D20", 8, 0.01), ("C3D10", 4, 0.03))
CYLINDERS = (("C3D20R", 4, 0.01), ("C3D20", 4, 0.01), ("C3D10", 2, 0.035))


def run() -> list[Record]:
    """Compare both benchmarks on meshes made finer, and the order with which bar and ring converge."""
    records = []
    for kind, n, most in PLATES:
        solid, moved, at = thick_plate(kind, n)
        stress = nodal_stress(solid, moved[None])[0]
        case = f"NAFEMS LE10, {kind}, {len(solid.mesh.points)} nodes"
        records.append(record(case, "σ_yy at D in MPa", stress[at[0], 1] / 1e6, -5.38, most, SOURCE))
    for kind, n, most in CYLINDERS:
        solid, moved, at = hot_cylinder(kind, n)
        stress = nodal_stress(solid, moved[None], heated=True)[0][at, 2].mean()
        case = f"NAFEMS LE11, {kind}, {len(solid.mesh.points)} nodes"
        records.append(record(case, "σ_zz at A in MPa", stress / 1e6, -105.0, most, SOURCE))
    for what, error_of, most in (("bar", rotating_bar, 1e-3), ("ring", rotating_ring, 1e-2)):
        for kind in KINDS:
            coarse, fine = error_of(kind, 8), error_of(kind, 16)
            case = f"stress of a rotating {what}, {kind}"
            records += [
                bound(case, "largest error at nodes over the largest stress", fine, most, "closed form"),
                bound(
                    case,
                    "order of convergence below 2",
                    max(0.0, 2 - np.log2(coarse / fine)),
                    0.3,
                    "the element's order",
                ),
            ]
    return records

"""Two equal cantilever blades with platforms, meshed with second-order tetrahedra.

Coordinates: x circumferential (the blades bend this way), y axial, z radial. Blade 1 stands at
x = 0, blade 2 at x = `pitch`. gmsh and meshio are imported only when a mesh is made or written.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import StickslipError, input_error
from stickslip.model.damper import ContactPoints

MATCH = 1e-9  # m: a contact point and its node may differ by this much
TET10_FROM_GMSH = np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 8])  # gmsh swaps VTK's last two nodes
TET_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])  # outward
GMSH_OPTIONS = {
    "Mesh.SecondOrderLinear": 1,  # straight edges: coarse curved elements would turn inside out
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.Algorithm": 6,
    "Mesh.RandomSeed": 1,
}


@dataclass(frozen=True, kw_only=True)
class BladePair:
    """Geometry of two equal blades; lengths in metres, angles in rad.

    A foot block (z < 0) carries a shank, which widens into a platform whose two undersides are
    inclined; a tapered, twisted, cambered lens section is lofted on the platform's top.

    Parameters
    ----------
    pitch
        Distance of the blades along x.
    foot_width, foot_depth, foot_height
        Extent of the foot block along x, y, z; its bottom and its x-flanks are clamped.
    shank_thickness
        Extent of the shank along x.
    platform_gap
        Clearance along x between the platforms of neighbours.
    platform_depth
        Extent of shank and platform along y.
    platform_height
        Height z of the platform's top.
    platform_edge
        Thickness of the platform at its edges.
    flat_angle, curved_angle
        Inclination from x of the underside that faces +x (blade 1: the damper's flat side) and of
        the one that faces −x (blade 2: its curved side).
    airfoil_length
        From the platform's top to the tip.
    hub_chord, tip_chord, hub_thickness, tip_thickness
        Size of the airfoil's end sections.
    camber
        Height of the camber line's arc over the chord's length.
    twist
        Rotation of the tip section against the hub section about z.
    airfoil_size, platform_size, foot_size
        Element sizes.

    Raises
    ------
    InputError
        If a length is not positive or the parts do not fit together.
    """

    pitch: float = 0.050
    foot_width: float = 0.034
    foot_depth: float = 0.048
    foot_height: float = 0.020
    shank_thickness: float = 0.009
    platform_gap: float = 0.001
    platform_depth: float = 0.048
    platform_height: float = 0.075
    platform_edge: float = 0.004
    flat_angle: float = math.radians(45)
    curved_angle: float = math.radians(45)
    airfoil_length: float = 0.165
    hub_chord: float = 0.046
    tip_chord: float = 0.040
    hub_thickness: float = 0.0075
    tip_thickness: float = 0.0050
    camber: float = 0.04
    twist: float = math.radians(8)
    airfoil_size: float = 0.0060
    platform_size: float = 0.0055
    foot_size: float = 0.0080

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            free = field.name in {"twist", "camber"}
            if not math.isfinite(value) or not (free or value > 0):
                raise _bad(field.name, f"must be positive and finite, got {value}", "Give metres.")
        for name in ("flat_angle", "curved_angle"):
            if not getattr(self, name) < math.pi / 2:
                raise _bad(name, f"must be below pi/2 rad, got {getattr(self, name)}", "Use rad.")
        if self.shank_thickness >= 2 * self.half_width:
            raise _bad(
                "pitch",
                f"{self.pitch} m leaves no room for platforms: they would overlap "
                f"(shank {self.shank_thickness} m, gap {self.platform_gap} m)",
                "Make the pitch larger than shank_thickness + platform_gap.",
            )
        if min(self.shank_tops) <= 0:
            raise _bad(
                "platform_height",
                f"{self.platform_height} m puts the undersides' lower end at {min(self.shank_tops)} m",
                "It must lie above the foot (z = 0): raise the platform or flatten its angles.",
            )
        self._check_supports()

    def _check_supports(self) -> None:
        reach = abs(self.camber) * self.hub_chord + self.hub_thickness / 2
        if self.hub_chord >= self.platform_depth or reach >= self.half_width:
            raise _bad(
                "hub_chord",
                f"the airfoil's hub section ({self.hub_chord} m × {2 * reach} m) "
                "overhangs the platform",
                "Make it smaller than the platform.",
            )
        if self.foot_width < self.shank_thickness or self.foot_depth < self.platform_depth:
            raise _bad(
                "foot_width",
                f"the foot ({self.foot_width} × {self.foot_depth} m) is smaller than the shank "
                f"({self.shank_thickness} × {self.platform_depth} m)",
                "Make the foot at least as large as what it carries.",
            )
        if self.foot_width >= self.pitch:
            raise _bad("foot_width", f"{self.foot_width} m: the feet overlap", "Lower it.")

    @property
    def half_width(self) -> float:
        """Half the platform's extent along x, in metres."""
        return (self.pitch - self.platform_gap) / 2

    @property
    def shank_tops(self) -> tuple[float, float]:
        """Height z at which the shank meets the flat and the curved side's underside."""
        reach = self.half_width - self.shank_thickness / 2
        edge = self.platform_height - self.platform_edge
        return edge - reach * math.tan(self.flat_angle), edge - reach * math.tan(self.curved_angle)

    @property
    def wedge_apex(self) -> tuple[float, float]:
        """(x, z) where blade 1's underside plane meets blade 2's: the apex of a damper."""
        flat, curved = math.tan(self.flat_angle), math.tan(self.curved_angle)
        rise = self.platform_gap * flat * curved / (flat + curved)
        return self.half_width + rise / flat, self.platform_height - self.platform_edge + rise


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of second-order tetrahedra.

    Parameters
    ----------
    points
        (n, 3) nodes in metres.
    cells
        (m, 10) nodes of each tetrahedron in VTK order.
    node_sets
        Name -> nodes; ``root`` is clamped.
    """

    points: FloatArray
    cells: IntArray
    node_sets: Mapping[str, IntArray]

    @property
    def surface(self) -> IntArray:
        """(k, 3) corner nodes of the skin's triangles, oriented outward."""
        faces = self.cells[:, TET_FACES].reshape(-1, 3)
        _, first, count = np.unique(
            np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
        )
        return np.asarray(faces[np.sort(first[count == 1])])


def mesh_blade_pair(geometry: BladePair, contacts: ContactPoints) -> SolidMesh:
    """Mesh both blades, with a node at every contact point.

    One blade is meshed and copied, so the blades are equal to the last bit.

    Parameters
    ----------
    geometry
        The blades.
    contacts
        Points of the damper; those on its flat side become nodes of blade 1, those on its curved
        side nodes of blade 2.

    Returns
    -------
    SolidMesh
        With the sets ``root``, ``contact`` (in the order of `contacts`), ``contact_L1`` and so on
        (one a line), ``force`` (mid-span of blade 1) and ``output`` (tip of blade 1, mid-span
        leading edge of blade 1, tip of blade 2).

    Raises
    ------
    InputError
        If a contact point does not lie on its platform's underside.
    StickslipError
        If gmsh cannot be loaded.
    """
    _check_on_undersides(geometry, contacts)
    offset = np.array([geometry.pitch, 0.0, 0.0])
    on_second = np.array([side == "curved" for side in contacts.side])
    targets = contacts.position - on_second[:, None] * offset
    marks = {"force": _section(geometry, 0.5)[7], "edge": _section(geometry, 0.5)[0]}
    marks["tip"] = _section(geometry, 1.0)[2]
    points, cells = _mesh_blade(geometry, targets)
    nearest = _match(points, np.vstack([targets, *(marks[k] for k in ("force", "edge", "tip"))]))
    n = len(points)
    contact = nearest[:-3] + n * on_second
    force, edge, tip = nearest[-3:]
    root = _clamped(geometry, points)
    sets = {"root": np.concatenate([root, root + n]), "contact": contact}
    for line in dict.fromkeys(name.split(".")[0] for name in contacts.names):
        sets[f"contact_{line}"] = contact[contacts.on_line(line)]
    sets |= {"force": np.array([force]), "output": np.array([tip, edge, tip + n])}
    return SolidMesh(np.vstack([points, points + offset]), np.vstack([cells, cells + n]), sets)


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """Write the mesh for ParaView (``.vtu``) or gmsh (``.msh``); node sets become point data."""
    if path.suffix not in {".vtu", ".msh"}:
        raise input_error(str(path), f"unknown mesh format {path.suffix!r}", "Use .vtu or .msh.")
    try:
        import meshio
    except ModuleNotFoundError as error:
        raise _missing("meshio", error) from error
    flags = {}
    for name, nodes in mesh.node_sets.items():
        flags[name] = np.zeros(len(mesh.points))
        flags[name][nodes] = 1.0
    tags = {}
    if path.suffix == ".msh":
        ones = np.ones(len(mesh.cells), dtype=np.int32)
        tags = {"gmsh:physical": [ones], "gmsh:geometrical": [ones]}
    data = meshio.Mesh(mesh.points, [("tetra10", mesh.cells)], point_data=flags, cell_data=tags)
    if path.suffix == ".msh":
        meshio.write(path, data, file_format="gmsh22", binary=True)
    else:
        meshio.write(path, data)


def _bad(name: str, problem: str, remedy: str) -> StickslipError:
    return input_error(f"BladePair.{name}", problem, remedy)


def _missing(package: str, error: Exception) -> StickslipError:
    if isinstance(error, OSError):
        return StickslipError(
            f"{package}: a system library is missing ({error}). On Debian or Ubuntu: apt-get install "
            "libglu1-mesa libxft2 libxcursor1 libxinerama1 libxrender1"
        )
    return StickslipError(f"{package}: not installed. Use: pip install 'stickslip[fe]'")


def _check_on_undersides(geometry: BladePair, contacts: ContactPoints) -> None:
    """Refuse contact points that are off the platforms' underside faces."""
    edge = geometry.platform_height - geometry.platform_edge
    misses = []
    for name, side, (x, y, z) in zip(contacts.names, contacts.side, contacts.position, strict=True):
        flat = side == "flat"
        inward = x if flat else geometry.pitch - x
        angle = geometry.flat_angle if flat else geometry.curved_angle
        off = z * math.cos(angle) - (
            edge * math.cos(angle) - (geometry.half_width - inward) * math.sin(angle)
        )
        inside = geometry.shank_thickness / 2 < inward < geometry.half_width
        if abs(off) > MATCH or not inside or abs(y) >= geometry.platform_depth / 2:
            misses.append(
                f"{name} at ({x:.6g}, {y:.6g}, {z:.6g}) m, {off:.3g} m from the {side} side's plane"
            )
    if misses:
        raise input_error(
            "mesh_blade_pair",
            "non-matching node sets: these contact points of the damper are not on a platform's "
            "underside: " + "; ".join(misses),
            "Place the damper's apex at the blades' wedge_apex "
            f"({geometry.wedge_apex[0]:.6g}, {geometry.wedge_apex[1]:.6g}) m, give both the same "
            "angles, and keep its lines and sections on the faces.",
        )


def _section(geometry: BladePair, span: float) -> FloatArray:
    """Return ten points (10, 3) around the airfoil section at the fraction `span` of its length.

    Four corners (blunt edges) and three points between them on either face: 0..4 run along the
    suction side from the leading to the trailing edge, 5..9 back along the pressure side.
    """
    chord = (1 - span) * geometry.hub_chord + span * geometry.tip_chord
    thickness = (1 - span) * geometry.hub_thickness + span * geometry.tip_thickness
    s = np.linspace(-1.0, 1.0, 5)
    half = thickness / 2 * (0.25 + 0.75 * (1 - s**2))
    line = geometry.camber * chord * (1 - s**2)
    along = np.concatenate([s, s[::-1]]) * chord / 2
    across = np.concatenate([line + half, (line - half)[::-1]])
    angle = geometry.twist * span
    x = across * math.cos(angle) - along * math.sin(angle)
    y = across * math.sin(angle) + along * math.cos(angle)
    z = np.full(10, geometry.platform_height + span * geometry.airfoil_length)
    return np.column_stack([x, y, z])


def _clamped(geometry: BladePair, points: FloatArray) -> IntArray:
    """Return the nodes on the bottom and the x-flanks of the foot."""
    x, _, z = points.T
    bottom = z < -geometry.foot_height + MATCH
    flank = (np.abs(x) > geometry.foot_width / 2 - MATCH) & (z < MATCH)
    return np.flatnonzero(bottom | flank)


def _match(points: FloatArray, targets: FloatArray) -> IntArray:
    """Return the node at each target; a mesh without one is an error of the mesher."""
    from scipy.spatial import cKDTree

    distance, nearest = cKDTree(points).query(targets)
    if np.any(distance > MATCH):
        missed = ", ".join(str(t) for t in targets[distance > MATCH])
        raise StickslipError(f"gmsh put no node at {missed}; change the element sizes slightly")
    return np.asarray(nearest, dtype=np.int64)


@contextmanager
def _gmsh() -> Iterator[Any]:
    """Give a silent, single-threaded gmsh with an empty model, and clean up after it."""
    try:
        import gmsh
    except (ModuleNotFoundError, OSError) as error:
        raise _missing("gmsh", error) from error
    ours = not gmsh.isInitialized()
    if ours:
        # signal handlers may only be set in the main thread: do without them
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.model.add("stickslip")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()


def _mesh_blade(geometry: BladePair, targets: FloatArray) -> tuple[FloatArray, IntArray]:
    """Mesh blade 1 alone with nodes at `targets`; return points (n, 3) and VTK cells (m, 10)."""
    with _gmsh() as gmsh:
        _build(gmsh.model.occ, geometry)
        gmsh.model.occ.synchronize()
        _embed(gmsh, targets)
        _set_sizes(gmsh.model.mesh.field, geometry)
        for name, value in GMSH_OPTIONS.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(11)
    cells = np.asarray(nodes, dtype=np.int64).reshape(-1, 10)[:, TET10_FROM_GMSH]
    used, cells = np.unique(cells, return_inverse=True)
    row = np.argsort(tags)[np.searchsorted(np.sort(tags), used)]
    return np.asarray(coordinates).reshape(-1, 3)[row], cells.reshape(-1, 10).astype(np.int64)


def _build(occ: Any, geometry: BladePair) -> None:
    """Build foot, shank with platform, and airfoil, fused into one solid."""
    g = geometry
    foot = occ.addBox(
        -g.foot_width / 2, -g.foot_depth / 2, -g.foot_height,
        g.foot_width, g.foot_depth, g.foot_height,
    )  # fmt: skip
    edge, (flat, curved) = g.platform_height - g.platform_edge, g.shank_tops
    w, s = g.half_width, g.shank_thickness / 2
    outline = [(s, 0), (s, flat), (w, edge), (w, g.platform_height)]
    outline += [(-w, g.platform_height), (-w, edge), (-s, curved), (-s, 0)]
    corners = [occ.addPoint(x, -g.platform_depth / 2, z) for x, z in outline]
    lines = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    body = [e for e in occ.extrude([(2, face)], 0, g.platform_depth, 0) if e[0] == 3]
    wires = [_wire(occ, _section(g, span)) for span in (0.0, 0.5, 1.0)]
    airfoil = occ.addThruSections(wires, makeSolid=True, makeRuled=True)
    occ.fuse([(3, foot)], body + [e for e in airfoil if e[0] == 3])


def _wire(occ: Any, section: FloatArray) -> int:
    """Return a closed wire: two splines a face (so that mid-chord is a vertex), blunt edges."""
    p = [occ.addPoint(*xyz) for xyz in section]
    curves = []
    for a in (0, 5):
        curves += [occ.addSpline(p[a : a + 3]), occ.addSpline(p[a + 2 : a + 5])]
        curves.append(occ.addLine(p[a + 4], p[(a + 5) % 10]))
    return int(occ.addWire(curves))


def _embed(gmsh: Any, targets: FloatArray) -> None:
    """Make every target a point of the plane face that holds it, so that it becomes a node."""
    on_face: dict[int, list[int]] = {}
    faces = [tag for _, tag in gmsh.model.getEntities(2)]

    def holds(face: int, target: FloatArray) -> bool:
        # isInside projects on the face first: the distance has to be asked for as well
        closest, _ = gmsh.model.getClosestPoint(2, face, list(target))
        near = np.abs(np.array(closest) - target).max() < MATCH
        return bool(near and gmsh.model.isInside(2, face, list(target)))

    for target in targets:
        face = next(f for f in faces if holds(f, target))
        on_face.setdefault(face, []).append(gmsh.model.occ.addPoint(*target))
    gmsh.model.occ.synchronize()
    for face, points in on_face.items():
        gmsh.model.mesh.embed(0, points, 2, face)


def _set_sizes(field: Any, geometry: BladePair) -> None:
    """Set one element size each for airfoil, platform, and shank with foot."""
    g, far = geometry, 1.0
    levels = [-far, min(g.shank_tops), g.platform_height, far]
    boxes = []
    sizes = (g.foot_size, g.platform_size, g.airfoil_size)
    for size, low, high in zip(sizes, levels, levels[1:], strict=False):
        tag = field.add("Box")
        for key, value in {
            "VIn": size, "VOut": far, "ZMin": low, "ZMax": high,
            "XMin": -far, "XMax": far, "YMin": -far, "YMax": far,
        }.items():  # fmt: skip
            field.setNumber(tag, key, value)
        boxes.append(tag)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", boxes)
    field.setAsBackgroundMesh(smallest)

"""Two equal cantilever blades with platforms: geometry, and mesh of second-order tetrahedra.

Coordinates: x circumferential (the blades bend this way), y axial, z radial. Blade 1 stands at
x = 0, blade 2 at x = `pitch`.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import InputError, StickslipError, input_error
from stickslip.model.mesh.gmsh_session import gmsh_session, quadratic_tetrahedra
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.rigid.dampers import ContactPoints
from stickslip.units import angle, check_quantities, length, quantity


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
        Inclination from x of the underside that faces +x (on blade 1, touched by the damper's flat side) and of the one that
        faces −x (on blade 2, touched by its curved side).
    airfoil_length
        Length from the platform's top to the tip.
    hub_chord, tip_chord, hub_thickness, tip_thickness
        Size of the airfoil's end sections.
    camber
        Height of the camber line's arc over the chord's length.
    twist
        Rotation of the tip section against the hub section about z.
    force_span
        Position of the force node on blade 1: on the airfoil, as a fraction of the span from hub to tip; negative: on the shank, as a
        fraction of its height from the platform down to the foot.
    airfoil_size, platform_size, foot_size
        Element sizes.

    Raises
    ------
    InputError
        If a length is not positive or the parts do not fit together.
    """

    pitch: float = length("distance of the two blades along x", 0.056)
    foot_width: float = length("extent of the foot along x", 0.034)
    foot_depth: float = length("extent of the foot along y", 0.048)
    foot_height: float = length("extent of the foot along z; its bottom and flanks are clamped", 0.020)
    shank_thickness: float = length("extent of the shank along x", 0.0132)
    platform_gap: float = length("clearance between neighbouring platforms along x", 0.001)
    platform_depth: float = length("extent of shank and platform along y", 0.048)
    platform_height: float = length("height of the platform's top above the foot", 0.110)
    platform_edge: float = length("thickness of the platform at its edges", 0.004)
    flat_angle: float = angle("inclination from x of the underside of blade 1", 45, above=0, below=90)
    curved_angle: float = angle("inclination from x of the underside of blade 2", 60, above=0, below=90)
    airfoil_length: float = length("length of the airfoil from the platform to the tip", 0.160)
    hub_chord: float = length("chord of the airfoil at the platform", 0.046)
    tip_chord: float = length("chord of the airfoil at the tip", 0.040)
    hub_thickness: float = length("thickness of the airfoil at the platform", 0.0065)
    tip_thickness: float = length("thickness of the airfoil at the tip", 0.0055)
    camber: float = quantity("height of the camber line over the chord", default=0.04, usual=0.3)
    twist: float = angle("rotation of the tip against the hub", 8, usual=90)
    force_span: float = quantity(
        "place of the node set force on blade 1: on the airfoil, a fraction of the span from the hub; below zero on the shank, "
        "a fraction of its height from the platform down",
        default=0.0,
        above=-1,
        below=0.5,
    )
    airfoil_size: float = length("element size in the airfoil", 0.0060)
    platform_size: float = length("element size in the platform", 0.0055)
    foot_size: float = length("element size in shank and foot", 0.0080)

    def __post_init__(self) -> None:
        check_quantities(self)
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
        self._check_force()

    def _check_force(self) -> None:
        """Refuse a force node so near to an end of the shank that only sliver elements fit between."""
        top = self.shank_tops[1]
        place, least = (1.0 + self.force_span) * top, self.foot_size / 20
        if self.force_span < 0.0 and not least <= place <= top - least:
            raise _bad(
                "force_span",
                f"{self.force_span:.9g} puts the force {min(place, top - place):.3g} m from an end of the shank, with elements of {self.foot_size} m",
                f"Keep it between {1.1 * least / top - 1:.3g} and {-1.1 * least / top:.3g} on the shank, or give zero: the hub.",
            )

    def _check_supports(self) -> None:
        reach = abs(self.camber) * self.hub_chord + self.hub_thickness / 2
        if self.hub_chord >= self.platform_depth or reach >= self.half_width:
            raise _bad(
                "hub_chord",
                f"the airfoil's hub section ({self.hub_chord} m × {2 * reach} m) overhangs the platform",
                "Make it smaller than the platform.",
            )
        if self.foot_width < self.shank_thickness or self.foot_depth < self.platform_depth:
            raise _bad(
                "foot_width",
                f"the foot ({self.foot_width} × {self.foot_depth} m) is smaller than the shank "
                f"({self.shank_thickness} × {self.platform_depth} m)",
                "Make the foot at least as large as the blade on it.",
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


def _bad(name: str, problem: str, remedy: str) -> InputError:
    return input_error(f"BladePair.{name}", problem, remedy)


MATCH = 1e-9  # m: largest distance of a node from its contact point


def mesh_blade_pair(geometry: BladePair, contacts: ContactPoints) -> SolidMesh:
    """Mesh both blades, with a node at every contact point.

    One blade is meshed and copied, so the blades are equal to the last bit.

    Parameters
    ----------
    geometry
        The blades.
    contacts
        Contact points of the damper; points on its flat side become nodes of blade 1, points on its curved
        side nodes of blade 2.

    Returns
    -------
    SolidMesh
        With the sets ``root``, ``underside_1`` and ``underside_2`` (nodes at the contact points on the flat and on the
        curved side, in their order; all nodes of the face where a side has no points), ``force`` (on blade 1, at `force_span`), ``tip1``, ``edge1`` (tip and
        mid-span leading edge of blade 1) and ``tip2`` (of blade 2). Further ``contact`` (in the order of `contacts`),
        ``contact_L1`` and so on (one a line) and ``output``.

    Raises
    ------
    InputError
        If a contact point does not lie on its platform's underside.
    StickslipError
        If gmsh cannot be loaded.
    """
    check_on_undersides(geometry, contacts)
    offset = np.array([geometry.pitch, 0.0, 0.0])
    on_second = np.array([side == "curved" for side in contacts.side], dtype=bool)
    targets = contacts.position - on_second[:, None] * offset
    marks = {"force": _force_place(geometry), "edge": _section(geometry, 0.5)[0]}
    marks["tip"] = _section(geometry, 1.0)[2]
    on_shank = geometry.force_span < 0.0
    points, cells = _mesh_blade(geometry, np.vstack([targets, marks["force"]]) if on_shank else targets)
    nearest = _match(points, np.vstack([targets, *(marks[k] for k in ("force", "edge", "tip"))]))
    n = len(points)
    contact = nearest[:-3] + n * on_second
    force, edge, tip = nearest[-3:]
    root = _clamped(geometry, points)
    sets = {"root": np.concatenate([root, root + n]), "contact": contact}
    for line in dict.fromkeys(name.split(".")[0] for name in contacts.names):
        sets[f"contact_{line}"] = contact[contacts.on_line(line)]
    sets |= {"force": np.array([force]), "output": np.array([tip, edge, tip + n])}
    faces = (_underside(geometry, points, 1), _underside(geometry, points, -1) + n)
    for name, own, face in zip(
        ("underside_1", "underside_2"), (contact[~on_second], contact[on_second]), faces, strict=True
    ):
        sets[name] = own if own.size else face
    sets |= {"tip1": np.array([tip]), "edge1": np.array([edge]), "tip2": np.array([tip + n])}
    return SolidMesh(np.vstack([points, points + offset]), np.vstack([cells, cells + n]), sets)


def check_on_undersides(geometry: BladePair, contacts: ContactPoints) -> None:
    """Refuse contact points that are off the platforms' underside faces.

    Raises
    ------
    InputError
        If there are such points; the message names them.
    """
    edge = geometry.platform_height - geometry.platform_edge
    misses = []
    for name, side, (x, y, z) in zip(contacts.names, contacts.side, contacts.position, strict=True):
        flat = side == "flat"
        inward = x if flat else geometry.pitch - x
        angle = geometry.flat_angle if flat else geometry.curved_angle
        off = z * math.cos(angle) - (edge * math.cos(angle) - (geometry.half_width - inward) * math.sin(angle))
        inside = geometry.shank_thickness / 2 < inward < geometry.half_width
        if abs(off) > MATCH or not inside or abs(y) >= geometry.platform_depth / 2:
            misses.append(f"{name} at ({x:.6g}, {y:.6g}, {z:.6g}) m, {off:.3g} m from the {side} side's plane")
    if misses:
        raise input_error(
            "mesh_blade_pair",
            "non-matching node sets: these contact points of the damper are not on a platform's "
            "underside: " + "; ".join(misses),
            "Place the damper's apex at the blades' wedge_apex "
            f"({geometry.wedge_apex[0]:.6g}, {geometry.wedge_apex[1]:.6g}) m, give both the same "
            "angles, and keep its lines and sections on the faces.",
        )


def _force_place(geometry: BladePair) -> FloatArray:
    """Return the position of the force node (3,): on the airfoil's pressure side or on the shank's face away from the damper."""
    if geometry.force_span >= 0.0:
        return np.asarray(_section(geometry, geometry.force_span)[7])
    height = (1.0 + geometry.force_span) * geometry.shank_tops[1]
    return np.array([-geometry.shank_thickness / 2, 0.0, height])


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


def _underside(geometry: BladePair, points: FloatArray, side: int) -> IntArray:
    """Return the nodes of the underside of blade 1 that faces +x (`side` 1: the flat one) or -x (-1: the curved one)."""
    g = geometry
    angle = g.flat_angle if side > 0 else g.curved_angle
    inward, z = side * points[:, 0], points[:, 2]
    off = (z - g.platform_height + g.platform_edge) * math.cos(angle)
    off = off + (g.half_width - inward) * math.sin(angle)
    return np.flatnonzero((np.abs(off) < MATCH) & (inward > g.shank_thickness / 2 - MATCH))


def _match(points: FloatArray, targets: FloatArray) -> IntArray:
    """Return the node at each target; a missing node is an error of the mesher."""
    from scipy.spatial import cKDTree

    distance, nearest = cKDTree(points).query(targets)
    if np.any(distance > MATCH):
        missed = ", ".join(str(t) for t in targets[distance > MATCH])
        raise StickslipError(f"gmsh put no node at {missed}; change the element sizes slightly")
    return np.asarray(nearest, dtype=np.int64)


def _mesh_blade(geometry: BladePair, targets: FloatArray) -> tuple[FloatArray, IntArray]:
    """Mesh blade 1 alone with nodes at `targets`; return points (n, 3) and VTK cells (m, 10)."""
    with gmsh_session() as gmsh:
        _build(gmsh.model.occ, geometry)
        gmsh.model.occ.synchronize()
        _embed(gmsh, targets)
        _set_sizes(gmsh.model.mesh.field, geometry)
        return quadratic_tetrahedra(gmsh)


def _build(occ: Any, geometry: BladePair) -> None:
    """Build foot, shank with platform, and airfoil, fused into one solid."""
    g = geometry
    foot = occ.addBox(-g.foot_width / 2, -g.foot_depth / 2, -g.foot_height, g.foot_width, g.foot_depth, g.foot_height)
    edge, (flat, curved) = g.platform_height - g.platform_edge, g.shank_tops
    w, s = g.half_width, g.shank_thickness / 2
    outline = [(s, 0), (s, flat), (w, edge), (w, g.platform_height)]
    outline += [(-w, g.platform_height), (-w, edge), (-s, curved), (-s, 0)]
    corners = [occ.addPoint(x, -g.platform_depth / 2, z) for x, z in outline]
    lines = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    body = [e for e in occ.extrude([(2, face)], 0, g.platform_depth, 0) if e[0] == 3]
    wires = [_wire(occ, _section(g, span)) for span in sorted({0.0, max(g.force_span, 0.0), 0.5, 1.0})]
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
    """Embed every target in the plane face that contains it, so that it becomes a node."""
    on_face: dict[int, list[int]] = {}
    faces = [tag for _, tag in gmsh.model.getEntities(2)]

    def holds(face: int, target: FloatArray) -> bool:
        # isInside projects on the face first, so the distance is checked as well
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
            "VIn": size,
            "VOut": far,
            "ZMin": low,
            "ZMax": high,
            "XMin": -far,
            "XMax": far,
            "YMin": -far,
            "YMax": far,
        }.items():
            field.setNumber(tag, key, value)
        boxes.append(tag)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", boxes)
    field.setAsBackgroundMesh(smallest)

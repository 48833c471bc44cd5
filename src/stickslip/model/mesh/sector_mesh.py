"""A sector of a bladed disk, meshed with second-order tetrahedra whose cyclic faces match node by node."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import StickslipError
from stickslip.model.axis import Axis
from stickslip.model.mesh.gmsh_session import gmsh_session, quadratic_tetrahedra
from stickslip.model.mesh.sector import BladedSector
from stickslip.model.mesh.solid_mesh import SolidMesh

ON_FACE = 1e-7  # m: largest distance of gmsh's nodes and centres from their surface
MOVED = 1e-8  # m: largest move of a node that makes the two faces match exactly
TET10 = 11  # gmsh's number of the element type
FLATTEST = 1e-3  # smallest volume of a tetrahedron over the volume of a regular one with its longest edge


@dataclass(frozen=True)
class _FacePair:
    """Two faces (gmsh's tags); the second is the first, turned by `angle` about z."""

    name: str
    low: int
    high: int
    angle: float


def mesh_sector(geometry: BladedSector) -> SolidMesh:
    """Mesh one sector; equal geometries give equal meshes.

    Parameters
    ----------
    geometry
        The sector.

    Returns
    -------
    SolidMesh
        With the node sets ``root`` (the bore), ``cyclic_low`` and ``cyclic_high`` (faces at minus and plus half the pitch),
        ``tip``, with a platform ``platform_low``, ``platform_high`` (its side faces), ``platform_under``, and with a shroud
        ``shroud_low``, ``shroud_high`` (its contact faces). The sets ``…_low`` and ``…_high`` have the same order: the i-th
        node of the high face is the i-th node of the low face turned about the axis, to rounding.

    Raises
    ------
    StickslipError
        If gmsh cannot be loaded or cannot mesh the geometry.
    """
    with gmsh_session() as gmsh:
        try:
            return _mesh(gmsh, geometry)
        except Exception as error:
            if isinstance(error, StickslipError):
                raise
            raise StickslipError(
                f"gmsh could not mesh the sector: {error}. Change the element sizes slightly"
            ) from error


def _mesh(gmsh: Any, geometry: BladedSector) -> SolidMesh:
    _build(gmsh.model.occ, geometry)
    gmsh.model.occ.synchronize()
    if len(gmsh.model.getEntities(3)) != 1:
        raise StickslipError("the sector's parts do not hang together; check its geometry")
    pairs = _face_pairs(gmsh, geometry)
    for pair in pairs:
        turn = np.eye(4)
        turn[:3, :3] = Axis().rotation(pair.angle)
        gmsh.model.mesh.setPeriodic(2, [pair.high], [pair.low], turn.ravel().tolist())
    gmsh.model.mesh.setSizeCallback(_sizes(geometry))
    try:
        points, cells = quadratic_tetrahedra(gmsh)
    finally:
        gmsh.model.mesh.removeSizeCallback()
    _check_shapes(points, cells)
    tags = np.unique(gmsh.model.mesh.getElementsByType(TET10)[1])
    sets = _single_faces(gmsh, geometry, tags)
    for pair in pairs:
        low, high = _matched_nodes(gmsh, pair, tags)
        turned = Axis().turned(points[low], pair.angle)
        if np.abs(turned - points[high]).max() > MOVED:
            raise StickslipError(f"the faces {pair.name}_low and {pair.name}_high do not match")
        points[high] = turned
        sets |= {f"{pair.name}_low": low, f"{pair.name}_high": high}
    return SolidMesh(points, cells, sets)


def _build(occ: Any, geometry: BladedSector) -> None:
    """Build disk, neck with platform, airfoil and shroud, fused into one solid."""
    parts = [_disk(occ, geometry)]
    if geometry.platform is not None:
        z = -geometry.platform.depth / 2
        outline = np.array([[x, y, z] for x, y in geometry.platform_outline()])
        swept = occ.extrude([(2, _polygon(occ, outline))], 0, 0, geometry.platform.depth)
        parts += [e for e in swept if e[0] == 3]
    wires = [_wire(occ, section) for section in geometry.airfoil_sections()]
    parts += [e for e in occ.addThruSections(wires, makeSolid=True) if e[0] == 3]
    if geometry.shroud is not None:
        parts.append(_shroud(occ, geometry))
    occ.fuse(parts[:1], parts[1:])


def _polygon(occ: Any, corners: FloatArray) -> int:
    """Return the plane face with these corners (p, 3)."""
    points = [occ.addPoint(*corner) for corner in corners]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _revolved(occ: Any, face: int, angle: float) -> tuple[int, int]:
    swept = occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, angle)
    return next((int(dim), int(tag)) for dim, tag in swept if dim == 3)


def _disk(occ: Any, geometry: BladedSector) -> tuple[int, int]:
    corners = np.array([[r, 0.0, z] for r, z in geometry.disk.outline])
    half = geometry.pitch / 2
    return _revolved(occ, _polygon(occ, Axis().turned(corners, -half)), geometry.pitch)


def _shroud(occ: Any, geometry: BladedSector) -> tuple[int, int]:
    """Turn the low contact face about the axis, so that the high one is its image."""
    shroud = geometry.shroud
    assert shroud is not None
    corners = np.array(
        [
            [geometry.shroud_radius + a * shroud.thickness / 2, s * math.tan(shroud.face_angle), s]
            for a, s in zip((-1, 1, 1, -1), np.array([-1, -1, 1, 1]) * shroud.depth / 2, strict=True)
        ]
    )
    angle = geometry.shroud_angle
    return _revolved(occ, _polygon(occ, Axis().turned(corners, -angle / 2)), angle)


def _wire(occ: Any, section: FloatArray) -> int:
    """Return the closed wire of an airfoil's section: a spline on each face, blunt edges."""
    p = [occ.addPoint(*xyz) for xyz in section]
    half = len(p) // 2
    curves = [occ.addSpline(p[:half]), occ.addLine(p[half - 1], p[half])]
    curves += [occ.addSpline(p[half:]), occ.addLine(p[-1], p[0])]
    return int(occ.addWire(curves))


def _sizes(geometry: BladedSector) -> Callable[..., float]:
    """Return gmsh's callback for the element size at a point, a function of its radius.

    It has no jumps, since gmsh would call it a million times to locate them.
    """
    g = geometry
    rim = g.disk.rim_radius
    radii, sizes = [rim - g.disk.rim_height], [g.disk_size]
    if g.platform is not None:
        radii += [rim, g.base_radius, g.base_radius + g.airfoil_size]
        sizes += [g.platform_size, g.platform_size, g.airfoil_size]
    else:
        radii, sizes = [*radii, rim], [*sizes, g.airfoil_size]
    inner, outer = (math.inf, math.inf)
    if g.shroud is not None:
        inner = g.shroud_radius - g.shroud.thickness / 2
        outer = g.shroud_radius + g.shroud.thickness / 2

    def size(dim: int, tag: int, x: float, y: float, z: float, lc: float) -> float:
        del dim, tag, z, lc
        radius = math.hypot(x, y)
        body = float(np.interp(radius, radii, sizes))
        return min(body, g.platform_size + max(inner - radius, radius - outer, 0.0))

    return size


def _face_pairs(gmsh: Any, geometry: BladedSector) -> list[_FacePair]:
    """Find the faces that are turned images of each other: cyclic, of the platform, of the shroud."""
    g = geometry
    pairs = [_pair(gmsh, "cyclic", g.pitch, 0.0, (0.0, g.disk.rim_radius))]
    if g.platform is not None:
        band = (g.disk.rim_radius, g.base_radius / math.cos(g.pitch / 2))
        pairs.append(_pair(gmsh, "platform", g.platform_angle, 0.0, band))
    if g.shroud is not None:
        reach = (g.shroud_radius - g.shroud.thickness, g.shroud_radius + g.shroud.thickness)
        pairs.append(_pair(gmsh, "shroud", g.shroud_angle, g.shroud.face_angle, reach))
    return pairs


def _pair(gmsh: Any, name: str, angle: float, tilt: float, band: tuple[float, float]) -> _FacePair:
    """Find the plane faces at plus and minus half the `angle`, tilted by `tilt`, with the radius of their centres in `band`."""
    found = []
    for sign in (-1, 1):
        normal = Axis().turned(np.array([[0.0, math.cos(tilt), -math.sin(tilt)]]), sign * angle / 2)
        faces = [
            tag
            for _, tag in gmsh.model.getEntities(2)
            if _lies_in(gmsh, tag, normal[0]) and band[0] < _radius(gmsh, tag) < band[1]
        ]
        if len(faces) != 1:
            raise StickslipError(
                f"the {name} face at {sign * math.degrees(angle) / 2:.6g} degrees came out in "
                f"{len(faces)} pieces; check what the airfoil or the neck cuts"
            )
        found.append(faces[0])
    return _FacePair(name, found[0], found[1], angle)


def _radius(gmsh: Any, face: int) -> float:
    x, y, _ = gmsh.model.occ.getCenterOfMass(2, face)
    return math.hypot(x, y)


def _lies_in(gmsh: Any, face: int, normal: FloatArray) -> bool:
    """Whether all corners of a face and its centre lie in the plane through the origin with this normal."""
    corners = gmsh.model.getBoundary([(2, face)], recursive=True)
    at = [gmsh.model.getValue(0, tag, []) for _, tag in corners]
    at.append(gmsh.model.occ.getCenterOfMass(2, face))
    return bool(np.abs(np.array(at) @ normal).max() < ON_FACE)


def _rows(tags: IntArray, wanted: Any) -> IntArray:
    """Return the rows of gmsh's node tags `wanted` in the sorted `tags`."""
    return np.asarray(np.searchsorted(tags, np.asarray(wanted)), dtype=np.int64)


def _matched_nodes(gmsh: Any, pair: _FacePair, tags: IntArray) -> tuple[IntArray, IntArray]:
    """Return the nodes of both faces, paired, in the order of the low face."""
    master, high, low, _ = gmsh.model.mesh.getPeriodicNodes(2, pair.high, True)
    on_face, _, _ = gmsh.model.mesh.getNodes(2, pair.low, True, False)
    if master != pair.low or len(np.unique(low)) != len(np.unique(on_face)):
        raise StickslipError(f"gmsh did not match all nodes of the {pair.name} faces")
    _, first = np.unique(low, return_index=True)
    return _rows(tags, low[first]), _rows(tags, high[first])


def _single_faces(gmsh: Any, geometry: BladedSector, tags: IntArray) -> dict[str, IntArray]:
    """Return the node sets of the faces that have no partner."""
    chosen: dict[str, list[IntArray]] = {}
    for _, face in gmsh.model.getEntities(2):
        corners = gmsh.model.getBoundary([(2, face)], recursive=True)
        at = np.array([gmsh.model.getValue(0, tag, []) for _, tag in corners])
        name = _face_name(geometry, at)
        if name:
            nodes, _, _ = gmsh.model.mesh.getNodes(2, face, True, False)
            chosen.setdefault(name, []).append(_rows(tags, nodes))
    wanted = {"root", "tip"} | ({"platform_under"} if geometry.platform else set())
    if set(chosen) != wanted:
        raise StickslipError(f"the sector has no faces for {sorted(wanted - set(chosen))}")
    return {name: np.unique(np.concatenate(parts)) for name, parts in chosen.items()}


def _face_name(geometry: BladedSector, corners: FloatArray) -> str:
    """Return the node set to which a face with these corners (n, 3) belongs; empty for none."""
    radius = np.hypot(corners[:, 0], corners[:, 1])
    if np.abs(radius - geometry.disk.bore_radius).max() < ON_FACE:
        return "root"
    shroud = geometry.shroud
    if shroud is not None and shroud.span == 1.0:
        if radius.min() > geometry.shroud_radius + shroud.thickness / 2 - ON_FACE:
            return "tip"
    elif np.abs(corners[:, 0] - geometry.tip_radius).max() < ON_FACE:
        return "tip"
    if geometry.platform is not None:
        _, inner, outer, *_ = geometry.platform_outline()
        normal = np.array([outer[1] - inner[1], inner[0] - outer[0]])
        normal /= np.linalg.norm(normal)
        for side in (1, -1):
            if np.abs((corners[:, :2] * [1, side] - inner) @ normal).max() < ON_FACE:
                return "platform_under"
    return ""


def _check_shapes(points: FloatArray, cells: IntArray) -> None:
    """Refuse tetrahedra that are inside out or nearly flat."""
    corner = points[cells[:, :4]]
    edges = (corner[:, :, None] - corner[:, None]).reshape(len(cells), -1, 3)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6
    quality = volume / (longest**3 / (6 * math.sqrt(2)))
    worst = int(np.argmin(quality))
    if quality[worst] < FLATTEST:
        raise StickslipError(
            f"gmsh made an element of quality {quality[worst]:.3g} at {corner[worst].mean(axis=0)}; "
            "change the element sizes slightly"
        )

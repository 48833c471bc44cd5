"""A part from the files of a finite-element program, with the node sets that the study defines."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import InputError, input_error, nearest_and_known
from stickslip.model.axis import Axis
from stickslip.model.damping import dissipates
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.elements import EXACT, Quadrature
from stickslip.model.fe.hourglass import hourglass_doubts
from stickslip.model.fe.material import Materials
from stickslip.model.matrices_at_speeds import AtSpeed, SpeedMatrices, speed_matrices, warnings_of
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import FACES, Part, solid_part, structure_part
from stickslip.model.readers.ansys_archive import (
    COUPLED,
    ansys_passed_over,
    ansys_speed,
    read_ansys_archive,
)
from stickslip.model.readers.ansys_equations import read_ansys_links
from stickslip.model.readers.ansys_materials import ansys_cell_materials
from stickslip.model.readers.calculix_deck import Deck, held_like_partners, read_deck
from stickslip.model.readers.frd import read_displacement
from stickslip.model.readers.open_model import negative_damping, read_structure, refuse_indefinite, refuse_other_models
from stickslip.model.readers.units import Units
from stickslip.model.structure import Structure
from stickslip.study.file.model.material import TemperatureTable
from stickslip.study.file.model.parts import FileModel, SetTable
from stickslip.study.models.temperature import doubts_of_temperature, temperature_of
from stickslip.study.own_code import called
from stickslip.units import RPM

EDGE = 1e-9  # enlargement of boxes and cylinders, over the size of the mesh, to include nodes on their faces


def with_sets(
    key: str, tables: Mapping[str, SetTable], points: FloatArray, numbers: IntArray, known: Mapping[str, IntArray]
) -> dict[str, IntArray]:
    """Return the sets of a file together with the sets that the study defines.

    Parameters
    ----------
    key
        Key of the part, for messages.
    tables
        Set tables of the study by name.
    points
        (n, 3) positions in m of the nodes or dofs that sets refer to by index; NaN if unknown.
    numbers
        (n,) their node numbers in the file.
    known
        Sets of the file.

    Raises
    ------
    InputError
        If the file already has a set of that name, or the new set is empty.
    """
    found = dict(known)
    for name, table in tables.items():
        place = f"{key}.sets.{name}"
        if name.lower() in {own.lower() for own in known}:
            raise input_error(place, "is the name of a set of the file", "Choose a name that the file does not use.")
        members = np.flatnonzero(_picked(place, table, points, numbers, known))
        if not members.size:
            raise _nothing(place, table, points)
        found[name] = members
    return found


def _picked(
    place: str, table: SetTable, points: FloatArray, numbers: IntArray, known: Mapping[str, IntArray]
) -> BoolArray:
    inside = np.ones(len(points), dtype=bool)
    if table.nodes is not None:
        missing = np.setdiff1d(table.nodes, numbers)
        if missing.size:
            raise input_error(
                f"{place}.nodes",
                f"the file has no node {missing[0]} that moves" + f", nor {missing.size - 1} more" * (missing.size > 1),
                "Give node numbers of the file; clamped nodes of matrices are none.",
            )
        inside &= np.isin(numbers, table.nodes)
    edge = EDGE * float(np.ptp(_placed(points), axis=0).max(initial=0.0))
    if table.pattern is not None:
        names = [n for n in known if fnmatchcase(n.lower(), table.pattern.lower())]
        if not names:
            raise input_error(
                f"{place}.pattern",
                f"fits no set of the file, got {table.pattern!r}",
                nearest_and_known(table.pattern, list(known)),
            )
        inside &= np.isin(np.arange(len(points)), np.concatenate([known[n] for n in names]))
    if table.box_m is not None:
        low, high = np.sort(np.array(table.box_m), axis=0)
        inside &= ((points >= low - edge) & (points <= high + edge)).all(axis=1)
    if table.cylinder_m is not None and table.radius_m is not None:
        first, last = np.array(table.cylinder_m)
        length = float(np.linalg.norm(last - first))
        along = (points - first) @ (last - first) / length
        from_axis = np.linalg.norm(points - first - np.outer(along, (last - first) / length), axis=1)
        inner, outer = table.radius_m
        inside &= (along >= -edge) & (along <= length + edge)
        inside &= (from_axis >= inner - edge) & (from_axis <= outer + edge)
    return inside


def _placed(points: FloatArray) -> FloatArray:
    return points[np.isfinite(points).all(axis=1)]


def _nothing(place: str, table: SetTable, points: FloatArray) -> InputError:
    placed = _placed(points)
    if not placed.size:
        return input_error(place, "picks none: no node has a place", "Give matrices their nodes.")
    low, high = (", ".join(f"{v:.5g}" for v in c) for c in (placed.min(axis=0), placed.max(axis=0)))
    keys = [k for k in ("nodes", "pattern", "box_m", "cylinder_m", "radius_m") if getattr(table, k) is not None]
    got = ", ".join(f"{k} = {getattr(table, k)!r}" for k in keys)
    return input_error(
        place,
        f"picks none of the nodes, got {got}",
        f"The nodes lie between [{low}] and [{high}] m, whatever the file's units: widen it.",
    )


ROOT = "root"
DECKS, ARCHIVES = (".inp", ".inp.gz"), (".cdb",)
MESHES = (*DECKS, *ARCHIVES)
PITCH = 1e-4  # largest distance of partners over the size of a sector
COMPANIONS = (".mas", ".dof")  # suffixes of the files that CalculiX writes with a stiffness
_KEPT = "Read it in Python, keep it with save_structure (.npz) and give that: use"


def file_part(
    key: str,
    table: FileModel,
    home: Path,
    material: Materials | None,
    heat: TemperatureTable | None = None,
    **others: Any,
) -> Part:
    """Read a part from its files.

    Parameters
    ----------
    key
        Key of the table, for messages: ``part.blade``.
    table
        The table.
    home
        Folder to which file names are relative.
    material
        Material of all elements; None: the material of the file.
    heat
        Table of its temperature; None: the temperatures of the file.
    **others
        Further fields of `Part`.

    Raises
    ------
    InputError
        If a file cannot be read, table and file disagree, or a set is missing.
    """
    path = home / table.file
    name = path.name.lower()
    if table.temperature is not None and not name.endswith(MESHES) and table.reader is None:
        raise input_error(
            f"{key}.temperature",
            "belongs to a mesh, and the file holds matrices",
            "Leave it out: the matrices are those of one temperature.",
        )
    if table.at_speed and name.endswith(MESHES):
        raise input_error(
            f"{key}.at_speed",
            "belongs to matrices, and the file is a mesh, which is assembled at any speed",
            "Leave at_speed out, or give file matrices at rest.",
        )
    try:
        if table.reader is not None:
            return _from_own_reader(key, table, home, material, others, heat)
        if name.endswith(DECKS):
            return _from_deck(key, table, path, material, others, (heat, home))
        if name.endswith(ARCHIVES):
            return _from_archive(key, table, path, material, others, (heat, home))
        return _from_matrices(key, table, home, others)
    except InputError as error:
        raise error.called(_words(key)) from None


def with_companions(path: Path) -> list[Path]:
    """Return a file and the companion files that CalculiX writes with a stiffness matrix."""
    zipped = ".gz" if path.name.endswith(".gz") else ""
    plain = path.name.removesuffix(".gz")
    if not plain.endswith(".sti"):
        return [path]
    beside = [path.with_name(plain.removesuffix(".sti") + end + zipped) for end in COMPANIONS]
    return [path, *(p for p in beside if p.is_file())]


def _words(key: str) -> dict[str, str]:
    """Return the study's keys by the arguments of the readers."""
    words = {name: f"{key}.{name}" for name in ("units", "mesh", "mass", "nodes")}
    return words | {"plausible": f"{key}.plausible = false", "ignore": "", "use": _KEPT}


def _sectors(key: str, table: FileModel, of_deck: int | None = None) -> int:
    """Return the number of sectors from the deck, or else from the study; if both give it, they must agree."""
    if of_deck is not None and table.sectors not in (None, of_deck):
        raise input_error(
            f"{key}.sectors",
            f"is {table.sectors}, but the deck's cyclic symmetry has {of_deck}",
            f"Give sectors = {of_deck}, or leave it out.",
        )
    sectors = of_deck or table.sectors or 1
    if sectors == 1 and table.low_face is not None:
        raise input_error(
            f"{key}.sectors",
            "must be above 1 with cyclic faces",
            "Give the number of sectors of the wheel, or leave the faces out.",
        )
    return sectors


def _units(table: FileModel) -> Units:
    return Units.named(table.units)


def _from_deck(
    key: str,
    table: FileModel,
    path: Path,
    given: Materials | None,
    others: dict[str, Any],
    heat: tuple[TemperatureTable | None, Path],
) -> Part:
    deck = read_deck(path, units=_units(table), plausible=table.plausible)
    sectors = _sectors(key, table, deck.sectors)
    if deck.sectors is None and sectors > 1 and table.cyclic == "node_to_node":
        deck = held_like_partners(deck, _face_nodes(key, table, deck.mesh, sectors), table.axis() or deck.axis, sectors)
    links = deck.links
    if links is not None and sectors > 1 and deck.sectors is None:
        links = replace(links, lasting=np.concatenate(_face_nodes(key, table, deck.mesh, sectors)))
    partly = deck.held.any(axis=1) & ~deck.held.all(axis=1)
    part = _solid(
        key,
        table,
        deck.mesh,
        given or _materials(deck),
        sectors,
        deck.axis,
        (*heat, deck.temperature),
        held=deck.held if partly.any() else None,
        links=links,
        quadrature=deck.calculix(table.hourglass) if table.quadrature == "calculix" else deck.exact(table.hourglass),
        clamped_sets=deck.clamped_sets,
        warnings=(
            *(f"{table.file}: passed over {text}" for text in deck.ignored),
            *(f"{table.file}: {text}" for text in deck.told),
        ),
        own_speed=deck.speed or 0.0,
        **others,
    )
    if part.solid is None:
        return part
    cut = np.zeros(len(deck.mesh.points), dtype=bool)
    for face in part.faces if part.sectors > 1 else ():
        cut[part.solid.mesh.node_sets.get(face, np.zeros(0, dtype=np.int64))] = True
    said = (f"{table.file}: {text}" for text in hourglass_doubts(part.solid, cut | ~part.solid.free))
    return replace(part, warnings=(*part.warnings, *said))


def _face_nodes(key: str, table: FileModel, mesh: SolidMesh, sectors: int) -> tuple[IntArray, IntArray]:
    """Return the nodes of the two cyclic faces that a study names."""
    sets = with_sets(key, table.sets, mesh.points, mesh.numbers, mesh.node_sets)
    low, high = (sets[name] for name in _faces(key, table, sets, sectors))
    return low, high


def _materials(deck: Deck) -> Materials:
    if len(set(deck.cell_material)) > 1:
        return [deck.materials[name] for name in deck.cell_material]
    return deck.material


def _from_archive(
    key: str,
    table: FileModel,
    path: Path,
    given: Materials | None,
    others: dict[str, Any],
    heat: tuple[TemperatureTable | None, Path],
) -> Part:
    mesh = read_ansys_archive(path, units=_units(table), linked=True)
    if given is None:
        numbers = mesh.cell_numbers.tolist()
        found = ansys_cell_materials(path, numbers, _units(table), plausible=table.plausible)
        given = found if len(set(found)) > 1 else found[0]
    sectors = _sectors(key, table)
    mesh = _cyclic_pairs(key, mesh, sectors, table.axis() or Axis())
    links = read_ansys_links(path, mesh, cyclic=sectors > 1)
    if links is not None and sectors > 1:
        links = replace(links, lasting=np.concatenate(_face_nodes(key, table, mesh, sectors)))
    quadrature = Quadrature.calculix() if table.quadrature == "calculix" else EXACT
    return _solid(
        key,
        table,
        mesh,
        given,
        sectors,
        None,
        (*heat, None),
        quadrature=quadrature,
        links=links,
        warnings=tuple(f"{table.file}: passed over {text}" for text in ansys_passed_over(path)),
        own_speed=ansys_speed(path, _units(table)),
        **others,
    )


def _cyclic_pairs(key: str, mesh: SolidMesh, sectors: int, axis: Axis) -> SolidMesh:
    """Return a mesh with cyclic faces made of its coupled pairs of nodes, and the nodes on the axis.

    Raises
    ------
    InputError
        If the pairs are not one pitch apart; such couplings are not supported.
    """
    from scipy.spatial import cKDTree

    sets = {name: own for name, own in mesh.node_sets.items() if name not in COUPLED}
    if len(sets) == len(mesh.node_sets):
        return mesh
    near = PITCH * float(np.ptp(mesh.points, axis=0).max())
    one, other = (mesh.node_sets[name] for name in COUPLED)
    if sectors == 1 and cKDTree(mesh.points[other]).query(mesh.points[one])[0].max() < near:
        return replace(mesh, node_sets=sets)  # equations of nodes at one place, see read_ansys_links
    on_axis = np.flatnonzero(np.linalg.norm(axis.arm(mesh.points), axis=1) < near)
    for low, high in ((one, other), (other, one)):
        moved = axis.turned(mesh.points[low], 2 * np.pi / sectors)
        distance, _ = cKDTree(mesh.points[high]).query(moved)
        if sectors > 1 and distance.max() < near:
            both = (np.union1d(own, on_axis) for own in (low, high))
            return replace(mesh, node_sets=sets | dict(zip(FACES, both, strict=True)))
    raise input_error(
        f"{key}.sectors",
        f"is {sectors}, and the file couples {one.size} pairs of nodes (CP) that lie no such pitch apart",
        "Give the number of sectors, or delete the coupling (CPDELE).",
    )


def _solid(
    key: str,
    table: FileModel,
    mesh: SolidMesh,
    material: Materials,
    sectors: int,
    axis: Axis | None,
    heat: tuple[TemperatureTable | None, Path, Temperature | None],
    clamped_sets: tuple[str, ...] = (),
    **others: Any,
) -> Part:
    mesh = replace(mesh, node_sets=with_sets(key, table.sets, mesh.points, mesh.numbers, mesh.node_sets))
    faces = _faces(key, table, mesh.node_sets, sectors)
    free = _clamped(key, table, mesh)
    gone = *clamped_sets, *(name for name in mesh.node_sets if name not in free.node_sets)
    axis = table.axis() or axis or Axis()
    given, home, of_deck = heat
    notes: list[str] = []
    temperature = temperature_of(key, given, free, material, axis, home=home, of_deck=of_deck, say=notes.append)
    doubts = doubts_of_temperature(key, given, free, material, axis, temperature or of_deck)
    others["warnings"] = (*others.get("warnings", ()), *notes, *doubts)
    return solid_part(
        free,
        material,
        axis,
        temperature=temperature,
        sectors=sectors,
        faces=faces,
        cyclic=_tied(table),
        clamped_sets=gone,
        supports=_supports(key, mesh, free, others.get("held")),
        alone=table.sectors == 1 or not table.plausible,
        **others,
    )


def _from_own_reader(
    key: str,
    table: FileModel,
    home: Path,
    material: Materials | None,
    others: dict[str, Any],
    heat: TemperatureTable | None,
) -> Part:
    """Read a part with the user's function."""
    place = f"{key}.reader"
    found = called(str(table.reader), place, home / table.file, units=_units(table))
    refuse_other_models(place, str(table.reader), found)
    if not isinstance(found, SolidMesh):
        return _from_matrices(key, table, home, others, found)
    if material is None:
        raise input_error(f"{key}.material", "is missing", "Add the table [material], or one of the part.")
    return _solid(key, table, found, material, _sectors(key, table), None, (heat, home, None), **others)


def _from_matrices(
    key: str, table: FileModel, home: Path, others: dict[str, Any], own: Structure | None = None
) -> Part:
    if table.clamped:
        raise input_error(
            f"{key}.clamped",
            "cannot be applied to a model of matrices, which hold their supports already",
            "Leave it out, and hold the nodes in the program that wrote the file.",
        )
    sectors = _sectors(key, table)
    files = {name: home / file for name, file in table.files().items()}
    structure = _matrices(key, table, files) if own is None else own
    picked = with_sets(key, table.sets, structure.dofs.position, structure.dofs.node, structure.sets)
    structure = replace(structure, sets=picked)
    if table.plausible:
        refuse_indefinite(structure, str(files["file"]))
    mesh = None
    if "mesh" in files and files["mesh"].name.lower().endswith(DECKS):
        mesh = read_deck(files["mesh"], units=_units(table), plausible=table.plausible).mesh
    if table.damping is None and dissipates(structure):  # the file's damping counts, not the damping of the whole study
        others = {name: value for name, value in others.items() if name != "damping"}
    faces = _faces(key, table, structure.sets, sectors)
    axis = table.axis() or Axis()
    turning = _at_speeds(key, table, files, structure, axis) if table.at_speed else None
    others["warnings"] = (
        *negative_damping(structure, table.file),
        *(() if turning is None else warnings_of(turning, key, axis)),
    )
    return structure_part(
        structure, mesh=mesh, turning=turning, sectors=sectors, faces=faces, cyclic=_tied(table), axis=axis, **others
    )


def _at_speeds(key: str, table: FileModel, files: Mapping[str, Path], rest: Structure, axis: Axis) -> SpeedMatrices:
    """Read the matrices at the speeds of a part; mass, nodes and sets are those of its own file."""
    states = [AtSpeed(0.0, rest)]
    for i, own in enumerate(table.at_speed):
        here = {
            name: files[f"at_speed[{i}].{name}"]
            for name in ("file", "damping_matrix")
            if f"at_speed[{i}].{name}" in files
        }
        shared = {name: files[name] for name in ("mesh", "mass", "nodes") if name in files}
        there = _matrices(f"{key}.at_speed[{i}]", table, here | shared)
        speed = RPM * own.speed_rpm
        structure = replace(there, sets=rest.sets)
        moved = files.get(f"at_speed[{i}].displacement")
        displacement = None if moved is None else read_displacement(moved, structure.dofs, _units(table))
        states.append(AtSpeed(speed, structure, displacement))
    try:
        return speed_matrices(states, axis, between=table.between)
    except InputError as error:
        raise error.inside(key) from None


def _matrices(key: str, table: FileModel, files: Mapping[str, Path]) -> Structure:
    """Read matrices by the suffix of their file."""
    names = {"mesh": "mesh", "mass": "mass", "damping_matrix": "damping", "nodes": "nodes"}
    beside = {names[name]: path for name, path in files.items() if name in names}
    return read_structure(f"{key}.file", files["file"], units=_units(table), plausible=table.plausible, **beside)


def _clamped(key: str, table: FileModel, mesh: SolidMesh) -> SolidMesh:
    """Return the mesh with the clamped nodes in the set ``root`` only."""
    sets = dict(mesh.node_sets)
    held = set(sets.pop(ROOT, np.zeros(0, dtype=np.int64)).tolist())
    for i, name in enumerate(table.clamped):
        held.update(sets[_known(f"{key}.clamped[{i}]", name, sets)].tolist())
    root = np.array(sorted(held), dtype=np.int64)
    kept = {name: _without(members, root) for name, members in sets.items()}
    return replace(mesh, node_sets={k: m for k, m in ({ROOT: root} | kept).items() if m.size})


def _supports(key: str, mesh: SolidMesh, free: SolidMesh, held: BoolArray | None) -> str:
    """Say which nodes the file holds and how many the study adds.

    Parameters
    ----------
    key
        Key of the part.
    mesh, free
        Mesh of the file, and the same with the clamped nodes of the study.
    held
        (node, 3) directions that the file holds; None: all or none at each node.
    """
    own, every = (one.node_sets.get(ROOT, np.zeros(0, dtype=np.int64)).size for one in (mesh, free))
    partly = 0 if held is None else int((held.any(axis=1) & ~held.all(axis=1)).sum())
    told = [f"{own} by its file"] + [f"{partly} more in some directions"] * bool(partly)
    told += [f"{every - own} more by {key}.clamped"] * (every > own)
    return f"{key}: nodes held are {', '.join(told)}"


def _faces(key: str, table: FileModel, sets: Mapping[str, IntArray], sectors: int) -> tuple[str, str]:
    """Return the names of the sets of the cyclic faces."""
    if table.cyclic == "none":
        if set(FACES) & set(sets):
            raise input_error(
                f"{key}.cyclic",
                "is none, and the file has cyclic faces",
                "Leave it out, or take the cyclic tie out of the file.",
            )
        return FACES
    found = []
    for face, usual in zip(("low_face", "high_face"), FACES, strict=True):
        name = getattr(table, face)
        if name is None and sectors > 1 and usual not in sets:
            raise _no_face(f"{key}.{face}", sectors, sets)
        found.append(usual if name is None else _known(f"{key}.{face}", name, sets))
    return found[0], found[1]


def _tied(table: FileModel) -> Literal["node_to_node", "segment_to_segment"]:
    return "segment_to_segment" if table.cyclic == "segment_to_segment" else "node_to_node"


def _no_face(place: str, sectors: int, sets: Iterable[str]) -> InputError:
    return input_error(
        place,
        f"is missing with {sectors} sectors, and the file has no cyclic tie",
        f'Name one of its sets: {", ".join(sorted(sets)) or "it has none"}. Of a part that only contacts connect say cyclic = "none".',
    )


def _known(place: str, name: str, sets: Mapping[str, IntArray]) -> str:
    """Return the name of a set as in the file; capitals do not matter."""
    found = alike(name, sets)
    if found is not None:
        return found
    raise input_error(place, f"the file has no set {name!r} of free nodes", nearest_and_known(name, list(sets)))


def alike(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that equals a name up to capitals; None if there is none or several."""
    words = list(known)
    if name in words:
        return name
    found = [word for word in words if word.lower() == name.lower()]
    return found[0] if len(found) == 1 else None


def _without(members: IntArray, held: IntArray) -> IntArray:
    return np.asarray(members[~np.isin(members, held)])

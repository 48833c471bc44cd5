"""The table [model.file]: from the files of a finite-element program to what a model is made of."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stickslip.arrays import BoolArray, IntArray
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.elements import EXACT, Quadrature
from stickslip.model.fe.solid import Materials
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.ansys_archive import read_ansys_archive, read_ansys_materials
from stickslip.model.readers.calculix_deck import Deck, read_deck
from stickslip.model.readers.open_model import read_model
from stickslip.model.readers.units import Units
from stickslip.model.structure import Structure
from stickslip.study.messages import of_a_study
from stickslip.study.structure_study import StructureStudy
from stickslip.study.structure_tables import FileModel

LOW, HIGH, ROOT = "cyclic_low", "cyclic_high", "root"
DECKS, ARCHIVES = (".inp", ".inp.gz"), (".cdb",)


@dataclass(frozen=True, eq=False)
class FileContent:
    """What a model is made of.

    Parameters
    ----------
    mesh
        With the sets ``cyclic_low`` and ``cyclic_high`` of a sector, and ``root``, which is clamped; None for matrices
        without one.
    material
        Of the mesh or of each of its cells, to assemble it and let it rotate; None where `structure` is complete as it is.
    structure
        Matrices; None where they are assembled from mesh and material. Its sets have the names of those of the mesh.
    axis
        Of rotation.
    quadrature
        Of the assembly.
    warnings
        What the user should know.
    held
        (nodes, 3) supports of single directions beside the clamped nodes; None where there are none.
    sectors
        Of the wheel; 1 for a whole structure.
    """

    mesh: SolidMesh | None
    material: Materials | None
    structure: Structure | None
    axis: Axis
    quadrature: Quadrature = EXACT
    warnings: tuple[str, ...] = ()
    held: BoolArray | None = None
    sectors: int = 1


def read_file_model(study: StructureStudy, say: Callable[[str], None]) -> FileContent:
    """Read the files that [model.file] names.

    Parameters
    ----------
    study
        The study.
    say
        Takes a line of text for each step.

    Raises
    ------
    InputError
        If a file cannot be read, the study and the file disagree, or a set is not there.
    """
    table = study.tables.model.file
    assert table is not None
    path = study.model_files["path"]
    say(f"reading {path}")
    name = path.name.lower()
    try:
        if name.endswith(DECKS):
            content = _from_deck(
                study, table, read_deck(path, units=_units(table), plausible=table.plausible)
            )
        elif name.endswith(ARCHIVES):
            content = _from_archive(study, table, path)
        else:
            content = _from_matrices(study, table)
    except InputError as error:
        raise of_a_study(error) from None
    wrong = study.tables.excess(content.sectors)
    if wrong:
        key, problem, remedy = wrong
        raise input_error(f"{study.path}: {key}", problem, remedy)
    return content


def _sectors(study: StructureStudy, table: FileModel, of_deck: int | None = None) -> int:
    """Return the number of sectors: the deck's, which the study may repeat, or the study's."""
    if of_deck is not None and table.sectors not in (None, of_deck):
        raise input_error(
            f"{study.path}: model.file.sectors",
            f"is {table.sectors}, but the deck's cyclic symmetry has {of_deck}",
            f"Give sectors = {of_deck}, or leave it out.",
        )
    sectors = of_deck or table.sectors or 1
    if sectors == 1 and table.low_face is not None:
        raise input_error(
            f"{study.path}: model.file.sectors",
            "must be above 1 with cyclic faces",
            "Give the number of sectors of the wheel, or leave the faces out.",
        )
    return sectors


def of_the_faces(study: StructureStudy, error: InputError) -> InputError:
    """Return a complaint about the cyclic faces with the study's keys, where it names a file."""
    if study.tables.model.file is None:
        return error
    words = {"swap": "Swap low_face and high_face"}
    for key, word in error.words.items():
        if key == "sectors":
            words[key] = word.replace("=", " = ")
    return error.called(words).at(
        error.place.replace("cyclic_sector", f"{study.path}: model.file", 1)
    )


def faces_of(study: StructureStudy, sets: Mapping[str, IntArray]) -> tuple[str, str]:
    """Return the names of the sets that hold the cyclic faces."""
    table = study.tables.model.file
    if table is None or table.low_face is None or table.high_face is None:
        return LOW, HIGH
    return _known(study, "low_face", table.low_face, sets), _known(
        study, "high_face", table.high_face, sets
    )


def _units(table: FileModel) -> Units:
    return Units.named(table.units)


def _from_deck(study: StructureStudy, table: FileModel, deck: Deck) -> FileContent:
    sectors = _sectors(study, table, deck.sectors)
    quadrature = deck.quadrature if table.quadrature == "calculix" else EXACT
    axis = table.axis() or deck.axis
    warnings = tuple(f"{table.path}: passed over {text}" for text in deck.ignored)
    material: Materials
    if study.tables.material is not None:
        material = study.tables.material.library()
    elif len(set(deck.cell_material)) > 1:
        material = [deck.materials[name] for name in deck.cell_material]
    else:
        material = deck.material
    mesh = _prepared(study, table, deck.mesh, sectors)
    partly = deck.held.any(axis=1) & ~deck.held.all(axis=1)
    held = deck.held if partly.any() else None
    return FileContent(mesh, material, None, axis, quadrature, warnings, held, sectors)


def _from_archive(study: StructureStudy, table: FileModel, path: Path) -> FileContent:
    mesh = read_ansys_archive(path, units=_units(table))
    if study.tables.material is not None:
        material = study.tables.material.library()
    else:
        found = read_ansys_materials(path, units=_units(table), plausible=table.plausible)
        if len(found) != 1:
            raise input_error(
                f"{study.path}: material",
                f"is missing, and {path.name} holds {len(found)} materials",
                "Add the table [material].",
            )
        material = next(iter(found.values()))
    sectors = _sectors(study, table)
    return FileContent(
        _prepared(study, table, mesh, sectors),
        material,
        None,
        table.axis() or Axis(),
        Quadrature.calculix() if table.quadrature == "calculix" else EXACT,
        sectors=sectors,
    )


def _from_matrices(study: StructureStudy, table: FileModel) -> FileContent:
    _refuse_clamped(study, table, "a model of matrices, which hold their supports already")
    files, mesh, sectors = study.model_files, None, _sectors(study, table)
    structure = _matrices(study, table)
    if "mesh" in files and files["mesh"].name.lower().endswith(DECKS):
        mesh = read_deck(files["mesh"], units=_units(table), plausible=table.plausible).mesh
    structure = _with_faces(study, table, structure, sectors)
    return FileContent(mesh, None, structure, table.axis() or Axis(), sectors=sectors)


def _matrices(study: StructureStudy, table: FileModel) -> Structure:
    """Read matrices by the suffix of their file."""
    beside = {key: path for key, path in study.model_files.items() if key != "path"}
    found = read_model(
        study.model_files["path"], units=_units(table), plausible=table.plausible, **beside
    )
    if isinstance(found, Structure):
        return found
    raise input_error(
        f"{study.path}: model.file.path",
        f"{table.path} holds results, not a model",
        "Give a deck (.inp), an archive (.cdb), or matrices.",
    )


def _refuse_clamped(study: StructureStudy, table: FileModel, what: str) -> None:
    if table.clamped:
        raise input_error(
            f"{study.path}: model.file.clamped",
            f"cannot be applied to {what}",
            "Leave it out, and hold the nodes in the program that wrote the file.",
        )


def _prepared(study: StructureStudy, table: FileModel, mesh: SolidMesh, sectors: int) -> SolidMesh:
    """Return the mesh with its cyclic faces and clamped nodes under the names that assembly knows."""
    sets = dict(mesh.node_sets)
    held = set(sets.pop(ROOT, np.zeros(0, dtype=np.int64)).tolist())
    for i, name in enumerate(table.clamped):
        held.update(sets[_known(study, f"clamped[{i}]", name, sets)].tolist())
    for key, role in (("low_face", LOW), ("high_face", HIGH)):
        name = getattr(table, key)
        if name is not None:
            sets[role] = sets[_known(study, key, name, sets)]
        elif sectors > 1 and role not in sets:
            raise _no_face(study, key, sectors, sets)
    root = np.array(sorted(held), dtype=np.int64)
    kept = {name: _without(members, root) for name, members in sets.items()}
    return replace(mesh, node_sets={ROOT: root} | {k: m for k, m in kept.items() if m.size})


def _with_faces(
    study: StructureStudy, table: FileModel, structure: Structure, sectors: int
) -> Structure:
    """Return the structure with its cyclic faces under the names that pairing knows."""
    sets = dict(structure.sets)
    for key, role in (("low_face", LOW), ("high_face", HIGH)):
        name = getattr(table, key)
        if name is not None:
            sets[role] = sets[_known(study, key, name, sets)]
        elif sectors > 1 and role not in sets:
            raise _no_face(study, key, sectors, sets)
    return replace(structure, sets=sets)


def _no_face(study: StructureStudy, key: str, sectors: int, sets: Iterable[str]) -> InputError:
    return input_error(
        f"{study.path}: model.file.{key}",
        f"is missing with {sectors} sectors, and the file has no cyclic tie",
        f"Name one of its sets: {', '.join(sorted(sets)) or 'it has none'}.",
    )


def _known(study: StructureStudy, key: str, name: str, sets: Mapping[str, IntArray]) -> str:
    """Return the set's name in the file, which may differ in capitals."""
    if name in sets:
        return name
    alike = [known for known in sets if known.lower() == name.lower()]
    if len(alike) == 1:
        return alike[0]
    raise input_error(
        f"{study.path}: model.file.{key}",
        f"the file has no set {name!r} of free nodes",
        did_you_mean(name, list(sets)) if sets else "It has no sets.",
    )


def _without(members: IntArray, held: IntArray) -> IntArray:
    return np.asarray(members[~np.isin(members, held)])

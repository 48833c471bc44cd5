"""Matrices that CalculiX stores with ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: ``.sti``, ``.mas``, ``.dof``."""

import re
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.entries import SYMMETRY, from_triangle
from stickslip.model.readers.keywords import keyword_blocks
from stickslip.model.readers.node_table import COMPONENTS, NodeTable
from stickslip.model.readers.positions import doubt_about_positions, find_nodes
from stickslip.model.readers.text import CUT_SHORT, number_table, read_text, whole_numbers
from stickslip.model.readers.units import ARGUMENTS, SI, Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure

MAX_NODE_DIGITS = 16  # largest number of digits of a node number: no program numbers further
EXPANDED = re.compile(r"B\d|S\d|M3D|CP[SE]|CAX|T\d")  # element types that CalculiX makes solids of
SUFFIXES = {".sti": "stiffness", ".mas": "mass", ".dof": "list of dofs"}


def read_calculix_matrices(
    path: Path | str,
    *,
    units: Units = SI,
    mesh: SolidMesh | Path | str | None = None,
    mass: Path | str | None = None,
    plausible: bool = True,
) -> Structure:
    """Read stiffness and mass that CalculiX stored.

    Parameters
    ----------
    path
        The job's name without suffix, or one of its files; gzipped ones (``.sti.gz``) are read as well.
    units
        Unit system of the model.
    mesh
        Source of the node positions, which the matrix files lack: the deck (``.inp``), the results (``.frd``), a CSV file with
        the columns ``node, x, y, z`` or a mesh in metres; the job's deck by default. Its node sets become sets of dofs.
    mass
        The ``.mas`` file, if it belongs to another job: CalculiX stores the same mass at rest and preloaded.
    plausible
        False accepts implausible mass and size.

    Returns
    -------
    Structure
        Sparse, undamped, in SI, dofs in the order of the ``.dof`` file. Nodes that CalculiX made of a beam's, a shell's or a plane
        element's node are copies of it: copy 2 of node 12 is node 212 if all numbers are below 100. Their positions are unknown.
        Incompatible modes of C3D8I bricks are coordinates ``mode``. The matrices of a cyclic job are complex Hermitian:
        they describe a travelling wave on the independent nodes of the cyclic tie.

    Raises
    ------
    InputError
        If a file is missing, cut short or of another run, or positions are unknown.
    """
    stem = _stem(Path(path))
    source = _deck(stem) if mesh is None else mesh
    kinds = _element_types(source)
    listed, component, copy = _read_dof(_find(stem, ".dof"), any(map(EXPANDED.match, kinds)))
    n = len(listed)
    nodes, node = _with_copies(find_nodes(source, units), listed, copy)
    inner = (listed > nodes.numbers.max(initial=0)) & ("C3D8I" in kinds)
    nodal = nodes.dofs(node[~inner], [c for c, i in zip(component, inner, strict=True) if not i])
    dofs = _with_inner_modes(nodal, inner)
    stiffness = _read_matrix(_find(stem, ".sti"), n)
    inertia = _read_matrix(_find(stem, ".mas") if mass is None else Path(mass), n)
    if np.iscomplexobj(stiffness) != np.iscomplexobj(inertia):
        raise input_error(
            str(mass or stem),
            "one of mass and stiffness is of a cyclic job, the other is not",
            "Give both of the same kind of job.",
        )
    damping = scipy.sparse.csr_array((n, n))
    raw = Structure(inertia, damping, stiffness, dofs, nodes.dof_sets(dofs))
    structure = in_si(raw, units)
    if plausible:
        check_units(structure, units, str(stem))
        doubt = doubt_about_positions(structure)
        if doubt:
            raise input_error(
                nodes.place,
                f"its nodes do not fit the stiffness of {stem.name}: {doubt}",
                "Give the deck that CalculiX ran, or $plausible where they are right.",
                **ARGUMENTS,
            )
    return structure


def _stem(path: Path) -> Path:
    plain = path.with_suffix("") if path.suffix == ".gz" else path
    return plain.with_suffix("") if plain.suffix in SUFFIXES else plain


def _find(stem: Path, suffix: str) -> Path:
    """Return the job's file, plain or gzipped."""
    plain = stem.with_name(stem.name + suffix)
    packed = stem.with_name(stem.name + suffix + ".gz")
    for path in (plain, packed):
        if path.is_file():
            return path
    raise input_error(
        str(plain),
        f"the {SUFFIXES[suffix]} is not there",
        "Run CalculiX with *FREQUENCY, SOLVER=MATRIXSTORAGE"
        + (", or give $mass of the job that has it." if suffix == ".mas" else "."),
        mass="mass=…",
    )


def _deck(stem: Path) -> Path:
    path = stem.with_name(stem.name + ".inp")
    if path.is_file():
        return path
    raise input_error(
        str(stem),
        "positions of the nodes are not in the matrices, and no deck of the same name is beside them",
        "Give $mesh (a deck .inp, results .frd, a CSV of nodes, or a mesh).",
        mesh="mesh=…",
    )


def _element_types(source: SolidMesh | Path | str) -> set[str]:
    """Return the element types of a deck; none of other sources."""
    if isinstance(source, SolidMesh) or ".inp" not in Path(source).suffixes[-2:]:
        return set()
    return {b.parameters.get("TYPE", "").upper() for b in keyword_blocks(Path(source)) if b.keyword == "ELEMENT"}


def _read_dof(path: Path, expanded: bool) -> tuple[IntArray, list[str], IntArray]:
    """Return node and component of each equation from lines ``node.direction``, and the copy of its node from 0 on.

    CalculiX makes solids of beams, shells and plane elements and names each node that it makes like the node of the deck. With
    `expanded` a dof that is named again begins a further copy of its node.
    """
    text = read_text(path)
    _check_end(path, text)
    nodes, components, copies = [], [], []
    copy: dict[int, int] = {}
    seen: set[tuple[int, int, str]] = set()
    for number, line in enumerate(text.splitlines(), 1):
        node, _, direction = line.strip().partition(".")
        if not (node.isdecimal() and len(node) < MAX_NODE_DIGITS and direction in {"1", "2", "3", "4", "5", "6"}):
            raise input_error(
                f"{path}: line {number}", f"needs node.direction, got {line[:60]!r}", "Give the .dof file of CalculiX."
            )
        own = int(node)
        if (own, copy.setdefault(own, 0), direction) in seen:
            if not expanded:
                raise input_error(
                    f"{path}: line {number}",
                    f"names a dof twice, direction {direction} of node {own}",
                    "Give the .dof file of a single run; of beams, shells or plane elements the deck that CalculiX ran, too.",
                )
            copy[own] += 1
        seen.add((own, copy[own], direction))
        nodes.append(own)
        components.append(COMPONENTS[int(direction) - 1])
        copies.append(copy[own])
    if not nodes:
        raise input_error(str(path), "names no dof", "Give the .dof file of CalculiX.")
    return np.array(nodes, dtype=np.int64), components, np.array(copies, dtype=np.int64)


def _with_copies(nodes: NodeTable, listed: IntArray, copy: IntArray) -> tuple[NodeTable, IntArray]:
    """Return the nodes with the copies that CalculiX made, and the node number (n,) of each equation.

    Copy k of node 12 of a deck with numbers below 100 is node k12: 112, 212. Sets hold all copies; the position of a node with copies
    is unknown.
    """
    step = 10 ** len(str(max(int(listed.max()), int(nodes.numbers.max(initial=0)))))
    node = listed + step * copy
    made = np.unique(node[copy > 0])
    if not made.size:
        return nodes, node
    doubled = np.isin(nodes.numbers, made % step)
    numbers = np.concatenate([nodes.numbers, made])
    points = np.vstack([np.where(doubled[:, None], np.nan, nodes.points), np.full((len(made), 3), np.nan)])
    sets = {name: np.concatenate([own, made[np.isin(made % step, own)]]) for name, own in nodes.node_sets.items()}
    order = np.argsort(numbers)
    return NodeTable(numbers[order], points[order], sets, nodes.place), node


def _with_inner_modes(nodal: Dofs, inner: BoolArray) -> Dofs:
    """Return the table of dofs with a mode for each equation of `inner` (n,): the incompatible modes of C3D8I."""
    if not inner.any():
        return nodal
    node, position = np.full(len(inner), -1), np.full((len(inner), 3), np.nan)
    node[~inner], position[~inner] = nodal.node, nodal.position
    names = iter(nodal.component)
    return Dofs(node, tuple("mode" if i else next(names) for i in inner), position)


def _check_end(path: Path, text: str) -> None:
    """Refuse a file whose last line has no line end: its last number may be truncated."""
    if not text.endswith("\n"):
        raise input_error(str(path), "ends in the middle of a line", CUT_SHORT)


def _read_matrix(path: Path, n: int) -> Matrix:
    """Return the (n, n) matrix of lines ``row column value``; it is complex if the file has twice as many equations."""
    text = read_text(path)
    _check_end(path, text)
    table = number_table(path, text, 3)
    index = whole_numbers(path, table, ("row", "column")) - 1
    size = int(index.max()) + 1 if len(index) else 0
    if size not in (n, 2 * n):
        raise input_error(
            str(path),
            f"is of {size} equations, the .dof file lists {n}",
            "The files belong to different runs, or one is cut short.",
        )
    matrix = from_triangle(index[:, 0], index[:, 1], table[:, 2], size, str(path))
    stored = np.zeros(size, dtype=bool)
    stored[index[index[:, 0] == index[:, 1], 0]] = True
    if not stored.all():
        raise input_error(str(path), f"lacks the diagonal of equation {np.flatnonzero(~stored)[0] + 1}", CUT_SHORT)
    return matrix if size == n else _complex(matrix, n, path)


def _complex(pair: Matrix, n: int, path: Path) -> Matrix:
    """Return the Hermitian matrix that a cyclic job stores as ``[[R, -I], [I, R]]``."""
    real, repeated, minus = pair[:n, :n], pair[n:, n:], pair[:n, n:]
    scale = float(abs(real).max())
    if max(float(abs(real - repeated).max()), float(abs(minus + minus.T).max())) > SYMMETRY * scale:
        raise input_error(
            str(path),
            f"has twice the {n} equations of the .dof file, but is not the pair of a travelling wave",
            "Give the files of one cyclic job with a single nodal diameter (NMIN = NMAX).",
        )
    return scipy.sparse.csr_array(real - 1j * minus)

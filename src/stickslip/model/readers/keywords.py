"""Keyword files (CalculiX, Abaqus): blocks of a ``*KEYWORD, PARAMETER=VALUE`` line and its data lines.

A keyword or parameter is read, ignored or reported; any other is refused by line: it may change mass, stiffness, supports, damping or
rotation.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from os.path import realpath
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.readers.text import SHOWN, number_table, read_text

# Parameters of the keywords that are read. The second row has harmless parameters: names, outputs, tolerances of a tie that is
# made anew here, amplitudes of a zero displacement, thicknesses of shells, options of rate-dependent materials.
PARAMETERS: dict[str, frozenset[str]] = {
    keyword: frozenset([*read, *harmless])
    for keyword, read, harmless in (
        ("INCLUDE", ["INPUT"], []),
        ("NODE", ["NSET", "INPUT", "SYSTEM"], []),
        ("ELEMENT", ["TYPE", "ELSET", "INPUT"], []),
        ("NSET", ["NSET", "ELSET", "GENERATE", "INPUT"], ["INSTANCE", "INTERNAL", "UNSORTED"]),
        ("ELSET", ["ELSET", "GENERATE", "INPUT"], ["INSTANCE", "INTERNAL", "UNSORTED"]),
        ("SURFACE", ["NAME", "TYPE", "INPUT"], ["INTERNAL", "INSTANCE", "TRIM", "NO OFFSET", "NO THICK", "MAX RATIO"]),
        ("MATERIAL", ["NAME"], ["RTOL", "SRATE FACTOR", "SRATE TYPE"]),
        ("ELASTIC", ["TYPE", "INPUT"], ["MODULI"]),
        ("DENSITY", ["INPUT"], []),
        ("SOLID SECTION", ["ELSET", "MATERIAL", "ORIENTATION"], ["CONTROLS", "NODAL THICKNESS"]),
        ("EXPANSION", ["TYPE", "ZERO", "INPUT"], []),
        ("TEMPERATURE", ["OP", "AMPLITUDE", "INPUT"], ["TIME DELAY"]),
        ("ORIENTATION", ["NAME", "SYSTEM", "DEFINITION", "INPUT"], []),
        ("BOUNDARY", ["OP", "TYPE", "INPUT"], ["AMPLITUDE", "TIME DELAY", "LOAD CASE", "FIXED"]),
        ("DLOAD", ["OP", "AMPLITUDE", "INPUT"], ["TIME DELAY", "LOAD CASE"]),
        (
            "STEP",
            ["NLGEOM"],
            ["NAME", "PERTURBATION", "INC", "INCF", "AMPLITUDE", "EXTRAPOLATION", "SOLVER", "UNSYMM", "CONVERT SDI"],
        ),
        ("TIE", ["CYCLIC SYMMETRY", "POSITION TOLERANCE"], ["NAME", "ADJUST", "TYPE", "NO ROTATION", "NO THICKNESS"]),
        ("CYCLIC SYMMETRY MODEL", ["N", "ELSET", "INPUT"], ["NGRAPH", "TIE", "CHECK"]),
        ("EQUATION", ["INPUT"], []),
        ("MPC", [], []),
        ("TRANSFORM", ["NSET", "TYPE"], []),
        ("RIGID BODY", ["NSET", "PIN NSET", "ELSET", "REF NODE", "REFNODE", "ROT NODE", "ROTNODE"], ["POSITION"]),
        ("COUPLING", ["REF NODE", "REFNODE", "SURFACE"], ["CONSTRAINT NAME"]),
        ("KINEMATIC", [], []),
        ("DISTRIBUTING", [], []),
        ("MASS", ["ELSET"], []),
        ("SPRING", ["ELSET"], ["RTOL"]),
        ("DASHPOT", ["ELSET"], ["RTOL"]),
        ("INSTANCE", ["NAME", "PART"], []),
        ("INITIAL CONDITIONS", ["TYPE"], ["INPUT", "USER", "FILE", "STEP", "INC", "INSTANCE"]),
    )
}

# Keywords that are skipped, as they do not affect mass, stiffness, supports or damping: names, procedures, output, and
# properties of contacts and shells (contacts and shells themselves are refused)
SILENT = frozenset(
    {
        "HEADING",
        "PREPRINT",
        "PART",
        "END PART",
        "ASSEMBLY",
        "END ASSEMBLY",
        "END INSTANCE",
        "PARAMETER",
        "PHYSICAL CONSTANTS",
        "END STEP",
        "STATIC",
        "FREQUENCY",
        "COMPLEX FREQUENCY",
        "BUCKLE",
        "STEADY STATE DYNAMICS",
        "MODAL DYNAMIC",
        "DYNAMIC",
        "VISCO",
        "HEAT TRANSFER",
        "COUPLED TEMPERATURE-DISPLACEMENT",
        "UNCOUPLED TEMPERATURE-DISPLACEMENT",
        "GREEN",
        "SELECT CYCLIC SYMMETRY MODES",
        "SELECT EIGENMODES",
        "NO ANALYSIS",
        "CONTROLS",
        "SOLUTION TECHNIQUE",
        "DIAGNOSTICS",
        "NODE PRINT",
        "NODE FILE",
        "NODE OUTPUT",
        "EL PRINT",
        "EL FILE",
        "ELEMENT OUTPUT",
        "ENERGY OUTPUT",
        "ENERGY PRINT",
        "ENERGY FILE",
        "MODAL OUTPUT",
        "MODAL FILE",
        "MODAL PRINT",
        "CONTACT FILE",
        "CONTACT PRINT",
        "CONTACT OUTPUT",
        "SECTION PRINT",
        "SECTION FILE",
        "INTEGRATED OUTPUT",
        "INTEGRATED OUTPUT SECTION",
        "OUTPUT",
        "USER OUTPUT",
        "PRINT",
        "RESTART",
        "MONITOR",
        "DESIGNVARIABLES",
        "DESIGN VARIABLES",
        "DESIGN RESPONSE",
        "OBJECTIVE",
        "CONSTRAINT",
        "SENSITIVITY",
        "FEASIBLE DIRECTION",
        "GEOMETRIC CONSTRAINT",
        "FILE FORMAT",
        "FILTER",
        "TIME POINTS",
        "AMPLITUDE",
        "MATRIX GENERATE",
        "MATRIX OUTPUT",
        "SUBSTRUCTURE GENERATE",
        "SUBSTRUCTURE MATRIX OUTPUT",
        "RETAINED NODAL DOFS",
        "COORDINATE SYSTEM",
        "SURFACE INTERACTION",
        "SURFACE BEHAVIOR",
        "FRICTION",
        "CONTACT DAMPING",
        "GAP CONDUCTANCE",
        "GAP HEAT GENERATION",
        "NODAL THICKNESS",
        "NORMAL",
        "SECTION CONTROLS",
        "HOURGLASS STIFFNESS",
        "CONDUCTIVITY",
        "SPECIFIC HEAT",
        "LATENT HEAT",
        "ELECTRICAL CONDUCTIVITY",
    }
)

# Keywords that are skipped and reported by line: loads of the deck's own analyses, which a study defines itself, and material
# behaviour beyond small vibration
TOLD = frozenset(
    {
        "CLOAD",
        "DSLOAD",
        "DFLUX",
        "CFLUX",
        "DSFLUX",
        "FILM",
        "SFILM",
        "RADIATE",
        "SRADIATE",
        "FIELD",
        "BASE MOTION",
        "LOAD CASE",
        "END LOAD CASE",
        "CONTACT PAIR",
        "PLASTIC",
        "CREEP",
        "CYCLIC HARDENING",
        "DEPVAR",
    }
)

# Initial conditions without effect on mass and stiffness
PASSING_CONDITIONS = frozenset({"TEMPERATURE", "DISPLACEMENT", "VELOCITY", "FIELD", "ROTATING VELOCITY"})

ABAQUS_WORDS = frozenset({"PART", "ASSEMBLY", "PREPRINT"})  # keywords that CalculiX does not have

# Damping, which a study defines in its own table
DAMPING = frozenset({"DAMPING", "MODAL DAMPING", "GLOBAL DAMPING", "DAMPING CONTROLS"})
# Keywords that are known to change the matrices
REFUSED = frozenset(
    {
        "DISTRIBUTING COUPLING",
        "CONTACT",
        "SHELL SECTION",
        "BEAM SECTION",
        "BEAM GENERAL SECTION",
        "MEMBRANE SECTION",
        "ROTARY INERTIA",
        "NONSTRUCTURAL MASS",
        "GAP",
        "SUBMODEL",
        "MODEL CHANGE",
        "PRE-TENSION SECTION",
        "USER ELEMENT",
        "MATRIX INPUT",
        "MATRIX ASSEMBLE",
        "NCOPY",
        "NGEN",
        "NFILL",
        "NMAP",
        "ELGEN",
        "ELCOPY",
        "SYSTEM",
        "DISTRIBUTION",
        "FOUNDATION",
        "EMBEDDED ELEMENT",
        "CONNECTOR SECTION",
        "SUPER ELEMENT",
        "SUBSTRUCTURE",
        "HYPERELASTIC",
        "HYPERFOAM",
        "VISCOELASTIC",
        "USER MATERIAL",
        "SUBSTRUCTURE PROPERTY",
        "SHELL TO SOLID COUPLING",
        "PHYSICAL",
        "IMPERFECTION",
        "CHANGE MATERIAL",
        "CHANGE SOLID SECTION",
        "INITIAL STRAIN INCREASE",
    }
)


MAX_INCLUDES = 200
DEEPEST_INCLUDE = 10
LARGEST = 2**53  # largest number of a node or element


@dataclass(frozen=True)
class Segment:
    """Consecutive data lines of one file; comments become empty lines."""

    path: Path
    first_line: int
    text: str


@dataclass(frozen=True)
class Block:
    """A keyword with its data.

    Parameters
    ----------
    keyword
        Upper case, without the star, one blank between words.
    parameters
        Upper case names -> values as written, unquoted; empty for flags.
    path, line
        File and line of the keyword.
    """

    keyword: str
    parameters: dict[str, str]
    path: Path
    line: int
    segments: list[Segment] = field(default_factory=list)

    @property
    def place(self) -> str:
        """File and line, for messages."""
        return f"{self.path}: line {self.line}, *{self.keyword}"

    def parameter(self, name: str) -> str:
        """Return a required parameter."""
        value = self.parameters.get(name, "")
        if not value:
            raise input_error(self.place, f"lacks the parameter {name}", f"Write {name}=….")
        return value

    def check_parameters(self) -> None:
        """Refuse an unknown parameter of the keyword."""
        known = PARAMETERS[self.keyword]
        for name in self.parameters:
            if name not in known:
                raise input_error(
                    self.place,
                    f"the parameter {name} is not read, and may change the model",
                    f"{did_you_mean(name, sorted(known))} Take it out if the model is the same without.",
                )

    def rows(self) -> Iterator[tuple[str, list[str]]]:
        """Yield place and fields of each data line; a trailing comma is ignored."""
        for segment in self.segments:
            for number, line in enumerate(segment.text.splitlines(), segment.first_line):
                if line.strip():
                    fields = [part.strip(' \t"') for part in line.strip().rstrip(",").split(",")]
                    yield f"{segment.path}: line {number}", fields

    def table(self, columns: int, *, blank_is_zero: bool = False) -> FloatArray:
        """Return the data lines as numbers (rows, columns), all with the same count.

        With `blank_is_zero` all fields but the first may be blank or left out, which means 0.
        """
        tables = []
        for s in self.segments:
            text = _filled(s.text, columns) if blank_is_zero else _without_last_commas(s.text)
            tables.append(number_table(s.path, text, columns, separator=",", first_line=s.first_line))
        return np.vstack(tables) if tables else np.empty((0, columns))


def keyword_blocks(path: Path) -> list[Block]:
    """Return the blocks of a keyword file, in order, with included files inserted.

    Parameters
    ----------
    path
        The file; ``*INCLUDE``, and ``INPUT=`` of a supported keyword, may name files in its folder and its subfolders.

    Raises
    ------
    InputError
        If a file cannot be read, an included one lies elsewhere, or files include each other without end.
    """
    blocks: list[Block] = []
    _read_into(blocks, path, [], [0])
    if not blocks:
        raise input_error(str(path), "has no keyword line", "Give an input deck, with lines such as *NODE.")
    return blocks


def whole_number(text: str, place: str, what: str) -> int:
    """Return an integer field of a data line."""
    try:
        number = int(text)
    except ValueError:
        number = LARGEST + 1
    if abs(number) > LARGEST:
        raise input_error(place, f"the {what} {text[:SHOWN]!r} is no whole number", "Check the line.")
    return number


def real_number(text: str, place: str, what: str) -> float:
    """Return a finite number of a data line."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise input_error(place, f"the {what} {text[:SHOWN]!r} is no finite number", "Check the line.")
    return value


def members(blocks: list[Block], kind: str, numbers: IntArray, named: dict[str, IntArray]) -> dict[str, IntArray]:
    """Return the sets of nodes or elements that the blocks define, in the order of the file.

    Parameters
    ----------
    blocks
        Blocks of the whole file.
    kind
        ``NSET`` or ``ELSET``.
    numbers
        Numbers of all nodes or elements, in any order.
    named
        Sets that ``*NODE, NSET=`` and ``*ELEMENT, ELSET=`` name.

    Returns
    -------
    dict
        Upper case name -> numbers, each once; ``*NSET, ELSET=`` is not evaluated, as it needs the elements.

    Raises
    ------
    InputError
        If a set refers to missing nodes, elements or sets.
    """
    known = np.sort(numbers)
    parts = {name: [listed] for name, listed in named.items()}
    for block in blocks:
        if block.keyword != kind:
            continue
        block.check_parameters()
        if not (kind == "NSET" and "ELSET" in block.parameters):
            name = block.parameter(kind).upper()
            parts.setdefault(name, []).extend(_listed(block, parts, known))
    return {name: unique_in_order(np.concatenate([*p, np.empty(0, int)])) for name, p in parts.items()}


def unique_in_order(values: IntArray) -> IntArray:
    """Return each value once, in the order of first occurrence."""
    _, first = np.unique(values, return_index=True)
    return np.asarray(values[np.sort(first)], dtype=np.int64)


def _listed(block: Block, sets: dict[str, list[IntArray]], known: IntArray) -> Iterator[IntArray]:
    what = "node" if block.keyword == "NSET" else "element"
    if "GENERATE" in block.parameters:
        for place, fields in block.rows():
            if len(fields) < 2:
                raise input_error(place, "needs first, last, step", "Give a step of at least 1.")
            first, last, step = (whole_number(f, place, what) for f in [*fields, "1"][:3])
            if step < 1:
                raise input_error(place, "needs first, last, step", "Give a step of at least 1.")
            yield known[(known >= first) & (known <= last) & ((known - first) % step == 0)]
        return
    for place, fields in block.rows():
        for text in fields:
            if text.upper() in sets:
                yield from list(sets[text.upper()])
                continue
            number = whole_number(text, place, what)
            index = np.searchsorted(known, number)
            if index == len(known) or known[index] != number:
                raise input_error(place, f"there is no {what} {number}", "Define it, or take it out of the set.")
            yield np.array([number])


def _filled(text: str, columns: int) -> str:
    """Return lines of numbers with zeros for blank fields behind the first and for those left out."""
    lines = text.splitlines()
    for i, line in enumerate(lines):
        if line.strip():
            first, *rest = (part.strip() for part in line.split(","))
            while len(rest) >= columns and not rest[-1]:  # commas at the end
                rest.pop()
            lines[i] = ",".join([first, *(part or "0" for part in rest), *["0"] * (columns - 1 - len(rest))])
    return "\n".join(lines)


def _without_last_commas(text: str) -> str:
    if ",\n" not in text.replace(" ", ""):
        return text
    return "\n".join(line.rstrip().rstrip(",") for line in text.splitlines())


def _read_into(blocks: list[Block], path: Path, stack: list[Path], count: list[int]) -> None:
    """Append the blocks of one file; data lines before its first keyword belong to the last block."""
    pending: list[str] = []
    start = 1

    def flush() -> None:
        if blocks and any(line.strip() for line in pending):
            blocks[-1].segments.append(Segment(path, start, "\n".join(pending)))
        pending.clear()

    lines = read_text(path).splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        number += 1
        if line.startswith("**") or not line.startswith("*"):
            pending.append("" if line.startswith("**") else line)
            continue
        flush()
        first = number
        while line.rstrip().endswith(",") and number < len(lines):
            line = line.rstrip() + lines[number]
            number += 1
        block = _parse_keyword(line, path, first)
        if block.keyword == "INCLUDE":
            block.check_parameters()
            _read_into(blocks, _included(block, path, stack, count), [*stack, path], count)
        else:
            blocks.append(block)
            if "INPUT" in block.parameters and block.keyword in PARAMETERS:
                known = len(blocks)
                _read_into(blocks, _included(block, path, stack, count), [*stack, path], count)
                if len(blocks) > known:
                    raise input_error(
                        blocks[known].place,
                        f"is a keyword in a file of data, which INPUT of {block.place} names",
                        "Take it out of that file, or name the file in *INCLUDE.",
                    )
        start = number + 1
    flush()


def _parse_keyword(line: str, path: Path, number: int) -> Block:
    head, *rest = line[1:].split(",")
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        if name.strip():
            parameters[" ".join(name.upper().split())] = value.strip().strip('"')
    return Block(" ".join(head.upper().split()), parameters, path, number)


def _included(block: Block, path: Path, stack: list[Path], count: list[int]) -> Path:
    """Return the file named by an ``*INCLUDE``; refuse files outside the deck's folder and circular inclusion."""
    root = Path(realpath((stack or [path])[0])).parent
    name = block.parameter("INPUT")
    target = Path(realpath(root / name))
    if not target.is_relative_to(root):
        raise _refused(block, name, f"lies outside the deck's folder {root.name!r}")
    count[0] += 1
    if count[0] > MAX_INCLUDES or len(stack) >= DEEPEST_INCLUDE:
        raise _refused(block, name, "is one of too many, or files include each other")
    return target


def _refused(block: Block, name: str, why: str) -> InputError:
    return input_error(
        block.place, f"the included file {name!r} {why}", "Put the files into one folder, or in one file."
    )

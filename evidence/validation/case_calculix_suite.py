"""The mechanical decks of CalculiX's test suite that `read_deck` answers, each with its steps replaced by one ``*FREQUENCY`` step.

The suite is Debian's package calculix-ccx-test. Supports of a deck's first step are kept. Decks that are refused, or that CalculiX does not
solve so, are not counted.
"""

import gzip
import re
import tempfile
from pathlib import Path

import numpy as np
import scipy.linalg

from evidence.validation.calculix import MISSING, available, frequencies_hz, run_deck
from evidence.validation.case_calculix_matrices_at_speed import frequencies
from evidence.validation.compare import Record, bound, left_out
from stickslip.arrays import FloatArray
from stickslip.errors import InputError, SingularError
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix_deck import Deck, assemble_deck, read_deck
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

SUITE = Path("/usr/share/doc/calculix-ccx-test/examples/test")
SOURCE = "CalculiX, run on the decks of its test suite"
CASE = "test suite of CalculiX, steps replaced by *FREQUENCY"
MODES = (10, 6, 4, 2, 1)  # CalculiX prints zeros where it is asked for too many
DENSE = 600  # dofs
AT_REST = 1e-4  # of the square root of largest stiffness over mean mass: lower frequencies are rigid motions
DIGITS = 1e-5
INCOMPATIBLE = 1e-3  # C3D8I, whose inner modes are condensed here, in meshes of more than FEW bricks
FEW = 10
GOAL = 85


def lines_of(path: Path) -> list[str]:
    """Return the lines of a file of the suite, plain or gzipped."""
    content = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    return content.decode("latin-1").splitlines()


def with_frequency_step(lines: list[str], modes: int, sectors: int | None) -> str:
    """Return a deck with one frequency step, which has the supports of its first step."""
    model, supports, steps, keep = list[str](), list[str](), 0, False
    for line in lines:
        if line.startswith("*") and not line.startswith("**"):
            word = " ".join(line[1:].split(",")[0].upper().split())
            steps += word == "STEP"
            keep = steps == 1 and word == "BOUNDARY"
        if not steps:
            model.append(line)
        elif keep:
            supports.append(line)
    more = [f"*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={sectors // 2}"] if sectors else []
    step = ["*STEP", "*FREQUENCY", f"{2 * modes if sectors else modes}", *more, *supports, "*END STEP"]
    return "\n".join([*model, *step]) + "\n"


def with_what_it_includes(path: Path, folder: Path) -> list[str]:
    """Return the lines of a deck, and copy the files that it names into the folder."""
    lines = lines_of(path)
    for line in lines:
        named = re.search(r"INPUT\s*=\s*([^,\s]+)", line, re.IGNORECASE) if line.startswith("*") else None
        for end in ("", ".gz"):
            if named and (SUITE / f"{named[1]}{end}").is_file():
                (folder / named[1]).write_text("\n".join(lines_of(SUITE / f"{named[1]}{end}")) + "\n")
    return lines


def lowest(structure: Structure, count: int) -> FloatArray:
    """Return the lowest frequencies in Hz."""
    if structure.n > DENSE:
        return natural_frequencies(structure, count)
    # the mass may be singular: mu = 1/omega^2 of a stiffness shifted to be positive definite
    mass, stiffness = structure.mass.toarray(), structure.stiffness.toarray()
    shift = 1e-6 * np.trace(stiffness).real / np.trace(mass).real
    inverse = scipy.linalg.eigh(mass, stiffness + shift * mass, eigvals_only=True)
    squares = np.sort(1.0 / inverse[inverse > 1e-14 * inverse[-1]]) - shift
    return np.asarray(np.sqrt(np.maximum(squares[:count], 0.0)) / (2 * np.pi))


def largest_difference(deck: Deck, lines: list[str], path: Path) -> float | None:
    """Return the largest relative difference of the frequencies; None where CalculiX finds none."""
    for modes in MODES:
        path.write_text(with_frequency_step(lines, modes, deck.sectors))
        try:
            printed = run_deck(path)
        except RuntimeError:
            continue
        theirs = frequencies_hz(printed) if deck.sectors else {0: np.array(frequencies(printed))}
        if theirs and any(np.any(one) for one in theirs.values()):
            break
    else:
        return None
    structure, worst = assemble_deck(deck), 0.0
    sector = cyclic_sector(structure, deck.sectors, axis=deck.axis) if deck.sectors else None
    mass = structure.mass.diagonal()
    scale = AT_REST * np.sqrt(structure.stiffness.diagonal().max() / mass[mass > 0].mean()) / (2 * np.pi)
    for diameter, wanted in theirs.items():
        ours = lowest(structure if sector is None else travelling_wave(sector, diameter), len(wanted))
        reference = wanted[: len(ours)]
        off = np.where(np.maximum(ours, reference) < scale, 0.0, np.abs(ours / np.maximum(reference, scale) - 1))
        worst = max(worst, float(off.max()))
    return worst


def compare(folder: Path) -> dict[str, tuple[float, Deck]]:
    """Return each deck that both answer, by name, with the largest difference."""
    found = {}
    for path in sorted(SUITE.glob("*.inp*")):
        lines = with_what_it_includes(path, folder)
        deck_path = folder / "deck.inp"
        deck_path.write_text(with_frequency_step(lines, 1, None))
        try:
            deck = read_deck(deck_path, plausible=False)
            off = largest_difference(deck, lines, deck_path)
        except (InputError, SingularError, np.linalg.LinAlgError):
            continue
        if off is not None:
            found[path.name.partition(".inp")[0]] = (off, deck)
    return found


def run() -> list[Record]:
    """Compare the frequencies of each deck; left out where CalculiX or its suite is missing."""
    if not available():
        return [left_out(CASE, MISSING, SOURCE)]
    if not SUITE.is_dir():
        return [left_out(CASE, "the package calculix-ccx-test is not installed", SOURCE)]
    with tempfile.TemporaryDirectory() as name:
        found = compare(Path(name))
    incompatible = {k: off for k, (off, deck) in found.items() if "C3D8I" in deck.cell_types}
    plain = {k: off for k, (off, _) in found.items() if k not in incompatible}
    fine = {k: off for k, off in incompatible.items() if len(found[k][1].cell_types) > FEW}
    groups = (("without C3D8I", plain, DIGITS), (f"with more than {FEW} C3D8I", fine, INCOMPATIBLE))
    records = [
        bound(
            CASE,
            f"{len(own)} decks {what}: largest difference ({max(own, key=lambda k: own[k])})",
            max(own.values()),
            most,
            SOURCE,
        )
        for what, own, most in groups
        if own
    ]
    missing = max(0, GOAL - len(plain) - len(fine))
    return [*records, bound(CASE, f"decks that lack to {GOAL} answered so", missing, 0.5, SOURCE)]

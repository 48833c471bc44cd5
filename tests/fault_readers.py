"""Damages files and reads them, in a process of its own: ``python fault_readers.py FOLDER SEED FIRST COUNT``.

Every damaged file must end in what was read or in an error that the package raises on purpose, within seconds and a bounded
memory. A line a failure goes to the output; a process that ends early was on the file that ``FOLDER/at`` names.
"""

import gzip
import resource
import shutil
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
from ansys_files import full_file, result_file
from small_v2 import write_four_masses, write_shrouded_sector, write_two_blades
from test_readers_ansys import ARCHIVE, cube
from test_readers_matrices import brick, in_mm, write_abaqus, write_matrix, write_table
from test_readers_nastran import LARGE, SMALL

from stickslip import read_model
from stickslip.errors import StickslipError
from stickslip.model import model_summary, read_nastran_dmig, save_structure
from stickslip.model.readers.units import Units
from stickslip.study.models.study import read_study

DATA = Path(__file__).parent / "data" / "calculix"
SECONDS = 20  # for a file that is read in milliseconds: the machine may be busy
MEMORY = 1_500_000_000  # bytes beside what is loaded
TEXTS = (
    b"",
    b"0",
    b"-1",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"nan",
    b"inf",
    b"99999999999999999999",
    b"2147483648",
    b"1,5",
    b"*",
    b",",
    b"\n",
    b"\xff\xfe",
    b"\x1b[31m",
    b"x" * 300,
    b"9" * 5000,
)
NUMBERS = (0, 1, -1, 2**31 - 1, -(2**31), 2**24, 1000)


@dataclass(frozen=True)
class Sample:
    """A whole file, in a folder with what it needs, and how it is read."""

    path: Path
    read: Callable[[Path], Any]


def read_and_sum_up(path: Path, **beside: str) -> None:
    """Do what ``stickslip inspect`` does but for frequencies."""
    files = {name: path.parent / other for name, other in beside.items()}
    model = read_model(path, units=Units.mm_t_s(), plausible=False, **files)  # type: ignore[arg-type]
    model_summary(model, n_modes=0, units=Units.mm_t_s())


def samples(folder: Path) -> list[Sample]:
    """Write the whole files of all readers."""
    found = _of_calculix(folder / "calculix") + _of_matrices(folder / "matrices")
    found += _of_others(folder / "others")
    for write in (write_four_masses, write_two_blades, write_shrouded_sector):
        found.append(Sample(write(folder / write.__name__), read_study))
    return found


def _of_calculix(folder: Path) -> list[Sample]:
    shutil.copytree(DATA, folder)
    whole = [p for end in ("*.inp", "*.frd", "*.frd.gz") for p in sorted(folder.glob(end))]
    found = [Sample(path, read_and_sum_up) for path in whole]
    for name in ("one_c3d4", "one_c3d8", "brick_matrix"):
        for end in (".sti.gz", ".mas.gz", ".dof"):
            first = partial(_of_job, name)
            found.append(Sample(folder / f"{name}{end}", first))
    return found


def _of_job(name: str, path: Path) -> None:
    read_and_sum_up(path.parent / f"{name}.sti.gz", mesh=f"{name}.inp")


def _of_matrices(folder: Path) -> list[Sample]:
    folder.mkdir()
    structure = brick()
    mass, stiffness = in_mm(structure)
    save_structure(structure, folder / "kept.npz")
    write_table(folder / "dofs.csv", structure)
    write_abaqus(folder / "job_STIF1.mtx", stiffness, structure.dofs, "lower")
    write_abaqus(folder / "job_MASS1.mtx", mass, structure.dofs, "lower")
    shutil.copy(DATA / "brick_matrix.inp", folder)
    found = [Sample(folder / "kept.npz", read_and_sum_up)]
    found += [Sample(folder / f"job_{n}1.mtx", _of_abaqus) for n in ("STIF", "MASS")]
    for kind in ("mtx", "mtx.gz", "npz", "h5"):
        names = {"stiffness": f"K.{kind}", "mass": f"M.{kind}", "nodes": "dofs.csv"}
        for name, matrix in (("stiffness", stiffness), ("mass", mass)):
            write_matrix(folder / names[name], scipy.sparse.coo_array(matrix), name)
        read = partial(_of_files, names)
        found += [Sample(folder / names[name], read) for name in names]
    return found


def _of_abaqus(path: Path) -> None:
    read_and_sum_up(path.parent / "job_STIF1.mtx", nodes="brick_matrix.inp")


def _of_files(names: dict[str, str], path: Path) -> None:
    read_and_sum_up(path.parent / names["stiffness"], mass=names["mass"], nodes=names["nodes"])


def _of_others(folder: Path) -> list[Sample]:
    folder.mkdir()
    half = np.random.default_rng(0).standard_normal((9, 9))
    for name, packed in (("file", ""), ("packed", "windows")):
        content = full_file(np.eye(9), half @ half.T, [7, 2, 5], held=[3, 4, 5], packed=packed)
        (folder / f"{name}.full").write_bytes(content)
    (folder / "nodes.cdb").write_text(ARCHIVE)
    (folder / "cube.cdb").write_text(cube())
    places = {2: (0.0, 0.0, 0.0), 5: (1.0, 0.0, 0.0), 7: (0.0, 1.0, 0.0)}
    shapes = np.random.default_rng(1).standard_normal((2, 3, 3))
    (folder / "file.rst").write_bytes(result_file([10.0, 20.0], shapes, places))
    (folder / "cards.pch").write_text(SMALL + LARGE)
    read = partial(read_and_sum_up, nodes="nodes.cdb")
    dmig = partial(read_nastran_dmig, mass="maax", stiffness="kaax", plausible=False)
    return [
        Sample(folder / "file.full", read),
        Sample(folder / "packed.full", read),
        Sample(folder / "nodes.cdb", lambda path: read(path.parent / "file.full")),
        Sample(folder / "cube.cdb", read_and_sum_up),
        Sample(folder / "file.rst", read_and_sum_up),
        Sample(folder / "cards.pch", dmig),
    ]


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return the bytes of a file with one to four faults; of a packed one, half the time inside."""
    if content[:2] == b"\x1f\x8b" and rng.random() < 0.7:
        return gzip.compress(damaged(gzip.decompress(content), rng), compresslevel=1)
    for _ in range(int(rng.integers(1, 5))):
        content = FAULTS[int(rng.integers(len(FAULTS)))](content, rng)
    return content


def _cut(rng: np.random.Generator, content: bytes, longest: int) -> tuple[int, int]:
    start = int(rng.integers(len(content) + 1))
    return start, min(len(content), start + int(rng.integers(1, longest)))


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(max(len(content), 1)))
    return content[:at] + bytes([int(rng.integers(256))]) + content[at + 1 :]


def _truncated(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _removed(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _cut(rng, content, 200)
    return content[:start] + content[end:]


def _repeated(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _cut(rng, content, 200)
    return content[:end] + content[start:end] * int(rng.integers(1, 4)) + content[end:]


def _moved(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _cut(rng, content, 100)
    rest = content[:start] + content[end:]
    at = int(rng.integers(len(rest) + 1))
    return rest[:at] + content[start:end] + rest[at:]


def _number(content: bytes, rng: np.random.Generator) -> bytes:
    at = 4 * int(rng.integers(len(content) // 4 + 1))
    value = NUMBERS[int(rng.integers(len(NUMBERS)))]
    return content[:at] + value.to_bytes(4, "little", signed=True) + content[at + 4 :]


def _word(content: bytes, rng: np.random.Generator) -> bytes:
    """Replace a word of a text; of others whatever stands between separators."""
    marks = [i for i, byte in enumerate(content[:20_000]) if byte in b" ,\n=[]"] or [0]
    k = int(rng.integers(len(marks)))
    start, end = marks[k] + 1, marks[k + 1] if k + 1 < len(marks) else marks[k] + 2
    return content[:start] + TEXTS[int(rng.integers(len(TEXTS)))] + content[max(end, start) :]


FAULTS = (_flipped, _truncated, _removed, _repeated, _moved, _number, _word, _word)


class TooSlowError(BaseException):
    """A file takes longer than allowed."""


def _stop(*_: object) -> None:
    raise TooSlowError


def outcome(sample: Sample, content: bytes, whole: bytes) -> str:
    """Read a file with another content; return what went wrong, or nothing."""
    sample.path.write_bytes(content)
    signal.alarm(SECONDS)
    try:
        sample.read(sample.path)
    except StickslipError as error:
        long = len(str(error).encode()) > 2048
        return f"a message of {len(str(error))} letters" if long else ""
    except (Exception, TooSlowError) as error:  # noqa: BLE001  that is what we are after
        at = traceback.extract_tb(error.__traceback__)[-1]
        own = [f for f in traceback.extract_tb(error.__traceback__) if "stickslip" in f.filename]
        where = own[-1] if own else at
        return f"{type(error).__name__}: {str(error)[:100]!r} at {Path(where.filename).name}:{where.lineno}"
    finally:
        signal.alarm(0)
        sample.path.write_bytes(whole)
    return ""


def main(folder: Path, seed: int, first: int, count: int) -> None:
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGALRM, _stop)
    every = samples(folder / "files")
    whole = [sample.path.read_bytes() for sample in every]
    for sample, content in zip(every, whole, strict=True):
        assert outcome(sample, content, content) == "", sample.path
    loaded = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (loaded + MEMORY, loaded + MEMORY))
    failures = 0
    for number in range(first, first + count):
        rng = np.random.default_rng([seed, number])
        k = int(rng.integers(len(every)))
        (folder / "at").write_text(f"{number}: {every[k].path.name}")
        wrong = outcome(every[k], damaged(whole[k], rng), whole[k])
        if wrong:
            failures += 1
            print(f"{number}: {every[k].path.name}: {wrong}", flush=True)
    print(f"{count} files, {failures} failures", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:5]))

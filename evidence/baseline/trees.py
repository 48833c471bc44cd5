"""Sources of a commit and of the working tree, each in a folder of its own with its own compiled functions."""

import os
import subprocess
import sys
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = "src/stickslip"
MAX_KEPT_TREES = 4  # folders of sources and compiled functions, some 60 MB each
DIGITS = 16  # of the digest in a folder's name
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Tree:
    """Sources of the package, unpacked.

    Parameters
    ----------
    name
        What the comparison calls it: a commit, or the working tree.
    folder
        Holds ``src/stickslip``.
    """

    name: str
    folder: Path

    def environment(self) -> dict[str, str]:
        """Return the variables of a process that imports this tree, with one thread."""
        kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONDONTWRITEBYTECODE", "NUMBA_CACHE_DIR")}
        return kept | ONE_THREAD | {"PYTHONPATH": str(self.folder / "src"), "PYTHONHASHSEED": "0", "NO_COLOR": "1"}

    def command(self, arguments: tuple[str, ...]) -> list[str]:
        """Return the command line of ``stickslip`` with these arguments."""
        return [sys.executable, "-m", "stickslip", *arguments]


def sources_of_commit(commit: str) -> dict[str, bytes]:
    """Return the files of the package in a commit, by path.

    Raises
    ------
    SystemExit
        If git knows no such commit.
    """
    asked = ["git", "archive", "--format=tar", commit, PACKAGE]
    made = subprocess.run(asked, cwd=ROOT, capture_output=True, check=False)
    if made.returncode:
        raise SystemExit(f"REF={commit}: {made.stderr.decode().strip()}")
    with tarfile.open(fileobj=BytesIO(made.stdout)) as archive:
        files = [(one.name, archive.extractfile(one)) for one in archive if one.isfile()]
        return {name: file.read() for name, file in files if file is not None}


def sources_at_work() -> dict[str, bytes]:
    """Return the files of the package in the working tree, by path, whether git knows them or not."""
    asked = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", PACKAGE]
    listed = subprocess.run(asked, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    paths = [path for path in listed.split("\0") if path and (ROOT / path).is_file()]
    return {path: (ROOT / path).read_bytes() for path in paths}


def unpacked(name: str, sources: Mapping[str, bytes], folder: Path) -> Tree:
    """Return sources as a tree below `folder`.

    The folder is named after their content. So compiled functions of other sources are never taken, and those of the
    same sources need no second compilation.
    """
    digest = sha256()
    for path in sorted(sources):
        digest.update(f"{path}\0{len(sources[path])}\0".encode() + sources[path])
    place = folder / digest.hexdigest()[:DIGITS]
    for path, content in sources.items():
        target = place / path
        if not target.is_file() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
    os.utime(place)
    return Tree(name, place)


def oldest_trees(folder: Path) -> list[Path]:
    """Return the folders of trees that are used no more: all but the newest."""
    newest_first = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    return newest_first[MAX_KEPT_TREES:]

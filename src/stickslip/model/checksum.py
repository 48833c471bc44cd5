"""Checksums at the end of files and records."""

from hashlib import file_digest, sha256
from io import BytesIO
from pathlib import Path
from typing import IO

MARK = b"\nstickslip: sha256 of all before: "
LENGTH = len(MARK) + 2 * sha256().digest_size  # bytes of mark and sum
MIN_MARK_BYTES = 8  # bytes by which a truncated mark is recognised; fewer may belong to the content


class Cut(ValueError):  # noqa: N818  it tells what has happened
    """Error: the content ends within its checksum."""


def with_checksum(content: bytes) -> bytes:
    """Return content followed by its SHA-256; readers of zip and HDF5 ignore trailing bytes."""
    return content + MARK + sha256(content).hexdigest().encode()


def add_checksum(path: Path) -> None:
    """Append the checksum to a complete file, as `with_checksum` does."""
    with path.open("rb+") as stream:
        stream.write(MARK + file_digest(stream, "sha256").hexdigest().encode())


def checked(content: bytes, *, required: bool = True) -> bytes:
    """Return the content without its checksum, after checking it.

    Parameters
    ----------
    content
        Content followed by its checksum.
    required
        Whether content without a checksum is refused; otherwise it is returned unchanged.

    Raises
    ------
    ValueError
        If the content does not match its checksum, or the checksum is incomplete.
    """
    length = _checked(BytesIO(content), len(content), required=required)
    return content[:length]


def check_file(path: Path) -> None:
    """Refuse a file that does not match its checksum; a file without a checksum, from another program, is accepted.

    Raises
    ------
    ValueError
        If the file does not match its checksum, or the checksum is incomplete.
    OSError
        If the file cannot be read.
    """
    with path.open("rb") as stream:
        _checked(stream, path.stat().st_size, required=False)


def _checked(stream: IO[bytes], size: int, *, required: bool) -> int:
    """Compare the content with its checksum; return the number of bytes before the checksum."""
    stream.seek(max(size - LENGTH, 0))
    end = stream.read(LENGTH)
    at = end.rfind(MARK)
    if (
        at > 0
        or (at == 0 and size < LENGTH)
        or any(end.endswith(MARK[:n]) for n in range(MIN_MARK_BYTES, len(MARK) + 1))
    ):
        raise Cut("was cut off within the checksum at its end")
    if at == 0:
        stream.seek(0)
        content = size - LENGTH
        found = sha256()
        while content:
            block = stream.read(min(content, 2**20))
            found.update(block)
            content -= len(block)
        if end != MARK + found.hexdigest().encode():
            raise ValueError("holds other bytes than were written: it is damaged, or was changed")
        return size - LENGTH
    if required:
        raise ValueError("has no checksum: it was cut off, or another program wrote it")
    return size

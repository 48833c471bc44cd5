"""Records of ANSYS's binary files; every pointer, length and window is checked before use.

A file is a chain of records of 32-bit words: the number of words, a word of flags, the words, the number again. The
flags say whether the words are integers or real numbers, in half or full precision, and which of two sparse forms they
are packed in (Programmer's Reference of ANSYS, file formats ``fdfull`` and ``fdresu``).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import InputError, did_you_mean, input_error

HEADER = 103  # first word of the header record that is specific to the kind of file
HEADER_WORDS = 1000  # more words than any release writes there
KINDS = {2: ".emat", 4: ".full", 8: ".sub", 9: ".mode", 10: ".rdsp", 11: ".tri", 12: ".rst"}
# bits of the flags word
INTEGER, HALF, ZLIB, WINDOWS, BITS = 1 << 31, 1 << 30, 1 << 29, 1 << 28, 1 << 27
CUT_SHORT = "Was the file copied whole, in binary mode? Write or copy it again."


@dataclass(frozen=True, eq=False)
class Records:
    """A binary ANSYS file that is mapped, not loaded.

    Parameters
    ----------
    path
        Path of the file.
    words
        (n,) 32-bit words.
    """

    path: Path
    words: IntArray

    def record(self, pointer: int, most: int, what: str) -> tuple[FloatArray, int]:
        """Return the numbers of the record at word `pointer`, unpacked, and the word at which the next record starts.

        Parameters
        ----------
        pointer
            Word at which the record starts.
        most
            Largest allowed count of numbers; it limits the allocated memory.
        what
            Expected content, for messages.

        Raises
        ------
        InputError
            If the record does not lie within the file, its two lengths differ, or it unpacks to more than `most`.
        """
        total = len(self.words)
        if not 0 <= pointer < total - 2:
            raise self.damaged(what, f"stands at word {pointer} of {total}")
        length, flags = int(self.words[pointer]), int(self.words[pointer + 1])
        start, end = pointer + 2, pointer + 2 + length
        if length < 0 or end >= total:
            raise self.damaged(what, f"at word {pointer} has {length} words, the file ends at {total}")
        if self.words[end] != length:
            raise self.damaged(
                what, f"at word {pointer} has {length} words by its start and {self.words[end]} by its end"
            )
        numbers = self._unpacked(self.words[start:end], flags, most, what)
        if len(numbers) > most:
            raise self.damaged(what, f"has {len(numbers)} numbers, at most {most} can be")
        return numbers, end + 1

    def integers(self, pointer: int, most: int, what: str) -> IntArray:
        """Return a record of whole numbers; see `record`."""
        numbers, _ = self.record(pointer, most, what)
        if numbers.dtype.kind != "i":
            raise self.damaged(what, "holds real numbers where whole ones belong")
        return np.asarray(numbers, dtype=np.int64)

    def reals(self, pointer: int, most: int, what: str) -> FloatArray:
        """Return a record of finite real numbers; see `record`."""
        numbers, _ = self.record(pointer, most, what)
        if numbers.dtype.kind != "f":
            raise self.damaged(what, "holds whole numbers where real ones belong")
        if not np.isfinite(numbers).all():
            raise self.damaged(what, "holds numbers that are not finite")
        return np.asarray(numbers, dtype=float)

    def header(self, what: str) -> IntArray:
        """Return the header record of this kind of file, filled up with zeros."""
        read = self.integers(HEADER, HEADER_WORDS, what)
        return np.concatenate([read, np.zeros(HEADER_WORDS - len(read), dtype=np.int64)])

    def damaged(self, what: str, problem: str) -> InputError:
        """Build the error for a damaged file."""
        return input_error(f"{self.path}: {what}", problem, CUT_SHORT)

    def _unpacked(self, words: IntArray, flags: int, most: int, what: str) -> FloatArray:
        kind = np.dtype(("<i2" if flags & HALF else "<i4") if flags & INTEGER else ("<f4" if flags & HALF else "<f8"))
        if flags & ZLIB:
            raise input_error(
                f"{self.path}: {what}",
                "is packed with zlib, which this reader does not unpack",
                "Write the file again after /FCOMP,RST,0.",
            )
        if flags & (WINDOWS | BITS) and len(words) < 2:
            raise self.damaged(what, "is packed, but shorter than the head of a packed record")
        if flags & BITS:
            return self._from_bits(words, kind, what)
        if flags & WINDOWS:
            return self._from_windows(words, kind, most, what)
        if kind.itemsize == 8 and len(words) % 2:
            raise self.damaged(what, f"holds real numbers, but {len(words)} words")
        return np.frombuffer(words.tobytes(), kind)

    def _from_bits(self, words: IntArray, kind: np.dtype, what: str) -> FloatArray:
        """Unpack a record of up to 32 numbers; one bit for each number says whether it is stored or zero."""
        size, bits = int(words[0]), int(words[1])
        stored = np.array([i for i in range(32) if bits >> i & 1])
        packed = words[2:].tobytes()
        values = np.frombuffer(packed, kind, count=len(packed) // kind.itemsize)
        if not 0 <= size <= 32 or (stored >= size).any() or len(values) < len(stored):
            raise self.damaged(what, f"is packed by {size} bits, of which it holds {len(values)}")
        numbers = np.zeros(size, kind)
        numbers[stored.astype(int)] = values[: len(stored)]
        return numbers

    def _from_windows(self, words: IntArray, kind: np.dtype, most: int, what: str) -> FloatArray:
        """Unpack a record of windows: single numbers, runs of numbers, and runs of one number."""
        size, windows = int(words[0]), int(words[1])
        if not 0 <= size <= most or not 0 <= windows <= len(words) or kind.itemsize < 4:
            raise self.damaged(what, f"is packed to {size} numbers in {windows} windows")
        numbers = np.zeros(size, kind)
        width, at = kind.itemsize // 4, 2
        for _ in range(windows):
            place = int(words[at]) if at < len(words) else size
            length, stored, at = 1, 1, at + 1
            if place <= 0:
                length = int(words[at]) if at < len(words) else 0
                stored, at = (length if length > 0 else 1), at + 1
            first, last = abs(place), abs(place) + abs(length)
            if not length or last > size or at + stored * width > len(words):
                raise self.damaged(what, f"has a window from {first} to {last} of {size} numbers")
            numbers[first:last] = np.frombuffer(words[at : at + stored * width].tobytes(), kind)
            at += stored * width
        return numbers


def long_pointer(low: int, high: int) -> int:
    """Return the 64-bit number that is stored as two 32-bit ones."""
    return (int(high) << 32) + (int(low) & 0xFFFFFFFF)


def open_records(path: Path | str, kind: int) -> Records:
    """Map a binary ANSYS file of a known kind.

    Parameters
    ----------
    path
        The file.
    kind
        4 for ``.full``, 12 for ``.rst``.

    Raises
    ------
    InputError
        If the file is missing, not from ANSYS, of another kind or of another byte order.
    """
    path = Path(path)
    if not path.is_file():
        near = did_you_mean(path.name, [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else [])
        raise input_error(str(path), "there is no such file", near if near.startswith("Did") else "Check the path.")
    count = path.stat().st_size // 4
    if count <= HEADER:
        raise input_error(str(path), f"has {count} words, a header needs more than {HEADER}", CUT_SHORT)
    try:
        words = np.memmap(path, dtype="<i4", mode="r", shape=(count,))
    except OSError as error:
        raise input_error(str(path), f"cannot be read ({error.strerror})", "Check the path.") from error
    if words[0] != 100:
        raise _not_ansys(path, words)
    records = Records(path, np.asarray(words))
    head = records.integers(0, HEADER_WORDS, "standard header")
    written = int(head[0])
    if written != kind:
        raise input_error(
            str(path),
            f"is a file of kind {written} ({KINDS.get(written, 'unknown')}), not {KINDS[kind]}",
            "Use read_ansys_full for .full and read_ansys_results for .rst.",
        )
    return records


def _not_ansys(path: Path, words: IntArray) -> InputError:
    if int(words[0:1].byteswap()[0]) == 100:
        return input_error(
            str(path),
            "has the byte order of a big-endian machine",
            "Write it on a machine with the usual byte order, or in text: the .cdb by CDWRITE.",
        )
    return input_error(
        str(path),
        f"is no binary file of ANSYS: it starts with {words[0]}, not with 100",
        "Use read_ansys_archive for .cdb.",
    )

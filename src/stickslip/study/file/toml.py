"""TOML files of limited size and depth."""

import re
import tomllib
from itertools import accumulate
from pathlib import Path
from typing import Any

from stickslip.errors import InputError, input_error

LARGEST_FILE = 1_000_000  # bytes
MOST_PARTS = 20  # parts of a key between dots: our longest keys have five
MOST_TABLES = 2000  # parts, contacts, loads and their tables
MOST_KEYS = 5000  # keys with a value
DEEPEST = 20  # levels of nested lists or tables: ours have four
MOST_DIGITS = 400  # digits of a number: the largest double has 309

_TEXTS = re.compile(
    r"""\"{3}(?:[^\\]|\\.)*?\"{3} | '{3}.*?'{3} | "(?:[^"\\\n]|\\.)*" | '[^'\n]*' | \#[^\n]*""", re.DOTALL | re.VERBOSE
)
_KEY = re.compile(rf"(?<![\w.-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")
_TABLE = re.compile(r"^[ \t]*\[", re.MULTILINE)
_NUMBER = re.compile(rf"(?<!\w)\d\w{{{MOST_DIGITS}}}")
_COMMA = re.compile(r"=\s*[+-]?\d+,\d+\s*(#.*)?$")
_LINE = re.compile(r"line (\d+)")


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file and its content.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, or exceeds the limits on size and depth.
    """
    text = _text(path)
    return text, parsed(text, path)


def parsed(text: str, path: Path) -> dict[str, Any]:
    """Return the content of TOML text; `path` names the file in messages.

    Raises
    ------
    InputError
        If it is not TOML, or exceeds the limits on size and depth.
    """
    _check_size(path, text)
    try:
        return tomllib.loads(text)
    # impossible dates and numbers raise the ValueError of their types, not of the parser
    except (ValueError, RecursionError) as error:
        raise _no_toml(path, text, str(error)) from None


def _text(path: Path) -> str:
    place = str(path)
    if not path.exists():
        raise input_error(
            place, "there is no such file", "Check the name, or write an example with 'stickslip new NAME'."
        )
    if not path.is_file():
        inside = path / "study.toml"
        name = f"{inside}." if inside.is_file() else "the study file itself, for example two_blades/study.toml."
        raise input_error(place, "is a folder" if path.is_dir() else "is not a file", f"Give {name}")
    try:
        with path.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise input_error(place, f"is larger than {LARGEST_FILE} bytes", "A study file is a few kilobytes of TOML.")
        # TOML allows both line ends; one form keeps hashes and provenance the same
        return content.decode("utf-8-sig").replace("\r\n", "\n")  # some editors write a byte-order mark
    except OSError as error:
        raise input_error(place, f"cannot be read ({error.strerror})", "Check its permissions.") from None
    except UnicodeDecodeError as error:
        raise input_error(place, f"is not UTF-8 text (byte {error.start})", "Save it as UTF-8.") from None


def _check_size(path: Path, text: str) -> None:
    # keys, brackets and digits are counted only outside texts and comments
    bare = _TEXTS.sub(lambda found: "x" * (found[0][0] != "#"), text)
    if (found := _KEY.search(bare)) is not None:
        raise _too_large(path, bare, found.start(), f"has a key of more than {MOST_PARTS} parts")
    if (found := _NUMBER.search(bare)) is not None:
        raise _too_large(path, bare, found.start(), f"has a number of over {MOST_DIGITS} digits")
    steps = ((b in "[{") - (b in "]}") for b in re.findall(r"[][{}]", bare))
    if max(accumulate(steps), default=0) > DEEPEST:
        raise _too_large(path, bare, 0, f"has over {DEEPEST} lists or tables within each other")
    for what, count, most in (("tables", len(_TABLE.findall(bare)), MOST_TABLES), ("keys", bare.count("="), MOST_KEYS)):
        if count > most:
            raise _too_large(path, bare, 0, f"has {count} {what}, more than {most}")


def _too_large(path: Path, bare: str, at: int, problem: str) -> InputError:
    line = f": line {bare.count(chr(10), 0, at) + 1}" if at else ""
    return input_error(f"{path}{line}", problem, "A study file is a few kilobytes of TOML.")


def _no_toml(path: Path, text: str, said: str) -> InputError:
    where = _LINE.search(said)
    line = text.split("\n")[int(where[1]) - 1] if where else ""
    remedy = "Correct the line named." if where else "Correct it."
    if _COMMA.search(line):
        remedy = "Write a point in decimal numbers: 1.5."
    return input_error(str(path), f"is not valid TOML: {said}", remedy)

"""TOML of a bounded size: what would take the parser minutes or gigabytes is refused before."""

import re
import tomllib
from itertools import accumulate
from pathlib import Path
from typing import Any

from stickslip.errors import InputError, input_error

LARGEST_FILE = 1_000_000  # bytes
MOST_PARTS = 20  # of a key, between dots: our longest have five
MOST_TABLES = 2000  # parts, contacts, loads and their tables
MOST_KEYS = 5000  # with a value
DEEPEST = 20  # lists or tables within each other: ours go to four
MOST_DIGITS = 400  # of a number: the largest that a computer holds has 309

_TEXTS = re.compile(
    r"""\"{3}(?:[^\\]|\\.)*?\"{3} | '{3}.*?'{3} | "(?:[^"\\\n]|\\.)*" | '[^'\n]*' | \#[^\n]*""",
    re.DOTALL | re.VERBOSE,
)
_KEY = re.compile(rf"(?<![\w.-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")
_TABLE = re.compile(r"^[ \t]*\[", re.MULTILINE)
_NUMBER = re.compile(rf"(?<!\w)\d\w{{{MOST_DIGITS}}}")
_COMMA = re.compile(r"=\s*[+-]?\d+,\d+\s*(#.*)?$")
_LINE = re.compile(r"line (\d+)")


def parsed(path: Path, text: str) -> dict[str, Any]:
    """Return what a TOML file holds.

    Parameters
    ----------
    path
        The file, for messages.
    text
        Its content.

    Raises
    ------
    InputError
        If it is no TOML, or larger in any way than studies are.
    """
    _check_size(path, text)
    try:
        return tomllib.loads(text)
    # the parser leaves impossible dates and numbers to the types that they become
    except (ValueError, RecursionError) as error:
        raise _no_toml(path, text, str(error)) from None


def _check_size(path: Path, text: str) -> None:
    # keys, brackets and digits count outside of texts and comments alone
    bare = _TEXTS.sub(lambda found: "x" * (found[0][0] != "#"), text)
    if (found := _KEY.search(bare)) is not None:
        raise _too_large(path, bare, found.start(), f"has a key of more than {MOST_PARTS} parts")
    if (found := _NUMBER.search(bare)) is not None:
        raise _too_large(path, bare, found.start(), f"has a number of over {MOST_DIGITS} digits")
    steps = ((b in "[{") - (b in "]}") for b in re.findall(r"[][{}]", bare))
    if max(accumulate(steps), default=0) > DEEPEST:
        raise _too_large(path, bare, 0, f"has over {DEEPEST} lists or tables within each other")
    for what, count, most in (
        ("tables", len(_TABLE.findall(bare)), MOST_TABLES),
        ("keys", bare.count("="), MOST_KEYS),
    ):
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

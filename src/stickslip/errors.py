"""Error types, and the form of their messages: place, error, value, remedy."""

import re
from collections.abc import Collection, Iterable, Mapping
from string import Template

# control characters, marks of direction, and code points that are no characters
_STEERING = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff\ud800-\udfff]")
LONGEST_MESSAGE = 1900  # bytes
LONGEST_TEXT = 600  # characters of a place, a problem or a remedy


class StickslipError(Exception):
    """Any error that this package raises on purpose."""


class InputError(StickslipError):
    """Bad input: a study file, a model or an argument that cannot be used.

    Parameters
    ----------
    place
        File, field or object, e.g. ``study.toml: damper.mass_kg``.
    problem
        Error and value, e.g. ``must be positive, got -0.1``.
    remedy
        Advice. ``$name`` stands for an argument whose name depends on the caller.
    words
        Name of each such argument at this caller: ``{"mesh": "mesh=…"}``.
    others
        Further errors of the same input, one line each in the message.
    """

    def __init__(
        self,
        place: str,
        problem: str,
        remedy: str,
        words: Mapping[str, str] | None = None,
        others: "tuple[InputError, ...]" = (),
    ) -> None:
        super().__init__(place, problem, remedy, words, others)  # arguments from which pickle restores the error
        self.place, self.problem, self.advice = place, problem, remedy
        self.words, self.others = dict(words or {}), others

    @property
    def remedy(self) -> str:
        """Advice, with the caller's names of arguments."""
        return Template(self.advice).safe_substitute(self.words) if self.words else self.advice

    @property
    def argument(self) -> str:
        """Wrong argument of an object if the place is ``Object.argument``; empty for the object as a whole."""
        return self.place.partition(".")[2]

    def __str__(self) -> str:
        return "\n".join(_capped(list(map(_line, self.each()))))

    def each(self) -> "list[InputError]":
        """Return the errors one by one."""
        alone = InputError(self.place, self.problem, self.advice, self.words)
        return [alone, *(one for other in self.others for one in other.each())]

    def at(self, place: str) -> "InputError":
        """Return the same error at another place."""
        return InputError(place, self.problem, self.advice, self.words, self.others)

    def inside(self, place: str) -> "InputError":
        """Return the same errors, each place prefixed by `place`."""
        others = tuple(other.inside(place) for other in self.others)
        return InputError(f"{place}: {self.place}", self.problem, self.advice, self.words, others)

    def under(self, old: str, new: str) -> "InputError":
        """Return the same errors, each place prefixed by `new`; a prefix `old` is removed."""
        others = tuple(other.under(old, new) for other in self.others)
        place = f"{new}: {self.place.removeprefix(f'{old}: ')}"
        return InputError(place, self.problem, self.advice, self.words, others)

    def called(self, words: Mapping[str, str]) -> "InputError":
        """Return the same errors with the arguments under other names."""
        others = tuple(other.called(words) for other in self.others)
        own = {name: words.get(name, word) for name, word in self.words.items()}
        return InputError(self.place, self.problem, self.advice, own, others)


class SingularError(StickslipError):
    """A linear system has no unique solution; the message names the coordinate."""


def input_error(place: str, problem: str, remedy: str, **words: str) -> InputError:
    """Build an `InputError`; `words` name the arguments that the remedy calls ``$name``."""
    return InputError(place, problem, remedy, words)


def missing_file(place: str, path: object) -> InputError:
    """Return the error for a file that a study names and that does not exist."""
    return input_error(place, f"there is no file {path}", "Check the name; it is relative to the study's folder.")


def no_wheel(place: str) -> InputError:
    """Return the error for a table that needs a wheel in a model without one."""
    remedy = "Give a part its number of sectors, or leave the table out."
    return input_error(place, "is given, and the model is no sector of a wheel", remedy)


def check_choice(place: str, value: object, choices: Collection[str], hint: str = "") -> None:
    """Raise an `InputError` unless `value` is one of the `choices`; a `hint` replaces the list of choices as remedy."""
    if value in choices:
        return
    known = ", ".join(choices)
    if hint:
        raise input_error(place, f"{value!r} is none of {known}", hint)
    raise input_error(place, f"is {value!r}", f"Give one of {known}.")


def printable(text: str) -> str:
    """Return the text with control characters as escapes: names in files must not steer a terminal."""
    return _STEERING.sub(lambda found: ascii(found[0])[1:-1], text)


def _line(error: InputError) -> str:
    text = f"{_cut(error.place)}: {_cut(error.problem)}. {_cut(error.remedy)}"
    return printable(text.replace("\n", "\\n"))


def _cut(text: str) -> str:
    """Return beginning and end of a long text."""
    half = LONGEST_TEXT // 2
    return text if len(text) <= LONGEST_TEXT else f"{text[:half]} ... {text[-half:]}"


def _capped(lines: list[str]) -> list[str]:
    """Return as many lines as a screen holds, at least one, and the number of further lines."""
    size = 0
    for n, line in enumerate(lines):
        size += len(line.encode(errors="replace")) + 1
        if size > LONGEST_MESSAGE and n:
            return [*lines[:n], f"... and {len(lines) - n} more."]
    return lines


def together(errors: Iterable[InputError]) -> InputError:
    """Return one error that lists all `errors` (at least one), a line each."""
    first, *rest = errors
    others = (*first.others, *rest)
    return InputError(first.place, first.problem, first.advice, first.words, others)


MAX_SHORT_WORD = 2  # letters of words that are too short for a guess


def nearest(word: str, known: list[str]) -> str:
    """Return the known word nearest to `word`, ignoring case; empty if none is near.

    Known words of one or two letters are never returned.
    """
    from difflib import get_close_matches

    plain = {one.casefold(): one for one in reversed(known) if len(one) > MAX_SHORT_WORD}
    near = get_close_matches(word.casefold(), plain, n=1, cutoff=0.6)
    return plain[near[0]] if near else ""


def did_you_mean(word: str, known: list[str]) -> str:
    """Return ``did you mean 'word'?`` for the `nearest` known word, or the list of known words."""
    near = nearest(word, known)
    if near:
        return f"Did you mean {near!r}?"
    return f"Known: {', '.join(sorted(known))}." if known else "There is none."


MAX_NAMES = 12  # names that a message lists


def nearest_and_known(word: str, known: list[str]) -> str:
    """Return ``did you mean 'word'?`` if a known word is near, then the list of known words, shortened if it is long."""
    near = did_you_mean(word, known)
    if not near.startswith("Did"):
        near = ""
    names = sorted(known)
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    listed = f"Known: {', '.join(names[:MAX_NAMES])}{more}." if names else "There is none."
    return f"{near} {listed}".strip()


IMPORTED_AS = {"scikit-fem": "skfem", "feral-solver": "feral"}  # packages with another import name


def missing_package(package: str, error: Exception, extra: str) -> StickslipError:
    """Build the error for an optional package that cannot be imported.

    Parameters
    ----------
    package
        Name of the package.
    error
        Exception of the import; an `OSError` means that a system library is missing.
    extra
        The extra of this package that installs it.
    """
    if isinstance(error, OSError):
        return StickslipError(
            f"{package}: a system library is missing ({error}). On Debian or Ubuntu: apt-get install "
            "libglu1-mesa libxft2 libxcursor1 libxinerama1 libxrender1"
        )
    lacking = (getattr(error, "name", None) or "").partition(".")[0]
    if lacking and lacking != IMPORTED_AS.get(package, package):
        return StickslipError(
            f"{package}: is installed, but it imports {lacking}, which is not. Use: pip install {lacking}"
        )
    return StickslipError(f"{package} is not installed. Use pip install 'stickslip[{extra}]'")

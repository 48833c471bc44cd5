"""The error types, and the shape of their messages: place, what is wrong, value got, remedy."""


class StickslipError(Exception):
    """Any error that this package raises on purpose."""


class InputError(StickslipError):
    """Bad input: a study file, a model or an argument that cannot be used."""


class SingularError(StickslipError):
    """A linear system has no unique solution; the message names the coordinate."""


def input_error(place: str, problem: str, remedy: str) -> InputError:
    """Build an `InputError` in the one form that messages have.

    Parameters
    ----------
    place
        File, field or object, e.g. ``study.toml: damper.mass_kg``.
    problem
        What is wrong and the value got, e.g. ``must be positive, got -0.1``.
    remedy
        What to do about it.
    """
    return InputError(f"{place}: {problem}. {remedy}")


def did_you_mean(word: str, known: list[str]) -> str:
    """Return ``did you mean 'x'?`` for the nearest known word, or the list of the known ones."""
    from difflib import get_close_matches

    near = get_close_matches(word, known, n=1, cutoff=0.6)
    if near:
        return f"Did you mean {near[0]!r}?"
    return "Known: " + ", ".join(sorted(known)) + "."


def missing_package(package: str, error: Exception, extra: str) -> StickslipError:
    """Build the error for an optional package that cannot be imported.

    Parameters
    ----------
    package
        Its name.
    error
        What the import raised; an `OSError` means that a library of the system is missing.
    extra
        The extra of this package that installs it.
    """
    if isinstance(error, OSError):
        return StickslipError(
            f"{package}: a system library is missing ({error}). On Debian or Ubuntu: apt-get install "
            "libglu1-mesa libxft2 libxcursor1 libxinerama1 libxrender1"
        )
    return StickslipError(f"{package}: not installed. Use: pip install 'stickslip[{extra}]'")

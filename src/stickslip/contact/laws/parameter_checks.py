"""Checks of law parameters, with one wording of their messages."""

from stickslip.errors import input_error


def check_not_negative(law: object, *names: str) -> None:
    """Raise `InputError` if one of the named numbers of `law` is negative; None is not."""
    for name in names:
        value = getattr(law, name)
        if value is not None and value < 0:
            raise input_error(
                f"{type(law).__name__}.{name}", f"must be finite and not negative, got {value}", "Give it in SI units."
            )


def check_any_stiffness(law: object, *names: str) -> None:
    """Raise `InputError` if all the named stiffnesses of `law` are zero."""
    if not any(getattr(law, name) for name in names):
        raise input_error(
            type(law).__name__, "all contact stiffnesses are zero", "Give at least one, or remove the contact."
        )

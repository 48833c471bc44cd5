"""Dataclass fields that several laws share, with their study keys, and checks of their values."""

from typing import Any

from stickslip.errors import input_error
from stickslip.units import quantity


def tangential_stiffness(**given: Any) -> Any:
    """Return the field of the stiffness along t; as in the functions below, ``default=`` makes it optional."""
    return _stiffness("tangent t", "tangential_stiffness", given)


def axial_stiffness(note: str = "", **given: Any) -> Any:
    """Return the field of the stiffness along w; `note` goes on with its meaning."""
    return _stiffness(f"tangent w{note}", "axial_stiffness", given)


def normal_stiffness(note: str = "", **given: Any) -> Any:
    """Return the field of the stiffness along the normal; `note` goes on with its meaning."""
    return _stiffness(f"normal{note}", "normal_stiffness", given)


NO_SECOND_TANGENT = " (0 between single dofs, which move along one line)"
KEEPS_PRELOAD = " (0 where the normal force stays the preload, as between single dofs)"


def friction_coefficient() -> Any:
    """Return the field of the friction coefficient."""
    about = "friction coefficient (steel on steel: 0.6)"
    return quantity(about, key="friction_coefficient", least=0, usual=5)


def slip_limit(least: float | None = 0, **given: Any) -> Any:
    """Return the field of a constant friction limit."""
    about = "friction force at which all has slipped, along either tangent"
    return quantity(about, "n", key="slip_limit", least=least, shared=True, **given)


def _stiffness(where: str, key: str, given: dict[str, Any]) -> Any:
    about = f"stiffness along the {where}"
    return quantity(about, "n_per_m", key=key, shared=True, **{"least": 0, **given})


def check_not_negative(law: object, *names: str) -> None:
    """Raise `InputError` if one of the named numbers of `law` is negative; None is allowed."""
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

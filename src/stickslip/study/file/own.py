"""Objects of the user's code in the tables of a study file."""

from collections.abc import Sequence
from typing import Any

from pydantic import ValidationInfo

from stickslip.errors import InputError
from stickslip.study.file.section import custom_error, shown
from stickslip.study.own_code import OwnCode


def own_object(info: ValidationInfo, address: str, kind: str, members: Sequence[str], *, instance: bool = False) -> Any:
    """Return the object at an address of a study file.

    Parameters
    ----------
    info
        Current validation; its context has the `OwnCode` of the study under ``code``.
    address, kind, members, instance
        As for `OwnCode.at`.

    Raises
    ------
    PydanticCustomError
        As `OwnCode.at`; also for an address given in Python, where the object itself is expected.
    """
    code: OwnCode | None = (info.context or {}).get("code")
    if code is None:
        raise custom_error(f"is a module path, got {shown(address)}", "In Python give the object itself.")
    try:
        return code.at(address, kind, members, instance=instance)
    except InputError as error:
        raise custom_error(error.problem, error.remedy) from None

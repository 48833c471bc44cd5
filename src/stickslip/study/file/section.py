"""The base class of all study tables."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from stickslip.errors import InputError
from stickslip.study.own_code import OwnCode

_NO_NAME = "/\\:*?[]<>|\"'`$"  # characters that some systems do not allow in file names
LARGEST_NUMBER = 1e30  # in the units of the file: products of ten such numbers or inverses do not overflow
LONGEST_VALUE = 60  # largest number of characters of a value in a message

Positive = Annotated[float, Field(gt=0)]
Range = Annotated[list[Positive], Field(min_length=2, max_length=2)]  # [lowest, highest]
ModeNumbers = Annotated[list[Annotated[int, Field(ge=1, le=999)]], Field(min_length=1, max_length=100)]
WaveNumbers = Annotated[list[Annotated[int, Field(ge=0, le=999)]], Field(min_length=1, max_length=200)]
FilePath = Annotated[str, Field(min_length=1, max_length=500)]  # relative to the study's folder


def _plain_name(given: str) -> str:
    if given.isprintable() and not set(given) & set(_NO_NAME) and given == given.strip():
        return given
    raise custom_error(
        f"is no name, got {shown(given)}", "Use letters, digits, '_' and '-': files are named after parts."
    )


Name = Annotated[str, Field(min_length=1, max_length=100), AfterValidator(_plain_name)]


class Section(BaseModel):
    """A table of the study file. Unknown keys, silent conversions, and numbers that are not finite or implausibly large are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, given: object) -> object:
        if isinstance(given, Mapping):
            found = (one for key, value in given.items() for one in _beyond(str(key), value))
            refuse_all(
                custom_error(
                    f"is {value:g}, which no quantity is",
                    f"Numbers are 0 or between {1 / LARGEST_NUMBER:g} and {LARGEST_NUMBER:g} in size. Check the unit.",
                    key,
                )
                for key, value in found
            )
        return given


def _beyond(key: str, value: object) -> Iterator[tuple[str, float]]:
    """Yield implausibly large numbers with their places; nested tables check their own."""
    if isinstance(value, list | tuple):
        for i, entry in enumerate(value):
            yield from _beyond(f"{key}[{i}]", entry)
    elif isinstance(value, float) and value and isfinite(value) and not _is_usual(abs(value)):
        yield key, value


def _is_usual(size: float) -> bool:
    return 1 / LARGEST_NUMBER <= size <= LARGEST_NUMBER


def custom_error(problem: str, remedy: str, key: str = "") -> PydanticCustomError:
    """Return the error that validators of this package raise; `key` names the wrong key if the validator checks a whole table."""
    context = {"problem": problem, "remedy": remedy, "key": key}
    return PydanticCustomError("stickslip", "{problem}. {remedy}", context)


def refuse_all(errors: Iterable[PydanticCustomError]) -> None:
    """Raise one error that contains all `errors`, if there are any; a validator can raise only once."""
    found = list(errors)
    if found:
        first, *others = [dict(error.context or {}) for error in found]
        context = {**first, "others": others}
        raise PydanticCustomError("stickslip", "{problem}. {remedy}", context)


def shown(value: object) -> str:
    """Return `value` as shown in messages, shortened if long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write a number of thousands of digits
        return "a number of thousands of digits"
    except RecursionError:
        return "what is nested too deeply to be shown"
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def rising_pair(values: Sequence[float], key: str, what: str = "frequency") -> None:
    """Refuse a pair that does not increase."""
    if len(values) == 2 and values[0] == values[1]:
        raise custom_error(f"begins and ends at {values[0]:g}", f"Give the lower {what} first, then a higher one.", key)
    if len(values) == 2 and not values[0] < values[1]:
        raise custom_error(
            f"must be the lower before the higher, got {list(values)}", f"Give the lower {what} first.", key
        )


def once(values: Sequence[object], key: str) -> None:
    """Refuse a list with duplicates."""
    if len(set(values)) < len(values):
        raise custom_error(f"holds an entry twice, got {shown(list(values))}", "Give every one once.", key)


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

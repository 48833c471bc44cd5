"""From what pydantic found to sentences that name the file, the key, the value got and a remedy."""

from collections.abc import Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from stickslip.errors import InputError, did_you_mean, input_error, together

LONGEST_VALUE = 60  # characters of a value that a message shows


def custom_error(problem: str, remedy: str, key: str = "") -> PydanticCustomError:
    """Return the error that a validator of this package raises; `key` is the one at fault if it judges a whole table."""
    context = {"problem": problem, "remedy": remedy, "key": key}
    return PydanticCustomError("stickslip", "{problem}. {remedy}", context)


def library_error(section: type[BaseModel], error: InputError) -> PydanticCustomError:
    """Return a dataclass's complaint about ``Class.field`` with the section's key for that field."""
    field = error.place.rpartition(".")[2]
    keys = [k for k in section.model_fields if k == field or k.startswith(field + "_")]
    return custom_error(error.problem, error.remedy, keys[0] if len(keys) == 1 else "")


def told(place: str, model: type[BaseModel], error: ValidationError) -> InputError:
    """Return one error that tells each problem: ``FILE: table.key: problem, got VALUE. REMEDY``."""
    return together(_told(place, model, details) for details in error.errors(include_url=False))


def _told(place: str, model: type[BaseModel], details: ErrorDetails) -> InputError:
    path = [str(p) for p in details["loc"]]
    context: dict[str, Any] = details.get("ctx", {})
    if details["type"] == "stickslip":
        key = context.get("key", "")
        where = ".".join([*path, key] if key else path)
        problem, remedy = context["problem"], context["remedy"]
    else:
        where = ".".join(path)
        problem, remedy = _problem(model, path, details, context)
    return input_error(f"{place}: {where}" if where else place, problem, remedy)


def _problem(
    model: type[BaseModel], path: Sequence[str], details: ErrorDetails, context: dict[str, Any]
) -> tuple[str, str]:
    kind, got = details["type"], shown(details["input"])
    owner, about = _owner(model, path), _about(model, path)
    if kind == "missing":
        return "is missing", f"Add it: {about}."
    if kind == "extra_forbidden":
        return f"unknown key {path[-1]!r}", did_you_mean(path[-1], list(owner.model_fields))
    if kind == "literal_error":
        known = context["expected"].replace("'", "").replace(" or ", ", ").split(", ")
        return f"is not known, got {got}", did_you_mean(str(details["input"]), known)
    if kind == "finite_number":
        return f"must be a finite number, got {got}", f"Give {about}."
    if kind in ("too_long", "too_short"):
        return f"has the wrong number of entries, got {got}", f"Give {about}."
    said = details["msg"].replace("Input should be", "must be").replace("a valid ", "a ")
    said = (
        said.replace("integer", "whole number")
        .replace("string", "text")
        .replace("list", "list of values")
    )
    if kind.endswith("model_type") or kind == "model_attributes_type":
        said = "must be a table"
    return f"{said[0].lower()}{said[1:]}, got {got}", f"Give {about}."


# the readers' arguments, in the words of who has no Python before him
_KEPT = "Read it in Python, keep it with save_structure (.npz) and give that: use"
_IN_STUDY = {
    "units": "model.file.units", "plausible": "model.file.plausible = false", "mesh": "model.file.mesh",
    "mass": "model.file.mass", "nodes": "model.file.nodes", "ignore": "", "use": _KEPT,
}  # fmt: skip
_ON_COMMAND_LINE = {
    "mesh": "--mesh", "mass": "model.file.mass in a study", "nodes": "model.file.nodes in a study",
    "ignore": "", "use": _KEPT,
}  # fmt: skip


def of_a_study(error: InputError) -> InputError:
    """Return a reader's complaint with the keys of a study in place of arguments of Python."""
    return error.called(_IN_STUDY)


def of_the_command_line(error: InputError) -> InputError:
    """Return a reader's complaint with options of ``stickslip inspect`` in place of arguments of Python."""
    return error.called(_ON_COMMAND_LINE)


def shown(value: object) -> str:
    """Return `value` as a message shows it: cut when long."""
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def _owner(model: type[BaseModel], path: Sequence[str]) -> type[BaseModel]:
    """Return the model of the table that holds the last key of `path`."""
    for part in path[:-1]:
        field = model.model_fields.get(part)
        annotation = None if field is None else field.annotation
        tables = [
            inner
            for inner in (annotation, *get_args(annotation))  # of ``Table | None`` too
            if isinstance(inner, type) and issubclass(inner, BaseModel)
        ]
        if not tables:
            break
        model = tables[0]
    return model


def _about(model: type[BaseModel], path: Sequence[str]) -> str:
    """Return the description of the key at `path`, an index of a list belonging to its key."""
    keys = [p for p in path if not p.isdigit()]
    field = _owner(model, keys).model_fields.get(keys[-1]) if keys else None
    if field is None or field.description is None:
        return "a value of the kind that the example of 'stickslip new' shows"
    return field.description

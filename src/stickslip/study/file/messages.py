"""Errors of pydantic, converted to sentences with file, key, value and remedy."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError
from pydantic_core import ErrorDetails

from stickslip.errors import InputError, did_you_mean, input_error, together
from stickslip.study.file.section import shown
from stickslip.study.file.suffixes import meant_key, nearest_key

NO_ABOUT = "a value of the kind that the example of 'stickslip new' shows"


@dataclass(frozen=True)
class Spot:
    """A place in a study file.

    Parameters
    ----------
    keys
        Keys that lead to it, as written in the file.
    owner
        Class of the table that holds the last key; None if the table has no fixed keys.
    about
        Meaning of the last key.
    """

    keys: tuple[str, ...]
    owner: type[BaseModel] | None
    about: str


def told(
    place: str, model: type[BaseModel], error: ValidationError, renamed: Mapping[str, str] | None = None
) -> InputError:
    """Return one error that lists all problems: ``FILE: table.key: problem, got VALUE. REMEDY``.

    Parameters
    ----------
    place
        The file.
    model
        Class of the whole file.
    error
        Error of pydantic.
    renamed
        Key in the tables -> key in the file, if they differ: ``load.shaker.ratio`` -> ``vary.load.shaker.ratio``.
    """
    every = [one for details in error.errors(include_url=False) for one in _each(details)]
    found = (_told(place, model, one, renamed or {}) for one in _unknown_first(model, every))
    return together({str(one): one for one in found}.values())


def _unknown_first(model: type[BaseModel], every: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Return unknown keys before missing ones; a missing key that an unknown one misspells is left out."""
    unknown = [one for one in every if one["type"] == "extra_forbidden"]
    rest = [one for one in every if one["type"] != "extra_forbidden"]
    spots = [spot_at(model, _path(one)) for one in unknown]
    meant = {(*spot.keys[:-1], meant_key(spot.keys[-1], _known(spot))) for spot in spots}
    return unknown + [one for one in rest if not (_is_missing(one) and _place(model, one) in meant)]


def _is_missing(details: ErrorDetails) -> bool:
    problem = str(details.get("ctx", {}).get("problem", ""))
    return details["type"] == "missing" or problem.startswith("is missing")


def _path(details: ErrorDetails) -> list[str | int]:
    return [part for part in details["loc"] if part != "[key]"]


def _place(model: type[BaseModel], details: ErrorDetails) -> tuple[str, ...]:
    """Return the keys that lead to an error."""
    own = details.get("ctx", {}).get("key", "") if details["type"] == "stickslip" else ""
    return (*spot_at(model, _path(details)).keys, *filter(None, [own]))


def _known(spot: Spot) -> list[str]:
    """Return the keys of the table at a place."""
    return [] if spot.owner is None else list(spot.owner.model_fields)


def _each(details: ErrorDetails) -> Iterator[ErrorDetails]:
    """Yield the errors raised by a validator of this package, or else the error of pydantic."""
    yield details
    for context in details.get("ctx", {}).get("others", ()):
        yield {**details, "ctx": context}


def _told(place: str, model: type[BaseModel], details: ErrorDetails, renamed: Mapping[str, str]) -> InputError:
    context: dict[str, Any] = details.get("ctx", {})
    if details["type"] == "stickslip":
        problem, remedy = context["problem"], context["remedy"]
    else:
        problem, remedy = _problem(spot_at(model, _path(details)), details, context)
    where = ".".join(_place(model, details))
    for key, other in renamed.items():
        if where == key or where.startswith((f"{key}.", f"{key}[")):
            where = other
    return input_error(f"{place}: {where}" if where else place, problem, remedy)


def spot_at(model: type[BaseModel], path: Sequence[str | int]) -> Spot:
    """Return the place of a pydantic path, without tags of unions and with list positions in brackets."""
    here: Any = model
    keys: list[str] = []
    owner, about = None, NO_ABOUT
    for part in path:
        here, owns = _opened(here, part)
        if owns is None:  # the tag of a union, which is no key of the file
            continue
        if isinstance(part, int):
            keys[-1:] = [f"{keys[-1] if keys else ''}[{part}]"]
            continue
        keys.append(part)
        owner = owns if isinstance(owns, type) else None
        field = owner.model_fields.get(part) if owner is not None else None
        about = (field.description if field is not None else None) or NO_ABOUT
    return Spot(tuple(keys), owner, about)


def _opened(here: Any, part: str | int) -> tuple[Any, type[BaseModel] | bool | None]:
    """Return the annotation under the part of a path, and its table; the table is None if the part is the tag of a union."""
    tagged = alternatives(here)
    if part in tagged:
        return tagged[str(part)], None
    for one in plain(here):
        if isinstance(one, type) and issubclass(one, BaseModel):
            field = one.model_fields.get(str(part))
            return (None, one) if field is None else (whole(field), one)
        if get_origin(one) in (dict, list, tuple):
            return get_args(one)[-1], True
    return None, True


def whole(field: Any) -> Any:
    """Return a field's annotation together with the metadata that pydantic separates from it."""
    if field.metadata:
        return Annotated[field.annotation, *field.metadata]
    return field.annotation


def plain(annotation: Any) -> list[Any]:
    """Return the types of an annotation: the members of unions, without ``Annotated``."""
    if get_origin(annotation) is Annotated:
        return plain(get_args(annotation)[0])
    if get_origin(annotation) in (dict, list, tuple) or not get_args(annotation):
        return [annotation]
    return [p for inner in get_args(annotation) for p in plain(inner)]


def alternatives(annotation: Any) -> dict[str, Any]:
    """Return the members of a tagged union by their tags."""
    if get_origin(annotation) is Annotated:
        inner, *metadata = get_args(annotation)
        tags = {m.tag: inner for m in metadata if isinstance(m, Tag)}
        return tags or alternatives(inner)
    found: dict[str, Any] = {}
    if get_origin(annotation) not in (dict, list, tuple):
        for inner in get_args(annotation):
            found |= alternatives(inner)
    return found


def _problem(spot: Spot, details: ErrorDetails, context: dict[str, Any]) -> tuple[str, str]:
    kind, got = details["type"], shown(details["input"])
    if kind == "missing":
        return "is missing", f"Add it: {spot.about}."
    if kind == "extra_forbidden":
        remedy = nearest_key(spot.keys[-1], _known(spot), details["input"])
        return f"unknown key {spot.keys[-1]!r}", remedy
    if kind == "literal_error":
        known = context["expected"].replace("'", "").replace(" or ", ", ").split(", ")
        word = "off" if details["input"] is False else str(details["input"])
        return f"is not known, got {got}", _one_of(word, known, spot.about)
    if kind == "list_type" and isinstance(details["input"], str | int | float):
        return f"must be a list, got {got}", f"Write {spot.keys[-1]} = [{got}]. It means: {spot.about}."
    said = _KINDS.get(kind) or details["msg"]
    for of_pydantic, ours in _WORDS:
        said = said.replace(of_pydantic, ours)
    return f"{said[0].lower()}{said[1:]}, got {got}", f"It means: {spot.about}."


def _one_of(word: str, known: list[str], about: str) -> str:
    """Return the word that was probably meant, or else all known words, with their meanings if the list does not explain itself."""
    remedy = did_you_mean(word, known)
    listed = about == NO_ABOUT or about.endswith(", ".join(known))
    return remedy if listed or not remedy.startswith("Known: ") else f"{remedy} It means: {about}."


_KINDS = {
    "finite_number": "must be a finite number",
    "too_long": "has the wrong number of entries",
    "too_short": "has the wrong number of entries",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "dict_type": "must be a table",
}
_WORDS = (
    ("Input should be", "must be"),
    ("a valid ", "a "),
    ("integer", "whole number"),
    ("string", "text"),
    ("list", "list of values"),
)

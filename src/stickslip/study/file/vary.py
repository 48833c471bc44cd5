"""The table [vary] gives lists of values for any key; lists of one table vary together, several tables are combined."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from stickslip.errors import InputError, input_error, together
from stickslip.study.file.case_names import JOINT, short_name, short_names
from stickslip.study.file.messages import alternatives, plain, whole
from stickslip.study.file.section import shown
from stickslip.study.file.suffixes import nearest_key

MOST_CASES = 1000
NAME = "name"  # key of [vary] with the names of its cases
NAMED = 'For example name = ["light", "heavy"].'
EXAMPLE = "For example [vary] with load.shaker.ratio = [100, 20]."

Values = dict[str, Any]  # varied key -> value


@dataclass(frozen=True)
class VariedCase:
    """Name and varied values of a case; both empty for a file without [vary]."""

    name: str
    values: Values


def cases_of(place: str, raw: Mapping[str, Any], model: type[BaseModel]) -> list[VariedCase]:
    """Return name and values of each case; one case for a file without [vary].

    Parameters
    ----------
    place
        The file.
    raw
        Content of the file.
    model
        Class of the whole file, which defines the known keys.

    Raises
    ------
    InputError
        If a key does not exist or is no list, lists of one table differ in length, or two cases have the same name.
    """
    given = raw.get("vary")
    if given is None:
        return [VariedCase("", {})]
    tables = given if isinstance(given, list) else [given]
    if not all(isinstance(table, dict) for table in tables):
        raise input_error(f"{place}: vary", f"must be a table, got {shown(given)}", EXAMPLE)
    errors: list[InputError] = []
    flat = [dict(_flat(place, {k: v for k, v in table.items() if k != NAME}, errors)) for table in tables]
    errors += _wrong(place, flat, raw, model)
    errors += [error for table, lists in zip(tables, flat, strict=True) for error in _wrong_names(place, table, lists)]
    if errors:
        raise together(errors)
    count = prod(len(next(iter(lists.values()))) for lists in flat if lists)
    if count > MOST_CASES:
        raise input_error(f"{place}: vary", f"spans {count} cases, more than {MOST_CASES}", "Vary fewer values.")
    kept = [(table.get(NAME), lists) for table, lists in zip(tables, flat, strict=True) if lists]
    runs = [[dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)] for _, lists in kept]
    words = short_names([rows for (names, _), rows in zip(kept, runs, strict=True) if names is None])
    told = [names or [short_name(row, words) for row in rows] for (names, _), rows in zip(kept, runs, strict=True)]
    found = [
        VariedCase(JOINT.join(filter(None, own)), {k: v for part in parts for k, v in part.items()})
        for own, parts in zip(product(*told), product(*runs), strict=True)
    ]
    doubled = [name for name, n in Counter(case.name for case in found).items() if n > 1]
    if doubled:
        raise input_error(
            f"{place}: vary", f"has several cases called {doubled[0]!r}", "Give each value, or name, once."
        )
    return found


def with_values(raw: Mapping[str, Any], values: Mapping[str, Any], *, keep_vary: bool = False) -> dict[str, Any]:
    """Return the content of a file with other values of some keys; [vary] is removed unless `keep_vary`."""
    content = {k: v for k, v in deepcopy(dict(raw)).items() if keep_vary or k != "vary"}
    for key, value in values.items():
        *tables, last = key.split(".")
        here = content
        for name in tables:
            here = here.setdefault(name, {})
        here[last] = value
    return content


def refuse_varied(place: str, raw: Mapping[str, Any], values: Mapping[str, Any]) -> None:
    """Refuse single values of keys that [vary] would overwrite.

    Raises
    ------
    InputError
        If there are such keys; the message names each, and how to replace or remove its list.
    """
    varied = varied_keys(place, raw)
    errors = [
        input_error(
            f"{place}: {key}",
            f"is varied, so one value has no effect: [vary] has {shown(lists)}",
            f'Replace [vary] as a whole: {{"vary": {{"{key}": [{value!r}]}}}} runs this value alone; "vary": {{}} leaves [vary] out.',
        )
        for key, value in values.items()
        if (lists := varied.get(key)) is not None
    ]
    if errors:
        raise together(errors)


def varied_keys(place: str, raw: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return the keys of [vary] with their lists."""
    given = raw.get("vary", {})
    tables = given if isinstance(given, list) else [given]
    return {key: found for table in tables for key, found in _flat(place, table, []) if key != NAME}


def value_at(raw: Mapping[str, Any], key: str) -> Any:
    """Return the value of a key outside of [vary]; None if it is not given."""
    here: Any = raw
    for name in key.split("."):
        here = here.get(name) if isinstance(here, Mapping) else None
    return here


def _flat(
    place: str, table: Mapping[str, Any], errors: list[InputError], above: str = ""
) -> Iterator[tuple[str, list[Any]]]:
    """Yield the keys of nested tables, joined by dots, with their lists; other values become errors."""
    for name, value in table.items():
        key = f"{above}{name}"
        if isinstance(value, dict):
            yield from _flat(place, value, errors, f"{key}.")
        elif isinstance(value, list) and value:
            yield key, value
        elif value == []:
            problem, remedy = ("is an empty list: there is nothing to compute", "Give one value or more.")
            errors.append(input_error(f"{place}: vary.{key}", problem, remedy))
        else:
            problem = f"must be a list of values, got {shown(value)}"
            errors.append(input_error(f"{place}: vary.{key}", problem, EXAMPLE))


def _wrong_names(place: str, table: Mapping[str, Any], lists: Mapping[str, Sequence[Any]]) -> Iterator[InputError]:
    """Yield errors about the names of a table's cases."""
    names, count = table.get(NAME, []), len(next(iter(lists.values()), ()))
    if NAME in table and not (isinstance(names, list) and all(isinstance(n, str) and n.strip() for n in names)):
        yield input_error(f"{place}: vary.{NAME}", f"must be a list of texts, got {shown(names)}", NAMED)
    elif NAME in table and len(names) != count:
        told = f"has {len(names)} for {count} cases"
        yield input_error(f"{place}: vary.{NAME}", told, f"Give one name a case of its table. {NAMED}")


def _wrong(
    place: str, tables: Sequence[Mapping[str, list[Any]]], raw: Mapping[str, Any], model: type[BaseModel]
) -> Iterator[InputError]:
    seen: set[str] = set()
    for lists in tables:
        for key in lists:
            yield from _unknown(place, key, raw, model)
            if key in seen:
                yield input_error(f"{place}: vary.{key}", "is varied twice", "Give one list.")
            seen.add(key)
        lengths = {key: len(values) for key, values in lists.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{key} has {n}" for key, n in lengths.items())
            yield input_error(
                f"{place}: vary",
                f"lists of one table run together and must be of one length: {told}",
                "Make them equally long, or give each a [[vary]] of its own: then all combinations are run.",
            )


def _unknown(place: str, key: str, raw: Mapping[str, Any], model: type[BaseModel]) -> list[InputError]:
    """Return the error about an unknown key, in a list; an empty list for a known key."""
    content: Any = raw
    here: Any = model
    for i, name in enumerate(key.split(".")):
        if alternatives(here) and not _chosen(here, content):
            return []  # the table has its own error, since its kind is unknown
        known, here = _below(here, content, name)
        if name not in known or (i == 0 and name in ("vary", "schema_version", "title")):
            return [input_error(f"{place}: vary.{key}", f"there is no key {name!r}", nearest_key(name, known))]
        content = content.get(name) if isinstance(content, Mapping) else None
    return []


def _below(here: Any, content: Any, name: str) -> tuple[list[str], Any]:
    """Return the keys allowed in a table, and the annotation of one of them."""
    for one in plain(here) if not alternatives(here) else _chosen(here, content):
        if isinstance(one, type) and issubclass(one, BaseModel):
            field = one.model_fields.get(name)
            return list(one.model_fields), None if field is None else whole(field)
        if get_origin(one) is dict:
            return list(content or ()), get_args(one)[-1]
    return [], None


def _chosen(here: Any, content: Any) -> list[Any]:
    """Return the member of a union that fits a table of the file."""
    tagged = alternatives(here)
    if not isinstance(content, Mapping):
        return []
    kind = next((key for key in tagged if key in content), content.get("shape"))
    return [tagged[kind]] if kind in tagged else []

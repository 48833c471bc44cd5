"""Keys of a study table with defaults and meanings, as text."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from stickslip.contact.laws import ALL_LAWS
from stickslip.errors import did_you_mean, input_error
from stickslip.study.file.model.contacts import keys_of, meaning_of
from stickslip.study.file.tables import study_tables

REQUIRED = "required"
_ANY_NAME = "NAME"  # stands for the user's name of a table
_LONGEST = 24  # largest number of characters of a default in a cell


@dataclass(frozen=True)
class Keys:
    """Keys of one table.

    Parameters
    ----------
    title
        The table as written in the file, with the key that chooses its kind.
    rows
        Key, default and meaning of each.
    """

    title: str
    rows: tuple[tuple[str, str, str], ...]


def tables_of_file() -> Keys:
    """Return the tables that a study file may have."""
    schema = study_tables().model_json_schema()
    rows = [(key, "", entry.get("description", "")) for key, entry in schema["properties"].items()]
    return Keys("A study file", tuple(rows))


def table_keys(name: str) -> list[Keys]:
    """Return the keys of a table, one entry for each of its kinds.

    Parameters
    ----------
    name
        Name of the table, such as ``forced_response``; ``contact.elastic_coulomb`` is a single kind.
    """
    schema = study_tables().model_json_schema()
    table, _, kind = name.strip("[]").partition(".")
    kind = "" if kind == _ANY_NAME else kind
    if table not in schema["properties"]:
        raise input_error(name, "is no table of a study file", _table_of(schema, table))
    entry = schema["properties"][table]
    below = entry.get("additionalProperties")
    title = f"{table}.{_ANY_NAME}" if isinstance(below, dict) else table
    found = dict(_kinds(schema, below if isinstance(below, dict) else entry))
    if not found:  # a single value, or [vary], whose keys are those of all tables
        return [Keys("A study file", ((table, "", entry.get("description", "")),))]
    if table == "contact":
        return [_of_contact(title, found[""], kind)]
    if kind and kind not in found:
        known = did_you_mean(kind, [word for word in found if word])
        raise input_error(name, f"is no kind of [{title}]", f"{known} 'stickslip keys {table}' has all.")
    chosen = {word: node for word, node in found.items() if not kind or word == kind}
    return [Keys(_title(title, word, node), _rows(node)) for word, node in chosen.items()]


def _table_of(schema: Mapping[str, Any], word: str) -> str:
    """Return the name of the table to which a kind belongs, or a hint at a table with a similar name."""
    if word in list(ALL_LAWS):
        return f"It is a law of contacts: 'stickslip keys contact.{word}'."
    for table, entry in schema["properties"].items():
        below = entry.get("additionalProperties")
        if word in dict(_kinds(schema, below if isinstance(below, dict) else entry)):
            return f"It is a kind of [{table}]: 'stickslip keys {table}.{word}'."
    return did_you_mean(word, list(schema["properties"]))


def _of_contact(title: str, node: Mapping[str, Any], law: str) -> Keys:
    """Return the keys common to all contacts, followed by the keys of a law."""
    every = {n: {**keys_of(n, per_area=True), **keys_of(n, per_area=False)} for n in ALL_LAWS}
    if law and law not in every:
        raise input_error(f"contact.{law}", "is no law", did_you_mean(law, list(every)))
    of_laws = {key for own in every.values() for key in own}
    rows = [row for row in _rows(node) if row[0] not in of_laws]
    if not law:
        told = f"'stickslip keys contact.LAW' adds the keys of a law ({', '.join(every)})"
        return Keys(f"[{title}]: keys of all laws; {told}", tuple(rows))
    per_area = keys_of(law, per_area=True).keys() - keys_of(law, per_area=False).keys()
    for key, default, meaning in _rows(node):
        if key in every[law]:
            needed = REQUIRED if every[law][key] else default
            own = meaning_of(law, key) or meaning
            rows.append((key, 'with per = "area"' if key in per_area else needed, own))
    return Keys(f'[{title}] with law = "{law}"', tuple(rows))


def _kinds(schema: Mapping[str, Any], entry: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the kinds of a table with the word that selects each; empty if there is only one."""
    for node in _nodes(schema, entry):
        words = [str(own["const"]) for own in node["properties"].values() if "const" in own]
        yield words[0] if words else "", node


def _nodes(schema: Mapping[str, Any], entry: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    if "$ref" in entry:
        entry = schema["$defs"][entry["$ref"].rpartition("/")[2]]
    for option in (*entry.get("anyOf", ()), *entry.get("oneOf", ())):
        yield from _nodes(schema, option)
    if "properties" in entry:
        yield entry


def _title(table: str, word: str, node: Mapping[str, Any]) -> str:
    keys = [k for k, own in node["properties"].items() if word and own.get("const") == word]
    return f'[{table}] with {keys[0]} = "{word}"' if keys else f"[{table}]"


def _rows(node: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    required = node.get("required", ())
    return tuple(
        (key, REQUIRED if key in required else _default(own), own.get("description", ""))
        for key, own in node["properties"].items()
        if "const" not in own
    )


def _default(entry: Mapping[str, Any]) -> str:
    value = entry.get("default")
    text = "" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else "..."

"""Keys of a study table with defaults and meanings, as text."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stickslip.contact.laws import ALL_LAWS
from stickslip.errors import did_you_mean, input_error, nearest, nearest_and_known
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
        Name of the table, such as ``forced_response``; ``contact.elastic_coulomb`` is a single kind, ``part.mass_kg`` a
        single key.

    Raises
    ------
    InputError
        If there is no such table, kind or key.
    """
    schema = study_tables().model_json_schema()
    table, _, kind = name.strip("[]").partition(".")
    kind = kind.removeprefix(_ANY_NAME).strip(".")
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
    chosen = {word: node for word, node in found.items() if not kind or word == kind}
    every = [Keys(_title(title, word, node), _rows(node)) for word, node in (chosen or found).items()]
    return every if chosen else _of_one_key(every, kind) or _of_a_name(every, found, name, title)


def _of_one_key(every: Sequence[Keys], word: str) -> list[Keys]:
    """Return the row of a key in each kind that has it; the word may have the user's name of the table before it."""
    key = word.rpartition(".")[2]
    rows = [Keys(own.title, tuple(row for row in own.rows if row[0] == key)) for own in every]
    return [own for own in rows if own.rows]


def _of_a_name(every: list[Keys], found: Mapping[str, Mapping[str, Any]], name: str, title: str) -> list[Keys]:
    """Return the keys of a table that the user names, if it has one kind.

    Raises
    ------
    InputError
        If the kind is not known from the name, or the table has no name of the user's.
    """
    table, _, word = name.strip("[]").partition(".")
    kinds = [kind for kind, node in found.items() if kind and kind not in node["properties"]]
    if not kinds and _ANY_NAME in title:
        return every
    if not kinds:
        remedy = (
            f"{did_you_mean(word, [row[0] for own in every for row in own.rows])} 'stickslip keys {table}' lists them."
        )
        raise input_error(name, f"is no key of [{title}]", remedy)
    near = nearest(word, kinds)
    alike = [near] if near else [kind for kind in kinds if word.lower() in str(found[kind]["description"]).lower()]
    chooser = next(key for node in found.values() for key, own in node["properties"].items() if "const" in own)
    others = "".join(f', or the table has {kind} = "..."' for kind in found if kind and kind not in kinds)
    listed = ", ".join(f'"{kind}"' for kind in dict.fromkeys([*alike, *kinds]))
    raise input_error(
        name,
        f"names neither a key nor a {chooser}. In a study the word behind the dot is a name of your own; {chooser} decides which keys the table has",
        f"{chooser} is one of {listed}{others}. 'stickslip keys {table}.{(alike or kinds)[0]}' lists the keys of one, 'stickslip keys {table}' all keys.",
    )


def _table_of(schema: Mapping[str, Any], word: str) -> str:
    """Return the name of the table to which a kind belongs, or a hint at a table with a similar name."""
    if word in list(ALL_LAWS):
        return f"It is a law of contacts: 'stickslip keys contact.{word}'."
    for table, entry in schema["properties"].items():
        below = entry.get("additionalProperties")
        if word in dict(_kinds(schema, below if isinstance(below, dict) else entry)):
            return f"It is a kind of [{table}]: 'stickslip keys {table}.{word}'."
    having = [name for name, entry in schema["properties"].items() if _has(schema, entry, word)]
    if having:
        return f"It is a key of {', '.join(f'[{name}]' for name in having)}: 'stickslip keys {having[0]}.{word}'."
    return did_you_mean(word, list(schema["properties"]))


def _has(schema: Mapping[str, Any], entry: Mapping[str, Any], key: str) -> bool:
    below = entry.get("additionalProperties")
    return any(key in node["properties"] for node in _nodes(schema, below if isinstance(below, dict) else entry))


def _of_contact(title: str, node: Mapping[str, Any], law: str) -> Keys:
    """Return the keys common to all contacts, followed by the keys of a law."""
    every = {n: {**keys_of(n, per_area=True), **keys_of(n, per_area=False)} for n in ALL_LAWS}
    if law and law not in every:
        one = _of_one_key([Keys(f"[{title}]", _rows(node))], law)
        if one:
            return one[0]
        raise input_error(
            f"contact.{law}",
            "names neither a key nor a law. In a study the word behind the dot is a name of your own; law decides which keys the table has",
            f"{nearest_and_known(law, list(every))} 'stickslip keys contact' has the keys of all laws.",
        )
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
    """Yield the kinds of a table with the value or else the required key that selects each; empty if there is only one."""
    nodes = list(_nodes(schema, entry))
    for node in nodes:
        words = [str(own["const"]) for own in node["properties"].values() if "const" in own]
        words += node.get("required", ["", ""])[:1] if len(nodes) > 1 else []
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
    if keys:
        return f'[{table}] with {keys[0]} = "{word}"'
    return f'[{table}] with {word} = "..."' if word else f"[{table}]"


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

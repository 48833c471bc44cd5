"""Write the parts of the documentation that are made from the code.

``python docs/generate.py`` writes what lies in the repository: tables of keys, variables and public names, and the typed keys of methods.
The build of the documentation adds what it alone can show: the full text of every name, comparisons, computed tables, a drawing.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import interface_by_task
import typed_keys

from stickslip.study.questions import ANALYSES

HERE = Path(__file__).parent
# page -> its heading and the tables of the study file on it; the empty name is the top of the file
PAGES_OF_KEYS = {
    "general": (
        "At the top, material, temperature, damping, reduction",
        ("", "material", "temperature", "damping", "reduction"),
    ),
    "parts": ("Parts", ("part",)),
    "contacts": ("Contacts and joins", ("contact", "join")),
    "loads": ("Loads, rotation, operating range", ("load", "rotation", "operation")),
    "stress": ("Stress and margin", ("stress",)),
    "aero": ("Aerodynamic coefficients", ("aero",)),
    "mistuning": ("Mistuning", ("mistuning",)),
    "output": ("Output and measured peaks", ("output", "measured")),
    "analyses": (
        "Questions",
        tuple(ANALYSES),
    ),
    "settings": ("Harmonics, solver, limits", ("harmonics", "solver", "retention", "limits")),
}
FIVE = "Two blades and a damper, five harmonics"  # a case of the validation with a table of its own
STATED = (
    "Where contacts slip much, five harmonics are not enough. A row holds if the error against time integration is the one that more harmonics "
    "state, and if the run does not trust the case where that error is above the tolerance."
)
RESULTS = HERE.parent / "evidence" / "validation" / "out" / "results.json"

MADE = "Made from the code by `python docs/generate.py`."


def write_all(folder: Path) -> None:
    """Write what only a build shows into `folder`."""
    from alert_numbers import alert_tables
    from glossary_drawing import draw_glossary
    from sector_drawing import draw_sector

    folder.mkdir(exist_ok=True)
    (folder / "validation.md").write_text(validation(), encoding="utf-8")
    (folder / "api.md").write_text(interface_by_task.in_full(), encoding="utf-8")
    for name, table in alert_tables().items():
        (folder / name).write_text(table, encoding="utf-8")
    draw_sector(folder / "sector.svg")
    draw_glossary(folder)


def kept() -> dict[str, str]:
    """Return the pages that lie in the repository, by their paths below `docs`."""
    titles = {name: title for name, (title, _) in PAGES_OF_KEYS.items()} | {"laws": "Contact laws"}
    found = {
        f"keys/{name}.md": f"# Keys: {titles[name]}\n\n{MADE} [The study file](../study_file.md) explains them.\n\n{text}"
        for name, text in {**keys(), "laws": laws()}.items()
    }
    found |= {
        f"variables/{name}.md": f"# Variables of {_node(name)}\n\n{MADE} [Results](../results.md) explains where they stand.\n\n{text}"
        for name, text in variables().items()
    }
    pages = {**found, "api.md": interface_by_task.interface_page()}
    return {path: text.rstrip() + "\n" for path, text in pages.items()}


def _node(name: str) -> str:
    return "the model, in most analyses" if name == "model" else f"`[{name}]`"


def keys() -> dict[str, str]:
    """Return one table of keys for each table of the study file, by the pages that hold them."""
    from stickslip.study.file.model.parts import PartTable
    from stickslip.study.file.tables import json_schema

    schema = json.loads(json_schema())
    return {
        name: "\n".join(Keys(schema, tuple(PartTable.model_fields)).of(tables))
        for name, (_, tables) in PAGES_OF_KEYS.items()
    }


@dataclass(frozen=True)
class Keys:
    """Tables of keys from the JSON Schema of study files.

    Parameters
    ----------
    schema
        Of the whole file.
    common
        Keys of every part that vibrates, told once.
    """

    schema: dict[str, Any]
    common: tuple[str, ...]

    def of(self, tables: tuple[str, ...]) -> list[str]:
        """Return the tables of keys of some tables of the file; the empty name is the top."""
        lines: list[str] = []
        for name in tables:
            if not name:
                lines += self._table("At the top", self.schema, flat=True)
                continue
            entry = self.schema["properties"][name]
            every = entry.get("additionalProperties")
            lines += self._below(name if every is None else f"{name}.NAME", every or entry)
        return lines

    def _below(self, path: str, entry: dict[str, Any]) -> list[str]:
        """Return the table at `path`; one for each kind where it may be one of several."""
        options = _options(entry)
        if not options:
            return self._table(f"`[{path}]`", self._resolved(entry), path=path)
        common = self.common if path == "part.NAME" else ()
        lines: list[str] = []
        for option in options:
            node = self._resolved(option)
            tags = {key: own["const"] for key, own in node["properties"].items() if "const" in own}
            key, word = next(iter(tags.items()), (node["required"][0], "..."))
            title = f'`[{path}]` with `{key} = "{word}"`'
            lines += self._table(title, node, path=path, without=(*common, *tags))
        return lines

    def _table(
        self, title: str, node: dict[str, Any], *, path: str = "", without: tuple[str, ...] = (), flat: bool = False
    ) -> list[str]:
        rows, below = [], []
        laws = "law" in node["properties"]  # their keys have tables of their own
        for key, entry in node["properties"].items():
            if key in without or (laws and key in self._of_laws()):
                continue
            inner, every = self._resolved(entry), entry.get("additionalProperties")
            nested = inner if "properties" in inner else None
            if flat and (nested is not None or every is not None or _is_table(entry)):
                continue
            if isinstance(every, dict) and not flat:
                below += self._table(f"`[{path}.{key}.NAME]`", self._resolved(every), path=f"{path}.{key}.NAME")
            if _options(entry) and not flat:
                below += self._below(f"{path}.{key}", entry)
                continue
            if nested is not None and not (path == "part.NAME" and key in self.common):
                below += self._table(f"`[{path}.{key}]`", nested, path=f"{path}.{key}")
                continue
            rows.append(f"| `{key}` | {_escaped(entry.get('description', ''))} | {_default(key, node)} |")
        if not rows:
            return below
        # the dataclass speaks of SI; keys have their units at their ends
        text = "" if flat else re.sub(r"; (lengths in )?metres.*", ".", node["description"])
        return [f"## {title}", "", text, "", "| key | meaning | default |", "|---|---|---|", *rows, "", *below]

    def _of_laws(self) -> set[str]:
        from stickslip.contact.laws import ALL_LAWS
        from stickslip.study.file.quantities import columns_of

        each = (columns_of(law, per_area=area) for law in ALL_LAWS.values() for area in (False, True))
        return {key for found in each for key in found}

    def _resolved(self, entry: dict[str, Any]) -> dict[str, Any]:
        parts = [*entry.get("allOf", []), *entry.get("anyOf", [])]  # a table that may be left out is one of two
        reference = entry.get("$ref") or next((p["$ref"] for p in parts if "$ref" in p), None)
        return self.schema["$defs"][reference.rsplit("/", 1)[1]] if reference else entry


def _options(entry: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the kinds that a table may be one of."""
    every = [entry, *entry.get("anyOf", [])]
    return next((one["oneOf"] for one in every if "oneOf" in one), [])


def _is_table(entry: dict[str, Any]) -> bool:
    return bool(entry.get("description", "").startswith("the table"))


def _default(key: str, node: dict[str, Any]) -> str:
    if key in node.get("required", ()):
        return "(required)"
    value = node["properties"][key].get("default")
    if value is None or value in ("", []):
        return "(left out)"
    return f"`{value:g}`" if isinstance(value, float) else f"`{json.dumps(value)}`"


def laws() -> str:
    """Return one table of keys for each contact law, from the fields of its dataclass."""
    from stickslip.contact.laws import ALL_LAWS
    from stickslip.study.file.quantities import columns_of

    lines: list[str] = []
    for name, law in ALL_LAWS.items():
        whole, area = (columns_of(law, per_area=flag) for flag in (False, True))
        rows = []
        for (key, (_, column)), of_area in zip(whole.items(), area, strict=True):
            default = "(required)" if column.is_required() else f"`{json.dumps(column.default)}`"
            default = "(left out)" if default == "`null`" else default
            also = "" if of_area == key else f"`{of_area}`"
            rows.append(f"| `{key}` | {also} | {_escaped(column.description)} | {default} |")
        lines += [
            f'## `law = "{name}"`',
            "",
            (law.__doc__ or "").partition("\n")[0],
            "",
            '| key | with `per = "area"` | meaning | default |',
            "|---|---|---|---|",
            *rows,
            "",
        ]
    return "\n".join(lines)


def variables() -> dict[str, str]:
    """Return the table of variables of each analysis by its name, and of the model, which most of them have."""
    from stickslip.analyses.columns import described
    from stickslip.analyses.facts import ModelFacts
    from stickslip.study.analysis import named

    of_model = list(described(ModelFacts))
    found = {"model": _variables(of_model, ("case",))}
    for name in ANALYSES:
        own = [row for kind in named(name).answers for row in described(kind) if row not in of_model]
        # points of a forced response follow each other over all cases
        found[name] = _variables(own, () if name == "forced_response" else ("case",))
    return found


def _variables(rows: list[tuple[str, tuple[str, ...], str, str]], outer: tuple[str, ...]) -> str:
    """Return a table of variables from their names, dimensions, units and meanings."""
    lines = [
        f"| `{name}` | {', '.join([*outer, *dims])} | {_escaped(about)} | {_unit(units)} |"
        for name, dims, units, about in rows
    ]
    return "\n".join(["| variable | dimensions | meaning | unit |", "|---|---|---|---|", *lines, ""])


def _unit(units: str) -> str:
    return {"1": "–", "percent": "%"}.get(units, units)


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def validation() -> str:
    """Return the table of comparisons, or how to make it."""
    if not RESULTS.exists():
        return "*This build has no results: run `make validate`, then `make docs`.*\n"
    records = json.loads(RESULTS.read_text(encoding="utf-8"))
    holding = sum(record["holds"] is True for record in records)
    stated = [record for record in records if record["case"] == FIVE]
    others = [record for record in records if record["case"] != FIVE]
    lines = [f"{holding} of {len(records)} comparisons hold.", "", *_comparisons(others)]
    if stated:
        lines += ["", "### Five harmonics, as in the paper", "", STATED, "", *_comparisons(stated)]
    return "\n".join(lines) + "\n"


def _comparisons(records: list[dict[str, Any]]) -> list[str]:
    """Return the lines of a table of comparisons."""
    lines = ["| case | quantity | ours | reference | tolerance | holds | source |", "|---|---|---|---|---|---|---|"]
    for record in records:
        cells = [_number(record[key]) for key in ("case", "quantity", "ours", "reference", "tolerance")]
        cells += [{True: "yes", False: "**no**"}.get(record["holds"], record["holds"]), _escaped(record["source"])]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _number(value: object) -> str:
    return f"{value:.7g}" if isinstance(value, float) else _escaped(str(value))


if __name__ == "__main__":
    for path, text in kept().items():
        (HERE / path).parent.mkdir(exist_ok=True)
        (HERE / path).write_text(text, encoding="utf-8")
    typed_keys.FILE.write_text(typed_keys.module(), encoding="utf-8")

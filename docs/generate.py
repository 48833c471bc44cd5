"""Write the parts of the documentation that are made from the code: study file, public names, validation, a drawing."""

import ast
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from alert_numbers import alert_tables
from sector_drawing import draw_sector

import stickslip

PARTS_OF_THE_PAGE = {
    "general": ("", "material", "damping", "reduction"),
    "parts": ("part",),
    "contacts": ("contact", "join"),
    "loads": ("load", "rotation"),
    "aero": ("aero",),
    "mistuning": ("mistuning",),
    "output": ("output", "measured"),
    "analyses": (
        "forced_response",
        "quasi_periodic",
        "limit_cycle",
        "nonlinear_mode",
        "resonance",
        "residual_tractions",
        "modes",
        "campbell",
        "flutter",
        "safe",
        "run_up",
    ),
    "settings": ("harmonics", "solver", "retention", "limits"),
}
RESULTS = Path(__file__).parent.parent / "evidence" / "validation" / "out" / "results.json"
PACKAGES = [
    "stickslip",
    "stickslip.model",
    "stickslip.assembly",
    "stickslip.contact",
    "stickslip.reduction",
    "stickslip.harmonic",
    "stickslip.solve",
    "stickslip.response",
    "stickslip.response.residual_tractions",
    "stickslip.response.self_excited",
]


def write_all(folder: Path) -> None:
    """Write every generated page part into `folder`."""
    folder.mkdir(exist_ok=True)
    for name, tables in keys().items():
        (folder / f"keys_{name}.md").write_text(tables, encoding="utf-8")
    (folder / "keys_laws.md").write_text(laws(), encoding="utf-8")
    (folder / "variables.md").write_text(variables(), encoding="utf-8")
    (folder / "variables_of_cycles.md").write_text(variables_of_cycles(), encoding="utf-8")
    (folder / "variables_of_tractions.md").write_text(variables_of_tractions(), encoding="utf-8")
    (folder / "variables_of_models.md").write_text(variables_of_models(), encoding="utf-8")
    (folder / "validation.md").write_text(validation(), encoding="utf-8")
    (folder / "api.md").write_text(api(), encoding="utf-8")
    for name, table in alert_tables().items():
        (folder / name).write_text(table, encoding="utf-8")
    draw_sector(folder / "sector.svg")


def keys() -> dict[str, str]:
    """Return one table of keys for each table of the study file, by the parts of the page that include them."""
    from stickslip.study.file.parts import PartTable
    from stickslip.study.file.tables import json_schema

    schema = json.loads(json_schema())
    return {
        name: "\n".join(Keys(schema, tuple(PartTable.model_fields)).of(tables))
        for name, tables in PARTS_OF_THE_PAGE.items()
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
        self,
        title: str,
        node: dict[str, Any],
        *,
        path: str = "",
        without: tuple[str, ...] = (),
        flat: bool = False,
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
                below += self._table(
                    f"`[{path}.{key}.NAME]`", self._resolved(every), path=f"{path}.{key}.NAME"
                )
            if _options(entry) and not flat:
                below += self._below(f"{path}.{key}", entry)
                continue
            if nested is not None and not (path == "part.NAME" and key in self.common):
                below += self._table(f"`[{path}.{key}]`", nested, path=f"{path}.{key}")
                continue
            rows.append(
                f"| `{key}` | {_escaped(entry.get('description', ''))} | {_default(key, node)} |"
            )
        if not rows:
            return below
        # the dataclass speaks of SI; keys have their units at their ends
        text = "" if flat else re.sub(r"; (lengths in )?metres.*", ".", node["description"])
        return [
            f"### {title}", "", text, "",
            "| key | meaning | default |", "|---|---|---|", *rows, "", *below,
        ]  # fmt: skip

    def _of_laws(self) -> set[str]:
        from stickslip.contact.laws import ALL_LAWS
        from stickslip.study.file.quantities import columns_of

        each = (
            columns_of(law, per_area=area) for law in ALL_LAWS.values() for area in (False, True)
        )
        return {key for found in each for key in found}

    def _resolved(self, entry: dict[str, Any]) -> dict[str, Any]:
        parts = [
            *entry.get("allOf", []),
            *entry.get("anyOf", []),
        ]  # a table that may be left out is one of two
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
            f"### `law = \"{name}\"`", "", (law.__doc__ or "").partition("\n")[0], "",
            "| key | with `per = \"area\"` | meaning | default |", "|---|---|---|---|", *rows, "",
        ]  # fmt: skip
    return "\n".join(lines)


def variables() -> str:
    """Return the variables of a forced response, as the code that writes them lists them."""
    from stickslip.study.analyses.forced.quantities import QUANTITIES

    rows = [
        f"| `{name}` | {', '.join(q.dims)} | {_escaped(q.about)} | {_unit(q.units)} |"
        for name, q in QUANTITIES.items()
    ]
    return "\n".join(["| variable | dimensions | meaning | unit |", "|---|---|---|---|", *rows, ""])


def variables_of_cycles() -> str:
    """Return the variables of limit cycles."""
    from stickslip.study.analyses.cycles.dataset import ABOUT

    rows = [
        f"| `{name}` | {', '.join(['case', *dims.split()])} | {_escaped(about)} | {_unit(units)} |"
        for name, (dims, units, about) in ABOUT.items()
    ]
    return "\n".join(["| variable | dimensions | meaning | unit |", "|---|---|---|---|", *rows, ""])


def variables_of_tractions() -> str:
    """Return the variables of bounds over residual tractions."""
    from stickslip.study.analyses.tractions.dataset import ABOUT

    rows = [
        f"| `{name}` | {', '.join(['case', *dims.split()])} | {_escaped(about)} | {_unit(units)} |"
        for name, (dims, units, about) in ABOUT.items()
    ]
    return "\n".join(["| variable | dimensions | meaning | unit |", "|---|---|---|---|", *rows, ""])


def variables_of_models() -> str:
    """Return what the linear analyses say of the model."""
    from stickslip.study.analyses.waves.about import NUMBERS

    rows = [
        f"| `{name}` | {', '.join(['case', *dims.split()])} | {_escaped(about)} | {_unit(units)} |"
        for name, (dims, units, about) in NUMBERS.items()
    ]
    return "\n".join(["| variable | dimensions | meaning | unit |", "|---|---|---|---|", *rows, ""])


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
    lines = [
        f"{holding} of {len(records)} comparisons hold.",
        "",
        "| case | quantity | ours | reference | tolerance | holds | source |",
        "|---|---|---|---|---|---|---|",
    ]
    for record in records:
        cells = [
            _number(record[key]) for key in ("case", "quantity", "ours", "reference", "tolerance")
        ]
        cells += [
            {True: "yes", False: "**no**"}.get(record["holds"], record["holds"]),
            _escaped(record["source"]),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _number(value: object) -> str:
    return f"{value:.7g}" if isinstance(value, float) else _escaped(str(value))


def api() -> str:
    """Return one heading a package with its public names, as its stub lists them."""
    root = Path(stickslip.__file__).parent
    lines = []
    for package in PACKAGES:
        stub = root.joinpath(*package.split(".")[1:], "__init__.pyi")
        lines += [f"## {package}", ""]
        for name in sorted(_names(stub)):
            kind = "autoclass" if name[0].isupper() else "autofunction"
            lines += ["```{eval-rst}", f".. {kind}:: {package}.{name}", "```", ""]
    return "\n".join(lines)


def _names(stub: Path) -> list[str]:
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    return [
        alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module  # packages have headings of their own
        for alias in node.names
    ]

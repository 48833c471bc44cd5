"""Write the parts of the documentation that are made from the code: study file, public names, validation, a drawing."""

import ast
import json
from pathlib import Path
from typing import Any

from alert_numbers import alert_tables
from sector_drawing import draw_sector

import stickslip

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
]


def write_all(folder: Path) -> None:
    """Write every generated page part into `folder`."""
    folder.mkdir(exist_ok=True)
    (folder / "study_file.md").write_text(study_file(), encoding="utf-8")
    (folder / "structure_study.md").write_text(structure_study(), encoding="utf-8")
    (folder / "validation.md").write_text(validation(), encoding="utf-8")
    (folder / "api.md").write_text(api(), encoding="utf-8")
    for name, table in alert_tables().items():
        (folder / name).write_text(table, encoding="utf-8")
    draw_sector(folder / "sector.svg")


def study_file() -> str:
    """Return one table of keys for each table of the study file."""
    from stickslip.study.schema import json_schema

    schema = json.loads(json_schema())
    return "\n".join(_section("", schema, schema.get("$defs", {})))


def structure_study() -> str:
    """Return one table of keys for each table of a study of a bladed disk."""
    from stickslip.study.structure_study import structure_schema

    schema = json.loads(structure_schema())
    return "\n".join(_section("", schema, schema.get("$defs", {})))


def _section(path: str, node: dict[str, Any], definitions: dict[str, Any]) -> list[str]:
    rows, below = [], []
    for key, entry in node.get("properties", {}).items():
        inner = _resolved(entry, definitions)
        if "properties" in inner:
            below += _section(f"{path}.{key}" if path else key, inner, definitions)
            continue
        default = "" if "default" not in entry else f"`{json.dumps(entry['default'])}`"
        default = "(left out)" if default == "`null`" else default
        rows.append(
            f"| `{key}` | {_escaped(entry.get('description', ''))} | {default or '(required)'} |"
        )
    if not rows:
        return below
    title = f"## `[{path}]`" if path else "## At the top"
    text = node.get("description", "") if path else ""
    return [title, "", text, "", "| key | meaning | default |", "|---|---|---|", *rows, "", *below]


def _resolved(entry: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    parts = [
        *entry.get("allOf", []),
        *entry.get("anyOf", []),
    ]  # a table that may be left out is one of two
    reference = entry.get("$ref") or next((p["$ref"] for p in parts if "$ref" in p), None)
    return definitions[reference.rsplit("/", 1)[1]] if reference else entry


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def validation() -> str:
    """Return the table of comparisons, or how to make it."""
    if not RESULTS.exists():
        return "*This build has no results: run `make validate`, then `make docs`.*\n"
    records = json.loads(RESULTS.read_text(encoding="utf-8"))
    holding = sum(bool(record["holds"]) for record in records)
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
        cells += ["yes" if record["holds"] else "**no**", _escaped(record["source"])]
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

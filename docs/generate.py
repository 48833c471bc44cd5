"""Write the parts of the documentation that are made from the code: study file, public names, validation, a drawing."""

import ast
import json
from pathlib import Path
from typing import Any

from alert_numbers import alert_tables
from sector_drawing import draw_sector

import stickslip

RESULTS = Path(__file__).parent.parent / "validation" / "out" / "results.json"
LAYERS = [
    "model",
    "reduction",
    "contact",
    "harmonic",
    "solve",
    "response",
    "study",
    "report",
    "errors",
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
    """Return one heading a layer with the public names that live in it."""
    tree = ast.parse(Path(stickslip.__file__).read_text(encoding="utf-8"))
    modules: dict[str, list[tuple[str, str]]] = {}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.ImportFrom)
            and node.module
            and node.module.startswith("stickslip.")
        ):
            layer = node.module.split(".")[1]
            modules.setdefault(layer, []).extend((alias.name, node.module) for alias in node.names)
    lines = []
    for layer in LAYERS:
        if layer not in modules:
            continue
        lines += [f"## {layer}", ""]
        for name, _ in sorted(modules[layer]):
            kind = "autoclass" if name[0].isupper() else "autofunction"
            lines += ["```{eval-rst}", f".. {kind}:: stickslip.{name}", "```", ""]
    return "\n".join(lines)

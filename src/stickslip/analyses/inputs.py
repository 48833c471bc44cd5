"""Inputs at the head of the page: loads, contacts with the values of their laws, damping, cases, names."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.pictures import of_first_case
from stickslip.report.quantities import NONE, aligned, number, quantity, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Table
from stickslip.study.file.case_names import is_number

# endings of keys, longer ones first; True: the unit takes a prefix such as µ or M
_UNITS = (
    ("n_per_m3", "N/m³", True),
    ("kg_per_m3", "kg/m³", False),
    ("n_per_m", "N/m", True),
    ("n_s_per_m", "N s/m", True),
    ("kg_m2", "kg m²", False),
    ("pa", "Pa", True),
    ("rpm", "rpm", False),
    ("hz", "Hz", False),
    ("deg", "°", False),
    ("kg", "kg", False),
    ("n", "N", True),
    ("m", "m", True),
    ("s", "s", True),
)
_BLADE = re.compile(r"\[(\d+)\]$")
_FEW_NAMES, _MOST_NAMES = 4, 24
_ENDS = 2  # numbers of a range
_LONGEST = 12  # entries of a list that are shown


def study_of(root: Node) -> Mapping[str, Any]:
    """Return the tables of a result's study file, or the equivalent tables of a Python model; empty for none."""
    try:
        return tomllib.loads(root.text("study_toml")) or json.loads(root.text("model_tables", "{}"))
    except ValueError:
        return {}


def inputs(study: Mapping[str, Any], nodes: Mapping[str, Node]) -> list[Table]:
    """Return the tables of the inputs.

    Parameters
    ----------
    study
        Tables of the study file, or the equivalent tables of a Python model; empty for none.
    nodes
        Nodes of the analyses by name.
    """
    response = _response(nodes)
    study = as_run(study)
    found = (_given(study, nodes), _contacts(study, response), _names(study, nodes))
    return [table for table in found if table is not None]


def _response(nodes: Mapping[str, Node]) -> Response | None:
    """Return the node with contacts and outputs, which have tables of their own."""
    return next((n for n in nodes.values() if isinstance(n, Response)), None)


@dataclass(frozen=True)
class Varied:
    """All values of a varied key, one for each case."""

    values: tuple[Any, ...]


def as_run(study: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a study; each varied key holds all its values."""
    found: dict[str, Any] = deepcopy(dict(study))
    varied = found.get("vary", {})
    for own in varied if isinstance(varied, list) else [varied]:
        for key, values in _flat(own if isinstance(own, dict) else {}):
            *tables, last = key.split(".")
            table: Any = found
            for name in tables:
                table = table.get(name) if isinstance(table, dict) else None
            if isinstance(table, dict) and isinstance(values, list):
                table[last] = Varied(tuple(values))
    return found


def told(key: str, value: Any) -> str:
    """Write a key of a study file and its value in words: ``normal_stiffness_n_per_m = 5.2e8`` as ``normal stiffness 520 MN/m``."""
    if isinstance(value, Varied):
        texts = [told(key, v) for v in value.values]
        rows = zip(*(one.split(" ") for one in texts), strict=False)
        name = "".join(f"{own[0]} " for own in takewhile(lambda own: len(set(own)) == 1, rows))
        return f"{name}{_joined([one.removeprefix(name) for one in texts])} (varied)"
    for ending, unit, scaled in _UNITS:
        if key.endswith(f"_{ending}") and _numbers(value):
            name = key.removesuffix(f"_{ending}").replace("_", " ")
            each = value if isinstance(value, list) else [value]
            if len(each) > 1 and scaled:
                scale = scale_for(np.array(each, dtype=float), unit)
                return f"{name} {_joined([number(v * scale.factor, 5) for v in each])} {scale.unit}"
            if scaled:
                return f"{name} {quantity(each[0], unit, 5)}"
            ends = [number(v, 5) for v in each]
            between = " and " if name == "between" else " to "
            return f"{name} {between.join(ends) if len(each) == _ENDS else _joined(ends)} {unit}"
        if key.endswith(f"_{ending}") and isinstance(value, list):
            return f"{key.removesuffix(f'_{ending}').replace('_', ' ')} {_plain(value)} {unit}"
    return f"{key.replace('_', ' ')} {_plain(value)}"


def _numbers(value: Any) -> bool:
    each = value if isinstance(value, list) and value else [value]
    return all(map(is_number, each))


def _plain(value: Any) -> str:
    if isinstance(value, Varied):
        return f"{_joined([_plain(v) for v in value.values])} (varied)"
    if isinstance(value, dict):
        return ", ".join(f"{k} = {_plain(v)}" for k, v in value.items())
    if isinstance(value, list):
        return _joined([f"({_plain(v)})" if isinstance(v, list) else _plain(v) for v in value])
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value, 6) if isinstance(value, int | float) else str(value)


def _joined(each: list[str]) -> str:
    if len(each) <= _LONGEST:
        return ", ".join(each)
    return f"{', '.join(each[:4])}, ... {each[-1]} ({len(each)} values)"


def _table(study: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return a table of the study; empty if it is missing or no table."""
    found = study.get(name, {})
    return found if isinstance(found, dict) else {}


def _flat(given: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in given.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _given(study: Mapping[str, Any], nodes: Mapping[str, Node]) -> Table | None:
    rows = [[f"part {name}", _part(own)] for name, own in _table(study, "part").items() if isinstance(own, dict)]
    rows += [[f"load {name}", _load(own)] for name, own in _table(study, "load").items() if isinstance(own, dict)]
    elsewhere = {"part", "load", "vary"} | ({"contact", "output"} if _response(nodes) else set())
    for name in study:
        rows += [] if name in elsewhere else _rows(name, study[name])
    varied = study.get("vary", {})
    for own in varied if isinstance(varied, list) else [varied]:
        rows += [[f"cases: {key}", _plain(v)] for key, v in _flat(own if isinstance(own, dict) else {})]
    return Table((), rows, "Tables of the study", numeric=False) if rows else None


def _rows(name: str, given: Any) -> list[list[str]]:
    """Return a row for a table of the study, or one for each of the named tables in it; none for a plain value or an empty table."""
    words = name.replace("_", " ")
    if isinstance(given, list):
        each = [own for own in given if isinstance(own, dict)]
        return [row for k, own in enumerate(each, 1) for row in _rows(f"{name} {k}" if len(each) > 1 else name, own)]
    if not isinstance(given, dict) or not given:
        return []
    if all(isinstance(own, dict) for own in given.values()):
        return [[f"{words} {key}", _keys(own)] for key, own in given.items() if own]
    return [[words, _keys(given)]]


def _keys(given: Mapping[str, Any]) -> str:
    """Return all keys of a table in words."""
    return "; ".join(told(key, value) for key, value in _flat(given))


def _part(own: Mapping[str, Any]) -> str:
    """Return the kind of a part, and its other keys in words."""
    of = next((key for key in ("shape", "file", "of") if own.get(key)), "")
    kind = own[of] if of else "matrices"
    rest = [told(k, v) for k, v in _flat(own) if k != of]
    return "; ".join([_plain(kind), *rest])


def _load(own: Mapping[str, Any]) -> str:
    """Describe place and direction of a load."""
    along = own.get("direction", "")
    along = f" along {_plain(along)}" if along else ""
    size = next((told(k, own[k]) for k in ("force_n", "pressure") if k in own), "")
    if "ratio_of" in own:
        size = f"{own['ratio_of']} over {_plain(own.get('ratio', NONE))}"
    static = own.get("harmonic", 1) == 0
    rest = [told(k, v) for k, v in own.items() if k in ("engine_order", "phase_deg", "frequency_hz", "frequency_ratio")]
    kind = "static" if static else f"harmonic {_plain(own.get('harmonic', 1))}"
    return "; ".join([f"{size.removeprefix('force ')} on {own.get('on', NONE)}{along}", kind, *rest])


def _contacts(study: Mapping[str, Any], response: Response | None) -> Table | None:
    """Return a table with one row a contact: surfaces, values of its law, points, and static force."""
    written = {n: o for n, o in _table(study, "contact").items() if isinstance(o, dict)}
    known = dict(response.groups) if response and response.has("contact_law") else {}
    names = list(dict.fromkeys([*known, *written]))
    if not names or response is None:
        return None
    laws = response.labels_of("contact_law") if known else ()
    forces = np.full(len(names), np.nan)
    if response.has("static_force"):
        normal = of_first_case(response, "static_force")[:, 2]
        forces = np.array([-float(normal[known[n]].sum()) if n in known else np.nan for n in names])
    rows = []
    for name, force in zip(names, aligned(forces + 0.0), strict=True):
        own = dict(written.get(name, {}))
        between = _plain(own.pop("between", NONE))
        law = ", ".join(dict.fromkeys(laws[k] for k in known.get(name, ()))) or _plain(own.get("law", NONE))
        values = "; ".join(told(k, v) for k, v in own.items() if k != "law") or NONE
        rows.append([name, between, law, values, str(len(known.get(name, ()))), force])
    head = ["contact", "between", "law", "values", "points", "normal force at rest (N)"]
    kept = [k for k in range(len(head)) if any(row[k] != NONE for row in rows)]
    cells = [[row[k] for k in kept] for row in rows]
    return Table([head[k] for k in kept], cells, "Contacts", numeric=False)


def _names(study: Mapping[str, Any], nodes: Mapping[str, Node]) -> Table | None:
    """Describe each output."""
    node = next((n for n in nodes.values() if "output" in n.data.coords), None)
    if node is None:
        return None
    output = _table(study, "output")
    loads = {n: o["on"] for n, o in _table(study, "load").items() if isinstance(o, dict) and "on" in o}
    points, labels = loads | dict(_table(output, "points")), node.labels("output")
    wanted = node.text("report_output")
    rows = [[label, _meaning(label, points) + "; **its peak counts**" * (label == wanted)] for label in labels]
    text = "Amplitudes are given in the harmonic that the load drives. Where nothing else vibrates, this is half of peak to peak. "
    text += "On a set of several nodes an output is the first of them, and 'stickslip check' says where that lies."
    shown = sorted(rows, key=lambda row: row[0] != wanted)[:_MOST_NAMES]
    more = [f"{len(rows) - len(shown)} more of the same kind."] if len(rows) > len(shown) else []
    folded = "" if len(shown) < _FEW_NAMES else f"Names of {len(rows)} outputs, and what they are"
    heading = "" if folded else "Names"
    return Table(("name", "what it is"), shown, heading, (text,), numeric=False, items=more, folded=folded)


def _meaning(label: str, points: Mapping[str, Any]) -> str:
    name, _, component = label.rpartition(".")
    blade = _BLADE.search(name)
    name = name[: blade.start()] if blade else name
    turns = component.startswith("r") and len(component) == 2
    way = f"rotation about {component[-1]}" if turns else f"motion along {component}"
    of = f"node set or dof {_plain(points[name])}" if name in points else name
    return f"{way} of {of}" + (f", in sector {blade[1]}" if blade else "")

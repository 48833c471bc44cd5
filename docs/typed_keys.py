"""The keys that methods of a model take, as `TypedDict` classes from the tables of the study file: editors complete and check them."""

from collections.abc import Iterator
from inspect import cleandoc
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import stickslip
from stickslip.api.model import OF_THE_MODEL
from stickslip.study.analysis import named
from stickslip.study.file.harmonics import Selection
from stickslip.study.file.section import Section
from stickslip.study.file.tables import Tables
from stickslip.study.questions import ANALYSES

FILE = Path(stickslip.__file__).parent / "api" / "keys.py"
WIDTH = 120
HEAD = '''
"""Keys of the methods of a model, made from the tables of the study file by `python docs/generate.py`.

Editors complete them, and type checkers compare names, types and required keys.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, Required, TypedDict

from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.selection.strategy import Strategy
'''
OWN_STRATEGY = Selection.__metadata__[0]  # of what may also be an object
ARRAYS = {float: "FloatArray", int: "IntArray"}


def module() -> str:
    """Return the module of all keys."""
    shared = dict.fromkeys(table for name in ANALYSES for table in named(name).shared)
    parts = [cleandoc(HEAD)]
    parts += [_class(table, Tables.model_fields[table].annotation, ()) for table in shared]
    for name in ANALYSES:
        own = named(name)
        code = getattr(stickslip.Model, name).__code__
        own_arguments = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        parts.append(_class(name, own.table, own.shared, own_arguments))
    return "\n\n\n".join(parts) + "\n"


def class_name(table: str) -> str:
    """Return the name of the class of a table."""
    return "".join(word.capitalize() for word in table.split("_")) + "Keys"


def _class(table: str, section: Any, shared: tuple[str, ...], taken: tuple[str, ...] = ()) -> str:
    bases = ", ".join([*map(class_name, shared)] or ["TypedDict"])
    lines = [f"class {class_name(table)}({bases}, total=False):", f'    """Keys of [{table}]{_and(shared)}."""', ""]
    for key, field in section.model_fields.items():
        if key in OF_THE_MODEL or key in taken:
            continue
        kind = " | ".join(dict.fromkeys(_types(field.rebuild_annotation())))
        kind = f"Required[{kind}]" if field.is_required() else kind
        lines += [*_lines(f"    {key}: {kind}"), f'    """{_meaning(field)}"""']
    return "\n".join(lines)


def _and(shared: tuple[str, ...]) -> str:
    names = [f"[{table}]" for table in shared]
    return f", {', '.join(names[:-1])} and {names[-1]}".replace(",  and", " and") if names else ""


def _meaning(field: Any) -> str:
    told = str(field.description or "").replace("\\", "\\\\").replace('"', "'")
    if field.is_required():
        return told
    default = field.get_default(call_default_factory=True, validated_data={})
    return told if default is None else f"{told}; default {default!r}".replace('"', "'")


def _types(kind: Any) -> Iterator[str]:
    """Yield the types of a union; lists are any sequence, arrays included."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        yield from _types(inner[0])
        yield from ("Strategy" for own in kind.__metadata__ if own == OWN_STRATEGY)
    elif origin in (Union, UnionType):
        for one in inner:
            yield from _types(one)
    elif origin is Literal:
        yield f"Literal[{', '.join(_quoted(word) for word in inner)}]"
    elif origin in (list, tuple):
        entry = " | ".join(dict.fromkeys(_types(inner[0])))
        yield f"Sequence[{entry}]"
        yield from (ARRAYS[one] for one in ARRAYS if one.__name__ == entry)
    elif origin is dict:
        yield f"Mapping[str, {' | '.join(dict.fromkeys(_types(inner[1])))}]"
    elif kind is NoneType:
        yield "None"
    elif issubclass(kind, Section):
        yield "Mapping[str, object]"
    else:
        yield kind.__name__


def _quoted(word: object) -> str:
    return f'"{word}"' if isinstance(word, str) else repr(word)


def _lines(line: str) -> list[str]:
    """Return a declaration in lines of the width of the project: one word of a long choice a line."""
    if len(line) <= WIDTH:
        return [line]
    head, _, rest = line.partition("Literal[")
    words, _, tail = rest.partition("]")
    chosen = [f"        {word}," for word in words.split(", ")]
    if not tail:
        return [f"{head}Literal[", *chosen, "    ]"]
    others = [f"        | {kind}" for kind in tail.removeprefix(" | ").split(" | ")]
    return [f"{head}(", "        Literal[", *(f"    {word}" for word in chosen), "        ]", *others, "    )"]

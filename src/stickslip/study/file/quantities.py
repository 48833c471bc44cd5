"""Tables made from dataclasses, whose fields define keys, units, ranges and defaults."""

from collections.abc import Collection
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import pydantic
from pydantic import create_model, model_validator

from stickslip.errors import InputError, input_error
from stickslip.study.file.section import Section, custom_error
from stickslip.units import Quantity, quantity_of

IN_WORDS = {
    "m": "m",
    "m2": "m²",
    "m4": "m⁴",
    "deg": "degrees",
    "kg": "kg",
    "kg_m2": "kg m²",
    "kg_per_m3": "kg/m³",
    "pa": "Pa",
    "n": "N",
    "n_per_m": "N/m",
    "n_per_m3": "N/m³",
    "n_per_m5": "N/m⁵",
    "n_s_per_m": "N s/m",
    "n_s_per_m3": "N s/m³",
    "m_per_s": "m/s",
}
Column = tuple[Any, Any]  # annotation and pydantic's field


def table_of(
    cls: type,
    *,
    base: type[Section] = Section,
    without: Collection[str] = (),
    optional: Collection[str] = (),
    name: str = "",
    **more: Column,
) -> type[Section]:
    """Return the pydantic table of a dataclass with quantity fields; it includes the checks of the dataclass.

    Parameters
    ----------
    cls
        The dataclass.
    base
        Base class of the table.
    without
        Fields that are not keys.
    optional
        Fields that are optional in the file, because their values may come from elsewhere.
    name
        Name of the table's class; empty: the name of `cls`.
    more
        Additional keys.
    """
    columns = columns_of(cls, without=without, optional=optional)

    def fits(table: Section) -> Section:
        if not without:
            refused_by(cls, lambda: build(cls, table))
        return table

    keys: dict[str, Any] = columns | more
    made: type[Section] = create_model(
        name or cls.__name__,
        __base__=base,
        __doc__=(cls.__doc__ or "").partition("\n")[0],
        __validators__={"fits": model_validator(mode="after")(fits)},  # type: ignore[dict-item]
        **keys,
    )
    return made


def columns_of(
    cls: type, *, without: Collection[str] = (), optional: Collection[str] = (), per_area: bool = False
) -> dict[str, Any]:
    """Return the keys of a dataclass's quantities, each with annotation and pydantic field."""
    hints = get_type_hints(cls)
    return {
        q.key_of(entry.name, per_area=per_area): _column(entry, q, hints[entry.name], entry.name in optional, per_area)
        for entry, q in quantities_of(cls)
        if entry.name not in without
    }


@cache
def quantities_of(cls: type) -> tuple[tuple[Field[Any], Quantity], ...]:
    """Return the quantity fields of a dataclass."""
    found = ((entry, quantity_of(entry)) for entry in fields(cls))
    return tuple((entry, q) for entry, q in found if q is not None)


def build(cls: type, table: Section, *, per_area: bool = False, **given: Any) -> Any:
    """Return the dataclass of a table, in SI units; fields in `given` replace or supplement the table's fields."""
    hints = get_type_hints(cls)
    for entry, q in quantities_of(cls):
        if entry.name in given:
            continue
        value = getattr(table, q.key_of(entry.name, per_area=per_area), None)
        if value is not None:
            given[entry.name] = _in_si(value, q, hints[entry.name])
        elif _inner(hints[entry.name]) is not hints[entry.name] and is_dataclass(_inner(hints[entry.name])):
            given[entry.name] = None  # an omitted table
    return cls(**given)


def refused_by(cls: type, make: Any) -> Any:
    """Return `make()`, an instance of `cls`; an error about a field becomes an error about its key."""
    try:
        return make()
    except InputError as error:
        raise custom_error(error.problem, error.remedy, key_path(cls, error.argument)) from None


def key_path(cls: type, argument: str) -> str:
    """Return the key path of the field ``a.b`` of a dataclass; empty for an unknown field."""
    keys = []
    for name in filter(None, argument.split(".")):
        found = {entry.name: q for entry, q in quantities_of(cls)} if is_dataclass(cls) else {}
        if name not in found:
            break
        keys.append(found[name].key_of(name))
        cls = _inner(get_type_hints(cls)[name])
    return ".".join(keys)


def _column(entry: Field[Any], q: Quantity, hint: Any, optional: bool, per_area: bool) -> Column:
    kind, about = _inner(hint), _about(q, per_area)
    if is_dataclass(kind):
        left_out = None if entry.default_factory is not MISSING or hint is not kind else ...
        nested: Any = table_of(kind)  # type: ignore[arg-type]
        return (nested if left_out is ... else nested | None), pydantic.Field(
            left_out, description=f"the table of it: {about}"
        )
    annotation = _annotation(kind, q)
    default = ... if entry.default is MISSING else entry.default
    if optional or default is None or hint is not kind:
        annotation = annotation | None
        default = None if optional or default is ... else default
    elif default is not ... and q.factor != 1.0:
        default = round(default / q.factor, 12)
    if isinstance(default, tuple):
        default = list(default)
    return annotation, pydantic.Field(default, description=about)


def _annotation(kind: Any, q: Quantity) -> Any:
    if get_origin(kind) is tuple:
        inner, *rest = get_args(kind)
        least, most = q.entries if Ellipsis in rest else (1 + len(rest), 1 + len(rest))
        return Annotated[
            list[_annotation(inner, q)],  # type: ignore[misc]
            pydantic.Field(min_length=least, max_length=most or 100),
        ]
    if q.choices:
        return Literal[q.choices]
    lowest, highest = q.in_files
    return Annotated[kind, pydantic.Field(gt=q.above, ge=lowest, lt=q.below, le=highest)]


def _inner(hint: Any) -> Any:
    """Return a type without ``| None``."""
    kinds = [kind for kind in get_args(hint) if kind is not NoneType]
    return kinds[0] if NoneType in get_args(hint) and len(kinds) == 1 else hint


def _in_si(value: Any, q: Quantity, hint: Any) -> Any:
    if isinstance(value, Section):
        return build(_inner(hint), value)
    if isinstance(value, list):
        return tuple(_in_si(v, q, hint) for v in value)
    return value * q.factor if q.factor != 1.0 else value


def _about(q: Quantity, per_area: bool) -> str:
    """Return the description of a key: quantity, unit, range."""
    unit = q.key_of("", per_area=per_area).removeprefix(q.key).removeprefix("_")
    if unit and unit not in IN_WORDS:
        raise input_error(
            f"quantity {q.about!r}", f"has the unit {unit!r} without words", f"Add it to `IN_WORDS` of {__name__}."
        )
    texts = [q.about + (f" in {IN_WORDS[unit]}" if unit else ""), _range(q)]
    return ", ".join(filter(None, texts))


def _range(q: Quantity) -> str:
    if q.choices:
        return ", ".join(q.choices[:-1]) + f" or {q.choices[-1]}"
    least, most = q.in_files
    low = f"above {q.above:g}" if q.above is not None else ""
    low = f"from {least:g}" if least is not None else low
    high = f"below {q.below:g}" if q.below is not None else ""
    high = f"to {most:g}" if most is not None else high
    return "greater than zero" if low == "above 0" and not high else f"{low} {high}".strip()

"""Conversion between the records of jobs and the variables of a result (`stickslip.column` describes the fields), case by case and joined."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache, cached_property
from types import UnionType
from typing import Any, ClassVar, Generic, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
import xarray as xr

from stickslip.analyses.facts import ModelFacts, facts_in
from stickslip.arrays import FloatArray, IntArray, TextArray
from stickslip.column import Column, Rows, columns_of, rows_of
from stickslip.report.result import Node
from stickslip.study.analysis import Solved
from stickslip.study.store.netcdf import alike, one_case, stacked, variable
from stickslip.study.verdict import ATTRIBUTE, Verdict, of_all_cases, to_json

MISSING: Mapping[type, Any] = {float: np.nan, int: -1, str: "", bool: False}
FILLED: Mapping[str, Any] = {"f": np.nan, "i": -1, "U": ""}  # padding of records of different length

# missing entry of an array, by the whole annotation: the parts of an annotation depend on the version of NumPy
ENTRIES: Mapping[Any, Any] = {FloatArray: np.nan, IntArray: -1, TextArray: "", tuple[str, ...]: "", Sequence[str]: ""}
CASE = "case"  # dimension of cases; the record of one case lacks it

R = TypeVar("R")  # class of the record of a case


def variables(record: Any) -> dict[str, xr.Variable]:
    """Return the variables of the record of a case in the order of its fields; fields that are None or empty have none."""
    kind = type(record)
    columns, inner = columns_of(kind), rows_of(kind)
    found: dict[str, xr.Variable] = {}
    for name in (f.name for f in fields(record)):
        value = getattr(record, name)
        if name in columns:
            found |= _told(columns[name].name or name, _stored(columns[name], (), value))
        elif name in inner:
            found |= _of_rows(_row_type(kind, name), inner[name], value)
    return found


def record_of(kind: type[R], case: xr.Dataset | Mapping[str, xr.Variable], sizes: Mapping[Any, int] | None = None) -> R:
    """Return the record of a case of a result, the inverse of `variables`; arrays of rows keep their padding.

    Parameters
    ----------
    kind
        Class of the record.
    case
        Variables of the case, or its dataset, in which single numbers and texts may be attributes. Missing values are NaN, −1, an empty
        text, or the default of the field.
    sizes
        Lengths of dimensions, the shape of a missing array. None: a missing array is empty.
    """
    values = {name: _value(c.name or name, c, kind, name, case, sizes) for name, c in columns_of(kind).items()}
    for name, inner in rows_of(kind).items():
        values[name] = tuple(_rows_read(_row_type(kind, name), inner, case))
    return kind(**{name: value for name, value in values.items() if value is not None})


def described(kind: type[Any], dim: str = "", prefix: str = "") -> Iterator[tuple[str, tuple[str, ...], str, str]]:
    """Yield name, dimensions, unit and meaning of all variables of a class of records, for the documentation."""
    for name, c in columns_of(kind).items():
        yield prefix + (c.name or name), (*dim.split(), *c.along), c.unit, c.meaning
    for name, inner in rows_of(kind).items():
        if inner.owner:
            yield inner.prefix + dim, (inner.dim,), "1", inner.owner
        yield from described(_row_type(kind, name), f"{dim} {inner.dim}" if inner.beside else inner.dim, inner.prefix)


def _of_rows(kind: type[Any], of: Rows, records: Sequence[Any]) -> dict[str, xr.Variable]:
    found: dict[str, xr.Variable] = {}
    if not records and not of.always:
        return found
    for name, c in columns_of(kind).items():
        each = [getattr(one, name) for one in records]
        none = np.zeros(0, type(MISSING.get(_plain_type(kind, name), 0.0)))
        told = None if any(value is None for value in each) else each or none
        found |= _told(of.prefix + (c.name or name), _stored(c, (of.dim,), told), always=not records)
    for name, inner in rows_of(kind).items():
        own = [getattr(one, name) for one in records]
        if inner.beside:
            found |= _beside(_row_type(kind, name), of, inner, own)
            continue
        owner = np.repeat(np.arange(len(own)), [len(each) for each in own])
        found |= _told(inner.prefix + of.dim, variable(inner.dim, owner, "1", inner.owner), always=inner.always)
        found |= _of_rows(_row_type(kind, name), inner, [row for each in own for row in each])
    return found


def _beside(kind: type[Any], of: Rows, inner: Rows, owned: Sequence[Sequence[Any]]) -> dict[str, xr.Variable]:
    found = {}
    for name, c in columns_of(kind).items():
        each = [np.array([getattr(row, name) for row in own], dtype=_plain_type(kind, name)) for own in owned]
        found[inner.prefix + (c.name or name)] = variable(f"{of.dim} {inner.dim}", _filled(each), c.unit, c.meaning)
    return found


def _told(name: str, found: xr.Variable | None, *, always: bool = False) -> dict[str, xr.Variable]:
    """Return a variable by its name; none if it is empty."""
    return {} if found is None or not (found.size or always) else {name: found}


def _stored(c: Column, own: tuple[str, ...], value: Any) -> xr.Variable | None:
    if value is None:
        return None
    array = _filled(value) if own and c.along else np.asarray(value)
    if array.dtype == bool:
        array = array.astype(np.int64)
    return variable(" ".join((*own, *c.along)), array if c.per == 1.0 else array / c.per, c.unit, c.meaning)


def _filled(each: Sequence[Any]) -> Any:
    """Return arrays of different lengths as rows of one array."""
    arrays = [np.asarray(one) for one in each]
    shape = np.max([one.shape for one in arrays], axis=0)
    kind = np.result_type(*arrays)
    out = np.full((len(arrays), *shape), FILLED[kind.kind], dtype=kind)
    for row, own in zip(out, arrays, strict=True):
        row[tuple(map(slice, own.shape))] = own
    return out


def _rows_read(kind: type[Any], of: Rows, case: xr.Dataset | Mapping[str, xr.Variable]) -> Iterator[Any]:
    columns = columns_of(kind)
    names = {name: of.prefix + (c.name or name) for name, c in columns.items()}
    count = next((len(case[name]) for name in names.values() if name in case), 0)
    within = {name: _owned(kind, name, inner, of, case) for name, inner in rows_of(kind).items()}
    values = {name: _read(case[names[name]], c) if names[name] in case else None for name, c in columns.items()}
    for i in range(count):
        own = {n: _missing(kind, n) if v is None else _as(kind, n, v[i]) for n, v in values.items()}
        own |= {name: tuple(row for at, row in found if at == i) for name, found in within.items()}
        yield kind(**{name: value for name, value in own.items() if value is not None})


def _owned(
    kind: type[Any], name: str, inner: Rows, of: Rows, case: xr.Dataset | Mapping[str, xr.Variable]
) -> list[tuple[int, Any]]:
    """Return the rows within rows, each with the index of the row that holds it."""
    row_type = _row_type(kind, name)
    if inner.beside:
        first, *others = (inner.prefix + (c.name or n) for n, c in columns_of(row_type).items())
        if first not in case:
            return []
        values = case[first].values
        at = np.nonzero(~np.isnan(values) if values.dtype.kind == "f" else values != FILLED[values.dtype.kind])
        flat = {n: xr.Variable(inner.dim, case[n].values[at]) for n in (first, *others) if n in case}
        return list(zip(at[0].tolist(), _rows_read(row_type, inner, flat), strict=True))
    found = list(_rows_read(row_type, inner, case))
    return list(zip(np.asarray(case[inner.prefix + of.dim].values).tolist(), found, strict=True)) if found else []


def _value(
    stored: str,
    c: Column,
    kind: type[Any],
    name: str,
    case: xr.Dataset | Mapping[str, xr.Variable],
    sizes: Mapping[Any, int] | None,
) -> Any:
    if stored in case:
        return _as(kind, name, _read(case[stored], c))
    told = case.attrs if isinstance(case, xr.Dataset) else {}
    if stored in told:
        value = np.asarray(told[stored])
        return _as(kind, name, value if c.per == 1.0 else c.per * value)
    if sizes is None:
        return _missing(kind, name)
    return _missing(kind, name, [sizes.get(d, 0) for d in c.along if d in sizes or d != CASE])


def _read(found: xr.Variable | xr.DataArray, c: Column) -> Any:
    return found.values if c.per == 1.0 else c.per * found.values


def _as(kind: type[Any], name: str, value: Any) -> Any:
    """Return a stored value in the type of the field; an empty text or array becomes None if the field allows it."""
    own = _plain_type(kind, name)
    told = own(value) if own in MISSING and np.ndim(value) == 0 else np.asarray(value)
    empty = not told if isinstance(told, str) else np.size(told) == 0
    return None if empty and kind.__dataclass_fields__[name].default is None else told


def _missing(kind: type[Any], name: str, shape: Sequence[int] | None = None) -> Any:
    """Return the value of a variable that a result lacks; None: the default of the field."""
    own = _plain_type(kind, name)
    if kind.__dataclass_fields__[name].default is None:
        return None
    if own in MISSING:
        return np.full(shape, MISSING[own]) if shape else MISSING[own]
    return np.zeros(0) if shape is None else np.full(shape, ENTRIES[own])


def _plain_type(kind: type[Any], name: str) -> Any:
    hint = _hints(kind)[name]
    return next(a for a in get_args(hint) if a is not type(None)) if get_origin(hint) is UnionType else hint


def _row_type(kind: type[Any], name: str) -> type[Any]:
    own: type[Any] = get_args(_hints(kind)[name])[0]
    return own


def _hints(kind: type[Any]) -> dict[str, Any]:
    return _cached_hints(kind)  # type: ignore[arg-type]  # a class has a hash


_cached_hints = cache(get_type_hints)


def of_answers(
    solved: Sequence[Solved],
    answer: Callable[[Solved], Any],
    verdicts: Callable[[str, Any], Iterable[Verdict]],
    lost: Callable[[Any], int] = lambda _: 0,
) -> xr.Dataset:
    """Return the node of all cases.

    Parameters
    ----------
    solved
        Content of the jobs.
    answer
        Returns the record of a case.
    verdicts
        Returns the verdicts on a case from its label and its record.
    lost
        Returns the number of its points without a solution.
    """
    answers = [answer(one) for one in solved]
    labels = [one.case.label for one in solved]
    models = [variables(ModelFacts(**facts_in(one.notes))) for one in solved]
    cases = [model | variables(own) for model, own in zip(models, answers, strict=True)]
    found = [v for label, own in zip(labels, answers, strict=True) for v in verdicts(label, own)]
    attributes = {ATTRIBUTE: to_json(of_all_cases(found, labels)), "failed": sum(map(lost, answers))}
    return xr.Dataset(stacked(cases), attrs=attributes)


@dataclass(frozen=True, eq=False)
class CaseView(Node, Generic[R]):
    """One case on the page, with its record; `kind` is the class of the record."""

    kind: ClassVar[type[Any]]

    @cached_property
    def found(self) -> R:
        """The record of the case."""
        found: R = record_of(self.kind, self.data)
        return found


def told_apart(data: xr.Dataset) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield equal cases once, with their labels as heading of the tables; the heading is empty if all cases are equal."""
    groups = alike(data)
    for group in groups:
        labels = [str(data["case_label"].values[i]) for i in group if len(groups) > 1]
        yield one_case(data, group[0]), f"{'; '.join(labels)}: " if labels else ""


def number(value: float, digits: int = 5) -> str:
    """Return a number for a table, with a dash for none."""
    return f"{value:.{digits}g}" if np.isfinite(value) else "-"

"""Description of a record's field: unit, meaning, and the dimensions under which a result stores it.

A record is a dataclass that a solver yields or an analysis answers with. `stickslip.analyses.columns` makes the variables of a result
from records, and records from the variables.
"""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, get_args, get_type_hints


@dataclass(frozen=True)
class Column:
    """Storage of a field in a result.

    Parameters
    ----------
    unit
        Unit of the stored variable, such as ``Hz``.
    meaning
        Description of the variable in the result and in the documentation.
    name
        Name of the variable, after the prefix of its rows; empty: the name of the field.
    per
        Value of the stored unit in the unit of the field: 2π for a field in rad/s that is stored in Hz.
    along
        Dimensions of the field itself, after the dimension of its rows.
    """

    unit: str
    meaning: str
    name: str = ""
    per: float = 1.0
    along: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rows:
    """Storage of a field with a tuple of records: one record after the other along a dimension.

    Parameters
    ----------
    dim
        Name of the dimension.
    prefix
        Prefix of the variable names.
    owner
        Meaning of the variable ``prefix + dimension of the owner``: the index of the record that contains a row. Empty if
        the rows belong to the case itself.
    always
        Whether a result without any records has the variables, of length zero.
    beside
        Whether the variables have the dimension of their owners as well; shorter rows are padded. The padding is known by
        the missing first field of the record.
    """

    dim: str
    prefix: str = ""
    owner: str = ""
    always: bool = False
    beside: bool = False


def column(
    unit: str, meaning: str, name: str = "", *, per: float = 1.0, along: str = "", default: Any = MISSING
) -> Any:
    """Return a field that a result stores as a variable; see `Column`. Dimensions are separated by spaces."""
    return field(default=default, metadata={"column": Column(unit, meaning, name, per, tuple(along.split()))})


def rows(dim: str, prefix: str = "", owner: str = "", *, always: bool = False, beside: bool = False) -> Any:
    """Return a field that holds a tuple of records; see `Rows`."""
    return field(default=(), metadata={"rows": Rows(dim, prefix, owner, always, beside)})


def columns_of(kind: type[Any]) -> dict[str, Column]:
    """Return the columns of a class of records by the names of their fields."""
    return {f.name: f.metadata["column"] for f in fields(kind) if "column" in f.metadata}


def rows_of(kind: type[Any]) -> dict[str, Rows]:
    """Return the rows of a class of records by the names of their fields."""
    return {f.name: f.metadata["rows"] for f in fields(kind) if "rows" in f.metadata}


def names_of(kind: type[Any], prefix: str = "") -> Iterator[str]:
    """Yield the names of all variables of a class of records, rows included."""
    yield from (prefix + (c.name or name) for name, c in columns_of(kind).items())
    for name, inner in rows_of(kind).items():
        yield from names_of(get_args(get_type_hints(kind)[name])[0], inner.prefix)

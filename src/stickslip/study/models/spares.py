"""Errors in [mistuning.NAME] that can be found without a mesh, and parts that occur only in single sectors."""

from collections.abc import Iterator
from pathlib import Path

from stickslip.assembly.contact import NEXT
from stickslip.errors import InputError, did_you_mean, input_error, missing_file, no_wheel
from stickslip.study.file.model.mistuning import MistuningTable
from stickslip.study.file.model.parts import Lumped
from stickslip.study.file.tables import Tables, original


def spare_parts(tables: Tables) -> set[str]:
    """Return the parts that occur in single sectors only."""
    return {table.by for table in tables.mistuning.values() if table.by is not None}


def mistuning_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield errors in [mistuning] that can be found before meshing."""
    yield from _spare_refusals(tables)
    for name, table in tables.mistuning.items():
        key = f"mistuning.{name}"
        if sectors == 1:
            yield no_wheel(key)
        if table.contact is not None and table.contact not in tables.contact:
            known = list(tables.contact)
            yield input_error(
                f"{key}.contact", f"there is no contact {table.contact!r}", did_you_mean(table.contact, known)
            )
        yield from _own_refusals(tables, key, table)
        if table.of is not None and table.of.partition(".")[0] not in tables.part:
            head = table.of.partition(".")[0]
            known = list(tables.part)
            yield input_error(f"{key}.of", f"there is no part {head!r}", did_you_mean(head, known))
        if table.file is not None and not (home / table.file).is_file():
            yield missing_file(f"{key}.file", home / table.file)
        given = table.deviations or table.gaps_m or []
        if sectors is not None and given and sectors % len(given):
            yield input_error(
                f"{key}.{'gaps_m' if table.gaps_m else 'deviations'}",
                f"has {len(given)} values, and {sectors} sectors are no multiple of that",
                "Give each sector one, or a pattern that fits.",
            )


def _own_refusals(tables: Tables, key: str, table: MistuningTable) -> Iterator[InputError]:
    """Yield errors about the part of a single sector."""
    unknown = False
    for word in ("part", "by"):
        named = getattr(table, word)
        if named is not None and named not in tables.part:
            unknown = True
            yield input_error(f"{key}.{word}", f"there is no part {named!r}", did_you_mean(named, list(tables.part)))
    if table.part is None or table.by is None or unknown:
        return
    whole = {one.part for one in tables.mistuning.values() if one.part is not None}
    if table.by in whole:
        own = "the wheel's own part" if table.by == table.part else "a part of all sectors"
        yield input_error(
            f"{key}.by", f"is {table.by!r}, {own}", "Name another [part.NAME], which stands in this sector alone."
        )
    old, new = original(tables, table.part), original(tables, table.by)
    before, after = getattr(old, "sectors", None), getattr(new, "sectors", None)
    if before is not None and after is not None and before != after:
        yield input_error(
            f"{key}.by",
            f"is {table.by!r} of {after} sectors, and {table.part!r}, in whose place it stands, has {before}",
            f"Give both sectors = {before}.",
        )
    if isinstance(old, Lumped) and isinstance(new, Lumped) and _elsewhere(old, new):
        yield input_error(
            f"{key}.by",
            f"is {table.by!r} with the masses {', '.join(new.labels)}, and {table.part!r}, in whose place it stands, "
            f"has {', '.join(old.labels)}",
            "Give both the same masses in the same order.",
        )


def _elsewhere(old: Lumped, new: Lumped) -> bool:
    """Whether a name in both tables belongs to different masses; masses are matched by their order."""
    at = {name: i for i, name in enumerate(new.labels)}
    return any(at.get(name, i) != i for i, name in enumerate(old.labels))


def _spare_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield errors about surfaces of parts that occur in single sectors only."""
    spare = {one.by: one.part for one in tables.mistuning.values() if one.by and one.part}
    named = [
        *(
            (f"{kind}.{n}.between", w)
            for kind in ("contact", "join")
            for n, t in getattr(tables, kind).items()
            for w in t.between
        ),
        *((f"load.{n}.on", t.on) for n, t in tables.load.items()),
        *((f"output.points.{n}", t.on) for n, t in tables.output.points.items()),
        *((f"mistuning.{n}.of", t.of) for n, t in tables.mistuning.items() if t.of),
    ]
    for key, word in named:
        part = word.removeprefix(NEXT).partition(".")[0]
        if part in spare and part not in spare.values():
            yield input_error(
                key,
                f"names {word!r}, and {part!r} stands in a single sector alone",
                f"Name it of {spare[part]!r}, which is in all sectors.",
            )

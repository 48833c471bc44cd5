"""Errors that can be found without a mesh: missing names, missing files, incomplete questions."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from stickslip.assembly.contact import ALONE, GROUND, NEXT, SPATIAL
from stickslip.assembly.forces import engine_order
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.errors import InputError, did_you_mean, input_error, missing_file, nearest_and_known, together
from stickslip.model.structure import is_numbered
from stickslip.study.file.model.bodies import BODIES, Cylinder, FlatCurved, RigidBodyTable, Wedge
from stickslip.study.file.model.contacts import law_class
from stickslip.study.file.model.parts import BeamTable, Copy, FileModel, Lumped, PrismBlades, Sector
from stickslip.study.file.section import Section
from stickslip.study.file.study import StudyFile
from stickslip.study.file.tables import Tables, original
from stickslip.study.models.aero import aero_refusals, knows_speeds
from stickslip.study.models.cost import too_large
from stickslip.study.models.files import MESHES
from stickslip.study.models.pressure import pressure_refusals
from stickslip.study.models.spares import mistuning_refusals
from stickslip.study.questions import ANALYSES

_FLAT_CURVED = {
    "flat": ("length_m", "flat_between_m"),
    "curved": ("length_m", "curved_width_m"),
}  # a wedge needs no keys for its areas


BLADES = ("root", "force", "tip1", "edge1", "tip2")
SECTOR = ("root", "cyclic_low", "cyclic_high", "tip")
SIDES = ("flat", "curved")
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
OF_SECTOR = re.compile(r"\[\d+\](?=\.)")  # index of one blade of a mistuned wheel


def refuse(file: StudyFile) -> None:
    """Refuse a study with errors that can be found without a mesh.

    Raises
    ------
    InputError
        If there are such errors; the message names each on a line.
    """
    found: dict[str, InputError] = {}
    for case in file.cases:
        for error in refusals(case.tables, file.home):
            found.setdefault(str(error), error.inside(str(file.path)))
    if found:
        raise together(found.values())


def refusals(tables: Tables, home: Path) -> Iterator[InputError]:
    """Yield the errors in the tables of a case, each with its key as place.

    Parameters
    ----------
    tables
        Tables of the case.
    home
        Folder to which file names are relative.
    """
    wrong = [*_parts(tables, home)]
    yield from wrong
    if not wrong:  # names can be checked only if the parts are valid
        large = too_large(tables, home)
        yield from [large] if large else []
        yield from _surfaces(tables)
        yield from without_areas(tables)
        yield from _shapes_of_joins(tables)
        yield from _loads(tables)
        yield from _outputs(tables)
        yield from _questions(tables, home)
        yield from fluid_refusals(tables, home, sectors_of(tables))
        yield from mistuning_refusals(tables, home, sectors_of(tables))
        yield from stage_refusals(tables)
        yield from run_up_refusals(tables)
        for name in tables.stress.card:
            if name not in tables.part:
                yield input_error(f"stress.card.{name}", "is no part", did_you_mean(name, list(tables.part)))


def sectors_of(tables: Tables) -> int | None:
    """Return the number of sectors: 1 for a single structure, None if only a file contains it."""
    found: list[int | None] = [1]
    for table in tables.part.values():
        known: Any = table
        if isinstance(known, Sector | Lumped):
            found.append(known.sectors)  # type: ignore[attr-defined]
        elif isinstance(known, FileModel):
            found.append(known.sectors)
    return None if None in found else max(n for n in found if n is not None)


def _parts(tables: Tables, home: Path) -> Iterator[InputError]:
    for name, table in tables.part.items():
        if "." in name or name in (GROUND, NEXT.rstrip(".")):
            yield input_error(
                f"part.{name}", "is no name of a part", f"Give one without dots, other than {GROUND} and {NEXT[:-1]}."
            )
        if isinstance(table, FileModel):
            for key, file in table.files().items():
                if (home / file).exists() and not (home / file).is_file():
                    yield input_error(
                        f"part.{name}.{key}",
                        f"{home / file} is no file",
                        "Give a file: what comes out of a pipe has to be written into one.",
                    )
                elif not (home / file).is_file():
                    yield missing_file(f"part.{name}.{key}", home / file)
        if isinstance(table, Copy):
            yield from _copied(tables, name, table.of)
        if isinstance(table, PrismBlades):
            yield from _nodes_at(tables, f"part.{name}.nodes_at", table)
        if isinstance(table, PrismBlades | Sector | BeamTable) and not (
            table.material or tables.material  # type: ignore[attr-defined]
        ):
            yield input_error(f"part.{name}.material", "is missing", "Add the table [material], or one of the part.")


def _copied(tables: Tables, name: str, of: str) -> Iterator[InputError]:
    place = f"part.{name}.of"
    if of not in tables.part:
        yield input_error(place, f"{of!r} is no part", did_you_mean(of, list(tables.part)))
        return
    line = [name]
    while of in tables.part and of not in line:
        line.append(of)
        table: Any = tables.part[of]
        if not isinstance(table, Copy):
            return
        of = table.of
    if of == name:
        yield input_error(place, f"{' is a copy of '.join([*line, of])}", "Let one of them be no copy.")


def _nodes_at(tables: Tables, place: str, table: Any) -> Iterator[InputError]:
    dampers = [name for name, other in tables.part.items() if isinstance(other, FlatCurved)]
    known = [f"{name}.{side}" for name in dampers for side in SIDES]
    for word in table.nodes_at:
        if word not in known:
            yield input_error(
                place,
                f"there is no surface {word!r} of a flat_curved part",
                did_you_mean(word, known)
                + ' Other bodies need no nodes: pairing = "node_to_segment" takes the body\'s points first and the set '
                '"underside_1" or "underside_2" second.',
            )
    for name in dict.fromkeys(word.partition(".")[0] for word in table.nodes_at):
        if getattr(tables.part.get(name), "placed", None):
            yield input_error(
                f"part.{name}.placed",
                f"moves points that {place} makes nodes of",
                "Leave placed out: apex_m puts this body in its place. Or leave nodes_at out.",
            )
    if len({word.partition(".")[0] for word in table.nodes_at}) > 1:
        yield input_error(place, "names surfaces of several parts", "Name those of one damper.")


def _surfaces(tables: Tables) -> Iterator[InputError]:
    for kind in ("contact", "join"):
        for name, table in getattr(tables, kind).items():
            place = f"{kind}.{name}.between"
            for word in table.between:
                if word != GROUND:
                    yield from _refused(tables, place, word, ("surface", "set"))
                if word.startswith(NEXT):
                    yield from _no_sector(tables, place, word)


def _shapes_of_joins(tables: Tables) -> Iterator[InputError]:
    """Yield the error about interface modes in a study without joined surfaces."""
    count = None if tables.reduction is None else tables.reduction.interface_modes
    wheel = (sectors_of(tables) or 1) > 1
    if count is not None and (wheel or not tables.join):
        why = "waves of a wheel hold no joined nodes" if wheel else "nothing is joined"
        yield input_error(
            "reduction.interface_modes",
            f"is {count}, and {why}",
            "Leave it out; it is for joins of a single structure.",
        )


def _no_sector(tables: Tables, place: str, word: str) -> Iterator[InputError]:
    head = word.removeprefix(NEXT).partition(".")[0]
    alone = head in tables.part and sectors_of(tables) == 1
    if alone:
        yield input_error(
            place,
            f"{word!r} is on the next sector, but {head!r} is no sector of a wheel",
            f"Give part.{head}.sectors, or name a surface of another part.",
        )


def _refused(tables: Tables, place: str, word: str, what: tuple[str, ...]) -> Iterator[InputError]:
    """Yield the error about a name that no part has, if this is known without a mesh."""
    head, _, rest = word.removeprefix(NEXT).partition(".")
    if head not in tables.part:
        yield input_error(place, f"there is no part {head!r}", did_you_mean(head, list(tables.part)))
        return
    known = names_of(tables, head)
    if known is None or not rest or rest in known:
        return
    node = rest.removeprefix("node").partition(".")[0]
    if node.isdigit() or rest in COMPONENTS:
        return
    ahead = NEXT if word.startswith(NEXT) else ""
    own = [f"{ahead}{head}.{name}" for name in known]
    yield input_error(place, f"there is no {' or '.join(what)} {word!r}", nearest_and_known(word, own))


def names_of(tables: Tables, part: str) -> tuple[str, ...] | None:
    """Return the names of surfaces and sets of a part before meshing; None if only a file contains them."""
    table = original(tables, part)
    return None if isinstance(table, FileModel) else _NAMES[type(table)](table)


def _of_blades(_table: Any) -> tuple[str, ...]:
    return ("underside_1", "underside_2", *BLADES)


def _of_sector(table: Any) -> tuple[str, ...]:
    platform = ("platform_low", "platform_high", "platform_under") if table.platform else ()
    shroud = ("shroud_low", "shroud_high") if table.shroud else ()
    return (*SECTOR, *platform, *shroud)


_NAMES: dict[type[Section], Callable[[Any], tuple[str, ...]]] = {
    PrismBlades: _of_blades,
    Sector: _of_sector,
    BeamTable: lambda _: ("deflection", "rotation", "axial", "tip"),
    Lumped: lambda table: tuple(table.labels),
    RigidBodyTable: lambda table: tuple(table.surfaces),
    FlatCurved: lambda _: SIDES,
    Wedge: lambda _: ("left", "right"),
    Cylinder: lambda _: ("left", "right"),
}


def _loads(tables: Tables) -> Iterator[InputError]:
    for name, table in tables.load.items():
        place = f"load.{name}"
        yield from _refused(tables, f"{place}.on", table.on, ("set",))
        if table.ratio_of is not None:
            other = tables.load.get(table.ratio_of.removeprefix("load."))
            if other is None or other.force_n is None:
                problem = "is no load" if other is None else "has no force_n itself"
                known = [f"load.{n}" for n, t in tables.load.items() if t.force_n is not None]
                yield input_error(
                    f"{place}.ratio_of",
                    f"{table.ratio_of!r} {problem}",
                    did_you_mean(table.ratio_of, known) if known else "Give a load force_n of its own.",
                )
        if table.engine_order is not None and sectors_of(tables) == 1:
            yield input_error(
                f"{place}.engine_order",
                "is of a wheel, but no part is a sector of one",
                "Leave it out, or give the part its number of sectors.",
            )
    yield from _driven(tables)


def _driven(tables: Tables) -> Iterator[InputError]:
    """Yield errors about harmonics of loads that the response does not keep."""
    if any(table.harmonic and table.engine_order is None for table in tables.load.values()):
        own = {name: table.harmonic for name, table in tables.load.items()}  # wheels are checked elsewhere
    else:
        try:
            _, own = engine_order(tables.load, wheel=True)
        except InputError as error:
            yield error
            return
    table = tables.harmonics
    low = table.beginning(own.values())
    high = low if table.high == "auto" else table.high_harmonics
    for key, kept in (("low", low), ("high", high)):
        lacking = {name: h for name, h in own.items() if h not in kept}
        for name, h in lacking.items():
            given = tables.load[name]
            asked = (given.engine_order or 0) * given.harmonic
            why = f", {asked // h} that common to all loads" if h != given.harmonic else ""
            yield input_error(
                f"load.{name}.harmonic",
                f"{h}{f' (engine order {asked}{why})' if why else ''} is not kept by harmonics.{key} = {getattr(table, key)}",
                "Add it there." if key == "high" else "Add it there, or leave that out.",
            )
        if lacking:
            return


def _outputs(tables: Tables) -> Iterator[InputError]:
    for name, point in tables.output.points.items():
        yield from _refused(tables, f"output.points.{name}", point.on, ("set", "dof"))
    peak = tables.output.peak
    if peak:
        head, _, direction = OF_SECTOR.sub("", peak).partition(".")
        of = {name: _directions(tables, point) for name, point in tables.output.points.items()}
        words = of.get(head, ())
        may_have = len(words) > 1 and (direction in COMPONENTS or is_numbered(direction))
        if direction not in words and not may_have:
            known = [f"{name}.{d}" for name, own in of.items() for d in own]
            yield input_error("output.peak", f"there is no output {peak!r}", did_you_mean(peak, known))


def _directions(tables: Tables, point: Any) -> tuple[str, ...]:
    """Return the directions in which a point is reported, if known without a mesh; for a single dof its direction."""
    _, dot, last = point.on.rpartition(".")
    if dot and (last.lower() in COMPONENTS or is_numbered(last.lower())):
        return (last.lower(),)
    return tuple(point.directions or tables.output.directions or COMPONENTS[:3])


def _questions(tables: Tables, home: Path) -> Iterator[InputError]:
    """Yield errors about analyses with missing inputs."""
    asked: Any = tables
    # coupled stages have modes only, which another check reports
    forced = None if staged(tables) else getattr(asked, "forced_response", None)
    driven = [table for table in tables.load.values() if table.harmonic > 0]
    if forced is not None and not driven:
        yield input_error(
            "forced_response",
            "has no harmonic load to respond to",
            'Add one, for example [load.shaker] with on = "part.set", force_n = 1.0 and direction = "x".',
        )
    sectors = sectors_of(tables)
    if forced is not None and sectors is not None and sectors > 1:
        for name, table in tables.load.items():
            if table.engine_order == 0 and table.harmonic > 0 and getattr(forced, "over", "") == "speed":
                yield input_error(
                    f"load.{name}.engine_order",
                    'is 0, and with over = "speed" the frequency is the engine order times the speed',
                    "Give an engine order from 1 on, or frequency_hz.",
                )
            if table.harmonic > 0 and table.engine_order is None:
                yield input_error(
                    f"load.{name}.engine_order",
                    f"is missing on a wheel of {sectors} sectors",
                    "Say how many periods the force has around the circumference.",
                )
    yield from _without_a_mesh(tables, home)
    if not staged(tables):
        yield from diameter_refusals(tables, sectors)


def _without_a_mesh(tables: Tables, home: Path) -> Iterator[InputError]:
    """Yield errors about speeds in a model that does not depend on the speed."""
    originals = [original(tables, name) for name in tables.part]
    if any(map(_turns, originals)):
        return
    asked: Any = tables
    if getattr(asked, "campbell", None) is not None:
        yield input_error(
            "campbell",
            "needs a part that a speed changes, and none is a mesh or has matrices at several speeds",
            "Give a part a shape, a deck (.inp), an archive (.cdb), or matrices with the tables at_speed.",
        )
    still = tables.rotation.speed_rpm == 0 or any(isinstance(part, BODIES) for part in originals)
    if not still and not knows_speeds(tables.aero, home):
        yield input_error(
            "rotation.speed_rpm",
            f"is {tables.rotation.speed_rpm:g}, but no part is a mesh, a rigid body or matrices at several speeds, and no aero.file "
            "has a column speed_rpm: a speed changes nothing else",
            "Give 0, a mesh, or matrices with the tables at_speed. Matrices that were exported at one speed hold its effects already.",
        )


def _turns(table: Any) -> bool:
    if isinstance(table, FileModel):
        return bool(table.at_speed) or table.file.lower().endswith(MESHES)
    return isinstance(table, PrismBlades | Sector)


def without_areas(tables: Tables) -> Iterator[InputError]:
    """Yield an error for each key that a contact per area needs and its rigid body lacks."""
    contacts: dict[str, Any] = tables.contact
    for name, contact in contacts.items():
        head, _, side = contact.between[0].partition(".")
        if contact.per != "area" or head not in tables.part:
            continue
        table: Any = tables.part[head]
        while isinstance(table, Copy) and table.of in tables.part:
            head, table = table.of, tables.part[table.of]
        for key, value in _told(table, side).items():
            if value is None:
                yield input_error(
                    f"part.{head}.{key}",
                    f'is missing, and contact.{name} has per = "area": the points of {contact.between[0]!r} have no area',
                    'Add it, or give the contact per = "interface" and the stiffness of the whole side.',
                )


def _told(table: Any, side: str) -> dict[str, Any]:
    """Return the keys that define the areas of a side's points, with their values; missing values are None."""
    if isinstance(table, FlatCurved):
        return {key: getattr(table, key) for key in _FLAT_CURVED.get(side, ())}
    if isinstance(table, Cylinder):
        return {"contact_width_m": table.contact_width_m}  # type: ignore[attr-defined]
    if isinstance(table, RigidBodyTable):
        surface = table.surfaces.get(side)  # type: ignore[attr-defined]
        return {} if surface is None else {f"surfaces.{side}.areas_m2": surface.areas_m2}
    return {}


def diameter_refusals(tables: Tables, sectors: int | None) -> Iterator[InputError]:
    """Yield errors about nodal diameters that a wheel with `sectors` lacks; None: only a file contains the number."""
    for name in ("modes", "campbell", "flutter"):
        yield from _diameters(name, getattr(tables, name, None), sectors)


def _diameters(name: str, table: Any, sectors: int | None) -> Iterator[InputError]:
    given = getattr(table, "nodal_diameters", None)
    if sectors is None or not given:
        return
    if sectors == 1 and max(given) > 0:
        yield input_error(
            f"{name}.nodal_diameters",
            "are of a wheel, and no part is a sector of one",
            "Leave them out, or give the part its number of sectors.",
        )
        return
    if max(given) > sectors // 2:
        yield input_error(
            f"{name}.nodal_diameters",
            f"{max(given)} is above half of {sectors} sectors",
            f"The nodal diameters go from 0 to {sectors // 2}.",
        )
        return
    for order in getattr(table, "engine_orders", ()):
        excited = min(order % sectors, -order % sectors)
        if excited not in given:
            yield input_error(
                f"{name}.engine_orders",
                f"{order} excites the nodal diameter {excited}, which is not computed",
                "Add it to nodal_diameters, or leave those out: then all that are excited are computed.",
            )


def fluid_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield errors in [aero] and in pressures of loads."""
    yield from aero_refusals(tables, home, sectors)
    yield from pressure_refusals(tables, home)


def run_up_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield errors about aerodynamic forces, mistuning and rigid contacts in a study with [run_up]."""
    asked: Any = getattr(tables, "run_up", None)
    contacts: dict[str, Any] = tables.contact
    if asked is None:
        return
    if tables.aero is not None:
        yield input_error(
            "run_up",
            "does not follow the aerodynamic forces of [aero] over speed",
            "Leave [aero] out, or compute forced responses at single speeds.",
        )
    for name in tables.mistuning:
        yield input_error(
            "run_up",
            f"is of tuned wheels, and [mistuning.{name}] makes sectors differ",
            "Leave it out, or compute forced responses at single speeds.",
        )
    for name, table in contacts.items():
        if asked.rate_rpm_per_s and law_class(table.law) is RigidCoulomb:
            yield input_error(
                "run_up.rate_rpm_per_s",
                f"needs contact forces that follow from gaps, and contact.{name}.law is {table.law}",
                "Give the contact a stiffness, or leave the rates out.",
            )


def staged(tables: Tables) -> bool:
    """Whether a join couples stages."""
    return any(table.pairing == SPATIAL for table in tables.join.values())


def stage_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield errors about features that are not supported for coupled stages."""
    if not staged(tables):
        return
    for name in ANALYSES:
        if name != "modes" and getattr(tables, name, None) is not None:
            why = f"is no question for stages, which a join by {SPATIAL} couples"
            yield input_error(name, why, ALONE)
    for name, table in tables.join.items():
        if table.pairing != SPATIAL:
            yield input_error(f"join.{name}.pairing", f"is {table.pairing} beside joins by {SPATIAL}", ALONE)
    for name in tables.contact:
        yield input_error(f"contact.{name}", "touches stages, which a join couples", ALONE)
    if tables.rotation.speed_rpm > 0:
        yield input_error("rotation.speed_rpm", "gives stages a prestress that crosses their flanges", ALONE)

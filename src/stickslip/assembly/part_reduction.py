"""Reduction of the parts, each once; copies and later models share the result."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.assembly.locations import node_rows
from stickslip.assembly.part_copies import turned_dofs, turned_structure
from stickslip.errors import InputError, SingularError
from stickslip.model.axis import Axis
from stickslip.model.fe.free_solid import inertia_relief
from stickslip.model.part import Part
from stickslip.model.slow_steps import step
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import surviving_sets, with_modal_dofs
from stickslip.reduction.cache import content_hash
from stickslip.reduction.choice import Reduction
from stickslip.reduction.speed_basis import modes_of, on_modes_of_others

Store = Callable[[str, Callable[[], Mapping[str, Any]]], Mapping[str, Any]]
REMEMBERED = 4  # reductions of a part that are cached
LAST = "last, with its way back"
MOST_BASIS_BYTES = 100_000_000  # of that map to all dofs


@dataclass(frozen=True)
class Spin:
    """Rotation of a model.

    Parameters
    ----------
    speed
        Rotor speed, rad/s.
    tangent, coriolis
        As in `RotatingSolid.at_speed`.
    axis
        Axis of rotation of rigid bodies; solids have their own axis.
    like
        Reference speeds of the reduction, rad/s, see `Model.modes_like`; empty: none.
    """

    speed: float = 0.0
    tangent: Literal["consistent", "textbook"] = "consistent"
    coriolis: bool = False
    axis: Axis = Axis()  # noqa: RUF009  # frozen
    like: tuple[float, ...] = ()

    @property
    def references(self) -> tuple["Spin", ...]:
        """Rotations at the reference speeds `like`; empty: the modes of this rotation are used."""
        if self.like in ((), (self.speed,)):
            return ()
        return tuple(replace(self, speed=speed, like=()) for speed in self.like)


@dataclass(frozen=True, eq=False)
class Steady:
    """Conditions of the displacement of a part in steady rotation and temperature.

    Parameters
    ----------
    tie
        Tie of the cyclic faces; None without such faces.
    unit
        (n,) displacement over the square of the speed, m s², solved together with the joined parts; None: displacement
        of the part alone.
    carried
        (n,) force over the square of the speed, N s², that contacts carry if they alone support the part; None for a
        supported part.
    hot
        (n,) displacement by the thermal strain in m, where `unit` is given; None without thermal strain.
    """

    tie: Matrix | None = None
    unit: FloatArray | None = None
    carried: FloatArray | None = None
    hot: FloatArray | None = None

    def displacement(self, part: Part, speed: float) -> FloatArray:
        """Return the (n,) displacement in m of a part with a solid at a speed in rad/s."""
        assert part.solid is not None
        if self.unit is not None:
            return np.asarray(speed**2 * self.unit + (0.0 if self.hot is None else self.hot))
        return part.solid.displacement(speed, tie=self.tie)


ALONE = Steady()


def is_loaded(part: Part, speed: float) -> bool:
    """Whether a part of finite elements has a static state: it rotates, or thermal strain loads it."""
    return part.solid is not None and (speed != 0.0 or part.solid.heated)


def steady_of(part: Part, tie: Matrix | None) -> Steady:
    """Return the conditions of steady rotation of a part alone.

    A free part is in equilibrium with its inertia forces.
    """
    relief = None if part.solid is None else inertia_relief(part.solid, tie)
    return Steady(tie) if relief is None else Steady(tie, *relief)


@dataclass(frozen=True, eq=False)
class ReducedPart:
    """Reduced part.

    Parameters
    ----------
    structure
        Matrices on the kept dofs, followed by modal coordinates; with `basis` only for the store `with_ways_back`.
    kept
        (k,) dofs of the part that are the first coordinates.
    steady
        (n,) static load of steady rotation, N; zeros at rest.
    """

    structure: Structure
    kept: IntArray
    steady: FloatArray


def in_memory(_content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
    """Compute the arrays without caching them: the store of a model outside a study."""
    return make()


def with_ways_back(_content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
    """Compute the arrays without caching them.

    Reductions with this store also return their `basis`, the map to all dofs.
    """
    return make()


def at_speed(name: str, part: Part, spin: Spin, rest: Steady = ALONE) -> Structure:
    """Return the full structure of a part at a speed."""
    if part.body is not None and spin.speed != 0.0:
        return part.body.at_speed(spin.speed, spin.axis, coriolis=spin.coriolis)
    if part.turning is not None:
        try:
            return part.turning.at_speed(spin.speed, coriolis=spin.coriolis)
        except InputError as error:
            raise error.inside(f"part.{name}") from None
    if part.solid is None or not is_loaded(part, spin.speed):
        return part.structure
    try:
        return part.solid.at_speed(
            spin.speed, tie=rest.tie, unit=rest.unit, hot=rest.hot, tangent=spin.tangent, coriolis=spin.coriolis
        )
    except SingularError as error:
        raise SingularError(f"part.{name}: {error}") from None


def stiffening(part: Part, spin: Spin, rest: Steady = ALONE) -> Matrix:
    """Return the (n, n) derivative by Ω² of the stiffness of `at_speed`, N s²/m."""
    if part.body is not None:
        return scipy.sparse.csr_array(part.body.at_speed(1.0, spin.axis).stiffness)
    if part.turning is not None:
        return part.turning.by_square(spin.speed)
    if part.solid is None:
        return scipy.sparse.csr_array((part.structure.n, part.structure.n))
    found = part.solid.polynomial(rest.tie, tangent=spin.tangent, unit=rest.unit, hot=rest.hot)
    return found.by_square(spin.speed)


def steady_load(part: Part, spin: Spin, structure: Structure, rest: Steady = ALONE) -> FloatArray:
    """Return the (n,) load on a part's dofs that causes the displacement of steady rotation at a speed, N."""
    if part.turning is not None:
        return part.turning.static_load(spin.speed)
    if not is_loaded(part, spin.speed):
        return np.zeros(part.structure.n)
    load = np.asarray(structure.stiffness @ rest.displacement(part, spin.speed))
    return load if rest.carried is None else load + spin.speed**2 * rest.carried


def damped(name: str, part: Part, structure: Structure) -> Structure:
    """Return the structure of a part with the damping from the part's matrices."""
    if part.damping is None:
        return structure
    try:
        # stress stiffening and spin softening do not dissipate
        return part.damping.of_matrices(structure, part.structure.stiffness)
    except InputError as error:
        raise error.inside(f"part.{name}") from None


def whole_nodes(table: Dofs, dofs: IntArray) -> IntArray:
    """Return all dofs of the nodes that have a dof among `dofs`, in ascending order."""
    numbers = np.unique(table.node[dofs])
    rows = node_rows(table, numbers[numbers >= 0])
    return np.union1d(dofs, rows[rows >= 0])


def reduced_parts(
    parts: Mapping[str, Part],
    kept: Mapping[str, IntArray],
    spin: Spin,
    rest: Mapping[str, Steady],
    store: Store = in_memory,
) -> dict[str, ReducedPart]:
    """Reduce all parts of a single structure.

    Parameters
    ----------
    parts
        Name -> part.
    kept
        Name -> dofs of the part that stay physical.
    spin
        Rotation of the model.
    rest
        Name -> conditions of the displacement in steady rotation.
    store
        Cache of reductions, as in `assemble`.

    Raises
    ------
    InputError
        If a part has fewer dofs than requested modes.
    SingularError
        If a part is free to move although its kept dofs are fixed.
    """
    wanted: dict[int, IntArray] = {}
    for name, part in parts.items():
        root = _root(part, spin, rest[name])
        own = whole_nodes(part.structure.dofs, kept[name])
        wanted[id(root)] = np.union1d(wanted.get(id(root), own), own)
    found = {}
    for name, part in parts.items():
        root = _root(part, spin, rest[name])
        steady = rest[name] if is_loaded(root, spin.speed) else ALONE
        made = _reduced(name, root, wanted[id(root)], (spin, steady), store)
        found[name] = made if root is part else _placed(made, part)
    return found


def _root(part: Part, spin: Spin, rest: Steady) -> Part:
    """Return the part whose reduction a part shares."""
    if part.template is None or part.place is None or part.body is not None:
        return part
    turns = (part.follows_speed and spin.speed != 0.0) or is_loaded(part, spin.speed)
    alike = part.place.keeps(part.axis) and rest.unit is None
    return part if turns and not alike else part.template


def _reduced(name: str, part: Part, kept: IntArray, turning: tuple[Spin, Steady], store: Store) -> ReducedPart:
    changes = part.follows_speed or part.body is not None
    spin, rest = turning if changes else (Spin(), ALONE)
    shared = None if rest.unit is None else rest.unit.tobytes() + (b"" if rest.hot is None else rest.hot.tobytes())
    whole = store is with_ways_back
    key = (spin, shared, kept.tobytes(), whole)
    if whole and part.memo.get(LAST, (None,))[0] == key:
        last: ReducedPart = part.memo[LAST][1]
        return last
    if key not in part.memo:

        def make() -> ReducedPart:
            n = part.structure.n
            with step(f"reducing part {name}: {n} dofs to {kept.size} of contacts, loads and outputs, and modes", n):
                made = _reduce(name, part, kept, spin, rest)
            if not whole and _small(made.structure.basis):
                part.memo[LAST] = (*key[:-1], True), made  # pictures of the motion need it next
            return made if whole else replace(made, structure=replace(made.structure, basis=None))

        if part.reduction is None or part.body is not None or whole:
            made = make()
        else:
            content = _content(part, spin, rest, kept)
            values = store(content, lambda: _packed(make()))
            structure, steady = unpacked(values, part.structure, kept)
            made = ReducedPart(structure, kept, steady)
        part.memo[key] = made
        forget(part.memo, ReducedPart, REMEMBERED)
    found: ReducedPart = part.memo[key]
    return found


def _small(basis: Matrix | None) -> bool:
    """Return whether a map to all dofs is small enough to stay in memory."""
    return isinstance(basis, np.ndarray) and basis.nbytes <= MOST_BASIS_BYTES


def _packed(made: ReducedPart) -> dict[str, Any]:
    return packed(made.structure, made.steady)


def forget(memo: dict[Any, Any], kind: type, most: int) -> None:
    """Remove all values of a kind from memory except the last `most`."""
    for key in [key for key, value in memo.items() if isinstance(value, kind)][:-most]:
        del memo[key]


def _reduce(name: str, part: Part, kept: IntArray, spin: Spin, rest: Steady) -> ReducedPart:
    full = at_speed(name, part, spin, rest)
    steady = steady_load(part, spin, full, rest)
    full = damped(name, part, full)
    try:
        if part.reduction is None or part.body is not None:
            whole = full if part.damping is None else part.damping.of_modes(full)
            return ReducedPart(whole, np.arange(full.n), steady)
        if spin.references and part.follows_speed and isinstance(part.reduction, Reduction):
            known = [at_speed(name, part, other, rest) for other in spin.references]
            others = [modes_of(one, kept, part.reduction) for one in known]
            small = on_modes_of_others(full, kept, part.reduction, others)
        else:
            small = part.reduction.of(full, kept)
        if part.damping is not None:
            small = part.damping.of_modes(small)
    except InputError as error:
        raise error.inside(f"part.{name}") from None
    except SingularError as error:
        raise SingularError(f"part.{name}: {error}") from None
    return ReducedPart(small, kept, np.asarray(small.project(steady)))


def _placed(made: ReducedPart, part: Part) -> ReducedPart:
    """Return the reduction of a part for its copy: physical coordinates rotate, modal ones are unchanged."""
    assert part.place is not None
    structure = turned_structure(made.structure, part.place)
    turn = turned_dofs(made.structure.dofs, part.place)
    if made.structure.basis is not None:
        assert part.template is not None
        whole = turned_dofs(part.template.structure.dofs, part.place)
        structure = replace(structure, basis=whole @ made.structure.basis @ turn.T)
    return ReducedPart(structure, made.kept, np.asarray(turn @ made.steady))


def _content(part: Part, spin: Spin, rest: Steady, kept: IntArray) -> str:
    solid = part.solid
    turning: tuple[object, ...] = ()
    if part.turning is not None and spin.speed != 0.0:
        turning = (spin, part.turning)
    if solid is not None and is_loaded(part, spin.speed):
        mesh, material = solid.mesh, solid.material
        given = (material,) if not isinstance(material, list | tuple) else tuple(material)
        state = (spin, rest.unit, rest.hot, solid.temperature)
        turning = (*state, mesh.points, mesh.cells, given, solid.axis, solid.quadrature, solid.followers)
    return content_hash("reduced", part.structure, kept, part.reduction, part.damping, turning)


def packed(structure: Structure, steady: Matrix) -> dict[str, Any]:
    """Return a reduced structure and its load of steady rotation as named arrays."""
    s = structure
    arrays = {"mass": s.mass, "damping": s.damping, "stiffness": s.stiffness, "loss": s.loss}
    own = {name: as_array(matrix) for name, matrix in arrays.items() if matrix is not None}
    return own | {"steady": steady}


def unpacked(values: Mapping[str, Any], full: Structure, kept: IntArray) -> tuple[Structure, Matrix]:
    """Return a reduced structure and its load of steady rotation from the arrays of `packed`.

    Dofs and sets follow from `full`.
    """
    mass, loss = np.asarray(values["mass"]), values.get("loss")
    dofs, sets = (with_modal_dofs(full.dofs.take(kept), len(mass) - kept.size), surviving_sets(full, kept))
    own = mass, values["damping"], values["stiffness"]
    return Structure(*own, dofs, sets, None, loss), np.asarray(values["steady"])

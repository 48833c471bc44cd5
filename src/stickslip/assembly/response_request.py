"""Forces and outputs of a response, and refusals of inconsistent requests."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.forces import Labels, Load, amplitude, error_names, force_of, output_labels
from stickslip.assembly.joints.gap_coordinates import refuse_rigid
from stickslip.assembly.joints.unconstrained_bodies import refuse_pulled, refuse_unheld
from stickslip.assembly.model import Model
from stickslip.errors import input_error


@dataclass(frozen=True, eq=False)
class Asked:
    """Loads and outputs of a response, on the dofs of all parts.

    Parameters
    ----------
    order
        Engine order, for several orders their base; None for a single structure, and without harmonic loads.
    orders
        Harmonic -> engine order of its loads.
    forces
        Name of a load -> (N,) force on the dofs of all parts, N.
    labels
        Reported dofs.
    spread
        Loads whose dofs need not stay in the reduction (`Model.spread`).
    names, watched
        Labels over which the truncation error is taken, and their dofs.
    """

    order: int | None
    orders: Mapping[int, int]
    forces: Mapping[str, Matrix]
    labels: Labels
    names: tuple[str, ...]
    watched: IntArray
    spread: tuple[str, ...] = ()

    @property
    def stay(self) -> IntArray:
        """Dofs that must each be a coordinate."""
        return np.concatenate([self.labels.dofs, self.watched])

    @property
    def kept(self) -> IntArray:
        """Dofs that stay physical, in addition to those of contacts and joins."""
        near = [np.flatnonzero(f) for name, f in self.forces.items() if name not in self.spread]
        return np.concatenate([self.stay, *near])


def asked(model: Model, harmonics: int) -> Asked:
    """Return forces, outputs and watched dofs of a response to a model.

    Raises
    ------
    InputError
        If a place is unknown, a load drives a harmonic above the highest one, or a body has no support.
    """
    order, driven = model.engine_order, model.driven
    forces = {name: force_of(model.places, name, load) for name, load in model.loads.items()}
    _refuse_beyond(driven, model.loads, harmonics)
    labels = output_labels(model.places, model.outputs, model.loads)
    if not labels.names:
        raise input_error("output.points", "there is none", "Name a point whose motion is reported.")
    points = contact_labels(model)
    names = error_names(labels, points, model.loads, model.alert_over)
    watched = _joined(labels, points, _body_labels(model)).of(names, "alert_over")
    refuse_rigid(model)
    refuse_unheld(model)
    refuse_pulled(model, static_forces(model, forces))
    orders = {h: h * order for h in sorted({*driven.values()}) if h and order is not None}
    return Asked(order, orders, forces, labels, names, watched, model.spread)


def _refuse_beyond(driven: Mapping[str, int], loads: Mapping[str, Load], harmonics: int) -> None:
    for name, harmonic in driven.items():
        if harmonic > harmonics:
            given = harmonic == loads[name].harmonic
            raise input_error(
                f"load.{name}.harmonic" if given else f"load.{name}",
                f"{'is' if given else 'acts in harmonic'} {harmonic}, and harmonics up to {harmonics} are computed",
                "Keep more harmonics.",
            )


def _joined(*labels: Labels) -> Labels:
    names = tuple(name for one in labels for name in one.names)
    return Labels(names, np.concatenate([one.dofs for one in labels]))


def contact_labels(model: Model) -> Labels:
    """Return labels ``point.x`` and so on for the displacements of contact points that are nodes."""
    pairs, table = model.pairs, model.places.dofs
    known = [(i, dof) for i, row in enumerate(pairs.nodes) for dof in row if dof >= 0]
    names = tuple(f"{pairs.names[i]}.{table.component[dof]}" for i, dof in known)
    return Labels(names, np.array([dof for _, dof in known], dtype=np.int64))


def _body_labels(model: Model) -> Labels:
    dofs, table = model.places.bodies(), model.places.dofs
    return Labels(tuple(f"{table.part[d]}.{table.component[d]}" for d in dofs), dofs)


def static_forces(model: Model, forces: Mapping[str, Matrix]) -> dict[str, FloatArray]:
    """Return the static forces (N,) on the dofs of all parts, N, by study key."""
    static = {f"load.{name}": np.real(force) for name, force in forces.items() if model.loads[name].harmonic == 0}
    if model.centrifugal and model.speed > 0:
        static["rotation.speed_rpm"] = centrifugal_of_bodies(model)
        for name, part in model.parts.items():
            if part.solid is not None:
                own = model.speed**2 * part.solid.centrifugal
                static["rotation.speed_rpm"][model.places.own(name)] = own
            elif part.turning is not None:
                static["rotation.speed_rpm"][model.places.own(name)] = part.turning.static_load(model.speed)
    return static


def centrifugal_of_bodies(model: Model) -> FloatArray:
    """Return the (N,) centrifugal forces (N) and moments (N m) on rigid bodies at their centres of mass."""
    force = np.zeros(model.places.n)
    for name, part in model.parts.items():
        if part.body is not None:
            force[model.places.own(name)] = part.body.centrifugal(model.speed, model.axis)
    return force


def excitation(model: Model) -> float:
    """Return the force amplitude by which responses are divided, N; NaN without harmonic loads."""
    driven = [amplitude(model.places, name, load) for name, load in model.loads.items() if load.harmonic > 0]
    return max(driven, default=float("nan")) or float("nan")

"""The reduced blade pair: made from mesh and material, checked against the full model, kept for the next start."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.damping import rayleigh_damping
from stickslip.model.dofs import Dofs
from stickslip.model.fe.solid import assemble_solid
from stickslip.model.mesh.blade_mesh import mesh_blade_pair
from stickslip.model.mesh.solid_mesh import SolidMesh, write_mesh
from stickslip.model.modes import natural_frequencies, with_springs
from stickslip.model.rigid.damper import FlatCurvedDamper
from stickslip.model.structure import Structure
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.study.assembly import join_damper
from stickslip.study.estimate import check_limits, estimate
from stickslip.study.folder import MESHES
from stickslip.study.journal import Journal
from stickslip.study.schema import Study, StudyTables

KEPT = ("contact", "force", "output")  # node sets that stay physical
MODES = 10  # natural frequencies compared
CHECKED = 5  # of them must agree
AGREEMENT = 1e-3  # relative
RIGID = 1e-4  # of the highest frequency: below, rounding


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Natural frequencies in Hz: blades alone and with every contact stuck, full and reduced."""

    free_full: FloatArray
    free_reduced: FloatArray
    stuck_full: FloatArray
    stuck_reduced: FloatArray

    def lines(self) -> list[str]:
        """Return the comparison as lines of text."""
        return [
            f"{what} mode {i + 1}: full {full:.4f} Hz, reduced {reduced:.4f} Hz, {100 * error:+.5f} %"
            for what, fulls, reduceds in self._pairs()
            for i, (full, reduced, error) in enumerate(
                zip(fulls, reduceds, _errors(fulls, reduceds), strict=True)
            )
        ]

    def warnings(self) -> list[str]:
        """Return a sentence for each set of modes that the reduction does not reproduce."""
        found = []
        for what, full, reduced in self._pairs():
            error = np.abs(_errors(full, reduced))[:CHECKED]
            if np.any(error > AGREEMENT):
                found.append(
                    f"the reduced model misses a {what} natural frequency by {100 * error.max():.3g} % (mode "
                    f"{int(np.argmax(error)) + 1}, more than {100 * AGREEMENT:g} %): raise reduction.fixed_interface_modes."
                )
        return found

    def _pairs(self) -> tuple[tuple[str, FloatArray, FloatArray], ...]:
        return ("free", self.free_full, self.free_reduced), (
            "stuck",
            self.stuck_full,
            self.stuck_reduced,
        )


def _errors(full: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return relative errors of frequencies; zero for the modes of a body that nothing holds, as a damper without friction."""
    moves = full > RIGID * full.max()
    return np.where(moves, reduced / np.where(moves, full, 1.0) - 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class ReducedBlades:
    """The reduced blades and all that results say of the full ones.

    Parameters
    ----------
    structure
        Reduced mass, damping and stiffness with the sets ``contact``, ``force``, ``output``.
    frequencies
        Comparison with the full model.
    surface_point, surface_triangle
        (p, 3) points in m and (k, 3) triangles of the skin.
    n_nodes
        Nodes of the mesh.
    """

    structure: Structure
    frequencies: Frequencies
    surface_point: FloatArray
    surface_triangle: IntArray
    n_nodes: int

    def packed(self) -> dict[str, Any]:
        """Return everything as named arrays."""
        s = self.structure
        found = {"mass": s.mass, "damping": s.damping, "stiffness": s.stiffness}
        found |= {
            "node": s.dofs.node,
            "component": np.array(s.dofs.component),
            "position": s.dofs.position,
        }
        found |= {f"set.{name}": index for name, index in s.sets.items()}
        found |= {f"hz.{f.name}": getattr(self.frequencies, f.name) for f in fields(Frequencies)}
        found |= {
            name: getattr(self, name) for name in ("surface_point", "surface_triangle", "n_nodes")
        }
        return found

    @classmethod
    def unpacked(cls, values: Mapping[str, Any]) -> Self:
        """Return what `packed` was given."""
        dofs = Dofs(values["node"], tuple(str(c) for c in values["component"]), values["position"])
        sets = {key.removeprefix("set."): v for key, v in values.items() if key.startswith("set.")}
        return cls(
            Structure(values["mass"], values["damping"], values["stiffness"], dofs, sets),
            Frequencies(**{f.name: values[f"hz.{f.name}"] for f in fields(Frequencies)}),
            values["surface_point"],
            values["surface_triangle"],
            values["n_nodes"],
        )


def reduced_blades(
    study: Study, damper: FlatCurvedDamper, journal: Journal | None, say: Callable[[str], None]
) -> ReducedBlades:
    """Return the reduced blades of a study, from the journal if an earlier start has made them.

    Parameters
    ----------
    study
        The study.
    damper
        Its contact points become nodes.
    journal
        Where they are kept, or None.
    say
        Takes a line of progress.

    Raises
    ------
    InputError
        If contacts and blades do not match, or the estimated cost exceeds the study's limits.
    """
    known = None if journal is None else journal.get("blades")
    if known is not None:
        say("reduced blades taken from the earlier start")
        return ReducedBlades.unpacked(known)
    check_limits(study, estimate(study, round(study.tables.blades.nodes())))
    mesh = mesh_blade_pair(study.tables.blades.library(), damper.contact_points())
    cost = estimate(study, len(mesh.points))
    say(str(cost))
    check_limits(study, cost)
    made = _reduce(study, mesh, damper, say)
    if journal is not None:
        for name in MESHES:
            write_mesh(mesh, study.folder / name)
        journal.put("blades", made.packed())
    return made


def _reduce(
    study: Study, mesh: SolidMesh, damper: FlatCurvedDamper, say: Callable[[str], None]
) -> ReducedBlades:
    t = study.tables
    say("assembling mass and stiffness")
    full = assemble_solid(mesh, t.material.library())
    full = rayleigh_damping(
        full, t.damping.ratio, (t.damping.between_hz[0], t.damping.between_hz[1])
    )
    say(f"reducing {full.n} coordinates")
    keep = np.concatenate([full.dof_set(name) for name in KEPT])
    reduced = craig_bampton(full, keep, t.reduction.fixed_interface_modes)
    say(f"comparing natural frequencies of {full.n} and of {reduced.n} coordinates")
    checked = Frequencies(
        *(natural_frequencies(s, MODES) for s in (full, reduced)),
        *(natural_frequencies(_stuck(t, s, damper), MODES) for s in (full, reduced)),
    )
    for line in checked.lines():
        say(line)
    # only the corners of the skin: what a picture needs
    corners, triangles = np.unique(mesh.surface, return_inverse=True)
    return ReducedBlades(
        structure=replace(reduced, basis=None),
        frequencies=checked,
        surface_point=mesh.points[corners],
        surface_triangle=triangles.reshape(-1, 3).astype(np.int64),
        n_nodes=len(mesh.points),
    )


def _stuck(tables: StudyTables, blades: Structure, damper: FlatCurvedDamper) -> Structure:
    joined, interface = join_damper(tables, blades, damper)
    return with_springs(joined, interface.gap_operator, interface.stuck_stiffness())

"""Stress at the peak of a forced response for other programs: surfaces for ParaView, a table, and fields of nodes."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.axis import Axis
from stickslip.model.fe.material import TENSOR
from stickslip.model.mesh.solid_mesh import mesh_writer
from stickslip.study.exchange.motion import Motion
from stickslip.study.store.atomic_write import whole_file
from stickslip.study.store.netcdf import one_case

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")
# variables of the result by the names of fields, Pa but for the last three
FIELDS = {
    "alternating_pa": "alternating_stress",
    "mean_pa": "mean_stress",
    "allowed_pa": "allowed_stress",
    "utilisation": "utilisation",
    "mesh_error": "stress_mesh_error",
    "left_out_modes": "stress_correction",
}


@dataclass(frozen=True, eq=False)
class SurfaceFields:
    """Stress of the surface nodes of meshed parts.

    Parameters
    ----------
    part, at
        (k,) names of the parts, and of what makes the stress singular: free, contact, joint, support, load.
    sector, node
        (k,) sectors from 0, and node numbers of the files.
    points
        (k, 3) m.
    triangles
        (f, 3) places.
    static
        (k, 6) static stress xx, yy, zz, xy, yz, xz along the global axes, Pa.
    values
        Names of `FIELDS` and (k,) values.
    """

    part: Sequence[str]
    at: Sequence[str]
    sector: IntArray
    node: IntArray
    points: FloatArray
    triangles: IntArray
    static: FloatArray
    values: dict[str, FloatArray]

    def turned(self, axis: Axis, pitch: float, sectors: int) -> "SurfaceFields":
        """Return the fields of all sectors of a wheel, on which the vibration is the same but for its phase."""
        if sectors == 1:
            return self
        each, k = range(sectors), len(self.points)
        turns = [axis.rotation(pitch * n) for n in each]
        tensors = [turn @ self.static[:, TENSOR] @ turn.T for turn in turns]
        rows, columns = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])
        return replace(
            self,
            part=[*self.part] * sectors,
            at=[*self.at] * sectors,
            sector=np.repeat(each, k),
            node=np.tile(self.node, sectors),
            points=np.vstack([axis.turned(self.points, pitch * n) for n in each]),
            triangles=np.vstack([self.triangles + n * k for n in each]),
            static=np.vstack([own[:, rows, columns] for own in tensors]),
            values={name: np.tile(own, sectors) for name, own in self.values.items()},
        )


def stress_fields(data: xr.Dataset, case: int) -> SurfaceFields | None:
    """Return the stress of a case of a forced response, of one sector; None if the result has none of it."""
    if "static_stress" not in data:
        return None
    own = one_case(data, case)
    there = np.isfinite(own["alternating_stress"].values)
    if not there.any():
        return None
    place = np.cumsum(there) - 1
    codes = str(own["stress_at"].attrs["flag_meanings"]).split()
    return SurfaceFields(
        part=[str(name) for name in own["stress_part"].values[there]],
        at=[codes[k] for k in own["stress_at"].values[there]],
        sector=np.zeros(np.count_nonzero(there), dtype=np.int64),
        node=own["stress_node"].values[there],
        points=own["stress_point"].values[there],
        triangles=place[data["stress_triangle"].values[data["stress_face_case"].values == case]],
        static=own["static_stress"].values[there],
        values={name: own[variable].values[there] for name, variable in FIELDS.items()},
    )


def write_stress_vtu(fields: SurfaceFields, path: Path) -> Path:
    """Write the surfaces with their stress for ParaView."""
    parts = list(dict.fromkeys(fields.part))
    numbers = {
        "part": np.array([parts.index(name) for name in fields.part]),
        "singular": np.array([kind != "free" for kind in fields.at], dtype=np.int64),
        "sector": fields.sector,
        "node": fields.node,
    }
    # ParaView orders the components of a symmetric tensor in the same way
    own = {"static_stress_pa": fields.static, **fields.values, **numbers}
    meshio = mesh_writer()
    mesh = meshio.Mesh(fields.points, [("triangle", fields.triangles)], point_data=own)
    with whole_file(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
    return path


def write_stress_csv(fields: SurfaceFields, path: Path) -> Path:
    """Write one row for each surface node."""
    head = ["part", "node", "sector", "x_m", "y_m", "z_m", "singular_at", *fields.values]
    columns = [fields.part, fields.node, fields.sector, *fields.points.T, fields.at, *fields.values.values()]
    head += [f"static_{name}_pa" for name in COMPONENTS]
    columns += [*fields.static.T]
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(zip(*(_plain(own) for own in columns), strict=True))
    return path


def _plain(column: Sequence[str] | FloatArray | IntArray) -> list[object]:
    return list(column.tolist() if isinstance(column, np.ndarray) else column)


def at_nodes(fields: SurfaceFields, motion: Motion, numbers: Sequence[IntArray]) -> tuple[IntArray, IntArray]:
    """Return the places (m,) whose nodes a file of a motion has, and the numbers (m,) of these nodes in it.

    Parameters
    ----------
    fields
        Stress of the same sectors.
    motion
        The motion in the file.
    numbers
        For each of its bodies the node numbers in the file.
    """
    known = {
        (body.nodes.part, body.sector, int(own)): int(new)
        for body, each in zip(motion.bodies, numbers, strict=True)
        for own, new in zip(body.nodes.numbers, each, strict=True)
    }
    keys = zip(fields.part, fields.sector.tolist(), fields.node.tolist(), strict=True)
    # a node between materials stands once for each of them: the one of the larger utilisation is written
    found: dict[int, int] = {}
    used = np.nan_to_num(fields.values["utilisation"], nan=np.inf)
    for place, key in enumerate(keys):
        number = known.get(key)
        if number is not None and (number not in found or used[place] > used[found[number]]):
            found[number] = place
    order = sorted(found)
    return np.array([found[n] for n in order], dtype=np.int64), np.array(order, dtype=np.int64)

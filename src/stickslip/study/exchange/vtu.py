"""Fields of nodes and contact points for ParaView: one ``.vtu`` for each instant, a ``.pvd`` with their times, and one file with the harmonics."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.model.mesh.solid_mesh import by_kind, cell_blocks, mesh_writer
from stickslip.study.exchange.chosen import as_complex
from stickslip.study.exchange.motion import Motion
from stickslip.study.store.atomic_write import whole_file, write_whole

SLIP = 1  # code of slip in `peak_state`


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """The contact points of one sector, over one period.

    Parameters
    ----------
    position
        (p, 3) positions, m.
    frame
        (p, 3, 3) columns t, w, n.
    area
        (p,) m²; NaN for points without facets.
    gap, force
        (p, 3, s) along t, w, n, in m and N.
    state
        (p, 2, s) stick 0, slip 1, open 2 for t and w; None away from the peak, where results hold no states.
    energy
        (p,) dissipated in a cycle, J.
    static_force
        (p, 3) under the static loads alone, N.
    """

    position: FloatArray
    frame: FloatArray
    area: FloatArray
    gap: FloatArray
    force: FloatArray
    state: IntArray | None
    energy: FloatArray
    static_force: FloatArray

    def at(self, share: float) -> dict[str, FloatArray]:
        """Return the fields at a fraction of the period, (p,) or (p, 3); vectors along the global axes."""
        gap, force = (_between(signal, share) for signal in (self.gap, self.force))
        tangential = np.array([1.0, 1.0, 0.0])
        found = {
            "gap_m": gap[:, 2],
            "sliding_m": np.einsum("pxd,pd->px", self.frame, gap * tangential),
            "force_n": np.einsum("pxd,pd->px", self.frame, force),
            "normal_force_n": -force[:, 2],
            "friction_force_n": np.hypot(force[:, 0], force[:, 1]),
            "pressure_pa": -force[:, 2] / self.area,
            "static_pressure_pa": -self.static_force[:, 2] / self.area,
            "energy_j": self.energy,
        }
        if self.state is not None:
            samples = self.state.shape[-1]
            now = self.state[:, :, int(share % 1.0 * samples + 1e-9) % samples]
            found["state"] = now.max(axis=1).astype(float)
            found["slip_distance_m"] = self.slip_distance
        return found

    @property
    def slip_distance(self) -> FloatArray:
        """(p,) path in m that the surfaces slide over each other in a period while the point slips."""
        assert self.state is not None
        steps = np.roll(self.gap[:, :2], -1, axis=-1) - self.gap[:, :2]
        return np.asarray(np.sqrt(((steps * (self.state == SLIP)) ** 2).sum(axis=1)).sum(axis=-1))


def contacts_of(data: xr.Dataset, motion: Motion, case: int, point: int) -> tuple[ContactMotion, ...]:
    """Return the motion of the contacts at a point of a response, one entry a sector; none for contacts without positions."""
    position, frame, area = (_of_case(data, f"contact_{name}", case) for name in ("position", "frame", "area"))
    placed = np.isfinite(position).all(axis=1)
    if not placed.any():
        return ()
    at_peak = point == int(data["peak_point"].values[case])
    if at_peak:
        gap, force = (_of_case(data, f"peak_{name}", case) for name in ("gap", "force"))
        state = _of_case(data, "peak_state", case).astype(np.int64)
    else:
        samples = data.sizes["sample"]
        gap, force = (_signal(as_complex(data[name].values[point]), samples) for name in ("gap", "contact_force"))
        state = None
    found = []
    for n in range(1 if motion.lag is None else motion.sectors):  # else points are those of all
        ahead, angle = n * (motion.lag or 0.0), n * motion.pitch
        turn = motion.axis.rotation(angle)
        found.append(
            ContactMotion(
                position=motion.axis.turned(position, angle)[placed],
                frame=(turn @ frame)[placed],
                area=area[placed],
                gap=_ahead(gap, ahead)[placed],
                force=_ahead(force, ahead)[placed],
                state=None if state is None else _ahead(state, ahead)[placed],
                energy=data["dissipated_energy"].values[point][placed],
                static_force=_of_case(data, "static_force", case)[placed],
            )
        )
    return tuple(found)


def _of_case(data: xr.Dataset, name: str, case: int) -> FloatArray:
    own = data[name]
    return np.asarray((own.isel(case=case) if "case" in own.dims else own).values)


def _signal(coefficients: ComplexArray, samples: int) -> FloatArray:
    """Return (p, 3, samples) values of harmonics (H+1, p, 3) over a period."""
    h = np.arange(len(coefficients))
    waves = np.exp(2j * np.pi * np.outer(h, np.arange(samples)) / samples)
    return np.asarray(np.einsum("hpd,hs->pds", coefficients, waves).real)


def _ahead(signal: Matrix, share: float) -> Matrix:
    """Return a signal (..., s) shifted forward by a fraction of the period; linear between samples, states from the sample before."""
    samples = signal.shape[-1]
    whole, rest = divmod(share % 1.0 * samples, 1.0)
    first = np.roll(signal, -int(whole), axis=-1)
    if signal.dtype.kind == "i" or rest < 1e-9:
        return first
    return np.asarray((1 - rest) * first + rest * np.roll(first, -1, axis=-1))


def _between(signal: FloatArray, share: float) -> FloatArray:
    return np.asarray(_ahead(signal, share)[..., 0])


Cells = list[tuple[str, IntArray]]


def write_vtu(motion: Motion, contacts: Sequence[ContactMotion], folder: Path, steps: int) -> tuple[Path, ...]:
    """Write the motion of all nodes and contact points over one period; return the files.

    Parameters
    ----------
    motion, contacts
        The motion at one point of a response.
    folder
        An existing folder.
    steps
        Number of instants in the period.
    """
    points = np.vstack([body.nodes.points for body in motion.bodies])
    cells, numbers = _cells(motion)
    still = {
        "part": _each(motion, [b.nodes.part for b in motion.bodies]),
        "sector": _each(motion, [b.sector for b in motion.bodies]),
        "node": np.concatenate([body.nodes.numbers for body in motion.bodies]),
    }
    mean = np.vstack([body.mean for body in motion.bodies])
    shares = np.arange(steps) / steps
    files, times = [], shares / motion.hz
    for k, share in enumerate(shares):
        moved = np.vstack([body.at(2 * np.pi * share) for body in motion.bodies])
        fields = {"displacement_m": mean + moved, "vibration_m": moved, **still}
        files.append(folder / f"motion_{k:03d}.vtu")
        _write(files[-1], points, cells, fields, numbers)
    written = [_collection(folder / "motion.pvd", files, times)]
    written.append(folder / "harmonics.vtu")
    _write(written[-1], points, cells, still | _harmonics(motion, mean), numbers)
    if contacts:
        own = []
        position = np.vstack([c.position for c in contacts])
        vertices = [("vertex", np.arange(len(position))[:, None])]
        for k, share in enumerate(shares):
            each = [c.at(float(share)) for c in contacts]
            fields = {name: np.concatenate([one[name] for one in each]) for name in each[0]}
            own.append(folder / f"contacts_{k:03d}.vtu")
            _write(own[-1], position, vertices, fields, {})
        written.append(_collection(folder / "contacts.pvd", own, times))
        files += own
    return (*written, *files)


def _harmonics(motion: Motion, mean: FloatArray) -> dict[str, FloatArray]:
    """Return the complex amplitude of each harmonic, its absolute value, and the mean displacement."""
    found = {"mean_m": mean}
    for h in (h for h in motion.harmonics if h > 0):
        own = np.vstack([body.amplitudes[h] for body in motion.bodies])
        found |= {
            f"harmonic_{h}_real_m": own.real,
            f"harmonic_{h}_imag_m": own.imag,
            f"harmonic_{h}_size_m": np.linalg.norm(own, axis=1),
        }
    return found


def _each(motion: Motion, values: Sequence[Any]) -> IntArray:
    """Return for each node the value of its body as a number; texts are numbered in the order of occurrence."""
    known = {value: k for k, value in enumerate(dict.fromkeys(values))}
    own = [known[v] if isinstance(v, str) else int(v) for v in values]
    return np.repeat(own, [len(b.nodes.points) for b in motion.bodies])


def _cells(motion: Motion) -> tuple[Cells, dict[str, list[IntArray]]]:
    cells: Cells = []
    numbers: list[IntArray] = []
    first = 0
    for body in motion.bodies:
        own, count = body.nodes, len(body.nodes.points)
        if own.cells is None or own.cell_numbers is None:
            cells.append(("vertex", np.arange(count)[:, None] + first))
            numbers.append(own.numbers)
        else:
            for (name, nodes), (_, rows) in zip(cell_blocks(own.cells), by_kind(own.cells), strict=True):
                cells.append((name, nodes + first))
                numbers.append(own.cell_numbers[rows])
        first += count
    return cells, {"element": numbers}


def _write(
    path: Path, points: FloatArray, cells: Cells, fields: Mapping[str, Any], numbers: Mapping[str, list[IntArray]]
) -> None:
    meshio = mesh_writer()
    data = meshio.Mesh(points, cells, point_data=dict(fields), cell_data=dict(numbers))
    with whole_file(path) as temporary:
        meshio.write(temporary, data, file_format="vtu")


def _collection(path: Path, files: Sequence[Path], times: FloatArray) -> Path:
    """Write the collection file with names and times for ParaView; return its path."""
    rows = "".join(
        f'    <DataSet timestep="{time:.17g}" part="0" file="{file.name}"/>\n'
        for file, time in zip(files, times, strict=True)
    )
    text = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{rows}  </Collection>\n</VTKFile>\n'
    write_whole(path, text.encode())
    return path

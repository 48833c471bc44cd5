"""Contacts over a period as fields: gaps, forces, pressures, states, slip."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.study.exchange.chosen import as_complex
from stickslip.study.exchange.motion import Motion

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

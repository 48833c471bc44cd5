"""The assembled model, the input of solvers and results."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.system import System

CHECKED = 5  # number of natural frequencies that must agree
AGREEMENT = 1e-3  # largest relative error
RIGID = 1e-4  # share of the highest frequency below which a frequency is rounding


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Table of the contact points for results.

    Parameters
    ----------
    names
        Names of the points: ``contact.point``, or the point's own name if the surface has names.
    groups
        Name of the contact of each point.
    laws
        Name of the law of each point.
    position
        (p, 3) in m; NaN for contacts of single dofs.
    frame
        (p, 3, 3) columns t, w, n.
    area
        (p,) in m²; NaN without facets.
    """

    names: tuple[str, ...]
    groups: tuple[str, ...]
    laws: tuple[str, ...]
    position: FloatArray
    frame: FloatArray
    area: FloatArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Outer surface of the parts, for pictures.

    Parameters
    ----------
    points
        (n, 3) in m.
    triangles
        (k, 3) points of each triangle.
    cut
        (k,) 1 where the triangle lies on a cyclic face, which is inside the wheel.
    """

    points: FloatArray
    triangles: IntArray
    cut: IntArray


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Natural frequencies in Hz of the full and the reduced model, with open and with stuck contacts.

    Open contacts are without free rigid bodies. On a wheel, the frequencies belong to the wave of the lowest driven
    harmonic.
    """

    free_full: FloatArray
    free_reduced: FloatArray
    stuck_full: FloatArray
    stuck_reduced: FloatArray

    def lines(self) -> list[str]:
        """Return the comparison as lines of text."""
        return [
            f"{what} mode {i + 1}: full {full:.4f} Hz, reduced {reduced:.4f} Hz, {100 * error:+.5f} %"
            for what, fulls, reduceds in self._pairs()
            for i, (full, reduced, error) in enumerate(zip(fulls, reduceds, _errors(fulls, reduceds), strict=True))
        ]

    def warnings(self, up_to_hz: float = np.inf) -> list[str]:
        """Return a warning for each set of modes, up to a frequency in Hz, that the reduction does not reproduce."""
        found = []
        for what, full, reduced in self._pairs():
            error = np.abs(_errors(full, reduced))[:CHECKED][full[:CHECKED] <= up_to_hz]
            if np.any(error > AGREEMENT):
                found.append(
                    f"the reduced model misses a {what} natural frequency by {100 * error.max():.3g} % (mode "
                    f"{int(np.argmax(error)) + 1}, more than {100 * AGREEMENT:g} %): keep more modes in [reduction]."
                )
        return found

    def _pairs(self) -> tuple[tuple[str, FloatArray, FloatArray], ...]:
        free = "free", self.free_full, self.free_reduced
        return free, ("stuck", self.stuck_full, self.stuck_reduced)


def _errors(full: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return relative errors of frequencies; zero for rigid-body modes, as of a damper without friction."""
    moves = full > RIGID * full.max(initial=0.0)
    return np.where(moves, reduced / np.where(moves, full, 1.0) - 1.0, 0.0)


FIRST = np.zeros(1, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Blades:
    """Outputs of a wheel with all its sectors.

    Parameters
    ----------
    sectors
        Number of sectors. Outputs and contact points are ordered sector by sector.
    labels
        Labels of the outputs of one sector.
    tuned
        The tuned wheel: all sectors are alike, and one sector is solved.
    deviations
        Name -> (n_s,) deviation of each sector, relative; of gaps in m.
    """

    sectors: int
    labels: tuple[str, ...]
    tuned: "Assembled"
    deviations: Mapping[str, FloatArray]

    def same_in_all(self, output: int) -> IntArray:
        """Return the positions of an output of one sector in all sectors."""
        own = len(self.labels)
        return np.asarray(output % own + own * np.arange(self.sectors))


@dataclass(frozen=True, eq=False)
class Assembled:
    """Reduced model with paired contacts under its static load. It contains only arrays and can be pickled.

    Parameters
    ----------
    system, bare
        Systems with and without the retention springs.
    load
        Forces on the coordinates of the system, N.
    contacts
        Table of the contact points, in the order of the interface.
    output_labels
        Labels of `System.outputs`.
    peak_output
        Position of the output whose peak is resolved.
    error_labels
        Labels of `System.alert_dofs`.
    retention
        Stiffness of the retention springs, N/m.
    excitation
        Amplitude by which responses are divided: the largest harmonic force, N; NaN for none.
    static_gap, static_force
        (p, 3) gaps (m) and contact forces (N) under the static loads alone.
    frequencies
        Natural frequencies of the full and the reduced model.
    skin
        Outer surface for pictures; None if no part has a mesh.
    sectors, engine_order
        Number of sectors and engine order of the wheel; 1 and None for a single structure. For several engine orders,
        their base m_0.
    counts
        Numbers of ``nodes``, ``dofs``, ``reduced`` and ``retained`` coordinates.
    warnings
        Warnings for the user.
    blades
        Outputs of all sectors of a mistuned wheel; None if one sector represents all.
    orders
        Engine order of each harmonic that loads drive; empty for a single structure.
    """

    system: System
    bare: System
    load: HarmonicLoad
    contacts: ContactTable
    output_labels: tuple[str, ...]
    peak_output: int
    error_labels: tuple[str, ...]
    retention: float
    excitation: float
    static_gap: FloatArray
    static_force: FloatArray
    frequencies: Frequencies
    skin: Skin | None
    sectors: int
    engine_order: int | None
    counts: dict[str, int]
    warnings: tuple[str, ...] = ()
    blades: Blades | None = None
    orders: Mapping[int, int] = field(default_factory=dict)

    @property
    def peak_of(self) -> IntArray:
        """Positions of the outputs whose largest amplitude is the peak."""
        own = self.system.peak_of
        return FIRST + self.peak_output if own is None else own

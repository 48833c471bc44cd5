"""Dynamic stiffness where every temporal harmonic has matrices of its own, complex and unsymmetric ones: the waves of a wheel.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, section 3 and appendices 1, 2 and 5.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import (
    Condensed,
    condense,
)
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.fourier import to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness, LinearSide
from stickslip.harmonic.matrices import checked_matrix, is_real_symmetric
from stickslip.harmonic.spectral import Blocks
from stickslip.harmonic.support import Harmonics, real_rows
from stickslip.model.structure import Structure

Stack = ComplexArray  # (H+1, rows, columns)


@dataclass(frozen=True, eq=False)
class TravellingStiffness:
    """The waves of a wheel and its load, seen from the retained coordinates; `condense_waves` makes one.

    The interior is solved at each frequency: reduced waves have few interior coordinates. The mean of a real motion feels the real
    part of the matrices.
    """

    structures: tuple[Structure, ...]  # of harmonics 0, 1, ...
    retained: IntArray
    interior: IntArray
    load: HarmonicLoad

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    @property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass of the first harmonic on the retained coordinates; for scales."""
        k, c, m, _ = (part[min(1, len(part) - 1)] for part in self._matrices)
        own = np.ix_(self.retained, self.retained)
        return np.abs(k[own]), np.abs(c[own]), np.abs(m[own])

    def with_load(self, load: HarmonicLoad) -> "TravellingStiffness":
        """Return the same waves under another load."""
        return replace(self, load=load)

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        D, G = self._dynamic(omega, order)
        f = self.load.coefficients(order)
        near, far = self.retained, self.interior
        d_ll, d_ln = _block(D, far, far), _block(D, far, near)
        right = np.concatenate([d_ln, f[:, far, None]], axis=2)
        solved = np.linalg.solve(d_ll, right)
        x, x_load = solved[:, :, :-1], solved[:, :, -1:]
        y = np.linalg.solve(d_ll.transpose(0, 2, 1), _block(D, near, far).transpose(0, 2, 1))
        y = y.transpose(0, 2, 1)
        across = _block(G, near, far) - y @ _block(G, far, far)
        stiffness = _block(D, near, near) - _block(D, near, far) @ x
        derivative = _block(G, near, near) - y @ _block(G, far, near) - across @ x
        load = f[:, near] - (_block(D, near, far) @ x_load)[:, :, 0]
        return Condensed(stiffness, derivative, load, -(across @ x_load)[:, :, 0])

    def products(self, omega: float, harmonics: Harmonics) -> "CondensedWaves":
        """Return the same by its products, at `omega` (rad/s) and for the `harmonics` of a support."""
        return CondensedWaves(self, omega, harmonics, self.condensed(omega, harmonics[-1]))

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        return self._spread(omega, q, self.load.coefficients(q.shape[0] - 1))

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        all_dofs = self.retained.size + self.interior.size
        return self._spread(omega, dq, np.zeros((dq.shape[0], all_dofs), dtype=complex))

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) matrix that makes of a change of the retained coordinates in one harmonic that of `dofs` (k,)."""
        D = self._dynamic(omega, harmonic)[0][harmonic]
        near, far = self.retained, self.interior
        spread = np.zeros((near.size + far.size, near.size), dtype=complex)
        spread[near] = np.eye(near.size)
        spread[far] = -np.linalg.solve(D[np.ix_(far, far)], D[np.ix_(far, near)])
        return spread[dofs]

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of a sector in each harmonic, mean over the period, J."""
        x = self.recover(omega, q)
        bent = self._matrices[0][: len(x)] @ x[:, :, None]
        twice = np.sum(x.conj() * bent[:, :, 0], axis=1).real
        return np.asarray((0.25 + 0.25 * (np.arange(len(x)) == 0)) * twice)

    def _spread(self, omega: float, q: ComplexArray, f: ComplexArray) -> ComplexArray:
        D, _ = self._dynamic(omega, q.shape[0] - 1)
        near, far = self.retained, self.interior
        right = f[:, far, None] - _block(D, far, near) @ q[:, :, None]
        out = np.empty(f.shape, dtype=complex)
        out[:, near] = q
        out[:, far] = np.linalg.solve(_block(D, far, far), right)[:, :, 0]
        return out

    def _dynamic(self, omega: float, order: int) -> tuple[Stack, Stack]:
        """Return D of harmonics 0..`order` and its derivative by ω."""
        if order >= len(self.structures):
            raise input_error(
                "TravellingStiffness",
                f"has waves for harmonics up to {len(self.structures) - 1}, asked for {order}",
                "Give tuned_wheel as many harmonics as the sweep's `high`.",
            )
        k, c, m, loss = (part[: order + 1] for part in self._matrices)
        h = np.arange(order + 1)[:, None, None]
        s = h * omega
        D = k + 1j * s * c - s**2 * m + 1j * (s > 0) * loss
        return D, h * (1j * c - 2 * s * m)

    @cached_property
    def _matrices(self) -> tuple[Stack, Stack, Stack, Stack]:
        """Stiffness, damping, mass and loss of all harmonics."""

        def stacked(name: str) -> Stack:
            known = {id(s): _checked(s, name) for s in self.structures}
            stack = np.array([known[id(s)] for s in self.structures])
            stack[0] = stack[0].real
            return stack

        return stacked("stiffness"), stacked("damping"), stacked("mass"), stacked("loss")


@dataclass(frozen=True, eq=False)
class CondensedWaves:
    """The condensed matrices of the waves at one frequency, by their products."""

    linear: TravellingStiffness
    omega: float
    harmonics: Harmonics
    waves: Condensed

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.linear.n

    @property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        return real_rows(self.waves.load, self.harmonics)

    @property
    def load_slope(self) -> FloatArray:
        """(m, n) its derivative by ω."""
        return real_rows(self.waves.load_derivative, self.harmonics)

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, CondensedWaves)
            and self.omega == other.omega
            and self.harmonics == other.harmonics
            and self.linear.structures is other.linear.structures
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return _times(self._own(self.waves.stiffness), rows)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z, which is that of the conjugate transpose."""
        return _times(self._own(self.waves.stiffness).conj().transpose(0, 2, 1), rows)

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        return self.product(rows), _times(self._own(self.waves.derivative), rows)

    def block(self, harmonic: int) -> ComplexArray:
        """Return ``Z_h``, (n, n) complex in Fortran order, to be changed at will."""
        return np.array(self.waves.stiffness[harmonic], order="F")

    def _own(self, stack: Stack) -> Stack:
        return np.asarray(stack[list(self.harmonics)])


def condense_side(
    side: LinearSide, retained: IntArray, load: HarmonicLoad, order: int
) -> DynamicStiffness:
    """Prepare the exact condensation of what vibrates, for harmonics up to `order`.

    By `condense`, whose frequencies cost few products, where all harmonics vibrate as one real symmetric structure; by
    `condense_waves` otherwise.
    """
    structures = tuple(side.of_harmonic(h) for h in range(order + 1))
    one = structures[0]
    if all(s is one for s in structures) and is_real_symmetric(one):
        return condense(one, retained, load)
    return condense_waves(structures, retained, load)


def condense_waves(
    structures: tuple[Structure, ...], retained: IntArray, load: HarmonicLoad
) -> TravellingStiffness:
    """Prepare the exact condensation of the waves of a tuned wheel.

    Parameters
    ----------
    structures
        The wave of each harmonic 0, 1, ...; the retained dofs mean the same in all.
    retained
        Dof indices that stay unknown.
    load
        Load on all dofs, each harmonic in the coordinates of its wave, N.

    Raises
    ------
    InputError
        If sizes differ, or the load has more harmonics than there are waves.
    """
    n = structures[0].n
    if load.static.size != n or any(s.n != n for s in structures):
        sizes = sorted({s.n for s in structures})
        raise input_error(
            "condense_waves",
            f"a load of {load.static.size} entries for waves of {sizes} dofs",
            "Give the load in the coordinates of the waves (TunedWheel.project).",
        )
    top = max((h for h, f in load.harmonics.items() if np.any(f)), default=0)
    if top >= len(structures):
        raise input_error(
            "HarmonicLoad",
            f"excites harmonic {top}, and there are waves up to {len(structures) - 1}",
            "Give tuned_wheel more harmonics.",
        )
    retained = np.asarray(retained, dtype=np.int64)
    return TravellingStiffness(structures, retained, np.setdiff1d(np.arange(n), retained), load)


def _times(stack: Stack, rows: FloatArray) -> FloatArray:
    """Return the rows of the products of a matrix a harmonic."""
    return to_real((stack @ to_complex(rows)[:, :, None])[:, :, 0])


def _block(stack: Stack, rows: IntArray, columns: IntArray) -> Stack:
    return np.asarray(stack[:, rows[:, None], columns])


def _checked(structure: Structure, name: str) -> FloatArray | ComplexArray:
    if getattr(structure, name) is None:
        return np.zeros((structure.n, structure.n))
    return checked_matrix(structure, name)

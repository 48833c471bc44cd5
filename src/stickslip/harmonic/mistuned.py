"""Dynamic stiffness of a mistuned wheel from the waves of the tuned one.

Each frequency costs one sector times the number of waves. The interior of the tuned wheel is solved wave by wave.
Deviations act on a few combinations ``y = P u`` of each sector's motion (its shares), with forces ``z = Δ y``. The
shares follow from ``(1 + A Δ) y = y_0``, where A is the receptance of the tuned wheel between shares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics, to_complex, to_real
from stickslip.harmonic.spectral import Blocks
from stickslip.reduction.mistuned import MistunedWheel, circulant

KEPT_BYTES = 2e8  # of cached condensed waves
MIN_KEPT_WAVES = 8  # smallest number of cached frequencies times harmonics


def by_sectors(wheel: MistunedWheel, retained: IntArray) -> bool:
    """Whether retained coordinates are the same in all sectors, and springs to the ground act only on them."""
    count, size = wheel.sectors, wheel.n // wheel.sectors
    if retained.size % count:
        return False
    own = retained.reshape(count, -1) - size * np.arange(count)[:, None]
    alike = bool(np.all(own == own[0]) and np.all(own >= 0) and np.all(own < size))
    return alike and bool(np.isin(wheel.springs.nonzero()[0], retained).all())


@dataclass(frozen=True, eq=False)
class MistunedStiffness:
    """A mistuned wheel and its load, condensed to the retained coordinates; build it with `condense_mistuned`."""

    wheel: MistunedWheel
    retained: IntArray
    load: HarmonicLoad
    rate: float = 0.0  # 1/s, of mass-proportional damping in addition to the wheel's own
    known: dict[float, "At"] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    @cached_property
    def near(self) -> IntArray:
        """Retained coordinates of a sector."""
        return self.retained[: self.n // self.wheel.sectors]

    @cached_property
    def far(self) -> IntArray:
        """Condensed coordinates of a sector."""
        return np.setdiff1d(np.arange(self.wheel.n // self.wheel.sectors), self.near)

    @cached_property
    def interior(self) -> IntArray:
        """Dof indices that are condensed."""
        return np.setdiff1d(np.arange(self.wheel.n), self.retained)

    @cached_property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass on the retained coordinates, for scaling."""
        s, own = self.wheel.structure, np.ix_(self.retained, self.retained)
        return s.stiffness[own], s.damping[own], s.mass[own]

    @property
    def most(self) -> None:
        """Highest available harmonic; None: any."""

    def load_at(self, _omega: float) -> HarmonicLoad:
        """Return the load, N, which is the same at all frequencies."""
        return self.load

    def with_load(self, load: HarmonicLoad) -> "MistunedStiffness":
        """Return the same wheel under another load."""
        return replace(self, load=load)

    def with_mass_damping(self, rate: float) -> "MistunedStiffness":
        """Return the same wheel with `rate` (1/s) times its mass added to its damping; the rate may be negative."""
        return replace(self, rate=self.rate + rate, known={})

    def at(self, s: float) -> "At":
        """Return the wheel at ``s = hω`` in rad/s; the last results are cached."""
        if s not in self.known:
            most = max(MIN_KEPT_WAVES, int(KEPT_BYTES / (6 * self.wheel.waves[0].nbytes)))
            for old in [one for one in self.known if one][: max(len(self.known) - most, 0)]:
                del self.known[old]
            self.known[s] = At.of(self, s)
        return self.known[s]

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        waves, h = [self.at(i * omega) for i in range(order + 1)], np.arange(order + 1)
        slopes = np.array([one.slope(np.eye(self.n, dtype=complex)) for one in waves])
        loads, load_slopes = self.loads(omega, range(order + 1))
        stiffness = np.array([one.stiffness for one in waves])
        return Condensed(stiffness, h[:, None, None] * slopes, loads, h[:, None] * load_slopes)

    def loads(self, omega: float, harmonics: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Return the condensed loads (k, n) of some harmonics and their derivatives by hω."""
        f = self.load.coefficients(harmonics[-1])
        found = [self.at(h * omega).load(f[h, self.retained], f[h, self.interior]) for h in harmonics]
        return np.array([load for load, _ in found]), np.array([slope for _, slope in found])

    def products(self, omega: float, harmonics: Harmonics) -> "CondensedSectors":
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        return CondensedSectors(self, omega, harmonics)

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        return self._spread(omega, q, self.load.coefficients(q.shape[0] - 1))

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        return self._spread(omega, dq, np.zeros((dq.shape[0], self.wheel.n), dtype=complex))

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        spread = np.zeros((self.wheel.n, self.n), dtype=complex)
        spread[self.retained] = eye = np.eye(self.n, dtype=complex)
        none = np.zeros((self.interior.size, self.n), dtype=complex)
        spread[self.interior] = self.at(harmonic * omega).inside(eye, none)
        return spread[dofs]

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the wheel in each harmonic, mean over the period, J."""
        stiffness = self.wheel.structure.stiffness
        twice = [np.vdot(x, stiffness @ x).real for x in self.recover(omega, q)]
        return np.asarray((0.25 + 0.25 * (np.arange(len(twice)) == 0)) * twice)

    def _spread(self, omega: float, q: ComplexArray, f: ComplexArray) -> ComplexArray:
        out = np.empty(f.shape, dtype=complex)
        out[:, self.retained] = q
        for h in range(len(q)):
            out[h, self.interior] = self.at(h * omega).inside(q[h], f[h, self.interior])
        return out


@dataclass(frozen=True, eq=False)
class At:
    """A mistuned wheel condensed at one frequency; derivatives are by ``s = hω``.

    Arrays by wave (n_s, ·, ·): blocks `nn`, `nl`, `ln` of the dynamic stiffness, `inverse` of its interior block,
    `slopes` of nn, nl, ln and ll, and the parts `near` and `far` of the shares that come from retained and interior
    motion.
    """

    linear: MistunedStiffness
    s: float
    nn: ComplexArray
    nl: ComplexArray
    ln: ComplexArray
    inverse: ComplexArray
    slopes: tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]
    near: ComplexArray
    far: ComplexArray

    @classmethod
    def of(cls, linear: MistunedStiffness, s: float) -> "At":
        """Solve the interior of all waves at one frequency."""
        wheel, a, b = linear.wheel, linear.near, linear.far
        k, c, m, loss = wheel.waves
        c = c + linear.rate * m if linear.rate else c
        D = k + 1j * (s * c + (s > 0.0) * loss) - s**2 * m
        G = 1j * c - 2.0 * s * m
        cut = [(slice(None), x[:, None], y) for x in (a, b) for y in (a, b)]
        nn, nl, ln, ll = (np.asarray(D[one], dtype=complex) for one in cut)
        slopes = tuple(np.asarray(G[one], dtype=complex) for one in cut)
        inverse = np.linalg.inv(ll) if b.size else ll
        shares = wheel.shares.astype(complex)
        return cls(linear, s, nn, nl, ln, inverse, slopes, shares[:, :, a], shares[:, :, b])  # type: ignore[arg-type]

    @cached_property
    def _follows(self) -> ComplexArray:
        return self.inverse @ self.ln

    @cached_property
    def _tuned(self) -> ComplexArray:
        """(n_s, n, n) stiffness of the waves of the tuned wheel."""
        return np.asarray(self.nn - self.nl @ self._follows)

    @cached_property
    def _seen(self) -> ComplexArray:
        """(n_s, r, n) shares by wave, caused by motion of the retained coordinates."""
        return np.asarray(self.near - self.far @ self._follows)

    @cached_property
    def _felt(self) -> ComplexArray:
        """(n_s, n, r) forces on the retained coordinates, caused by forces on the shares."""
        back = self.far.conj().transpose(0, 2, 1)
        return np.asarray(self.near.conj().transpose(0, 2, 1) - self.nl @ (self.inverse @ back))

    @cached_property
    def _reaction(self) -> ComplexArray:
        """(k, k) matrix of the forces ``z = reaction @ y_0`` of the active deviations on the shares."""
        sector, share = self.linear.wheel.active
        delta = self.linear.wheel.factors[sector, share]
        receptance = np.fft.ifft(self.far @ self.inverse @ self.far.conj().transpose(0, 2, 1), axis=0)
        behind = (sector[:, None] - sector) % self.linear.wheel.sectors
        A = receptance[behind, share[:, None], share]
        return np.asarray(np.linalg.solve(np.eye(delta.size) + delta[:, None] * A, np.diag(delta)))

    def _deviate(self, shares: ComplexArray, reaction: ComplexArray | None = None) -> ComplexArray:
        """Return the (n_s, r, k) forces of the deviations by wave, from the shares (n_s, r, k) of the tuned wheel."""
        sector, share = self.linear.wheel.active
        y = np.fft.ifft(shares, axis=0, norm="ortho")
        z = np.zeros_like(y)
        by = self._reaction if reaction is None else reaction
        z[sector, share] = by @ y[sector, share]
        return np.asarray(np.fft.fft(z, axis=0, norm="ortho"))

    def times(self, q: ComplexArray) -> ComplexArray:
        """Return the stiffness times `q` (n,) or (n, k)."""
        waves = self._to_waves(q)
        out = self._tuned @ waves
        if self.linear.wheel.active[0].size:
            out += self._felt @ self._deviate(self._seen @ waves)
        found = self._to_sectors(out, q)
        return found if self._springs is None else np.asarray(found + self._springs @ q)

    def adjoint_times(self, q: ComplexArray) -> ComplexArray:
        """Return the conjugate transpose of the stiffness times `q` (n,)."""
        waves = self._to_waves(q)
        out = self._tuned.conj().transpose(0, 2, 1) @ waves
        if self.linear.wheel.active[0].size:
            felt, seen = (part.conj().transpose(0, 2, 1) for part in (self._felt, self._seen))
            out += seen @ self._deviate(felt @ waves, self._reaction.conj().T)
        found = self._to_sectors(out, q)
        return found if self._springs is None else np.asarray(found + self._springs.T @ q)

    @property
    def stiffness(self) -> ComplexArray:
        """(n, n), N/m; assembled at first use, because it is large."""
        out = circulant(np.fft.ifft(self._tuned, axis=0))
        if self.linear.wheel.active[0].size:
            out += self._deviation()
        return out if self._springs is None else np.asarray(out + self._springs)

    def _deviation(self) -> ComplexArray:
        """Return the (n, n) stiffness of the deviations, whose blocks between waves have low rank."""
        sector, share = self.linear.wheel.active
        count, r = self.linear.wheel.sectors, self.far.shape[1]
        reaction = np.zeros((count, r, count, r), dtype=complex)
        reaction[sector[:, None], share[:, None], sector, share] = self._reaction
        waves = np.fft.ifft(np.fft.fft(reaction, axis=0, norm="ortho"), axis=2, norm="ortho")
        blocks = self._felt[:, None] @ waves.transpose(0, 2, 1, 3) @ self._seen
        sectors = np.fft.fft(np.fft.ifft(blocks, axis=0, norm="ortho"), axis=1, norm="ortho")
        n = count * self.near.shape[2]
        return np.asarray(sectors.transpose(0, 2, 1, 3).reshape(n, n))

    @cached_property
    def _springs(self) -> Matrix | None:
        springs, own = self.linear.wheel.springs, self.linear.retained
        return springs[own][:, own] if springs.nnz else None

    def slope(self, q: ComplexArray) -> ComplexArray:
        """Return the derivative of the stiffness times `q` (n,) or (n, k)."""
        inner = self._inner(self._to_waves(q), None)
        near, far = self._changed(self._to_waves(q), inner)
        return self._to_sectors(self._condensed(near, far), q)

    def load(self, near: ComplexArray, far: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the (n,) condensed load, N, and its derivative, from loads on retained dofs (n,) and interior (l,)."""
        inside = self._to_waves(far)
        outside = self._to_waves(near)
        found = self._condensed(outside, inside)
        none = np.zeros_like(outside)
        slope = -self._condensed(*self._changed(none, self._inner(none, inside)))
        return self._to_sectors(found, near), self._to_sectors(slope, near)

    def inside(self, q: ComplexArray, far: ComplexArray) -> ComplexArray:
        """Return the (l,) displacements of the interior from the retained ones `q` (n,) and the load (l,) on it."""
        return self._to_sectors(self._inner(self._to_waves(q), self._to_waves(far)), far)

    def _inner(self, q: ComplexArray, far: ComplexArray | None) -> ComplexArray:
        """Return the interior's motion by wave number under motion of the retained coordinates and loads."""
        right = -(self.ln @ q) if far is None else far - self.ln @ q
        alone = self.inverse @ right
        if not self.linear.wheel.active[0].size:
            return np.asarray(alone)
        z = self._deviate(self.near @ q + self.far @ alone)
        return np.asarray(alone - self.inverse @ (self.far.conj().transpose(0, 2, 1) @ z))

    def _condensed(self, near: ComplexArray, far: ComplexArray) -> ComplexArray:
        """Return loads by wave number, condensed to the retained coordinates."""
        alone = self.inverse @ far
        out = near - self.nl @ alone
        if self.linear.wheel.active[0].size:
            out = out - self._felt @ self._deviate(self.far @ alone)
        return np.asarray(out)

    def _changed(self, q: ComplexArray, x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        nn, nl, ln, ll = self.slopes
        return nn @ q + nl @ x, ln @ q + ll @ x

    def _to_waves(self, rows: ComplexArray) -> ComplexArray:
        """Return (n_s m,) or (n_s m, k) of all sectors as (n_s, m, k) by wave number."""
        count = self.linear.wheel.sectors
        columns = 1 if rows.ndim == 1 else rows.shape[1]
        each = np.asarray(rows, dtype=complex).reshape(count, len(rows) // count, columns)
        return np.asarray(np.fft.fft(each, axis=0, norm="ortho"))

    def _to_sectors(self, waves: ComplexArray, like: ComplexArray) -> ComplexArray:
        found = np.fft.ifft(waves, axis=0, norm="ortho").reshape(like.shape)
        return np.asarray(found if self.s else found.real + 0j)


@dataclass(frozen=True, eq=False)
class CondensedSectors:
    """The condensed matrices of a mistuned wheel at one frequency, as products with vectors."""

    linear: MistunedStiffness
    omega: float
    harmonics: Harmonics

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.linear.n

    @cached_property
    def _at(self) -> list[At]:
        return [self.linear.at(h * self.omega) for h in self.harmonics]

    @cached_property
    def _loads(self) -> tuple[ComplexArray, ComplexArray]:
        return self.linear.loads(self.omega, self.harmonics)

    @cached_property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        return to_real(self._loads[0])

    @cached_property
    def load_slope(self) -> FloatArray:
        """(m, n) derivative of the load by ω."""
        return to_real(np.array(self.harmonics)[:, None] * self._loads[1])

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, CondensedSectors)
            and self.omega == other.omega
            and self.harmonics == other.harmonics
            and self.linear.wheel is other.linear.wheel
            and self.linear.rate == other.linear.rate
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        pairs = zip(self._at, to_complex(rows), strict=True)
        return to_real(np.array([one.times(q) for one, q in pairs]))

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z, which is the real form of Zᴴ."""
        pairs = zip(self._at, to_complex(rows), strict=True)
        return to_real(np.array([one.adjoint_times(q) for one, q in pairs]))

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        slope = [one.slope(q) for one, q in zip(self._at, to_complex(rows), strict=True)]
        return self.product(rows), to_real(np.array(self.harmonics)[:, None] * np.array(slope))

    def block(self, harmonic: int) -> ComplexArray:
        """Return a copy of ``Z_h``, (n, n) complex in Fortran order."""
        return np.array(self.linear.at(harmonic * self.omega).stiffness, order="F")


def condense_mistuned(wheel: MistunedWheel, retained: IntArray, load: HarmonicLoad) -> MistunedStiffness:
    """Prepare the exact condensation of a mistuned wheel to coordinates that are the same in all sectors (`by_sectors`)."""
    if load.static.size != wheel.n:
        raise input_error(
            "condense_mistuned",
            f"a load of {load.static.size} entries for {wheel.n} coordinates",
            "Give the load of all sectors.",
        )
    return MistunedStiffness(wheel, np.asarray(retained, dtype=np.int64), load)

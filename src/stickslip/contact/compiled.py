"""Contact laws as arrays, the input of the evaluators, and the names of the evaluators."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.element import element
from stickslip.contact.law import UNCOUPLED_TANGENTS, ContactLaw, PiecewiseLinear, PlanarFriction
from stickslip.errors import check_choice, input_error

Evaluator = Literal["intervals", "march", "events"]


def check_evaluator(evaluator: str) -> None:
    """Refuse an unknown evaluator."""
    check_choice("evaluator", evaluator, get_args(Evaluator), "'events' has no sampling error.")


@dataclass(frozen=True, eq=False)
class MarchedLaws:
    """Contacts of one law class, evaluated together by marching."""

    contacts: IntArray
    kernel: Any
    parameters: FloatArray  # (n, n_parameters)
    start: FloatArray  # (n, n_state)


@dataclass(frozen=True, eq=False)
class CompiledContacts:
    """The laws of all contacts, grouped by evaluator.

    Attributes
    ----------
    evaluator
        Evaluator of piecewise-linear laws: ``intervals`` (on samples), ``events`` (exact), or ``march``. All other laws
        except planar friction are marched.
    n_contacts
        Number of contacts.
    pairs
        Number of derivative blocks of a contact: 5, 7 or 9.
    weights
        (n_contacts,) factors of the forces; None: ones.
    piecewise
        Indices of contacts that are sums of elementary contacts.
    elements, first
        (n_elements, 7) and (len(piecewise) + 1,): elements of these contacts, see `contact_period`.
    planar, planar_elements
        Indices of contacts with isotropic planar friction, and their (len(planar), 7) rows.
    marched
        All other contacts.
    sliders
        (n_contacts, 3) gaps, m, at which the springs of contacts that are not marched are unstretched before t = 0,
        zero along the normal; None: zeros.
    """

    evaluator: Evaluator
    n_contacts: int
    pairs: int
    weights: FloatArray | None
    piecewise: IntArray
    elements: FloatArray
    first: IntArray
    planar: IntArray
    planar_elements: FloatArray
    marched: tuple[MarchedLaws, ...]
    sliders: FloatArray | None = None

    @property
    def needs_samples(self) -> bool:
        """Whether forces depend on the number of samples."""
        return bool(self.marched) or (self.evaluator != "events" and self.piecewise.size > 0)

    @property
    def keeps_events(self) -> bool:
        """Whether an evaluation without samples returns the events of all contacts."""
        return self.evaluator == "events" and not self.marched and not self.planar.size

    def from_sliders(self, gap_coefficients: FloatArray) -> FloatArray:
        """Return the (2H+1, 3 n_contacts) coefficients of the gaps relative to the initial slider positions.

        Evaluators start with sliders at zero.
        """
        if self.sliders is None:
            return gap_coefficients
        moved = gap_coefficients.copy()
        moved[0] -= self.sliders.reshape(-1)
        return moved


def checked_weights(weights: FloatArray, n: int) -> FloatArray:
    """Return the factors of `n` contacts as an array, or raise `InputError`."""
    factors = np.asarray(weights, dtype=float)
    if factors.shape != (n,) or not np.all(np.isfinite(factors) & (factors > 0)):
        raise input_error(
            "weights",
            f"must be {n} positive numbers, got {factors.size} from {factors.min(initial=np.inf):g} on",
            "Give the area of each contact point, or None.",
        )
    return factors


def compile_contacts(
    laws: Sequence[ContactLaw], weights: FloatArray | None = None, evaluator: Evaluator = "intervals"
) -> CompiledContacts:
    """Group `laws` by evaluator and write their parameters into arrays.

    Parameters
    ----------
    laws
        One law per contact.
    weights
        (n_contacts,) factors of the forces; None: ones.
    evaluator
        ``intervals`` or ``events`` for piecewise-linear laws, ``march`` for all. With the first two, planar friction is
        evaluated at events, and all other laws are marched.

    Raises
    ------
    InputError
        If the evaluator is unknown, or the weights are not one positive number per contact.
    """
    check_evaluator(evaluator)
    if weights is not None:
        weights = checked_weights(weights, len(laws))
    march_all = evaluator == "march"
    rows: list[FloatArray] = []
    piecewise: list[int] = []
    planar: dict[int, FloatArray] = {}
    others: dict[tuple[Any, int, int], list[int]] = {}
    for index, law in enumerate(laws):
        if isinstance(law, PiecewiseLinear) and not march_all:
            piecewise.append(index)
            rows.append(law.elements())
        elif not march_all and (row := _planar_row(law)) is not None:
            planar[index] = row
        else:
            kind = (law.kernel, law.parameters().size, law.initial_state().size)
            others.setdefault(kind, []).append(index)
    return CompiledContacts(
        evaluator,
        len(laws),
        max((law.pairs for law in laws), default=UNCOUPLED_TANGENTS),
        weights,
        np.array(piecewise, dtype=np.int64),
        np.concatenate(rows) if rows else np.zeros((0, 7)),
        np.cumsum([0, *(len(r) for r in rows)], dtype=np.int64),
        np.array(list(planar), dtype=np.int64),
        np.array(list(planar.values())).reshape(-1, 7),
        tuple(_marched(laws, np.array(indices), kind[0]) for kind, indices in others.items()),
        _sliders(laws, [*piecewise, *planar]),
    )


def _sliders(laws: Sequence[ContactLaw], evaluated: Sequence[int]) -> FloatArray | None:
    """Return the initial slider positions of contacts that are not marched; marched contacts start from their state."""
    given = {c: at for c in evaluated if (at := getattr(laws[c], "slider", None)) is not None}
    if not given:
        return None
    out = np.zeros((len(laws), 3))
    for c, at in given.items():
        out[c, :2] = at
    return out


def _planar_row(law: ContactLaw) -> FloatArray | None:
    """Return the row of an elementary contact for a law whose friction is isotropic in the plane."""
    values = law.planar() if isinstance(law, PlanarFriction) else None
    if values is None:
        return None
    k, k_n, mu, preload = values
    return element(k_t=k, k_w=k, k_n=k_n, mu=mu, preload=preload)


def _marched(laws: Sequence[ContactLaw], contacts: IntArray, kernel: Any) -> MarchedLaws:
    return MarchedLaws(
        contacts,
        kernel,
        np.array([laws[c].parameters() for c in contacts], dtype=float),
        np.array([laws[c].initial_state() for c in contacts], dtype=float).reshape(contacts.size, -1),
    )

"""Estimated cost of the linear systems: with full matrices, and with products.

The coefficients are seconds of one core, measured by the rows ``krylov/crossover`` of `evidence.benchmarks`. Where they are off by a common
factor, as on a slower machine, nothing changes: they are compared with each other.
"""

from stickslip.arrays import IntArray
from stickslip.harmonic.matrix_products import MAX_SMALL_BLOCK
from stickslip.operators import Costs

# an array: a call, each entry, each entry times the unknowns
ARRAY_CALL, ARRAY_ENTRY, ARRAY_FACTOR = 2e-5, 4.3e-9, 1.6e-11
# a product: a call, each derivative of the contacts, each unknown
PRODUCT_CALL, PRODUCT_CONTACT, PRODUCT_UNKNOWN = 9e-5, 2e-9, 1.4e-8
# what a product takes of each entry of a harmonic's matrix, all harmonics in one compiled loop; or of each harmonic and each entry, one by one
LOOP_ENTRY = 5e-10
CALL, CALL_ENTRY = 6e-5, 1.6e-9
# new factors of a harmonic: a call, each entry, each entry times the coordinates; with inverses (no entries on their own), or without
INVERSE_CALL, INVERSE_FACTOR = 1.3e-4, 1.25e-9
FACTORS_CALL, FACTORS_ENTRY, FACTORS_FACTOR = 8e-5, 3e-8, 5e-11
# one real factor for all harmonics: each coordinate, for the low modes, each entry, each entry times the coordinates
SHARED_COORDINATE, SHARED_ENTRY, SHARED_FACTOR = 8e-6, 4e-8, 1.6e-11
# sparse matrices: what a product and new factors take of each entry of the stiffness, and of each harmonic
SPARSE_PRODUCT, SPARSE_FACTORS = 2e-8, 3e-6
# what rests: a call, each harmonic, each entry of its matrix, each entry times the coordinates; entries of matrices that nothing else needs
RESTING_CALL, RESTING_HARMONIC, RESTING_ENTRY, RESTING_FACTOR = 1.4e-4, 4e-5, 1.5e-8, 6e-11
FORMED_ENTRY = 1.4e-8


def linear_costs(coordinates: int, harmonics: int, derivatives: int, sparse: int = 0, *, shared: bool = False) -> Costs:
    """Estimate the costs of one system.

    Parameters
    ----------
    coordinates
        Retained coordinates.
    harmonics
        Number of harmonics, including the static one.
    derivatives
        Number of entries of the derivatives of all contact forces.
    sparse
        Number of entries of the sparse stiffness, if nothing is condensed and one factor serves all harmonics; 0: arrays.
    shared
        Whether one real factor serves all harmonics of condensed matrices.
    """
    entries = coordinates**2
    unknowns = coordinates * (2 * harmonics - 1)
    if sparse:
        one, factors = CALL + SPARSE_PRODUCT * sparse, SPARSE_FACTORS * sparse / harmonics
    elif coordinates <= MAX_SMALL_BLOCK:
        one, factors = (LOOP_ENTRY * entries, INVERSE_CALL + INVERSE_FACTOR * coordinates * entries)
    else:
        one, factors = (
            CALL + CALL_ENTRY * entries,
            FACTORS_CALL + (FACTORS_ENTRY + FACTORS_FACTOR * coordinates) * entries,
        )
    own = PRODUCT_CALL + PRODUCT_CONTACT * derivatives + PRODUCT_UNKNOWN * unknowns
    new = harmonics * factors
    if shared:
        new = SHARED_COORDINATE * coordinates
        new += (SHARED_ENTRY + SHARED_FACTOR * coordinates) * entries
    return Costs(own + harmonics * one, new, _array(unknowns))


def _array(unknowns: int) -> float:
    return ARRAY_CALL + (ARRAY_ENTRY + ARRAY_FACTOR * unknowns) * unknowns**2


def products_pay(costs: Costs) -> bool:
    """Whether a Jacobian is worth keeping by its products; the solver decides for each Jacobian."""
    return costs.products_pay


def reduced_cost(coordinates: int, kept: IntArray, *, known: bool) -> float:
    """Estimate the seconds of a system that is solved as an array after elimination of the unknowns of stuck contacts.

    Parameters
    ----------
    coordinates
        Retained coordinates.
    kept
        (H+1,) number of coordinates of each harmonic that are not eliminated.
    known
        Whether the same unknowns were eliminated at this frequency before.
    """
    own = RESTING_CALL + _array(int(2 * kept.sum() - kept[0]))
    if known:
        return own
    entry = RESTING_ENTRY + RESTING_FACTOR * coordinates
    if coordinates > MAX_SMALL_BLOCK:
        entry += FORMED_ENTRY
    return own + kept.size * (RESTING_HARMONIC + entry * coordinates**2)

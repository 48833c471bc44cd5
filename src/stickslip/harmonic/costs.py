"""Estimated cost of the linear systems, with full matrices and with products.

The coefficients are seconds on one core, measured by the rows ``krylov/crossover`` of `evidence.benchmarks`. A common
factor, as on a slower machine, does not matter, because costs are only compared with each other.
"""

from stickslip.arrays import IntArray
from stickslip.harmonic.matrix_products import MAX_SMALL_BLOCK
from stickslip.operators import Costs

# full array: per call, per entry, per entry and unknown
ARRAY_CALL, ARRAY_ENTRY, ARRAY_FACTOR = 2e-5, 4.3e-9, 1.6e-11
# product: per call, per derivative of the contacts, per unknown
PRODUCT_CALL, PRODUCT_CONTACT, PRODUCT_UNKNOWN = 9e-5, 2e-9, 1.4e-8
# product with the matrices of the harmonics: per entry in one compiled loop; or per harmonic and per entry, one by one
LOOP_ENTRY = 5e-10
CALL, CALL_ENTRY = 6e-5, 1.6e-9
# factors of one harmonic: per call, per entry, per entry and coordinate; for inverses (no term per entry), and for LU
INVERSE_CALL, INVERSE_FACTOR = 1.3e-4, 1.25e-9
FACTORS_CALL, FACTORS_ENTRY, FACTORS_FACTOR = 8e-5, 3e-8, 5e-11
# one real factor for all harmonics: per coordinate (low modes), per entry, per entry and coordinate
SHARED_COORDINATE, SHARED_ENTRY, SHARED_FACTOR = 8e-6, 4e-8, 1.6e-11
# sparse matrices: product and factors, per entry of the stiffness and per harmonic
SPARSE_PRODUCT, SPARSE_FACTORS = 2e-8, 3e-6
# elimination of stuck contacts: per call, per harmonic, per entry, per entry and coordinate; per entry of matrices
# formed only for it
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
    """Whether the Jacobian should be kept as products; the solver decides again for each Jacobian."""
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

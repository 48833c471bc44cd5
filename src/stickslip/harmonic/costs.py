"""What the linear systems of a periodic problem cost as arrays and by products, from what can be counted.

The coefficients are seconds of one core, measured by the rows ``krylov/crossover`` of `evidence.benchmarks`. Where they are off by a common
factor, as on a slower machine, nothing changes: they are compared with each other.
"""

from stickslip.harmonic.small_blocks import SMALL
from stickslip.operators import Costs

# an array: a call, each entry, each entry times the unknowns
ARRAY_CALL, ARRAY_ENTRY, ARRAY_FACTOR = 2e-4, 5e-9, 1.6e-11
# a product: a call, each derivative of the contacts, each unknown
PRODUCT_CALL, PRODUCT_CONTACT, PRODUCT_UNKNOWN = 5e-5, 6e-10, 1.4e-8
# what a product takes of each harmonic, and of each entry of its matrix; all harmonics in one compiled loop, or one by one
LOOP, LOOP_ENTRY = 0.0, 5e-10
CALL, CALL_ENTRY = 6e-5, 1.6e-9
# new factors of a harmonic: a call, each entry, each entry times the coordinates; with inverses, or without
INVERSE_CALL, INVERSE_ENTRY, INVERSE_FACTOR = 8e-5, 0.0, 1.4e-9
FACTORS_CALL, FACTORS_ENTRY, FACTORS_FACTOR = 8e-5, 3e-8, 5e-11
# sparse matrices: what a product and new factors take of each entry of the stiffness, and of each harmonic
SPARSE_PRODUCT, SPARSE_FACTORS = 2e-8, 3e-6
# a Newton iteration: its systems by LU, those by a Krylov method, which leaves a hundredth of the residual, and the products of one of these
BY_ARRAY, BY_PRODUCTS, PRODUCTS = 4, 6, 8


def linear_costs(coordinates: int, harmonics: int, derivatives: int, sparse: int = 0) -> Costs:
    """Estimate the costs of one system.

    Parameters
    ----------
    coordinates
        Retained coordinates.
    harmonics
        Their number, the static one counted.
    derivatives
        Numbers that the derivatives of all contact forces consist of.
    sparse
        Entries of the sparse stiffness, where nothing is condensed and one factor serves all harmonics; 0: arrays.
    """
    entries = coordinates**2
    unknowns = coordinates * (2 * harmonics - 1)
    if sparse:
        one, factors = CALL + SPARSE_PRODUCT * sparse, SPARSE_FACTORS * sparse / harmonics
    elif coordinates <= SMALL:
        one, factors = (
            LOOP + LOOP_ENTRY * entries,
            INVERSE_CALL + (INVERSE_ENTRY + INVERSE_FACTOR * coordinates) * entries,
        )
    else:
        one, factors = (
            CALL + CALL_ENTRY * entries,
            FACTORS_CALL + (FACTORS_ENTRY + FACTORS_FACTOR * coordinates) * entries,
        )
    own = PRODUCT_CALL + PRODUCT_CONTACT * derivatives + PRODUCT_UNKNOWN * unknowns
    array = ARRAY_CALL + (ARRAY_ENTRY + ARRAY_FACTOR * unknowns) * unknowns**2
    return Costs(own + harmonics * one, harmonics * factors, array)


def products_pay(costs: Costs) -> bool:
    """Whether a Newton iteration costs less by products than by arrays, where few contacts slip; where it does not, the solver changes over."""
    return costs.factors + BY_PRODUCTS * PRODUCTS * costs.product < BY_ARRAY * costs.array

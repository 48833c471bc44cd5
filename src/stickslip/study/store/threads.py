"""Number of BLAS threads, set before NumPy is imported."""

import os

from stickslip.model.blas_threads import BLAS_THREADS


def one_blas_thread() -> None:
    """Set BLAS to one thread before NumPy is loaded, unless the user has set a number.

    The matrices of a run have a few hundred rows. Several threads wait for each other, and take ten times as long if other programs
    use the cores.
    """
    if not any(name in os.environ for name in BLAS_THREADS):
        for name in BLAS_THREADS[1:]:
            os.environ[name] = "1"

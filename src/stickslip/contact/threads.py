"""Number of threads for the contacts of a period."""

import numba

CONTACTS_WORTH_THREADS = 300
_SHARES_PER_THREAD = 4  # more shares than threads: contacts that slip and open take longer than stuck ones


def thread_shares(n_contacts: int) -> int:
    """Return the number of shares of the contacts.

    It is 1 for few contacts, or for one thread (``NUMBA_NUM_THREADS=1``).
    """
    if n_contacts < CONTACTS_WORTH_THREADS:
        return 1
    threads = numba.get_num_threads()
    return 1 if threads == 1 else _SHARES_PER_THREAD * threads

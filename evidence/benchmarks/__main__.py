"""Run every benchmark and write ``evidence/benchmarks/out/results.json``.

A benchmark is a module ``evidence/benchmarks/bench_*.py`` with a function ``run()`` that returns a list of records:
``name`` like ``forced/newton_over_lapack``, the ``value`` measured, the ``goal`` as a text with its unit (``"<= 2"``),
whether it ``holds``, and a ``note`` on what was measured how. A goal that is missed stays in the list and is no failure.

    python -m evidence.benchmarks            # all
    python -m evidence.benchmarks forced     # only modules whose name contains the word; nothing is written
"""

from evidence.suite import Suite

COLUMNS = {key: key for key in ("name", "value", "goal", "holds", "note")}
SUITE = Suite("evidence.benchmarks", "bench_", "Benchmarks", COLUMNS)

if __name__ == "__main__":
    SUITE.main()

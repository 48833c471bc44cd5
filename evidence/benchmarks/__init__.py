"""Speed, measured. Each ``bench_*.py`` has ``run() -> list[dict]``; ``python -m evidence.benchmarks`` runs them all."""

"""Speed, measured. Each ``bench_*.py`` has ``run() -> list[dict]``; ``python -m benchmarks`` runs them all."""

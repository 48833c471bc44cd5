"""Comparisons with closed forms, other codes and the literature.

Each ``case_*.py`` has ``run() -> list[dict]``; ``python -m evidence.validation`` runs them all.
"""

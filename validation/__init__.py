"""Comparisons with closed forms, other codes and the literature.

Each ``case_*.py`` has ``run() -> list[dict]``; ``python -m validation`` runs them all.
"""

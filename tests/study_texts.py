"""Studies of one mass as text, to which a test adds the table of its analysis, and what a text answers."""

from pathlib import Path

from stickslip.study.models.study import Study, read_study
from stickslip.study.outcome import Outcome
from stickslip.study.run import run_study

# of literature benchmarks B3 and B13, with their dashpot, slip limit and force
JENKINS = """
schema_version = 2
[part.blade]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 1.0]]
dashpots_n_s_per_m = [["ground", 1, 0.02]]
[contact.damper]
between = ["blade.m1", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 0.5
slip_limit_n = 0.1
[load.shaker]
on = "blade.m1"
force_n = 0.1
"""
# softening, then hardening: a detached curve above the resonance, in closed form in test_all_motions.py
DETACHED = """
schema_version = 2
[part.blade]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 1.0]]
dashpots_n_s_per_m = [["ground", 1, 0.05]]
[contact.spring]
between = ["blade.m1", "ground"]
law = "polynomial_spring"
along_t = [0.0, 0.0, -2.0, 0.0, 1.0]
[load.shaker]
on = "blade.m1"
force_n = 0.02
"""


def study_of(text: str, folder: Path) -> Study:
    """Return the study of a text, written as ``study.toml`` into a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return read_study(path)


def answered(text: str, folder: Path, checks: frozenset[str] = frozenset()) -> Outcome:
    """Return what the study of a text answers."""
    return run_study(study_of(text, folder), checks=checks)

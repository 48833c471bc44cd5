"""Pages, terminals, tables and comparisons say and draw of stored results what they did: any other word, number or line is looked at.

The results are of runs of small studies, one for each analysis, with the variables that analyses write.
"""

from pathlib import Path

import pytest
from held_pages import differences, every, held, now

from stickslip.study.questions import ANALYSES

ANEW = "Is it meant? Then write it anew: python tests/held_pages.py"


@pytest.mark.parametrize("name", every())
def test_what_is_shown_of_a_result_is_what_it_was(name: str, tmp_path: Path) -> None:
    changed = differences(now(name, tmp_path), held(name))
    assert not changed, "\n".join([f"{len(changed)} changes. {ANEW}", *changed[:20]])


def test_each_analysis_is_shown() -> None:
    heads = {line.split(".")[0] for name in every() for line in held(name)}
    assert set(ANALYSES) <= heads

"""Estimated size and time of ``stickslip check``, before files are read and heavy libraries are imported."""

import math

from stickslip.study.file.study import StudyFile
from stickslip.study.file.tables import Tables
from stickslip.study.models.checks import sectors_of
from stickslip.study.models.cost import SECONDS_A_NODE, SECONDS_A_WAVE, nodes_of_tables


def before_check(file: StudyFile) -> str:
    """Return the line with the size of the parts, estimated from files and element sizes, and their time on one core."""
    case, count = file.cases[0], len(file.cases)
    nodes, waves = nodes_of_tables(case.tables, file.home), _waves(case.tables)
    seconds = max(nodes * (SECONDS_A_NODE + SECONDS_A_WAVE * (waves or 0)), 1.0)
    of_waves = f" (a wheel {nodes * SECONDS_A_WAVE:.2g} s more for each wave)" if waves is None else ""
    cases = f"{count} cases" if count > 1 else "one case"
    return f"checking {cases}: parts of about {_rounded(nodes)} nodes take some {seconds:.0f} s{of_waves}"


def _rounded(nodes: float) -> str:
    """Return a number of nodes with two digits: ``54,000``."""
    size = max(nodes, 1.0)
    return f"{round(size, 1 - math.floor(math.log10(size))):,.0f}"


def _waves(tables: Tables) -> int | None:
    """Return the number of reduced waves of a wheel; 0 for a single structure, None if only a file contains the sectors."""
    asked, sectors = getattr(tables, "forced_response", None), sectors_of(tables)
    if sectors is None or sectors == 1:
        return 0 if sectors else None
    every = asked is not None and (asked.stability != "off" or asked.bifurcations in ("all", "branches"))
    return sectors // 2 + 1 if every else 1

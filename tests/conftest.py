"""Settings of the whole suite.

Property tests are repeatable and have no time limit per example. Tests that need the same compiled functions run in one worker: on a cold
cache two would compile them at the same time.
"""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "repeatable",
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("repeatable")

COMPILED_TOGETHER = {
    "planar": ("coupled_coulomb", "planar", "planar_judge"),
    "time": ("laws_in_time", "sectors", "shooting", "stiff_in_time", "transient", "verify"),
}
GROUP_OF = {f"test_{name}": group for group, names in COMPILED_TOGETHER.items() for name in names}


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Name the group of each test that has one."""
    for item in items:
        group = GROUP_OF.get(Path(item.path).stem)
        if group:
            item.add_marker(pytest.mark.xdist_group(group))

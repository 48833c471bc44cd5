"""Public names that the last release had and the next one has not: they warn, name what does the same, and work."""

import importlib

import pytest
import xarray as xr

import stickslip as ss
from stickslip.contact import neighbours
from stickslip.response import rigid
from stickslip.response.rotating import campbell

GONE_SOON = [
    (ss.response, "rigid_response", rigid, "forced_response solves rigid contacts"),
    (ss.response, "RigidPoint", rigid, "forced_response solves rigid contacts"),
    (ss.response, "cyclic_campbell", campbell, "travelling_wave of each wave number"),
    (ss.contact, "neighbour_interface", neighbours, "next.PART.SURFACE"),
    (ss.contact, "neighbour_gaps", neighbours, "next.PART.SURFACE"),
]


@pytest.mark.parametrize(("package", "name", "module", "instead"), GONE_SOON)
def test_a_deprecated_name_works_and_names_what_does_the_same(package, name, module, instead):
    with pytest.warns(DeprecationWarning, match=instead):
        found = getattr(package, name)
    assert found is getattr(module, name)
    assert name not in package.__all__


@pytest.mark.parametrize("package", ["response", "contact"])
def test_other_names_do_not_warn(package):
    found = importlib.import_module(f"stickslip.{package}")
    assert all(getattr(found, name) is not None for name in found.__all__)
    with pytest.raises(AttributeError, match="no_such_name"):
        found.no_such_name  # noqa: B018


def test_a_result_is_still_opened_by_its_old_verb(tmp_path):
    path = ss.Result(xr.DataTree()).save(tmp_path / "empty.nc")
    with pytest.warns(DeprecationWarning, match=r"Result\.open goes with 0\.3: Result\.from_file"):
        assert ss.Result.open(path).path == ss.Result.from_file(path).path == path

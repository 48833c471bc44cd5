"""Measured peaks as variables of a forced response."""

from typing import Any

import xarray as xr

from stickslip.study.models.measured import MeasuredPeaks, Quantity
from stickslip.study.store.netcdf import variable

DIM = "measured"


def with_measured(data: xr.Dataset, found: MeasuredPeaks | None) -> xr.Dataset:
    """Return the dataset of a forced response with what was measured, along the dimension ``measured``."""
    if found is None:
        return data
    variables: dict[str, Any] = {
        "measured_value": variable(DIM, found.values, "1", f"value of {found.key} in the test"),
        "measured_others": variable(
            DIM, list(found.others), "1", "values of other varied keys in the test; empty where not told"
        ),
        "measured_excitation_n": variable(
            DIM, found.excitation, "N", "amplitude of the force that measured amplitudes belong to"
        ),
        **_of("measured_amplitude", found.amplitude, "peak amplitude"),
        **_of("measured_frequency_hz", found.frequency, "peak frequency"),
    }
    own = {"measured_key": found.key, "measured_file": found.file, "measured_source": found.source}
    return data.assign(variables).assign_attrs(own)


def _of(name: str, found: Quantity, about: str) -> dict[str, Any]:
    """Return the variables of a quantity and of its error bars; none where it was not measured."""
    if not found.unit:
        return {}
    own = {name: variable(DIM, found.values, found.unit, f"measured {about}")}
    if found.bar:
        long_name = f"{found.bar} of the measured {about}"
        own[f"{name}_error"] = variable(DIM, found.errors, found.unit, long_name)
        own[f"{name}_error"].attrs["error"] = found.bar
    return own

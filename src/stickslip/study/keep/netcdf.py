"""Labelled variables, and files of them that are always whole."""

from pathlib import Path

import numpy as np
import xarray as xr

from stickslip.errors import input_error


def write_tree(tree: xr.DataTree, path: Path) -> None:
    """Write netCDF-4 under a temporary name and put it in place, so that `path` is always a whole file.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    temporary = path.with_name(path.name + ".part")
    try:
        tree.to_netcdf(temporary, format="NETCDF4", engine="h5netcdf")
        temporary.replace(path)
    # the HDF5 libraries tell of a full disk by RuntimeError
    except (OSError, RuntimeError) as error:
        raise input_error(
            str(path),
            f"cannot be written ({error})",
            "Make room and run the same command again: no finished point is lost.",
        ) from error


def variable(dims: str, values: object, units: str, long_name: str) -> xr.Variable:
    """Return a variable over the dimensions named in `dims`, separated by spaces."""
    return xr.Variable(
        tuple(dims.split()), np.asarray(values), {"units": units, "long_name": long_name}
    )

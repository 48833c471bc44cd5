"""Draw the README's figure from a run of the example: ``python docs/readme_figure.py RESULT.nc``."""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import xarray as xr

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent


def main(path: Path) -> None:
    """Write docs/images/forced_response.png."""
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        data = tree["forced_response"].to_dataset().load()
    ratios = data.vary_value.values[:, 0]  # of pull to shaker
    output = int(np.flatnonzero(data.output.values == data.attrs["report_output"])[0])
    figure, (response, optimum) = plt.subplots(1, 2, figsize=(10.5, 4.2), width_ratios=(2, 1), layout="constrained")
    colours = mpl.colormaps["plasma"](np.linspace(0.0, 0.85, data.sizes["case"]))
    for case, colour in enumerate(colours):
        part = data.isel(point=np.flatnonzero((data.point_case.values == case) & (data.status.values == 0)))
        branch = part.isel(point=np.argsort(part.frequency_hz.values, kind="stable"))
        force = float(data.excitation_n[case])
        response.plot(
            branch.frequency_hz,
            branch.amplitude[:, output] / force * 1e6,
            "-",
            color=colour,
            lw=1.2,
            label=f"{ratios[case]:g}",
        )
        many = part.isel(point=np.flatnonzero(part.order.values > 1))
        response.plot(many.frequency_hz, many.amplitude[:, output] / force * 1e6, "d", color=colour, ms=3)
    response.plot([], [], "dk", ms=3, label="more than one harmonic")
    response.set(yscale="log", xlabel="frequency, Hz", ylabel="tip amplitude / excitation force, µm/N")
    response.legend(title=r"$F_{CL}/F_{HE}$", fontsize=8, ncols=2)
    response.grid(alpha=0.3)
    optimum.plot(ratios, data.peak_amplitude / data.excitation_n * 1e6, "o-k", ms=4, lw=1)
    optimum.set(xscale="log", yscale="log", xlabel=r"$F_{CL}/F_{HE}$", ylabel="peak, µm/N")
    optimum.grid(alpha=0.3, which="both")
    figure.savefig(HERE / "images" / "forced_response.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

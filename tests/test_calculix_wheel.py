"""The example of a wheel from a CalculiX deck: its frequencies against CalculiX, friction at its platforms, through the command line."""

import shutil
from pathlib import Path

import numpy as np
from small_v2 import EXAMPLES, changed
from test_cli import done

from stickslip.front.result import Result

FEW = {
    "modes.number": "3",
    "modes.nodal_diameters": "[0, 3, 11]",
    "modes.shapes": "false",
    "reduction.fixed_interface_modes": "8",
    "harmonics.high": "1",
    "forced_response.peak_points": "0",
    "vary.load.gas.force_n": "[0.1, 5.0]",
}


def test_the_wheel_of_a_calculix_deck_rubs_at_its_platforms(tmp_path: Path) -> None:
    folder = tmp_path / "wheel"
    shutil.copytree(EXAMPLES / "calculix_wheel", folder)
    text = (folder / "study.toml").read_text()
    text = text.replace(
        "frequency_hz = [1728.0, 1744.0]", "frequencies_hz = [1733.0, 1734.0, 1735.0, 1736.0]"
    )
    (folder / "study.toml").write_text(changed(text, FEW))
    done("run", str(folder / "study.toml"), "--no-report")
    found = Result.open(folder / "results").data
    modes = found["modes"].to_dataset()
    assert np.abs(modes["difference"].values).max() < 3.5e-7  # CalculiX prints seven digits
    forced = found["forced_response"].to_dataset()
    assert np.all(forced["status"] == 0)
    assert forced.attrs["engine_order"] == 13
    normal = forced["static_force"].isel(case=0).sel(direction="n").values
    assert (normal < 0).sum() == 18  # of 27: at speed the rest has opened
    amplitude = forced["amplitude"].values[:, 0].reshape(2, 4) / np.array([[0.1], [5.0]])
    lost = forced["dissipated_energy"].sum("contact").values.reshape(2, 4)
    assert np.all(lost[1] > 1e-4 * lost[1].max())
    # slip takes the resonance down, from above 1735 Hz to 1734 Hz
    assert amplitude[0].argmax() == 3
    assert amplitude[1].argmax() == 1
    assert amplitude[1, 0] > 1.2 * amplitude[0, 0]

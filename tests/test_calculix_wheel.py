"""The example of a wheel from a CalculiX deck: its frequencies against CalculiX, friction at its platforms, through the command line."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from small_v2 import EXAMPLES, changed
from test_cli import done

from stickslip.assembly.assembling import assemble
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.response.recovery import fields
from stickslip.study.models.study import read_study
from stickslip.study.store.netcdf import read_tree

FEW = {
    "modes.number": "3",
    "modes.nodal_diameters": "[0, 3, 11]",
    "modes.shapes": "false",
    "reduction.fixed_interface_modes": "8",
    "vary.load.gas.force_n": "[5.0]",
}
HERTZ = 1733.0, 1734.0, 1735.0, 1736.0


def small(folder: Path) -> Path:
    """Write the example with few waves and modes, under the largest of its loads; return the study."""
    shutil.copytree(EXAMPLES / "calculix_wheel", folder)
    path = folder / "study.toml"
    path.write_text(changed(path.read_text(), FEW))
    return path


def test_the_frequencies_of_a_calculix_deck_are_those_of_calculix(tmp_path: Path) -> None:
    path = small(tmp_path / "wheel")
    done("run", str(path), "--no-report", "--only", "modes")
    modes = read_tree(path.parent / "results" / "result.nc")["modes"].to_dataset()
    assert modes["difference"].size == 9
    assert np.abs(modes["difference"].values).max() < 3.5e-7  # CalculiX prints seven digits


def test_the_wheel_of_a_calculix_deck_rubs_at_its_platforms(tmp_path: Path) -> None:
    found = assemble(read_study(small(tmp_path / "wheel")).model(), 1)
    assert found.engine_order == 13
    assert (found.static_force[:, 2] < 0).sum() == 18  # of 27: at speed the rest has opened
    omega = 2 * np.pi * np.array(HERTZ)
    sweep = Sweep(
        omega_range=(omega[0], omega[-1]), at=tuple(omega), low=1, high=1, selection="always_low", peak_points=0
    )
    tip = found.output_labels.index("tip.y")
    amplitude, lost = [], []
    for newton in (0.1, 5.0):
        force = {h: f * newton / 5.0 for h, f in found.load.harmonics.items()}
        load = replace(found.load, harmonics=force)
        problem = forced_problem(found.system, load, sweep)
        points = accepted_points(list(forced_response(found.system, load, sweep)))
        assert all(point.converged for point in points)
        own = [fields(problem, point) for point in points]
        amplitude.append([abs(one.outputs[1, tip]) / newton for one in own])
        lost.append([one.energy.sum() for one in own])
    assert min(lost[1]) > 1e-4 * max(lost[1]) > 1e-9
    # slip takes the resonance down, from above 1735 Hz to 1734 Hz
    assert np.argmax(amplitude[0]) == 3
    assert np.argmax(amplitude[1]) == 1
    assert amplitude[1][0] > 1.2 * amplitude[0][0]

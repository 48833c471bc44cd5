"""Refusals whose words no other test reads: place, problem and remedy of each."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_v2 import changed, write_four_masses
from synthetic_result import tree_of
from test_clear_answers import LOAD, free_dofs, sweep, system
from test_readers_deck import CUBE, deck_of

import stickslip as ss
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.fluid.pressure import PressureField
from stickslip.contact.laws.iwan import FirstLoading
from stickslip.contact.loop_fit import fit_loops
from stickslip.errors import InputError
from stickslip.harmonic.matrices import real_symmetric
from stickslip.model.matrices import chain, lumped
from stickslip.model.npz import read_npz, write_npz
from stickslip.model.part import BodyPoints
from stickslip.model.structure import Structure
from stickslip.model.structure_file import load_structure, save_structure
from stickslip.reduction import InfluenceCoefficients
from stickslip.response.all_motions.found import MotionSearch
from stickslip.response.forced.response import forced_problem
from stickslip.response.residual_tractions.bounds import traction_bounds
from stickslip.response.rotating.campbell import campbell
from stickslip.response.time.transient import check_outputs
from stickslip.study.models.study import read_study


def coefficients(**more: Any) -> InfluenceCoefficients:
    """Return one blade's own coefficient at one frequency."""
    own = {"distances": [0], "values": np.zeros((1, 1, 1, 1, 1), complex), "frequencies": [1.0]} | more
    return InfluenceCoefficients(**own)


def fluid(**more: Any) -> Aerodynamics:
    return Aerodynamics(**({"influence": coefficients(), "reference": 1.0, "modes": (1,)} | more))


def loop(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.linspace(0.0, 1e-3, force.size), force


def own_places() -> BodyPoints:
    return BodyPoints(("a",), np.zeros((2, 3)), np.zeros((1, 3, 3)))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: lumped(np.eye(2), np.eye(2), names=("a", "a")),
            "lumped: names: need 2 different names, got ['a', 'a']. Name each coordinate.",
        ),
        (
            lambda: FirstLoading(displacement=(1.0, 2.0), force=(1.0,)),
            "FirstLoading: got 2 displacements and 1 forces. Give two corners or more, with finite numbers.",
        ),
        (
            lambda: FirstLoading(displacement=(1.0, np.inf), force=(1.0, 2.0)),
            "FirstLoading: got 2 displacements and 2 forces. Give two corners",
        ),
        (lambda: fit_loops([]), "fit_loops: loops: is empty. Give one recording or more."),
        (
            lambda: fit_loops([loop(np.full(200, 3.0))]),
            "the force is 3 at every sample. Give a loop in which both change.",
        ),
        (
            own_places,
            "BodyPoints: 1 names, positions (2, 3), frames (1, 3, 3). Give (p, 3) positions and (p, 3, 3) frames.",
        ),
        (
            lambda: coefficients(frequencies=[1.0, 2.0]),
            "has shape (1, 1, 1, 1, 1) for (1, 2, 1) speeds, frequencies and distances. Give (speeds,",
        ),
        (
            lambda: coefficients(distances=[1, 1], values=np.zeros((1, 1, 2, 1, 1))),
            "InfluenceCoefficients.distances: has a neighbour twice: [1, 1]. Give each once.",
        ),
        (
            lambda: coefficients(frequencies=[2.0, 1.0], values=np.zeros((1, 2, 1, 1, 1))),
            "InfluenceCoefficients.frequencies: do not ascend from zero on. Sort them.",
        ),
        (
            lambda: coefficients(speeds=[-1.0]),
            "InfluenceCoefficients.speeds: do not ascend from zero on. Sort them.",
        ),
        (lambda: fluid(modes=(1, 2)), "has coefficients between 1 and names 2 modes or points. Give as many."),
        (lambda: fluid(reference=0.0), "Aerodynamics.reference: is 0.0. Give rad/s."),
        (lambda: fluid(largest_displacement=-1.0), "Aerodynamics.largest_displacement: is -1.0. Give metres."),
        (lambda: fluid(modes=(0,)), "Aerodynamics.modes: are (0,). The lowest is 1."),
        (
            lambda: PressureField(np.zeros((3, 3)), np.zeros(4, complex)),
            "pressure: has (3, 3) points for (4,) pressures. Give (n, 3) and (n,), n from 3 on.",
        ),
        (
            lambda: MotionSearch(omega_range=(1.0, 2.0), spread=0.0),
            "MotionSearch.spread: is 0.0. Give a factor above zero.",
        ),
        (
            lambda: MotionSearch(omega_range=(1.0, 2.0), at=(2.5,)),
            "MotionSearch.at: leaves the range 1 to 2 rad/s. Widen omega_range.",
        ),
        (lambda: MotionSearch(omega_range=(1.0, 2.0), modes=0), "MotionSearch.modes: is 0. Give a count from 1 on."),
        (
            lambda: list(traction_bounds(system(), LOAD, [0.0])),
            "omegas: are [0.0]. Give frequencies above zero, rad/s.",
        ),
        (lambda: list(traction_bounds(system(), LOAD, [5.0], 1)), "output: is 1, of 1 outputs. Give 0 to 0."),
        (
            lambda: list(traction_bounds(system(), LOAD, [])),
            "omegas: are []. Give frequencies above zero, rad/s.",
        ),
        (
            lambda: campbell(lambda _: chain(2, 1.0, 1.0), [2.0, 1.0], 1),
            "campbell: speeds: must ascend from 0 or more, got [2.0, 1.0]. Give rad/s.",
        ),
        (
            lambda: check_outputs(np.array([2]), 2, "march"),
            "march: outputs: got [2] for 2 dofs. Give indices from 0 to 1.",
        ),
        (
            lambda: real_symmetric(Structure(np.eye(2), np.eye(2), (1 + 0.1j) * np.eye(2), free_dofs(2)), "stiffness"),
            "Structure.stiffness: is complex. Give structural damping as Structure.loss",
        ),
        (
            lambda: forced_problem(system(), ss.HarmonicLoad(np.zeros(3), {1: np.ones(3)}), sweep()),
            "3 entries for 2 dofs. Give one a dof.",
        ),
        (
            lambda: ss.Result(tree_of(modes=xr.Dataset())).to_dataframe("modes"),
            "to_dataframe('modes'): holds no variables. Look at result.data.",
        ),
    ],
)
def test_arguments_are_refused_by_name_with_the_remedy(make: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError) as told:
        make()
    assert said in str(told.value)


def test_files_of_structures_are_refused_by_path_with_the_remedy(tmp_path: Path) -> None:
    structure = chain(2, 1.0, 1.0)
    with pytest.raises(InputError, match=r"^save_structure: set 'a': holds float64 values\. Give dof indices\.$"):
        save_structure(
            Structure(structure.mass, structure.damping, structure.stiffness, structure.dofs, {"a": np.array([0.0])}),
            tmp_path / "a.npz",
        )
    with pytest.raises(InputError, match=r"a\.mat: unknown file format '\.mat'\. Name it \.npz\.$"):
        write_npz(tmp_path / "a.mat", {})
    (tmp_path / "text.npz").write_text("mass, stiffness")
    with pytest.raises(InputError, match=r"text\.npz: is no \.npz file \(File is not a zip file\)"):
        read_npz(tmp_path / "text.npz")
    save_structure(structure, tmp_path / "b.npz")
    write_npz(tmp_path / "c.npz", read_npz(tmp_path / "b.npz") | {"version": np.array(99)})
    said = r"c\.npz: has version 99 of the format, this program reads \d\. Use the newest stickslip, or write the file"
    with pytest.raises(InputError, match=said):
        load_structure(tmp_path / "c.npz")


TWICE = "[[vary]]\nload.shaker.force_n = [1.0, 2.0]\n[[vary]]\nload.shaker.force_n = [3.0]\n"
MANY = f"[[vary]]\nload.shaker.force_n = {list(range(1, 41))}\n[[vary]]\npart.chain.masses_kg = {[[m] * 4 for m in range(1, 31)]}\n"
LOOSE = (
    "\n[part.body]\nshape = 'rigid_body'\nmass_kg = 1.0\ninertia_kg_m2 = [1.0, 1.0, 1.0]\ncentre_m = [0.0, 0.0, 0.0]\n"
)
FACE = "[part.body.surfaces.face]\npoints_m = [[0.0, 0.0, 0.0]]\n"


@pytest.mark.parametrize(
    ("changes", "more", "said"),
    [
        (
            {"part.chain.springs_n_per_m": '[["ground", 1, 4e4], [1, 2]]'},
            "",
            'must be [end, end, value], got [1, 2]. Ends are "ground", names of masses or their numbers from 1',
        ),
        (
            {"part.chain.names": '["a", "b"]'},
            "",
            "part.chain.names: has 2 names for 4 masses. Name every mass, or leave names out.",
        ),
        ({}, TWICE, "vary.load.shaker.force_n: is varied twice. Give one list."),
        ({}, MANY, "vary: spans 1200 cases, more than 1000. Vary fewer values."),
        (
            {},
            LOOSE + FACE,
            "part.body.surfaces.face.normal: is missing. Give normal for all points alike, or normals, one a point.",
        ),
        (
            {},
            "[mistuning.other]\npart = 'chain'\n",
            "mistuning.other.sector: is missing beside part. Say which sector, and what stands there.",
        ),
        (
            {},
            "[quasi_periodic]\nfrequencies_hz = [9.0, 8.0]\n",
            "quasi_periodic.frequencies_hz: must grow. Sort them, and give each once.",
        ),
        (
            {},
            "[quasi_periodic]\nfrequency_hz = [8.0, 9.0]\nharmonics = 5\nmost_harmonics = 3\n",
            "quasi_periodic.most_harmonics: is less than harmonics. Raise it.",
        ),
    ],
)
def test_keys_are_refused_by_name_with_the_remedy(
    changes: Mapping[str, str], more: str, said: str, tmp_path: Path
) -> None:
    path = write_four_masses(tmp_path)
    path.write_text(changed(path.read_text(encoding="utf-8"), changes) + more, encoding="utf-8")
    with pytest.raises(InputError) as told:
        read_study(path)
    assert said in str(told.value)


def test_a_list_of_frequencies_that_falls_is_refused(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8").replace("frequency_hz = [8.0, 16.0]", "frequencies_hz = [9.0, 8.0]")
    path.write_text(text.replace("points = 10\n", "").replace("peak_points = 2\n", ""), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"forced_response\.frequencies_hz: must grow\. Sort them, and give each once\."
    ):
        read_study(path)


CYCLIC = "*CYCLIC SYMMETRY MODEL, N={}\n0.,0.,0.,0.,0.,1.\n"
SPEED = "*DLOAD\nEALL, CENTRIF, {}0.,0.,0., 0.,0.,1.\n"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "*NSET, NSET=BOTTOM",
            "*ELEMENT, TYPE=C3D8\n1, 8, 7, 6, 5, 4, 3, 2, 1\n*NSET, NSET=BOTTOM",
            "element 1 twice. Give it once.",
        ),
        ("*MATERIAL, NAME=Steel\n", "", "line 25, *ELASTIC: belongs to no *MATERIAL. Put it below its material."),
        ("2.1e11, 0.3\n", "2.1e11\n", "line 27: needs 2 numbers, got 1. Check the line."),
        ("BOTTOM, 1, 3\n", "BOTTOM\n", "line 32: names no direction. Write node, first, last."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 3, 1\n", "line 32: directions 3 to 1. They count from 1 to 3."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 0, 1\n", "line 32: directions 0 to 1. They count from 1 to 3."),
        ("BOTTOM, 1, 3\n", "BOTTOM, 1, 3\n" + SPEED.format("-4., "), "line 34: speed² is -4. It cannot be negative."),
        (
            "BOTTOM, 1, 3\n",
            "BOTTOM, 1, 3\n" + SPEED.format(""),
            "line 34: CENTRIF with 8 fields. Give speed², a point and",
        ),
        ("BOTTOM, 1, 3\n", "BOTTOM, 1, 3\n" + CYCLIC.format(4) + CYCLIC.format(5), "N=5 after N=4. Give one."),
    ],
)
def test_decks_are_refused_by_line_with_the_remedy(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert CUBE.count(old) == 1
    with pytest.raises(InputError) as told:
        deck_of(tmp_path, CUBE.replace(old, new))
    assert said in str(told.value)

"""The example of a blisk with a friction ring against literature benchmark B9, through the command line."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_v2 import EXAMPLES, changed
from test_cli import done

from evidence.validation.case_b9_friction_ring import FREQUENCIES, HARMONICS
from stickslip.api.result import Result

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

EXAMPLE = (EXAMPLES / "friction_ring" / "study.toml").read_text()
SECTORS = 24
DIGITS = 2e-6  # relative: the reference says how many digits it has; its samples and the weak spring are the rest
OPTIMUM, LOWEST = 2.91226, 1.374209e-5  # slip limit in N and peak in m, with one harmonic
EVERYWHERE = "frequencies_hz = [622.0, 623.0, 624.0, 625.0, 626.0, 627.0]"


def run(folder: Path, text: str, changes: dict[str, str], *only: str) -> xr.Dataset:
    """Run a study and return the node of its only answer."""
    folder.mkdir()
    (folder / "study.toml").write_text(changed(text, changes))
    done("run", str(folder / "study.toml"), "--no-report", "--only", *only)
    return Result.from_file(folder / "results").data[only[0]].to_dataset()


def at_fixed(folder: Path, harmonics: list[int], changes: dict[str, str] | None = None) -> xr.Dataset:
    text = EXAMPLE.replace("frequency_hz = [621.0, 629.0]", EVERYWHERE).partition("[vary]")[0]
    own = {"harmonics.low": f"{harmonics}", "harmonics.high": f"{harmonics}", "harmonics.selection": "'always_low'"}
    fixed = own | {"forced_response.peak_points": "0", "forced_response.stability": "'off'"}
    return run(folder, text, fixed | (changes or {}), "forced_response")


def test_frequencies_are_those_of_the_blisk_and_of_the_free_ring(tmp_path: Path) -> None:
    data = run(tmp_path / "modes", EXAMPLE.partition("[vary]")[0], {"modes.number": "4"}, "modes")
    found = data["frequency_hz"].isel(case=0).values
    for diameter, row in FREQUENCIES.items():
        for printed in row:
            hertz = float(printed)
            away = np.abs(found[diameter] - hertz).min()
            assert away < 6e-7 or hertz > found[diameter].max()  # beyond four modes, the ring's among them


@pytest.mark.validation
def test_optimum_of_the_limit_force(tmp_path: Path) -> None:
    """By [vary], with one harmonic as the reference has it."""
    limits = [2.85, OPTIMUM, 2.97]
    one = {
        "harmonics.low": "1",
        "harmonics.high": "1",
        "forced_response.stability": "'off'",
        "forced_response.points": "16",
    }
    changes = one | {"vary.contact.groove.slip_limit_n": f"{limits}", "forced_response.peak_points": "20"}
    text = EXAMPLE.replace("[621.0, 629.0]", "[624.0, 625.5]")
    data = run(tmp_path / "study", text, changes, "forced_response")
    peaks = data["peak_amplitude"].values
    assert peaks.argmin() == 1
    assert peaks[1] == pytest.approx(LOWEST, rel=5e-6)
    curve = np.polynomial.Polynomial.fit(limits, peaks, 2)
    assert curve.deriv().roots()[0] == pytest.approx(OPTIMUM, abs=0.02)


@pytest.mark.parametrize(("column", "harmonics"), [(1, [1]), (2, [1, 3]), (3, [1, 3, 5, 7, 9, 11, 13])])
def test_each_harmonic_has_its_own_wave(tmp_path: Path, column: int, harmonics: list[int]) -> None:
    """The amplitudes of the reference, which are 3 % off where all harmonics get the wave of the first one."""
    data = at_fixed(tmp_path / "study", harmonics)
    expected = [row[column] for row in HARMONICS]
    tolerance = DIGITS if column == 1 else 1e-5  # the reference has 4096 samples, exact events are used here
    np.testing.assert_allclose(data["amplitude"].values[:, 0], expected, rtol=tolerance)


def test_engine_order_22_is_the_mirror_image_of_2(tmp_path: Path) -> None:
    two = at_fixed(tmp_path / "two", [1, 3, 5])
    other = at_fixed(tmp_path / "other", [1, 3, 5], {"load.gas.engine_order": "22"})
    np.testing.assert_allclose(other["amplitude"], two["amplitude"], rtol=1e-10)
    assert float(two["amplitude"].sel(output="tip.x")[2]) == pytest.approx(1.675185e-5, rel=1e-5)


def annulus() -> str:
    """Write all 96 masses as two parts that know of no sectors, one friction element and one force a sector."""

    def links(rows: list[tuple[str, str, float]]) -> str:
        def place(end: str, n: int) -> str:
            own = end.removeprefix("next.")
            return end if end == "ground" else f"{own}{(n + (own != end)) % SECTORS}"

        every = [[place(a, n), place(b, n), v] for n in range(SECTORS) for a, b, v in rows]
        return str(every).replace("'", '"')

    names = [f"{name}{n}" for n in range(SECTORS) for name in ("disk", "root", "tip")]
    blisk = [("disk", "ground", 6e5), ("disk", "next.disk", 5e7), ("disk", "root", 1e6), ("root", "tip", 2e6)]
    ring = [("piece", "next.piece", 8e6), ("piece", "ground", 1.0)]
    contacts = "\n".join(
        f'[contact.c{n}]\nbetween = ["blisk.disk{n}", "ring.piece{n}"]\nlaw = "jenkins"\n'
        "tangential_stiffness_n_per_m = 2e7\nslip_limit_n = 4.0"
        for n in range(SECTORS)
    )
    loads = "\n".join(
        f'[load.l{n}]\non = "blisk.tip{n}"\nforce_n = 1.0\nphase_deg = {(360 * 2 * n / SECTORS) % 360}'
        for n in range(SECTORS)
    )
    points = ", ".join(f"tip{n} = 'blisk.tip{n}'" for n in range(SECTORS))
    return (
        f"schema_version = 2\n[part.blisk]\nshape = 'lumped'\nnames = {names}\nmasses_kg = {[1.2, 0.35, 0.25] * SECTORS}\n"
        f"springs_n_per_m = {links(blisk)}\n[part.blisk.damping]\nmodal_ratio = 1e-3\n[part.ring]\nshape = 'lumped'\n"
        f"names = {[f'piece{n}' for n in range(SECTORS)]}\nmasses_kg = {[0.25] * SECTORS}\nsprings_n_per_m = {links(ring)}\n"
        f"{contacts}\n{loads}\n[forced_response]\nfrequencies_hz = [624.0, 625.0]\nstability = 'off'\npeak_points = 0\n"
        "[harmonics]\nlow = [1, 3, 5]\nhigh = [1, 3, 5]\nselection = 'always_low'\n[output]\n"
        f"points = {{ {points} }}\n"
    )


def test_the_annulus_answers_as_one_sector(tmp_path: Path) -> None:
    one = at_fixed(tmp_path / "one", [1, 3, 5])["amplitude"].values[2:4, 0]
    every = run(tmp_path / "every", annulus(), {}, "forced_response")["amplitude"].values
    assert np.abs(every / one[:, None] - 1).max() < 1e-8

"""Several engine orders at once: base order and harmonics, superposition, all sectors without symmetry, and motions in time."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.api.study import Study
from stickslip.assembly.forces import engine_order
from stickslip.errors import InputError

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

SECTORS = 6
# disk, blade and tip of a sector; shrouds rub and hit their neighbours, the root rubs in its slot
MASSES, NAMES = [1.0, 0.5, 0.3], ["disk", "blade", "tip"]
SPRINGS = [("disk", "ground", 2e5), ("disk", "next.disk", 4e5), ("disk", "blade", 3e5), ("blade", "tip", 1e5)]
DASHPOTS = [(one, other, 4e-5 * k) for one, other, k in SPRINGS]
CONTACTS = {
    "shroud": ("tip", "next.tip", 'law = "jenkins", tangential_stiffness_n_per_m = 2e4, slip_limit_n = 3.0'),
    "root": ("disk", "blade", 'law = "jenkins", tangential_stiffness_n_per_m = 5e4, slip_limit_n = 1.5'),
    "stop": ("blade", "next.blade", 'law = "unilateral_spring", normal_stiffness_n_per_m = 2e4, gap_m = 4e-5'),
}
LOADS = {2: (6.0, 0.0), 3: (4.0, 40.0)}  # engine order -> force, phase in degrees
HARMONICS = "low = 9\nhigh = 9\nselection = 'always_low'"


def links(rows: list[tuple[str, str, float]]) -> str:
    return "[" + ", ".join(f'["{a}", "{b}", {v!r}]' for a, b, v in rows) + "]"


def text(part: Mapping[str, object], contacts: str, loads: str, asked: str, harmonics: str = HARMONICS) -> str:
    own = "\n".join(f"{key} = {value}" for key, value in part.items())
    return (
        f"schema_version = 2\n[part.wheel]\nshape = 'lumped'\n{own}\n{contacts}\n{loads}\n[forced_response]\n{asked}\n"
        f"stability = 'off'\npeak_points = 0\n[harmonics]\n{harmonics}\n[output]\npoints = {{ tip = 'wheel.tip' }}\n"
    )


def one_sector(loads: Mapping[int, tuple[float, float]], asked: str, harmonics: str = HARMONICS, **laws: str) -> str:
    part = {
        "sectors": SECTORS,
        "masses_kg": MASSES,
        "names": NAMES,
        "springs_n_per_m": links(SPRINGS),
        "dashpots_n_s_per_m": links(DASHPOTS),
    }
    contacts = "[contact]\n" + "\n".join(
        f'{name} = {{ between = ["wheel.{a}", "{b.replace("next.", "next.wheel.") if b.startswith("next.") else "wheel." + b}"], {laws.get(name, law)} }}'
        for name, (a, b, law) in CONTACTS.items()
    )
    driven = "\n".join(
        f'[load.order{m}]\non = "wheel.tip"\nforce_n = {force}\nphase_deg = {phase}\nengine_order = {m}'
        for m, (force, phase) in loads.items()
    )
    return text(part, contacts, driven, asked, harmonics)


def all_sectors(loads: Mapping[int, tuple[float, float]], base: int, asked: str) -> str:
    """Write the wheel as one structure that knows of no sectors: the tip of sector 0 is ``tip``."""

    def place(name: str, n: int) -> str:
        if name == "ground":
            return name
        own, number = name.removeprefix("next."), (n + name.startswith("next.")) % SECTORS
        return own + f"_{number}" * bool(number)

    def everywhere(rows: list[tuple[str, str, float]]) -> str:
        return links([(place(a, n), place(b, n), v) for n in range(SECTORS) for a, b, v in rows])

    part = {
        "masses_kg": MASSES * SECTORS,
        "names": [place(name, n) for n in range(SECTORS) for name in NAMES],
        "springs_n_per_m": everywhere(SPRINGS),
        "dashpots_n_s_per_m": everywhere(DASHPOTS),
    }
    contacts = "[contact]\n" + "\n".join(
        f'{name}_{n} = {{ between = ["wheel.{place(a, n)}", "wheel.{place(b, n)}"], {law} }}'
        for n in range(SECTORS)
        for name, (a, b, law) in CONTACTS.items()
    )
    driven = "\n".join(
        f'[load.order{m}_{n}]\non = "wheel.{place("tip", n)}"\nforce_n = {force}\nharmonic = {m // base}\n'
        f"phase_deg = {(phase + 360 * m * n / SECTORS) % 360}"
        for n in range(SECTORS)
        for m, (force, phase) in loads.items()
    )
    return text(part, contacts, driven, asked)


def response(folder: Path, written: str, **checks: bool):
    folder.mkdir(parents=True)
    (folder / "study.toml").write_text(written)
    return Study.from_file(folder / "study.toml").run(**checks).data["forced_response"].to_dataset()


def tip(data, harmonic: int) -> np.ndarray:
    pair = data["output_displacement"].isel(harmonic=harmonic, output=0).values
    return pair[..., 0] + 1j * pair[..., 1]


def of(**orders: tuple[int, int | None]) -> dict[str, SimpleNamespace]:
    return {name: SimpleNamespace(harmonic=h, engine_order=m) for name, (h, m) in orders.items()}


def test_the_base_is_the_common_divisor_of_the_orders_that_act() -> None:
    assert engine_order(of(a=(1, 4), b=(1, 6), still=(0, None)), wheel=True) == (2, {"a": 2, "b": 3, "still": 0})
    assert engine_order(of(a=(2, 3), b=(1, 9)), wheel=True) == (3, {"a": 2, "b": 3})
    # one order stays as it is, whatever its harmonics
    assert engine_order(of(a=(2, 4), b=(3, 4)), wheel=True) == (4, {"a": 2, "b": 3})
    assert engine_order(of(a=(1, 0)), wheel=True) == (0, {"a": 1})
    assert engine_order(of(a=(3, None)), wheel=False) == (None, {"a": 3})
    with pytest.raises(InputError, match=r"engine order 0 beside others .load\.a: 0, load\.b: 2"):
        engine_order(of(a=(1, 0), b=(1, 2)), wheel=True)


def test_orders_superpose_where_nothing_slips(tmp_path: Path) -> None:
    """Each engine order of a linear wheel answers as it does alone, at its own multiple of the speed and in its own wave."""
    stuck = {
        "shroud": 'law = "jenkins", tangential_stiffness_n_per_m = 2e4, slip_limit_n = 1e6',
        "root": 'law = "jenkins", tangential_stiffness_n_per_m = 5e4, slip_limit_n = 1e6',
        "stop": 'law = "jenkins", tangential_stiffness_n_per_m = 2e4, slip_limit_n = 1e6',
    }
    loads = {4: (6.0, 0.0), 10: (4.0, 40.0)}  # beyond the number of sectors, too
    asked = "over = 'speed'\nspeed_rpm = [500.0, 900.0]\nfrequencies = 5"
    both = response(tmp_path / "both", one_sector(loads, asked, "high = 7\nselection = 'always_high'", **stuck))
    assert both.attrs["engine_order"] == 2
    assert both.attrs["driven_harmonics"] == [2, 5]
    np.testing.assert_allclose(both["frequency_hz"], np.linspace(500, 900, 5) / 60 * 2)
    for m, force in loads.items():
        alone = response(tmp_path / str(m), one_sector({m: force}, asked, "", **stuck))
        found, expected = tip(both, m // 2), tip(alone, 1)
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
        assert np.abs(found).min() > 0
    others = [h for h in range(8) if h not in (2, 5)]
    assert max(np.abs(tip(both, h)).max() for h in others) < 1e-12 * np.abs(tip(both, 2)).max()


@pytest.mark.parametrize("frequency", [33.0, 38.0])
def test_one_sector_answers_as_all_under_two_orders(tmp_path: Path, frequency: float) -> None:
    """Friction and stops mix the orders: harmonic 1, which none drives, moves too."""
    asked = f"frequencies_hz = [{frequency}]"
    one = response(tmp_path / "one", one_sector(LOADS, asked))
    every = response(tmp_path / "every", all_sectors(LOADS, 1, asked))
    assert one.attrs["driven_harmonics"] == [2, 3]
    assert np.all(one["status"] == 0)
    assert float(one["dissipated_energy"].sum()) > 0
    stop = one["peak_state"].sel(contact="stop").values
    assert set(np.unique(stop)) == {0, 2}  # closes and opens
    largest = np.abs(tip(every, 2)).max()
    for h in range(10):
        assert np.abs(tip(one, h) - tip(every, h)).max() < 1e-8 * largest
    assert np.abs(tip(one, 1)).max() > 1e-4 * largest


def test_two_orders_in_time_and_in_words(tmp_path: Path) -> None:
    """All sectors integrated agree with the balance of one; terminal and page name each order."""
    asked = "frequencies_hz = [38.0]"
    written = one_sector(LOADS, asked, "low = 15\nhigh = 15\nselection = 'always_low'")
    (tmp_path / "study.toml").write_text(written)
    result = Study.from_file(tmp_path / "study.toml").run(verify=True)
    data = result.data["forced_response"].to_dataset()
    assert abs(float(data["verify_difference_percent"][0])) < 0.01
    assert data["verify_motion"].values.tolist() == ["attained"]
    assert data["driven"].values.tolist() == ["engine order 2", "engine order 3"]
    own = data["driven_amplitude"].values[0, :, 0]
    np.testing.assert_allclose(np.linalg.norm(own), data["amplitude"].values[0, 0], rtol=1e-12)
    table = next(t for t in FORCED_RESPONSE.summary(data) if "each engine order" in t.title)
    assert [row[1:] for row in table.rows] == [
        ("2", f"{1e3 * own[0]:.5g}", "38.000", "76.000"),
        ("3", f"{1e3 * own[1]:.5g}", "38.000", "114.000"),
    ]
    page = result.report(tmp_path / "page.html").read_text()
    assert "Amplitude of each engine order" in page
    assert "engine order 3 at 3 times that" in page

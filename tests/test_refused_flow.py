"""What a study says of coefficients, flutter and limit cycles that cannot be computed, before anything is."""

import re
from pathlib import Path

import pytest

import stickslip as ss
from stickslip.study.check import check_study
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study

STUDY = """
schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 6
names = ["disk", "blade", "tip"]
masses_kg = [1.0, 0.5, 0.3]
springs_n_per_m = [["disk", "ground", 2e5], ["disk", "next.disk", 4e5], ["disk", "blade", 3e5], ["blade", "tip", 1e5]]
[damping]
modal_ratio = 0.002
[contact.c]
between = ["wheel.disk", "wheel.blade"]
law = "jenkins"
tangential_stiffness_n_per_m = 5e4
slip_limit_n = 2.0
[output]
points = { tip = "wheel.tip" }
[aero]
file = "c.csv"
reference_hz = 70.0
shapes = "blade_alone"
clamped = "wheel.disk"
"""
FLUTTER = "[flutter]\n"
ND9 = ('shapes = "blade_alone"\nclamped = "wheel.disk"', 'shapes = "nodal_diameter"\nnodal_diameter = 9')
ROTATING = ("[damping]", "[rotation]\nspeed_rpm = 4000\n[damping]")
BY = "real_per_s2,imag_per_s2"
RESPONSE = """
[load.l]
on = "wheel.tip"
force_n = 10.0
engine_order = 2
[forced_response]
frequency_hz = [60.0, 90.0]
points = 3
[harmonics]
{}
"""
ONE = f"neighbour,{BY}\n-1,100,50\n0,20,-900\n1,-90,40\n"
GROWS = f"neighbour,{BY}\n0,20,1900\n"
OVER_FREQUENCY = "\n".join(
    [f"neighbour,frequency_hz,{BY}", *(f"{j},{f},1,-500" for j in (-1, 0, 1) for f in (10, 260))]
)
AT_SPEEDS = f"neighbour,speed_rpm,{BY}\n0,3000,20,-900\n0,5000,20,-800\n"


def checked(folder: Path, rows: str, asked: str = FLUTTER, change: tuple[str, str] = ("", "")) -> None:
    (folder / "c.csv").write_text(rows, encoding="utf-8")
    text = STUDY.replace(*change) if change[0] else STUDY
    (folder / "study.toml").write_text(text + asked, encoding="utf-8")
    check_study(read_study(folder / "study.toml"))


def waves(*numbers: int) -> str:
    return "\n".join([f"wave_number,{BY}", *(f"{k},20,{10 * k - 900}" for k in numbers)])


@pytest.mark.parametrize(
    ("rows", "asked", "change", "words"),
    [
        (
            f"{ONE}3,50,500\n-3,50,500\n",
            FLUTTER,
            ("", ""),
            r"c\.csv: neighbour: has -3 and 3, which are one blade of 6",
        ),
        (
            f"{ONE.replace('neighbour', 'recorded_on')}5,1,1\n",
            FLUTTER,
            ("", ""),
            r"recorded_on: has -1 and 5, which are one blade",
        ),
        (waves(0), FLUTTER, ("", ""), r"wave_number: lacks 1, 2, 3, 4, 5 of the waves 0 to 5"),
        (waves(0, 2, 4), FLUTTER, ("", ""), r"lacks 1, 3, 5 of the waves"),
        (waves(*range(7)), FLUTTER, ("", ""), r"has 0 and 6, which are one wave of 6"),
        (f"phase_angle_deg,{BY}\n0,20,-900\n", FLUTTER, ("", ""), r"phase_angle_deg: holds 0 alone"),
        (ONE, FLUTTER, ND9, r"aero\.nodal_diameter: is 9, and 6 sectors have the nodal diameters 0 to 3"),
        (ONE, FLUTTER, ROTATING, r"rotation\.speed_rpm: is 4000, .*no aero\.file has a column speed_rpm"),
        (
            OVER_FREQUENCY,
            RESPONSE.format("low = 3\nhigh = 3\nselection = 'always_low'"),
            ("", ""),
            r"aero\.file: has coefficients for 10 to 260 Hz, and .* harmonics up to 3 needs 60 to 270 Hz",
        ),
        (
            OVER_FREQUENCY,
            RESPONSE.format("high = 5"),
            ("", ""),
            r"up to 5 needs 60 to 450 Hz\. Add rows .* beyond = \"nearest\"",
        ),
        (OVER_FREQUENCY, RESPONSE.format("high = 5"), ("[aero]", "[aero]\nbeyond = 'nearest'"), ""),
        (OVER_FREQUENCY, RESPONSE.format("high = 2"), ("", ""), ""),
        (
            OVER_FREQUENCY.replace("260", "75"),
            "[flutter]\nnumber = 2\n",
            ("", ""),
            r"2 modes of each wave needs 48\..* to 1\d\d\..* Hz",
        ),
        (
            OVER_FREQUENCY.replace("260", "65"),
            "[modes]\nnumber = 1\n",
            ("", ""),
            r"10 to 65 Hz, and the question for 1 modes of each wave needs 48\..* to 7\d\..* Hz",
        ),
        (
            OVER_FREQUENCY.replace("-500", "1900"),
            "[limit_cycle]\nmost_harmonics = 7\n",
            ("", ""),
            r"limit cycle with up to 7 harmonics \(most_harmonics\) needs 48\.0.* to 700\..* Hz",
        ),
        (ONE, "[flutter]\nnumber = 99\n", ("", ""), r"flutter\.number: is 99, and the wave 0 has 3 modes"),
        (ONE, FLUTTER, ("[aero]", "[aero]\nmode = 3"), r"aero\.mode: is 3, .*'wheel\.disk' held there are 2"),
        (
            GROWS,
            "[limit_cycle]\nmodes = [1, 99]\n",
            ("", ""),
            r"limit_cycle\.modes: holds 99, and what is looked at has 3 modes",
        ),
        (GROWS, "[limit_cycle]\nmodes = [2]\n", ("", ""), ""),
        (AT_SPEEDS, FLUTTER, ROTATING, ""),
        (waves(1, 2, 3, 4, 5, 6), FLUTTER, ("", ""), ""),
    ],
)
def test_what_cannot_be_computed_is_refused_by_the_check(
    rows: str, asked: str, change: tuple[str, str], words: str, tmp_path: Path
) -> None:
    if not words:
        checked(tmp_path, rows, asked, change)
        return
    with pytest.raises(ss.InputError) as told:
        checked(tmp_path, rows, asked, change)
    assert re.search(words, str(told.value).replace("\n", " ")), str(told.value)


def test_a_speed_chooses_among_coefficients_where_it_changes_nothing_else(tmp_path: Path) -> None:
    damping = []
    for name, rows, change in (("speeds", AT_SPEEDS, ROTATING), ("between", f"neighbour,{BY}\n0,20,-850\n", ("", ""))):
        (tmp_path / name).mkdir()
        checked(tmp_path / name, rows, FLUTTER, change)
        found = run_study(read_study(tmp_path / name / "study.toml"))
        damping.append(found.tree["flutter"]["damping"].values)
    assert damping[0] == pytest.approx(damping[1], rel=1e-12)

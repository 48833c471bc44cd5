"""The second damper: the same blades, a full section in balance, and what the search asks of it."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evidence.second_damper.search import JUDGED, RATIOS, STUCK, AtPeak, Candidate, Found
from stickslip.model.rigid.dampers import section_moments

EXAMPLES = Path(__file__).parents[1] / "examples"
OWN = Candidate(50.0, 78.0, (0.002, 0.025), 0.1)
ANGLES = ("flat_angle_deg", "curved_angle_deg")


def tables(name: str) -> dict:
    return tomllib.loads((EXAMPLES / name / "study.toml").read_text())


def test_the_blades_and_their_load_are_those_of_the_first_study() -> None:
    first, second = tables("two_blades"), tables("second_bending")
    for key in ("material", "damping", "contact", "load"):
        assert first[key] == second[key], key
    one, other = ({k: v for k, v in t["part"]["blades"].items() if k not in ANGLES} for t in (first, second))
    assert one == other


def test_the_study_has_the_damper_that_the_search_found() -> None:
    parts = tables("second_bending")["part"]
    for key, value in OWN.values.items():
        if key.startswith("part."):
            _, part, name = key.split(".")
            assert parts[part][name] == (list(value) if isinstance(value, tuple) else value), key
    share = tables("second_bending")["forced_response"]["static_friction_share"]
    assert share == OWN.values["forced_response.static_friction_share"]


def test_moments_of_a_section() -> None:
    corners = np.array([(1.0, 2.0), (5.0, 2.0), (5.0, 8.0), (1.0, 8.0)])
    for order in (1, -1):
        area, centre, second = section_moments(corners[::order])
        assert area == pytest.approx(24)
        assert second == pytest.approx((4**2 / 12, 6**2 / 12, 0.0))
        assert centre == pytest.approx((3, 5))


def test_without_friction_the_pull_presses_both_lines_of_the_flat_side_alike() -> None:
    f, c = np.radians([OWN.flat_deg, OWN.curved_deg])
    normals = [(-np.sin(f), np.cos(f))] * 2 + [(np.sin(c), np.cos(c))]
    places = [(-d * np.cos(f), -d * np.sin(f)) for d in OWN.flat]
    places.append((OWN.right * np.cos(c), -OWN.right * np.sin(c)))
    centre = OWN.values["part.damper.centre_m"]
    rows = [(*n, p[0] * n[1] - p[1] * n[0]) for n, p in zip(normals, places, strict=True)]
    first, second, right = np.linalg.solve(np.array(rows).T, [0, 1, centre[0]])
    assert right > 0
    # R stands on a grid of half a millimetre
    assert first == pytest.approx(second, rel=0.05)


def found(**changed: AtPeak) -> Found:
    """Return a damper that shows all that is asked, but for peaks at ratios such as ``r5``."""
    slips = AtPeak(5.0, 1e-6, 600.0, (0.0, 0.0, 0.3), (0.0, 0.0, 0.0), 0)
    few = dict.fromkeys(RATIOS, slips) | {STUCK: replace(slips, slips=(0.0, 0.0, 0.0))}
    few |= {float(name[1:]): peak for name, peak in changed.items()}
    return Found(OWN, (150.0, 130.0, 170.0), few, dict.fromkeys(JUDGED, slips), {23.4: 0.02, 11.7: 0.04})


def test_what_is_asked_of_the_damper() -> None:
    good = found()
    assert all(good.holds().values())
    peak = good.few[5.0]
    for name, bad in {
        "L1 and L2 share the pull": replace(good, static=(150.0, 30.0, 170.0)),
        "L1 and L2 stay closed": found(r5=replace(peak, opens=(0.2, 0.0, 0.0))),
        "the flat side does not slip": found(r29=replace(peak, slips=(0.0, 0.01, 0.3))),
        "R slips below 30": found(r29=replace(peak, slips=(0.0, 0.0, 0.0))),
        "all stick above 230": found(r240=peak),
        "one harmonic is enough": found(r5=replace(peak, size=1.1e-6)),
        "the alert never asks": replace(good, alarms={23.4: 0.02, 11.7: 0.06}),
    }.items():
        assert [k for k, so in bad.holds().items() if not so] == [name]

"""The motion at the peak on the page: surfaces of rigid bodies, what is drawn at a phase, and play in a browser."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from browser import CHROMIUM, Browser
from synthetic_result import box, parts, provenance, synthetic_result, tree_of

from stickslip.analyses.forced_response.page.at_peak.motion import MOST_BYTES, in_motion, motion_of_case
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.page import report_html
from stickslip.arrays import FloatArray
from stickslip.assembly.part_copies import copy_of, placed_body
from stickslip.model.part import BodyPoints, Damper, Place, damper_part, rigid_part
from stickslip.model.rigid.body import BodySolid, RigidBody
from stickslip.model.rigid.dampers import CylinderDamper, FlatCurvedDamper, WedgeDamper, section_moments

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path: the page is not opened")
WEDGE = WedgeDamper(left_angle=0.8, right_angle=0.6, top_width=0.004, height=0.012, length=0.04, mass=0.02)
CYLINDER = CylinderDamper(radius=0.006, length=0.03, left_angle=0.7, mass=0.02)


def volume(solid: BodySolid) -> float:
    """Volume inside a surface whose triangles may have either sense: a convex body, from its middle."""
    a, b, c = (solid.points[solid.triangles[:, k]] - solid.points.mean(axis=0) for k in range(3))
    return float(np.abs(np.einsum("kd,kd->k", a, np.cross(b, c))).sum() / 6)


@pytest.mark.parametrize(("damper", "extent"), [(WEDGE, 0.04), (CYLINDER, 0.03), (FlatCurvedDamper(length=0.05), 0.05)])
def test_dampers_are_drawn_as_prisms_over_their_sections(damper: Damper, extent: float) -> None:
    solid = damper_part(damper).drawn
    assert solid is not None
    assert solid.drawn_from == "section"
    assert np.ptp(solid.points[:, 1]) == pytest.approx(extent)
    assert volume(solid) == pytest.approx(section_moments(damper.outline())[0] * extent, rel=1e-12)


def test_without_a_length_a_damper_ends_half_a_section_beyond_its_last_ones() -> None:
    assert FlatCurvedDamper(sections=(-0.016, 0.0, 0.016)).ends == pytest.approx((-0.024, 0.024))


def on_top(height: float) -> BodyPoints:
    """Return four points of a square of 2 cm at a height, facing up."""
    places = np.array([[x, y, height] for x in (-0.01, 0.01) for y in (-0.01, 0.01)])
    return BodyPoints(("a", "b", "c", "d"), places, np.tile(np.eye(3), (4, 1, 1)))


def test_a_body_without_a_section_is_drawn_from_its_contact_faces_to_its_centre() -> None:
    body = RigidBody(mass=0.1, inertia=(1e-6, 1e-6, 1e-6), centre=(0.0, 0.0, 0.002))
    solid = rigid_part(body, {"top": on_top(0.005)}).drawn
    assert solid is not None
    assert solid.drawn_from == "contact faces"
    assert volume(solid) == pytest.approx(0.02 * 0.02 * 0.003, rel=1e-9)
    flat = RigidBody(mass=0.1, inertia=(1e-6, 1e-6, 1e-6), centre=(0.0, 0.0, 0.005))
    assert rigid_part(flat, {"top": on_top(0.005)}).drawn is None


def test_a_placed_body_and_a_copy_take_their_surfaces_along() -> None:
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    part, place = damper_part(WEDGE), Place(quarter, np.array([0.1, 0.2, 0.3]))
    assert part.drawn is not None
    for moved in (placed_body(part, place), copy_of(part, place)):
        assert moved.drawn is not None
        assert moved.drawn.drawn_from == "section"
        assert np.allclose(moved.drawn.points, place.put(part.drawn.points), atol=1e-15)


def with_motion(ratios: tuple[float, ...] = (20, 5)) -> xr.Dataset:
    """Return a result with a drawn box that moves in two harmonics, and contacts that move with it."""
    data = synthetic_result(ratios=ratios, n=24, verify=False)
    points, triangles = box((0.0, 0.0, 0.0), (0.02, 0.02, 0.1), (1, 1, 4))
    contacts, cases, chance = data.sizes["contact"], len(ratios), np.random.default_rng(7)
    position = data["contact_position"].values

    def motion(count: int) -> FloatArray:
        found = chance.normal(size=(cases, 2, count, 3)) + 1j * chance.normal(size=(cases, 2, count, 3))
        return parts(1e-5 * found)

    return data.assign(
        drawn_point=(("case", "drawn_node", "xyz"), np.tile(points, (cases, 1, 1))),
        drawn_triangle=(("drawn_face", "corner"), triangles),
        drawn_part=("drawn_node", ["blade"] * (len(points) - 3) + ["damper"] * 3),
        drawn_kind=("drawn_node", ["mesh"] * (len(points) - 3) + ["contact faces"] * 3),
        drawn_contact=(("contact", "xyz"), position),
        drawn_load=("drawn_load", ["pull", "shaker"]),
        drawn_load_harmonic=("drawn_load", [0, 1]),
        drawn_load_point=(("drawn_load", "xyz"), points[:2]),
        drawn_load_direction=(("drawn_load", "xyz"), np.eye(3)[:2]),
        drawn_support=(("drawn_support", "xyz"), points[2:5]),
        peak_drawn_motion=(("case", "drawn_harmonic", "drawn_node", "xyz", "part"), motion(len(points))),
        peak_contact_motion=(("case", "drawn_harmonic", "contact", "xyz", "part"), motion(contacts)),
    )


def test_the_caption_says_what_each_body_is_drawn_from() -> None:
    plot = in_motion(Response(with_motion()))
    assert plot is not None
    assert "No section of damper is known: it is drawn from its contact faces to its centre of mass." in plot.caption
    assert "meshes (blade)" in plot.caption
    names = [trace.name for trace in plot.figure.data]
    assert {"pull (static)", "shaker", "held", "axis t", "axis w", "axis n"} <= set(names)


def test_cases_beyond_the_room_of_the_page_say_so() -> None:
    data = with_motion((20, 10, 5))
    wide = (
        2 * MOST_BYTES // (3 * 4 * 2 * 3) // data.sizes["drawn_node"]
    )  # two thirds of the room a case: 2 harmonics, 3 parts
    data = xr.concat([data[list(DRAWN)]] * wide, "drawn_node").merge(data.drop_vars(list(DRAWN)), compat="override")
    plot = in_motion(Response(data))
    assert plot is not None
    told = {case: "is not in the page" in text for case, text in plot.case_captions.items()}
    assert told == {case: case != plot.chosen for case in told}


DRAWN = ("drawn_point", "drawn_part", "drawn_kind", "peak_drawn_motion")
HEAVY = "surface", "retained", "peak_gap", "peak_force", "dissipated", "predicted", "real_error"
MARKED = "document.querySelector('#plot-in_motion').data[3].marker.color"
PLACES = "Array.from(document.querySelector('#plot-in_motion').data[{}].{})"


def at_phase(degrees: float, percent: float) -> str:
    """Return a script that puts the phase and the size of the motion into the form of the figure."""
    return (
        "(() => { const form = document.querySelector('#fig-in_motion form'); "
        f"form.elements.phase.value = {degrees}; form.elements.size.value = {percent}; "
        "form.dispatchEvent(new Event('input')); })()"
    )


@needs_browser
def test_what_is_drawn_at_a_phase_is_the_harmonics_there_and_play_changes_colours(
    browser: Browser, tmp_path: Path
) -> None:
    data = with_motion()
    view, page = Response(data), tmp_path / "report.html"
    others = [str(name) for name in data.data_vars if str(name).startswith(HEAVY)]
    drawn = data.drop_vars(others)  # other figures take longer to open than this one
    page.write_text(report_html(tree_of(provenance(), forced_response=drawn)), encoding="utf-8")
    browser.errors.clear()
    browser.width(480, 600)  # a picture in space takes its time by the pixel
    browser.open(page)
    assert browser.until("document.querySelector('#plot-in_motion canvas') !== null")
    own = motion_of_case(view, next(c for c in view.peaked if c.index == view.chosen))
    points = np.vstack([data["drawn_point"].values[0], data["drawn_contact"].values])
    span = float(np.ptp(points, axis=0).max())
    nodes = data.sizes["drawn_node"]
    for degrees in (0, 75):
        browser.run(at_phase(degrees, 10))
        turn = np.exp(1j * np.radians(degrees) * np.arange(1, 3))
        moved = np.einsum("h,hpd->pd", turn, own.coefficients).real
        wanted = 1e3 * (points + 0.1 * span / own.largest * moved)
        first = f"{PLACES.format(0, 'z')}[5]"
        assert browser.until(f"Math.abs({first} - {wanted[5, 2]}) < {0.1 * span}")
        for trace, rows in ((0, wanted[:nodes]), (3, wanted[nodes:])):
            shown = np.array([browser.run(PLACES.format(trace, axis)) for axis in "xyz"]).T
            # 16 bits of the largest displacement, drawn as a tenth of the picture
            assert np.abs(shown - rows).max() < 1e-4 * 1e3 * span
    assert browser.run("document.querySelector('#plot-in_motion').data[4].visible") is False
    browser.run("document.querySelector('#fig-in_motion form').elements.frames.click()")
    assert browser.until("document.querySelector('#plot-in_motion').data[4].visible === true")
    play = "document.querySelector('#fig-in_motion form').elements.play"
    browser.run(f"{play}.focus(), document.activeElement.click()")  # a button: the keyboard reaches it
    before = browser.run(f"Array.from({MARKED}).join()")
    assert browser.until(f"Array.from({MARKED}).join() !== '{before}'")
    assert browser.run(f"{play}.textContent") == "stop"
    browser.run(f"{play}.click()")
    assert browser.errors == []

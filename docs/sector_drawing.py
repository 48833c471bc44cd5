"""Draw the cross-section and the axial view of the default sector, from its geometry alone."""

from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from stickslip import BladedSector
from stickslip.model import Axis, Shroud

MM = 1e3
SETS = {"cyclic": "tab:blue", "platform": "tab:red", "shroud": "tab:orange", "root": "black"}


def draw_sector(path: Path) -> None:
    """Write the drawing as SVG."""
    sector = BladedSector(shroud=Shroud(gap=0.002))  # a gap wide enough to be seen
    figure, (section, view) = plt.subplots(
        1, 2, figsize=(10, 7), sharey=True, layout="constrained", width_ratios=[2, 3]
    )
    _cross_section(section, sector)
    _axial_view(view, sector)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _cross_section(axes: Axes, sector: BladedSector) -> None:
    """Draw what a cut along the axis shows: radius upward, axis to the right."""
    disk, platform, airfoil, shroud = sector.disk, sector.platform, sector.airfoil, sector.shroud
    assert platform is not None
    assert shroud is not None
    r, z = disk.outline.T
    axes.fill(z * MM, r * MM, "0.85", edgecolor="0.3")
    _box(axes, platform.depth, disk.rim_radius, platform.top_radius, "0.8")
    edge = [np.abs(airfoil.section(s)[:, 1]).max() * MM for s in (0.0, 1.0)]
    base, tip = sector.base_radius * MM, sector.tip_radius * MM
    axes.fill([-edge[0], edge[0], edge[1], -edge[1]], [base, base, tip, tip], "0.9", edgecolor="0.3")
    half = shroud.thickness / 2
    _box(axes, shroud.depth, sector.shroud_radius - half, sector.shroud_radius + half, "0.8")
    bore = disk.bore_radius * MM
    axes.plot(np.array([-1, 1]) * disk.bore_width * MM / 2, [bore, bore], "k", lw=4)
    for radius, name in (
        (disk.bore_radius, "bore_radius"),
        (disk.hub_radius, "hub_radius"),
        (disk.rim_radius - disk.rim_height, "rim_radius − rim_height"),
        (disk.rim_radius, "rim_radius"),
        (platform.top_radius, "top_radius"),
        (sector.tip_radius, "top_radius + airfoil_length"),
    ):
        axes.axhline(radius * MM, color="0.6", lw=0.6, ls=":")
        axes.text(27, radius * MM, name, va="bottom", fontsize=8)
    for radius, width, name in (
        (disk.bore_radius, disk.bore_width, "bore_width"),
        (0.5 * (disk.hub_radius + disk.rim_radius), disk.web_width, "web_width"),
        (disk.rim_radius - disk.rim_height / 2, disk.rim_width, "rim_width"),
        (sector.shroud_radius, shroud.depth, "depth"),
    ):
        at = radius * MM - 9 * (name == "bore_width") + 8 * (name == "depth")
        ends = np.array([-1, 1]) * width * MM / 2
        axes.annotate("", (ends[0], at), (ends[1], at), arrowprops={"arrowstyle": "<->"})
        axes.text(0, at + 1, name, ha="center", va="bottom", fontsize=8)
    axes.set(xlabel="z, mm", ylabel="x, mm", title="Cross-section", aspect="equal", xlim=(-30, 105))


def _box(axes: Axes, depth: float, low: float, high: float, color: str) -> None:
    half = depth * MM / 2
    low, high = low * MM, high * MM
    axes.fill([-half, half, half, -half], [low, low, high, high], color, edgecolor="0.3")


def _axial_view(axes: Axes, sector: BladedSector) -> None:
    """Draw what is seen along the axis: x upward, y to the left, so that angles grow to the left."""
    disk, shroud = sector.disk, sector.shroud
    assert shroud is not None
    half = sector.pitch / 2
    _ring(axes, disk.bore_radius, disk.rim_radius, half, "0.85")
    outline = sector.platform_outline() * MM
    axes.fill(outline[:, 1], outline[:, 0], "0.8", edgecolor="0.3")
    sections = [np.abs(sector.airfoil.section(s)[:, 0]).max() * MM for s in (0.0, 1.0)]
    base, tip = sector.base_radius * MM, sector.tip_radius * MM
    axes.fill([-sections[0], sections[0], sections[1], -sections[1]], [base, base, tip, tip], "0.9", edgecolor="0.3")
    inner = sector.shroud_radius - shroud.thickness / 2
    _ring(axes, inner, inner + shroud.thickness, sector.shroud_angle / 2, "0.8")
    arc = np.linspace(-half, half, 30)
    axes.plot(*(disk.bore_radius * MM * np.array([np.sin(arc), np.cos(arc)])), "k", lw=4)
    _label(axes, "root (bore)", (0.0, disk.bore_radius * MM - 7), SETS["root"])
    for sign, side in ((-1, "low"), (1, "high")):
        _edge(axes, sign * half, disk.bore_radius, disk.rim_radius, SETS["cyclic"])
        low = outline[2 if sign > 0 else 5]
        top = outline[3 if sign > 0 else 4]
        axes.plot([low[1], top[1]], [low[0], top[0]], color=SETS["platform"], lw=3)
        angle = sign * sector.shroud_angle / 2
        _edge(axes, angle, inner, inner + shroud.thickness, SETS["shroud"])
        for name, at in (
            (f"cyclic_{side}", (18.0, 115.0)),
            (f"platform_{side}", (28.0, 186.0)),
            (f"shroud_{side}", (42.0, 284.0)),
        ):
            place, outward = (sign * at[0], at[1]), "right" if sign > 0 else "left"
            _label(axes, name, place, SETS[name.split("_")[0]], outward)
    _label(axes, "platform_under", (28.0, 176.0), "tab:purple", "right")
    for a, b in ((1, 2), (6, 5)):
        axes.plot(outline[[a, b], 1], outline[[a, b], 0], color="tab:purple", lw=3)
    _label(axes, "tip", (0.0, tip + 6), "tab:green")
    for sign in (-1, 1):
        end = Axis().turned(np.array([[0.31, 0.0, 0.0]]), sign * half)[0] * MM
        axes.plot([0, end[1]], [0, end[0]], color="0.6", lw=0.6, ls=":")
    axes.text(0, 12, "pitch = 2π / sectors", ha="center", fontsize=8)
    axes.set(xlabel="y, mm", title="Along the axis", aspect="equal", xlim=(85, -85), ylim=(0, 310))


def _ring(axes: Axes, inner: float, outer: float, half: float, color: str) -> None:
    angle = np.linspace(-half, half, 30)
    y = np.concatenate([inner * np.sin(angle), outer * np.sin(angle[::-1])]) * MM
    x = np.concatenate([inner * np.cos(angle), outer * np.cos(angle[::-1])]) * MM
    axes.fill(y, x, color, edgecolor="0.3")


def _edge(axes: Axes, angle: float, inner: float, outer: float, color: str) -> None:
    ends = np.array([inner, outer]) * MM
    axes.plot(ends * np.sin(angle), ends * np.cos(angle), color=color, lw=3)


def _label(axes: Axes, text: str, at: tuple[float, float], color: str, align: str = "center") -> None:
    axes.text(*at, text, color=color, ha=align, va="center", fontsize=9)

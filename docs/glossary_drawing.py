"""Draw the pictures of the glossary, each from a closed form or a few lines of arithmetic, without the package."""

from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle, Wedge

STICK, SLIP, OPEN = "tab:blue", "tab:red", "0.55"
SECTORS = 12


def draw_glossary(folder: Path) -> None:
    """Write the pictures as SVG into `folder`; their names begin with ``glossary_``."""
    for name, figure in (
        ("contact", _contact()),
        ("loop", _loop()),
        ("resonance", _resonance()),
        ("harmonics", _harmonics()),
        ("wheel", _wheel()),
        ("campbell", _campbell()),
    ):
        figure.savefig(folder / f"glossary_{name}.svg", metadata={"Date": None})
        plt.close(figure)


def _contact() -> Figure:
    """Two bodies, a contact point between them, its springs and its slider."""
    figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
    axes.add_patch(Rectangle((0, 0), 11.5, 1, color="0.85"))
    axes.add_patch(Rectangle((0, 4), 11.5, 1, color="0.85"))
    axes.text(0.2, 0.5, "body A, for example a damper", va="center")
    axes.text(0.2, 4.5, "body B, for example a blade's platform", va="center")
    _spring(axes, (8.0, 1), (8.0, 4))
    axes.text(8.3, 2.6, "normal spring $k_n$\npresses only, opens when pulled", va="center")
    axes.plot([1.4, 1.4], [4, 2.4], "k")
    _spring(axes, (1.4, 2.4), (4.2, 2.4))
    axes.text(2.8, 2.9, "tangential spring $k_t$", ha="center")
    axes.add_patch(Rectangle((4.2, 1), 0.9, 1.9, facecolor="tab:orange", alpha=0.5))
    axes.text(5.3, 1.6, "slider, gives way\nat $\\mu N$", va="center")
    axes.annotate("", (6.6, 5.3), (4.2, 5.3), arrowprops={"arrowstyle": "<->"})
    axes.text(5.4, 5.45, "relative displacement along $t$", ha="center", va="bottom")
    axes.set(xlim=(0, 12.3), ylim=(-0.1, 6.2))
    axes.axis("off")
    return figure


def _spring(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw a spring as a zigzag."""
    a, b = np.array(start), np.array(end)
    along = np.linspace(0.0, 1.0, 41)
    aside = 0.18 * np.where((along > 0.2) & (along < 0.8), np.sin(2 * np.pi * 10 * along), 0.0)
    across = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a)
    x, y = (a[:, None] + (b - a)[:, None] * along) + across[:, None] * aside
    axes.plot(x, y, "k", linewidth=1)


def _loop() -> Figure:
    """Hysteresis loops of one point: constant normal force, and a normal force that vanishes in a part of the cycle."""
    figure, both = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained", sharey=True)
    angle = np.linspace(0.0, 4 * np.pi, 4001)
    gap = 3.0 * np.sin(angle)
    for axes, normal, title in (
        (both[0], np.ones_like(angle), "constant normal force"),
        (both[1], np.maximum(0.0, 0.7 + 1.1 * np.cos(angle)), "normal force that varies: the contact lifts off"),
    ):
        force, state = _friction(gap, 0.6 * normal)
        last = angle >= 2 * np.pi
        for k, (colour, word) in enumerate(((STICK, "stick"), (SLIP, "slip"), (OPEN, "open"))):
            mine = last & (state == k)
            if mine.any():
                axes.plot(gap[last], np.where(mine, force, np.nan)[last], color=colour, label=word, linewidth=2)
        axes.fill(gap[last], force[last], color="0.93")
        axes.set(title=title, xlabel="relative displacement (µm)")
        axes.title.set_fontsize(10)
        axes.legend(loc="lower center")
    both[0].set_ylabel("friction force (N)")
    return figure


def _friction(gap: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return force and state (0 stick, 1 slip, 2 open) of a spring of 1 N/µm whose force the limit bounds."""
    force, state = np.zeros_like(gap), np.zeros(gap.size, dtype=int)
    for i in range(1, gap.size):
        trial = force[i - 1] + gap[i] - gap[i - 1]
        force[i] = np.clip(trial, -limit[i], limit[i])
        state[i] = 2 if limit[i] == 0.0 else int(force[i] != trial)
    return force, state


def _resonance() -> Figure:
    """Responses of one mass with a sliding spring at five loads, and the backbone through their peaks."""
    amplitude = np.geomspace(0.01, 300.0, 40000)  # over the displacement at which the contact begins to slip
    slip = np.maximum(amplitude, 1.0)
    theta = np.arccos(1.0 - 2.0 / slip)
    spring = (
        0.5 * (theta - 0.5 * np.sin(2 * theta)) / np.pi
    )  # describing function of a spring of half the mass's own stiffness
    loss = 0.01 + 0.5 * 4.0 / np.pi * (slip - 1.0) / slip**2
    figure, axes = plt.subplots(figsize=(7, 3.8), layout="constrained")
    for load in (0.008, 0.1, 0.4, 0.8, 3.0):
        inside = (load / amplitude) ** 2 - loss**2
        held = inside >= 0.0
        half = np.sqrt(np.where(held, inside, np.nan))
        for sign in (-1.0, 1.0):
            square = 1.0 + spring + sign * half
            hz = np.sqrt(np.where(square > 0, square, np.nan))
            axes.plot(hz, amplitude / load, color="tab:blue", linewidth=1)
    axes.plot(np.sqrt(1.0 + spring), 1.0 / loss, color="tab:red", linewidth=2, label="backbone: peaks at all loads")
    axes.plot([], [], color="tab:blue", label="response at one load")
    stuck, free = np.sqrt(1.5), 1.0
    for hz, word in ((stuck, "all contacts stick"), (free, "no friction")):
        axes.axvline(hz, color="0.6", linestyle=":")
        axes.text(hz, 1.1, word, rotation=90, va="bottom", ha="right", color="0.3", fontsize=9)
    axes.set(xlim=(0.85, 1.4), ylim=(1.0, 150.0), yscale="log")
    axes.set(xlabel="frequency over the frequency without friction", ylabel="amplitude per unit of load")
    axes.legend(loc="upper right")
    return figure


def _harmonics() -> Figure:
    """The force of a slipping contact over one period, and its sums of one and of five harmonics."""
    angle = np.linspace(0.0, 4 * np.pi, 4097)[:-1]
    force, _ = _friction(3.0 * np.sin(angle), np.full(angle.size, 0.6))
    force, angle = force[2048:], angle[2048:] - 2 * np.pi
    lines = np.fft.rfft(force) / force.size
    figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
    axes.plot(angle / (2 * np.pi), force, color="0.4", linewidth=3, alpha=0.5, label="friction force")
    for high, colour in ((1, "tab:orange"), (5, "tab:blue")):
        kept = np.where(np.arange(lines.size) <= high, lines, 0.0)
        word = "1 harmonic" if high == 1 else f"harmonics 0 to {high}"
        axes.plot(angle / (2 * np.pi), np.fft.irfft(kept * force.size, force.size), color=colour, label=word)
    axes.set(xlabel="time over the period", ylabel="force (N)")
    axes.legend(loc="lower left")
    return figure


def _wheel() -> Figure:
    """A wheel with one sector marked, and blades that move with two and three nodal diameters."""
    figure, three = plt.subplots(1, 3, figsize=(9, 3.4), layout="constrained")
    for axes, diameters in zip(three, (None, 2, 3), strict=True):
        for k in range(SECTORS):
            middle = 360.0 * k / SECTORS
            moved = 0.0 if diameters is None else np.cos(np.deg2rad(diameters * middle))
            marked = "tab:orange" if k == SECTORS // 4 else "0.9"
            fill = plt.get_cmap("coolwarm")(0.5 + 0.5 * moved) if diameters else marked
            axes.add_patch(Wedge((0, 0), 0.55, middle - 15, middle + 15, width=0.3, facecolor="0.85", edgecolor="0.5"))
            axes.add_patch(Wedge((0, 0), 1.0, middle - 8, middle + 8, width=0.45, facecolor=fill, edgecolor="0.3"))
        for line in range(diameters or 0):
            at = np.pi * (0.5 + line) / (diameters or 1)
            axes.plot([-1.1 * np.cos(at), 1.1 * np.cos(at)], [-1.1 * np.sin(at), 1.1 * np.sin(at)], "k--", linewidth=1)
        axes.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15), aspect="equal")
        axes.set_title("one sector of twelve" if diameters is None else f"{diameters} nodal diameters", fontsize=10)
        axes.axis("off")
    return figure


def _campbell() -> Figure:
    """Two natural frequencies over the speed, three engine orders, and the crossings."""
    figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
    rpm = np.linspace(0.0, 9000.0, 181)
    for order in (2, 4, 6):
        axes.plot(rpm, order * rpm / 60.0, "k--", linewidth=0.8)
        axes.text(9000, order * 150.0, f" EO {order}", va="center")
    for rest, rise in ((260.0, 1.6), (620.0, 1.2)):
        hz = np.sqrt(rest**2 + rise * (rpm / 60.0) ** 2)
        axes.plot(rpm, hz, color="tab:blue")
        for order in (2, 4, 6):
            over = order**2 - rise
            crossing = 60.0 * rest / np.sqrt(over)
            if crossing < rpm[-1]:
                axes.plot(crossing, order * crossing / 60.0, "o", color="tab:red")
    axes.set(xlim=(0, 9900), ylim=(0, 1000), xlabel="speed (rpm)", ylabel="frequency (Hz)")
    axes.spines[["top", "right"]].set_visible(False)
    return figure

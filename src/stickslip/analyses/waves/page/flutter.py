"""Flutter margins on the page: the least stable diagram and a table of all waves."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.waves.page.waves import Waves
from stickslip.report.content import Table, Words
from stickslip.report.plot import ALARM, MUTED, Plot, colour, ring, styled
from stickslip.report.quantities import counted, number
from stickslip.report.section import Block, Card, Section

_NEEDED = ("wave_number", "phase_angle_deg", "damping_by_energy", "damping_by_eigenvalue", "damping")
_PERCENT = 100.0


def least_stable_diagram(view: Waves) -> Plot:
    """Draw the damping of each mode over the inter-blade phase angle."""
    angle, names = view.floats("phase_angle_deg"), view.waves
    energy, eigen, total = (_PERCENT * view.floats(name) for name in _NEEDED[2:])
    figure = go.Figure()
    for m in range(energy.shape[1]):
        mode, line = f"mode {m + 1}", {"color": colour(m), "width": 1.4}
        said = "%{text}: %{y:.4g} %<extra></extra>"
        figure.add_trace(
            go.Scatter(
                x=view.floats("curve_angle_deg"),
                y=_PERCENT * view.floats("curve_damping")[m],
                mode="lines",
                line=line,
                name=f"{mode}, any phase angle",
                hovertemplate="%{x:.0f}°: %{y:.4g} %<extra></extra>",
            )
        )
        for values, how, mark in (
            (energy[:, m], "energy method", {"size": 8, "color": colour(m)}),
            (eigen[:, m], "eigenvalue", ring(colour(m), 12)),
            (
                total[:, m],
                "with the structure's damping",
                {"size": 7, "color": colour(m), "symbol": "x-thin-open", "line": {"width": 1.6}},
            ),
        ):
            texts = [f"{mode}, {name}, {how}" for name in names]
            figure.add_trace(
                go.Scatter(
                    x=angle,
                    y=values,
                    mode="markers",
                    marker=mark,
                    name=f"{mode}, {how}",
                    text=texts,
                    hovertemplate=said,
                )
            )
    required = _PERCENT * view.scalar("required_damping", 0.0)
    figure.add_hline(y=required, line={"color": ALARM, "width": 1, "dash": "dash"})
    styled(figure, 540)
    figure.update_xaxes(title_text="inter-blade phase angle (degrees)", range=[-186, 186], dtick=45)
    figure.update_yaxes(title_text="damping ratio (%)", zeroline=True, zerolinecolor=MUTED)
    i, m = int(view.scalar("least_wave", 0)), int(view.scalar("least_mode", 0))
    below = int(np.count_nonzero(total < required))
    fate = (
        f"{counted(below, 'wave')} and modes lie below the dashed line of {number(required)} %."
        if below
        else f"All lie above the dashed line of {number(required)} %."
    )
    caption = (
        f"Aerodynamic damping over the inter-blade phase angle. The curve follows from the influence coefficients at any angle by "
        f"the energy method; marks are the waves that the wheel has. Angles above zero are waves that run backward, against the "
        f"rotation. The least stable is {names[i]}, mode {m + 1}, with {number(float(total[i, m]), 4)} % of critical "
        f"damping, that of the structure included. {fate}"
    )
    return Plot(f"flutter{view.key}", "Least stable diagram", caption, figure)


def margins(view: Waves) -> Table:
    """Return a table of the damping of each wave: one row a wave and mode, by phase angle."""
    hz, angle = view.floats("frequency_hz"), view.floats("phase_angle_deg")
    shares = [_PERCENT * view.floats(name) for name in _NEEDED[2:]]
    flow = view.floats("frequency_in_flow_hz")
    required = _PERCENT * view.scalar("required_damping", 0.0)
    rows = []
    for m in range(hz.shape[1]):
        for w in np.argsort(angle, kind="stable"):
            told = [number(float(share[w, m]), 4) for share in shares]
            fate = "" if shares[2][w, m] >= required else "unstable" if shares[2][w, m] < 0 else "below required"
            name = view.waves[w]
            rows.append(
                [
                    f"{name}, mode {m + 1}",
                    number(float(angle[w]), 5),
                    number(float(hz[w, m]), 6),
                    number(float(flow[w, m]), 6),
                    *told,
                    fate,
                ]
            )
    head = [
        "wave",
        "phase angle (°)",
        "still fluid (Hz)",
        "in the flow (Hz)",
        "by energy (%)",
        "by eigenvalue (%)",
        "with the structure (%)",
        "",
    ]
    return Table(head, rows, "Margins")


def mistuned(view: Waves) -> Words | None:
    """Return the modes of the mistuned wheel in the flow."""
    if not view.has("wheel_damping"):
        return None
    damping, hertz = _PERCENT * view.floats("wheel_damping"), view.floats("wheel_frequency_hz")
    tuned = _PERCENT * float(view.floats("damping").min())
    grows = int(np.count_nonzero(damping < 0))
    told = (
        f"No wave is a mode then. The least damped mode of the wheel has "
        f"{number(float(damping[0]), 4)} % at {number(float(hertz[0]), 6)} Hz, where the least stable wave of the tuned wheel has "
        f"{number(tuned, 4)} %; {grows} of {len(damping)} modes grow. The coefficients are those of the reference frequency."
    )
    return Words((told,), "With the sectors as they differ")


def _cards(view: Waves) -> list[Card]:
    total = view.floats("damping")
    i, m = int(view.scalar("least_wave", 0)), int(view.scalar("least_mode", 0))
    least, required = float(total[i, m]), view.scalar("required_damping", 0.0)
    note = f"{view.waves[i]}, mode {m + 1}"
    if least < required:
        grow = int(np.count_nonzero(total < 0))
        fate = (
            f"{counted(grow, 'mode')} of all waves unstable"
            if grow
            else f"less than the {number(_PERCENT * required)} % required"
        )
        note += f"; {fate}"
    found = [Card(f"{number(_PERCENT * least, 4)} %", "least damping in the flow", note, least < required)]
    if view.has("wheel_damping"):
        wheel = view.floats("wheel_damping")
        grow = int(np.count_nonzero(wheel < 0))
        note = f"{grow} of {counted(wheel.size, 'mode')} unstable"
        text = f"{number(_PERCENT * float(wheel[0]), 4)} %"
        found.append(Card(text, "least damping with the sectors as they differ", note, wheel[0] < required))
    return found


_BLOCK = Block("flutter", "Flutter", (least_stable_diagram, margins, mistuned))
SECTION: Section = Section("flutter", _NEEDED, Waves, (_BLOCK,), by_case=True, cards=_cards)

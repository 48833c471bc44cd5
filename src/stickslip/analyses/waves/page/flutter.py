"""Flutter margins on the page: the least stable diagram and a table of all waves."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.waves.page.waves import Waves, view_of
from stickslip.analyses.waves.records import Flutter, contact_state, hertz, with_contacts
from stickslip.arrays import FloatArray
from stickslip.report.plot import ALARM, MUTED, Plot, colour, ring, styled
from stickslip.report.quantities import counted, number
from stickslip.report.section import Block, Card, Section, Table, Words

_NEEDED = ("wave_number", "phase_angle_deg", "damping_by_energy", "damping_by_eigenvalue", "damping")
_PERCENT = 100.0


def least_stable_diagram(view: Waves[Flutter]) -> Plot:
    """Draw the damping of each mode over the inter-blade phase angle."""
    found, names = view.found, view.waves
    angle = np.array([w.phase_angle_deg for w in found.waves])
    energy, eigen, total = _percents(found)
    figure = go.Figure()
    for m in range(energy.shape[1]):
        mode, line = f"mode {m + 1}", {"color": colour(m), "width": 1.4}
        said = "%{text}: %{y:.4g} %<extra></extra>"
        figure.add_scatter(
            x=found.curve_angle_deg,
            y=_PERCENT * found.curve_damping[m],
            mode="lines",
            line=line,
            name=f"{mode}, any phase angle",
            hovertemplate="%{x:.0f}°: %{y:.4g} %<extra></extra>",
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
            figure.add_scatter(
                x=angle,
                y=values,
                mode="markers",
                marker=mark,
                name=f"{mode}, {how}",
                text=texts,
                hovertemplate=said,
            )
    required = _PERCENT * view.found.required_damping
    figure.add_hline(y=required, line={"color": ALARM, "width": 1, "dash": "dash"})
    styled(figure, 540)
    figure.update_xaxes(title_text="inter-blade phase angle (degrees)", range=[-186, 186], dtick=45)
    figure.update_yaxes(title_text="damping ratio (%)", zeroline=True, zerolinecolor=MUTED)
    i, m = view.found.least_wave, view.found.least_mode
    state = contact_state(view.found.contacts)
    below = int(np.count_nonzero(total < required))
    fate = (
        f"{counted(below, 'wave')} and modes lie below the dashed line of {number(required)} %."
        if below
        else f"All lie above the dashed line of {number(required)} %."
    )
    caption = (
        f"Aerodynamic damping over the inter-blade phase angle. The curve follows from the influence coefficients at any angle by "
        f"the energy method{f', {state}' if state else ''}; marks are the waves that the wheel has. Angles above zero are waves that run backward, against the "
        f"rotation. The least stable is {names[i]}, mode {m + 1}, with {number(float(total[i, m]), 4)} % of critical "
        f"damping, structural damping included. {fate}"
    )
    return Plot(f"flutter{view.key}", "Least stable diagram", caption, figure)


def _percents(found: Flutter) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (w, n) damping ratios in %: by energy, by eigenvalue, with the structure."""
    energy, eigen = np.array([w.by_energy for w in found.waves]), np.array([w.by_eigenvalue for w in found.waves])
    return _PERCENT * energy, _PERCENT * eigen, _PERCENT * found.damping


def margins(view: Waves[Flutter]) -> Table:
    """Return a table of the damping of each wave: one row a wave and mode, by phase angle."""
    hz, waves = hertz(view.found), view.found.waves
    shares = _percents(view.found)
    required = _PERCENT * view.found.required_damping
    rows = []
    for m in range(hz.shape[1]):
        for w in np.argsort([w.phase_angle_deg for w in waves], kind="stable"):
            told = [number(float(share[w, m]), 4) for share in shares]
            fate = "" if shares[2][w, m] >= required else "unstable" if shares[2][w, m] < 0 else "below required"
            name = view.waves[w]
            rows.append(
                [
                    f"{name}, mode {m + 1}",
                    number(waves[w].phase_angle_deg, 5),
                    number(float(hz[w, m]), 6),
                    number(float(waves[w].in_flow_hz[m]), 6),
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
    return Table(head, rows, with_contacts("Margins", view.found.contacts))


def mistuned(view: Waves[Flutter]) -> Words | None:
    """Return the modes of the mistuned wheel in the flow."""
    modes = view.found.wheel_modes
    if not modes:
        return None
    tuned = _PERCENT * float(view.found.damping.min())
    grows = sum(mode.damping < 0 for mode in modes)
    told = (
        f"With mistuning no wave is a mode. The least damped mode of the wheel has "
        f"{number(_PERCENT * modes[0].damping, 4)} % at {number(modes[0].frequency_hz, 6)} Hz; the least stable wave of the tuned wheel has {number(tuned, 4)} %. Of {len(modes)} modes {grows} grow. The coefficients belong to the reference frequency."
    )
    return Words((told,), "With the sectors as they differ")


def _cards(view: Waves[Flutter]) -> list[Card]:
    total = view.found.damping
    i, m = view.found.least_wave, view.found.least_mode
    least, required = float(total[i, m]), view.found.required_damping
    note = with_contacts(f"{view.waves[i]}, mode {m + 1}", view.found.contacts)
    if least < required:
        grow = int(np.count_nonzero(total < 0))
        fate = (
            f"{counted(grow, 'mode')} of all waves unstable"
            if grow
            else f"less than the {number(_PERCENT * required)} % required"
        )
        note += f"; {fate}"
    found = [Card(f"{number(_PERCENT * least, 4)} %", "least damping in the flow", note, least < required)]
    if wheel := view.found.wheel_modes:
        grow = sum(mode.damping < 0 for mode in wheel)
        note = f"{grow} of {counted(len(wheel), 'mode')} unstable"
        text = f"{number(_PERCENT * wheel[0].damping, 4)} %"
        found.append(Card(text, "least damping with the sectors as they differ", note, wheel[0].damping < required))
    return found


_BLOCK = Block("flutter", "Flutter", (least_stable_diagram, margins, mistuned))
SECTION: Section = Section("flutter", _NEEDED, view_of(Flutter), (_BLOCK,), by_case=True, cards=_cards)

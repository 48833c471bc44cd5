"""Other analyses of compared designs: nonlinear modes, flutter margins, limit cycles."""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.compared.designs import Design
from stickslip.analyses.limit_cycle.page import SECTION as LIMIT_CYCLES
from stickslip.analyses.limit_cycle.page import cycle_table
from stickslip.analyses.nonlinear_mode.page import SECTION as MODES
from stickslip.analyses.nonlinear_mode.page import Modes
from stickslip.analyses.nonlinear_mode.page import table as mode_table
from stickslip.analyses.waves.page.flutter import SECTION as FLUTTER
from stickslip.analyses.waves.page.flutter import margins
from stickslip.analyses.waves.page.waves import Waves
from stickslip.analyses.waves.records import Flutter
from stickslip.report.content import Table, Words
from stickslip.report.plot import DASHES, INK, Plot, styled
from stickslip.report.quantities import NONE, scale_for
from stickslip.report.result import Node, analysis
from stickslip.report.section import Content, Section

View = TypeVar("View", bound=Node)


def told_by(designs: Sequence[Design], section: Section) -> list[tuple[Design, str, Any]]:
    """Return every case of the designs with the analysis of a section: design, label, view."""
    found = []
    for design in designs:
        if section.name in design.tree.children:
            data = analysis(design.tree, section.name)
            for k in range(data.sizes.get("case", 1)):
                view = section.view(data.isel(case=k) if "case" in data.dims else data)
                if view.has(*section.needs):
                    found.append((design, view.text("case_label"), view))
    return found


def stacked(views: Sequence[tuple[Design, str, View]], table: Callable[[View], Table | Words]) -> list[Content]:
    """Join the tables of all cases, with columns for design and case in front; texts of cases without a table follow as a list."""
    head: Sequence[str] = ()
    rows, words = [], []
    for design, label, view in views:
        own, said = table(view), f"**{design.name}**{f' ({label})' * bool(label)}: "
        if isinstance(own, Table):
            head = own.head
            rows += [[design.name, label or NONE, *row] for row in own.rows]
            words += [said + item for item in own.items]
        else:
            words += [said + item for item in own.told]
    found: list[Content] = [Table(["design", "case", *head], rows)] if rows else []
    return [*found, Words(items=words)] if words else found


def nonlinear_modes(designs: Sequence[Design]) -> list[Content]:
    """Return figure and table of the nonlinear modes: frequency and damping over the amplitude."""
    views: list[tuple[Design, str, Modes]] = told_by(designs, MODES)
    if not views:
        return []
    every = np.concatenate([branch.amplitude for _, _, v in views for branch in v.found.branches])
    scale = scale_for(np.array([np.nanmedian(every)]), "m")
    figure = make_subplots(1, 2, horizontal_spacing=0.12)
    for k, (design, label, view) in enumerate(views):
        before = sum(own is design for own, _, _ in views[:k])
        for i, branch in enumerate(view.found.branches):
            name = ", ".join(word for word in (design.name, label, branch.name) if word)
            dash = DASHES[(before + i) % len(DASHES)]
            amplitude = branch.amplitude[branch.known]
            for panel, y in enumerate((branch.frequency_hz, 100.0 * branch.damping_ratio), 1):
                figure.add_scatter(
                    x=scale.factor * amplitude,
                    y=y[branch.known],
                    mode="lines",
                    name=name,
                    legendgroup=name,
                    showlegend=panel == 1,
                    line={"color": design.colour, "width": 1.8, "dash": dash},
                    hovertemplate=f"%{{y:.6g}} at %{{x:.4g}} {scale.unit}<extra>{name}</extra>",
                    row=1,
                    col=panel,
                )
    styled(figure, 420)
    outputs = " or ".join(dict.fromkeys(v.found.output for _, _, v in views))
    figure.update_xaxes(type="log", title_text=f"amplitude of {outputs} ({scale.unit})")
    figure.update_yaxes(title_text="frequency (Hz)", col=1)
    figure.update_yaxes(title_text="damping ratio (%)", col=2)
    caption = "Frequency and damping ratio of the modes over their amplitude."
    plot = Plot("compared_nonlinear_modes", "Nonlinear modes over each other", caption, figure)
    return [plot, *stacked(views, mode_table)]


def flutter(designs: Sequence[Design]) -> list[Content]:
    """Return figure and table of the flutter margins: damping over the phase angle, and all waves."""
    views: list[tuple[Design, str, Waves[Flutter]]] = told_by(designs, FLUTTER)
    if not views:
        return []
    figure = go.Figure()
    for k, (design, label, view) in enumerate(views):
        before = sum(own is design for own, _, _ in views[:k])
        angle = np.array([w.phase_angle_deg for w in view.found.waves])
        order = np.argsort(angle, kind="stable")
        for m, own in enumerate(100.0 * view.found.damping.T):
            name = ", ".join(word for word in (design.name, label, f"mode {m + 1}") if word)
            figure.add_scatter(
                x=angle[order],
                y=own[order],
                mode="lines+markers",
                name=name,
                line={"color": design.colour, "width": 1.4, "dash": DASHES[(before + m) % len(DASHES)]},
                hovertemplate=f"%{{y:.4g}} % at %{{x:.0f}}°<extra>{name}</extra>",
            )
    figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    styled(figure, 440)
    figure.update_xaxes(title_text="inter-blade phase angle (degrees)", dtick=45)
    figure.update_yaxes(title_text="damping ratio (%)")
    caption = "Total damping, of flow and structure, at the waves that the wheels have."
    plot = Plot("compared_flutter", "Flutter margins over each other", caption, figure)
    return [plot, *stacked(views, margins)]


def limit_cycles(designs: Sequence[Design]) -> list[Content]:
    """Return the limit cycles of all designs in one table."""
    return stacked(told_by(designs, LIMIT_CYCLES), cycle_table)

"""Stress at the peak on the page: utilisation of the worst place, its picture, Haigh diagram, table, and its cycle."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.at_peak.contacts import chosen_case
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import STRESS_AT, SurfaceStress, holds, read
from stickslip.analyses.forced_response.verdicts.margin import Place, name_of, places_of, size_of, worst_of
from stickslip.analyses.pictures import space, surface
from stickslip.arrays import FloatArray
from stickslip.model.strength import history, von_mises
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, INK, MUTED, Plot, legend_above, styled
from stickslip.report.quantities import aligned, number, percent, quantity
from stickslip.report.section import Card, Chooser, Table

MPA = 1e6
MM = 1e3
SAMPLES = 128  # of the cycle of the worst place
SHOWN = 3  # cycles in the figure
DRAWN = 0.02  # of the largest alternating stress, from which a node is in the Haigh diagram
_SCALE = [[0.0, "#f2f5f9"], [0.5, "#56b4e9"], [0.8, "#e69f00"], [1.0, "#d55e00"]]


def _of(response: Response, case: ShownCase) -> SurfaceStress | None:
    if not holds(SurfaceStress, response.data):
        return None
    own = read(SurfaceStress, response.data, case.index)
    return own if np.isfinite(own.alternating_stress).any() else None


def _known(response: Response) -> dict[ShownCase, SurfaceStress]:
    each = {case: _of(response, case) for case in response.peaked}
    return {case: own for case, own in each.items() if own is not None}


def stressed_case(response: Response) -> Chooser | None:
    """Return the buttons that choose the case of the figures below; None without stress."""
    return chosen_case(response) if _known(response) else None


def stress_card(response: Response) -> Card | None:
    """Return the utilisation of the worst place: of the only case, or the smallest over all cases; None without stress."""
    worst = {case: place for case, own in _known(response).items() if (place := worst_of(own)) is not None}
    if not worst:
        return None
    case = min(worst, key=lambda c: (np.isnan(worst[c].utilisation), worst[c].utilisation))
    place = worst[case]
    doubt = f", {response.level(case)}" if response.trust(case) else ""
    told = f"{place.name}{case.where}: {size_of(place.alternating)} alternating, {size_of(place.mean)} mean{doubt}"
    if np.isnan(place.utilisation):
        return Card("Void", "margin: the stress is above yield", told, danger=True)
    if np.isinf(place.utilisation):
        return Card("Nothing endured", "the mean stress is beyond the static limit", told, danger=True)
    of = "smallest utilisation of the fatigue limit" if len(worst) > 1 else "utilisation of the fatigue limit"
    return Card(number(place.utilisation, 3), of, told, danger=place.utilisation >= 1.0)


def stress_surface(response: Response) -> Plot | None:
    """Draw the utilisation on the surfaces of the parts."""
    known = {case: own for case, own in _known(response).items() if own.stress_triangle is not None}
    if not known:
        return None
    figure, captions = go.Figure(), {}
    top = max(float(np.nanmax(_free(own), initial=0.0)) for own in known.values())
    for case, own in known.items():
        shown = np.where(np.isfinite(own.utilisation), own.utilisation, top)
        figure.add_trace(_coloured(own, shown, top, case))
        places = places_of(own, own.worst_place)
        figure.add_trace(_marks(own, places, case))
        captions[case.index] = _caption(own, places)
    points = next(iter(known.values())).stress_point * MM
    found = points[np.isfinite(points).all(axis=1)]
    styled(figure, 520)
    figure.update_layout(scene=space(found.min(axis=0), found.max(axis=0), close=False))
    legend_above(figure)
    caption = "Alternating stress over the stress that the material endures at its mean, or that of the criterion, at the peak, on the surfaces of the meshed parts."
    return Plot("stress_surface", "Utilisation at the peak", caption, figure, captions, response.chosen)


def _free(own: SurfaceStress) -> FloatArray:
    return np.asarray(own.utilisation[(own.stress_at == 0) & np.isfinite(own.utilisation)])


def _coloured(own: SurfaceStress, shown: FloatArray, top: float, case: ShownCase) -> go.Mesh3d:
    assert own.stress_triangle is not None
    drawn = surface(own.stress_point * MM, own.stress_triangle, name="utilisation", meta=case.index)
    bar = {"title": {"text": "utilisation"}, "thickness": 14, "len": 0.75}
    return drawn.update(
        intensity=shown.astype(np.float32),
        colorscale=_SCALE,
        cmin=0.0,
        cmax=top or 1.0,
        colorbar=bar,
        flatshading=False,
    )


def _marks(own: SurfaceStress, places: list[Place], case: ShownCase) -> go.Scatter3d:
    x, y, z = (own.stress_point[own.worst_place[: len(places)]] * MM).T
    texts = [str(k + 1) if k == 0 else "" for k in range(len(places))]
    mark = {"size": [6] + [3] * (len(places) - 1), "color": INK}
    return go.Scatter3d(
        x=x, y=y, z=z, mode="markers+text", text=texts, marker=mark, name="ten worst places", meta=case.index
    )


def _caption(own: SurfaceStress, places: list[Place]) -> str:
    if not places:
        return "No place is away from contacts, joins, supports and loads."
    first = places[0]
    kinds = (name for code, name in enumerate(STRESS_AT) if code and np.any(own.stress_at == code))
    apart = ", ".join(
        f"{size_of(float(np.nanmax(own.alternating_stress[own.stress_at == STRESS_AT.index(kind)])))} at a {kind}"
        for kind in kinds
    )
    singular = f" Listed apart, as elastic stress is singular there: up to {apart} (alternating)." if apart else ""
    by = "" if np.isfinite(first.allowed) or np.isnan(first.utilisation) else f" by {name_of(own)}"
    return f"Worst: {first.name} ({first.where} mm), utilisation {number(first.utilisation, 3)}{by}.{_scaled(own)}{singular}"


def _scaled(own: SurfaceStress) -> str:
    """Say at which amplitude the limit is reached."""
    if not np.isfinite(own.allowed_amplitude):
        return ""
    how = (
        "an estimate, as contacts slip, open or are nonlinear springs"
        if own.stress_slips
        else "exact while contacts stick"
    )
    return f" It reaches its limit at {quantity(float(own.allowed_amplitude), 'm')} of the report output, by scaling the vibration: {how}."


def haigh(response: Response) -> Plot | None:
    """Draw the Haigh diagram with the surface nodes."""
    known = {case: own for case, own in _known(response).items() if np.isfinite(own.haigh_amplitude).any()}
    if not known:
        return None
    figure, captions = go.Figure(), {}
    for case, own in known.items():
        line = {"color": INK, "width": 2}
        x, y = own.haigh_mean / MPA, own.haigh_amplitude / MPA
        figure.add_trace(go.Scatter(x=x, y=y, mode="lines", line=line, name="endured", meta=case.index))
        for free, name, colour, size in (
            (False, "contact, joint, support, load", MUTED, 3),
            (True, "other nodes", "#0072b2", 4),
        ):
            at = ((own.stress_at == 0) == free) & (own.alternating_stress > DRAWN * np.nanmax(own.alternating_stress))
            dot = {"color": colour, "size": size}
            x, y = own.mean_stress[at] / MPA, own.alternating_stress[at] / MPA
            figure.add_trace(go.Scattergl(x=x, y=y, mode="markers", marker=dot, name=name, meta=case.index))
        worst = own.worst_place[own.worst_place >= 0]
        x, y = own.mean_stress[worst] / MPA, own.alternating_stress[worst] / MPA
        mark = {"color": ALARM, "size": 8, "symbol": "diamond"}
        figure.add_trace(go.Scatter(x=x, y=y, mode="markers", marker=mark, name="ten worst places", meta=case.index))
        captions[case.index] = _margin_words(own)
    styled(figure, 420)
    legend_above(figure)
    figure.update_xaxes(title_text="mean stress (MPa)")
    figure.update_yaxes(title_text="alternating stress (MPa)", rangemode="tozero")
    caption = "Alternating stress: largest equivalent stress of the vibration over its phase. Mean: equivalent stress of the static state, signed by its largest principal stress."
    return Plot("haigh", "Haigh diagram at the peak", caption, figure, captions, response.chosen)


def _margin_words(own: SurfaceStress) -> str:
    place = worst_of(own)
    if place is None:
        return ""
    if np.isnan(place.utilisation):
        return f"Worst: {place.name}. Its stress is above yield, there is no margin."
    return f"Line: {name_of(own)}, limits of the worst place. Worst: {place.name}, factor {number(1 / place.utilisation, 3)} to the line."


def worst_places(response: Response) -> Table | None:
    """List the ten worst places of each case."""
    rows: list[list[str]] = []
    for case, own in _known(response).items():
        places = places_of(own, own.worst_place)
        columns = [
            aligned(np.array([getattr(p, name) for p in places]) / MPA, 4)
            for name in ("alternating", "mean", "allowed")
        ]
        used = aligned(np.array([p.utilisation for p in places]), 3)
        for k, place in enumerate(places):
            values = [column[k] for column in columns]
            rows.append(
                [
                    case.short,
                    place.name,
                    place.where,
                    *values,
                    used[k],
                    percent(100 * place.mesh_error),
                    percent(100 * place.correction),
                ]
            )
    if not rows:
        return None
    head = [
        "place",
        "x, y, z (mm)",
        "alternating (MPa)",
        "mean (MPa)",
        "endured (MPa)",
        "utilisation",
        "mesh error",
        "left-out modes",
    ]
    told = [
        "Away from contacts, joins, supports and loaded nodes. The mesh error is estimated from the jump of stress between elements (energy norm); the last column is the change by modes that the reduction leaves out, which is included."
    ]
    return response.table("Worst places", told, head, rows)


def stress_cycle(response: Response) -> Plot | None:
    """Draw the stress of the worst places over a period."""
    known = _known(response)
    if not known:
        return None
    figure, captions = go.Figure(), {}
    time = np.linspace(0, 1, SAMPLES + 1)
    for case, own in known.items():
        harmonics = np.nan_to_num(own.worst_stress[..., 0] + 1j * own.worst_stress[..., 1])
        static = harmonics[:1].real
        moving = history(np.concatenate([np.zeros_like(harmonics[:1]), harmonics[1:]]), SAMPLES)
        moving = np.concatenate([moving, moving[:1]])
        for k, place in enumerate(places_of(own, own.worst_place)[:SHOWN]):
            for values, dash, what in (
                (moving[:, k], "solid", "vibration"),
                (static[0, k] + moving[:, k], "dot", "with the static stress"),
            ):
                line = {"dash": dash, "width": 2, "color": ("#0072b2", "#d55e00", "#009e73")[k]}
                figure.add_trace(
                    go.Scatter(
                        x=time,
                        y=von_mises(values) / MPA,
                        mode="lines",
                        line=line,
                        name=f"{place.name}, {what}",
                        meta=case.index,
                    )
                )
        captions[case.index] = ""
    styled(figure, 380)
    legend_above(figure)
    figure.update_xaxes(title_text="time / period")
    figure.update_yaxes(title_text="equivalent stress (MPa)", rangemode="tozero")
    caption = "Equivalent stress (von Mises) at the three worst places over a period."
    return Plot("stress_cycle", "Stress over the cycle", caption, figure, captions, response.chosen)

"""Terminal tables of the analyses by waves."""

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.collected import told_apart
from stickslip.analyses.waves.of_wheel import table as of_wheel
from stickslip.analyses.waves.records.results import label, wave_name
from stickslip.study.analysis import TextTable

LEAST = 5  # modes of a mistuned wheel that are shown
MOST_PAIRS = 30  # of an interference table on the screen
NEARBY = 0.2  # margin up to which the tangent of a frequency over the speed is good to a digit after the point


def of_cases(data: xr.Dataset, tables: Callable[[xr.Dataset], Sequence[TextTable]]) -> tuple[TextTable, ...]:
    """Return the tables of each case, and the effects of the centrifugal load; equal cases share their tables."""
    found = []
    for case, head in told_apart(data):
        if not case.sizes.get("wave"):
            continue
        made = (*tables(case), *_static(case))
        found += [TextTable(f"{head}{t.title}", t.head, t.rows) for t in made]
    return tuple(found)


def modes_tables(case: xr.Dataset) -> list[TextTable]:
    """Return the natural frequencies at a speed, and their differences from the reference."""
    names, hertz = _names(case), case["frequency_hz"].values
    head = ("wave", "kind", *(f"{m + 1}" for m in range(hertz.shape[1])))
    rows = tuple((*name, *(f"{f:.7g}" for f in own)) for name, own in zip(names, hertz, strict=True))
    tables = [TextTable(f"Natural frequencies in Hz {_at(case.attrs['speed_rpm'])}", head, rows)]
    if "stage_share" in case:
        tables.append(_stiffest_table(case, names, head))
        tables.append(_stage_table(case, names, head))
    if "damped_hz" in case and np.isfinite(case["damped_hz"]).any():
        tables.append(_damped_table(case, names))
    tables += of_wheel(case)
    if "difference" in case and np.isfinite(case["difference"]).any():
        off = case["difference"].values
        worst = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
        title = (
            f"Relative differences from the reference; the largest is {off[worst]:.2e} "
            f"({names[worst[0]][0]}, mode {worst[1] + 1})"
        )
        rows = tuple(
            (*name, *(f"{d:.1e}" if np.isfinite(d) else "-" for d in own))
            for name, own in zip(names, off, strict=True)
            if np.isfinite(own).any()
        )
        tables.append(TextTable(title, head, rows))
    return tables


def _stiffest_table(case: xr.Dataset, names: Sequence[tuple[str, str]], head: tuple[str, ...]) -> TextTable:
    """Return the frequencies with the uncoupled harmonics of the flanges fixed."""
    rows = tuple(
        (*name, *(f"{f:.7g}" for f in own)) for name, own in zip(names, case["stiffest_hz"].values, strict=True)
    )
    return TextTable("The same in Hz, all harmonics held that flanges do not couple", head, rows)


def _stage_table(case: xr.Dataset, names: Sequence[tuple[str, str]], head: tuple[str, ...]) -> TextTable:
    """Return the share of each stage in the energy of each mode."""
    counts = zip(case["stage_name"].values, case["stage_sectors"].values, strict=True)
    stages = [f"{name} ({count} sectors)" for name, count in counts]
    rows = tuple(
        (name, stage, *(f"{share:.1%}" for share in shares))
        for (name, _), own in zip(names, case["stage_share"].values, strict=True)
        for stage, shares in zip(stages, own.T, strict=True)
    )
    return TextTable("Share of each stage in the kinetic energy", (head[0], "stage", *head[2:]), rows)


def flutter_tables(case: xr.Dataset) -> list[TextTable]:
    """Return the damping of each wave, and the least stable one."""
    labels, total = _labels(case), case["damping"].values
    i, m = int(case.attrs["least_wave"]), int(case.attrs["least_mode"])
    required = float(case.attrs["required_damping"])
    columns = ("frequency_hz", "damping_by_energy", "damping_by_eigenvalue", "damping")
    rows = tuple(
        _flutter_row(labels[w], float(case["phase_angle_deg"][w]), n, [float(case[c][w, n]) for c in columns], required)
        for n in range(total.shape[1])
        for w in np.argsort(case["phase_angle_deg"].values, kind="stable")
    )
    head = ("wave", "phase angle deg", "mode", "Hz", "by energy %", "by eigenvalue %", "with structure %", "")
    title = (
        f"Flutter margins {_at(case.attrs['speed_rpm'])}: the least stable is {labels[i]}, mode {m + 1}, with "
        f"{100 * (total[i, m] - required):.4g} %"
    )
    return [TextTable(title, head, rows), *_mistuned_flutter(case)]


def _mistuned_flutter(case: xr.Dataset) -> list[TextTable]:
    """Return the least damped modes of a mistuned wheel; none for a tuned one."""
    if "wheel_damping" not in case:
        return []
    hertz, damping = case["wheel_frequency_hz"].values, case["wheel_damping"].values
    rows = tuple(
        (f"{f:.6g}", f"{100 * d:.4g}", "UNSTABLE" if d < 0 else "")
        for f, d in zip(hertz[:LEAST], damping[:LEAST], strict=True)
    )
    title = f"The wheel, its sectors as they differ: least damping {100 * damping[0]:.4g} %"
    return [TextTable(title, ("Hz", "with structure %", ""), rows)]


def _flutter_row(name: str, angle: float, mode: int, numbers: Sequence[float], required: float) -> tuple[str, ...]:
    hertz, *damping = numbers
    told = "UNSTABLE" if damping[-1] < 0 else "below required" if damping[-1] < required else ""
    shares = (f"{100 * d:.4g}" for d in damping)
    return (name, f"{angle:.1f}", f"{mode + 1}", f"{hertz:.6g}", *shares, told)


def _damped_table(case: xr.Dataset, names: Sequence[tuple[str, str]]) -> TextTable:
    """Return frequency and damping of the eigenvalues with aerodynamic forces."""
    hertz, damping = case["damped_hz"].values, case["damping"].values
    rows = tuple(
        (*name, *(f"{f:.7g} ({100 * d:.4g} %)" for f, d in zip(*own, strict=True)))
        for name, own in zip(names, zip(hertz, damping, strict=True), strict=True)
    )
    head = ("wave", "kind", *(f"{m + 1}" for m in range(hertz.shape[1])))
    return TextTable("Damped frequencies in Hz and damping ratios in the flow", head, rows)


def campbell_tables(case: xr.Dataset) -> list[TextTable]:
    """Return frequencies at the ends of the speed range, and the crossings by speed."""
    speeds, hertz = case["speed_rpm"].values, case["frequency_hz"].values
    labels = _labels(case)
    rows = tuple(
        (name, f"{m + 1}", f"{branch[0]:.6g}", f"{branch[-1]:.6g}")
        for name, own in zip(labels, hertz, strict=True)
        for m, branch in enumerate(own.T)
    )
    head = ("wave", "mode", f"{speeds[0]:g} rpm", f"{speeds[-1]:g} rpm")
    columns = ("speed_rpm", "frequency_hz", "engine_order", "wave", "mode")
    crossings = zip(*(case[f"crossing_{name}"].values.tolist() for name in columns), strict=True)
    met = tuple(
        (f"{rpm:.1f}", f"{hz:.2f}", f"{order}", labels[wave], f"{mode + 1}")
        for rpm, hz, order, wave, mode in sorted(crossings)
    )
    title = "Crossings with engine orders that excite the mode"
    return [
        TextTable("Frequencies in Hz", head, rows),
        TextTable(title, ("rpm", "Hz", "engine order", "wave", "mode"), met),
    ]


def safe_tables(case: xr.Dataset) -> list[TextTable]:
    """Return the pairs of engine order and mode, the nearest first."""
    rpm, near = case.attrs["speed_rpm"], int(case["pair_near"].sum())
    pairs = case.sizes["pair"]
    shown = min(max(MOST_PAIRS, near), pairs)
    labels = _labels(case)
    rows = tuple(_pair(case.isel(pair=i), labels) for i in range(shown))
    title = f"At {rpm:g} rpm: {near} near resonances within {case.attrs['margin_percent']:g} %"
    if shown < pairs:
        title += f"; the nearest {shown} of {pairs} pairs"
    at = f"Hz at {rpm:g} rpm"
    head = ("engine order", "wave", "mode", at, "resonance at rpm", "margin %", "")
    return [TextTable(title, head, rows)]


def _pair(pair: xr.Dataset, labels: Sequence[str]) -> tuple[str, ...]:
    verdict = "NEAR" if pair["pair_near"] else "clear" if pair["pair_judged"] else "order not judged"
    return (
        f"{int(pair['pair_engine_order'])}",
        labels[int(pair["pair_wave"])],
        f"{int(pair['pair_mode']) + 1}",
        f"{float(pair['pair_frequency_hz']):.6g}",
        *_meeting(float(pair["pair_resonance_rpm"]), float(pair["pair_margin"])),
        verdict,
    )


def _meeting(rpm: float, margin: float) -> tuple[str, str]:
    """Write the speed of a resonance and its margin with few digits if extrapolated far."""
    if not np.isfinite(rpm):
        return "never", "-"
    if abs(margin) > NEARBY:
        return f"~{float(f'{rpm:.2g}'):.0f}", f"{100 * margin:+.0f}"
    return f"{rpm:.1f}", f"{100 * margin:+.2f}"


def _static(case: xr.Dataset) -> list[TextTable]:
    """Return the effects of the centrifugal load; none without rotation."""
    told = case.attrs
    if not np.isfinite(told["static_rpm"]):
        return []
    head = ("rpm", "largest displacement mm", "largest strain %", "largest rotation deg")
    cells = (
        f"{told['static_rpm']:g}",
        f"{1e3 * told['static_displacement_m']:.4g}",
        f"{100 * told['static_strain']:.3g}",
        f"{np.degrees(told['static_rotation_rad']):.3g}",
    )
    return [TextTable("Static displacement under the centrifugal load", head, (cells,))]


def _at(rpm: float) -> str:
    return f"at {rpm:g} rpm" if rpm else "at rest"


def _parted(case: xr.Dataset) -> bool:
    return bool((2 * case["wave_number"] > case.attrs["sectors"]).any())


def _labels(case: xr.Dataset) -> list[str]:
    sectors = int(case.attrs["sectors"])
    return [label(int(k), sectors, parted=_parted(case)) for k in case["wave_number"]]


def _names(case: xr.Dataset) -> list[tuple[str, str]]:
    """Return names and kinds of the waves; without splitting both directions share the frequencies."""
    sectors = int(case.attrs["sectors"])
    named = [wave_name(int(k), sectors) for k in case["wave_number"]]
    if sectors == 1:
        return [("whole", "")] * len(named)
    parted = _parted(case)
    return [(f"ND {diameter}", kind if parted or kind == "standing" else "both ways") for diameter, kind in named]

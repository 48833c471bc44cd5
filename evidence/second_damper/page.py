"""The page on the second damper: what was looked for, what was found, and what no candidate shows."""

from collections.abc import Sequence

from evidence.models.two_blades import COARSER, SHIPPED
from evidence.second_damper.mesh import Refined
from evidence.second_damper.search import (
    ALIKE,
    ASKED,
    BALANCED,
    CLOSED,
    JUDGED,
    LENGTH,
    LOWEST,
    ONSET,
    PUBLISHED,
    SHARES,
    STUCK,
    Found,
    named,
)
from stickslip.study.models.study import read_study

SHOWN = 12  # rows of the table
HEAD = (
    "damper",
    "normal forces",
    *(f"R slips at {r:g}" for r in JUDGED),
    *(f"peak at {r:g}" for r in JUDGED),
    "1 to 5 harmonics",
    "alert",
    f"at {LOWEST:g}",
    "not shown",
)


def _row(found: Found) -> list[str]:
    missing = [name for name, so in found.holds().items() if not so]
    low = found.few[LOWEST]
    asunder = f"{100 * max(map(found.off, JUDGED)):.1f} %" if found.many else "–"
    lowest = f"R slips {100 * low.slips[2]:.0f} %, flat side {100 * max(low.slips[:2]):.0f} %, L1 or L2 open {100 * max(low.opens[:2]):.0f} %"
    return [
        named(found.candidate),
        "/".join(f"{v:.0f}" for v in found.static) + " N",
        *(f"{100 * found.few[r].slips[2]:.0f} %" for r in JUDGED),
        *(f"{100 * found.of_stuck(r):.1f} % ({(found.many or found.few)[r].hertz:.1f} Hz)" for r in JUDGED),
        asunder,
        "/".join(f"{100 * found.alarms[r]:.1f} %" for r in PUBLISHED) if found.alarms else "–",
        lowest,
        "; ".join(missing) or "nothing",
    ]


def _table(rows: Sequence[Found]) -> list[str]:
    cells = [list(HEAD), ["---"] * len(HEAD), *map(_row, rows)]
    return ["| " + " | ".join(row) + " |" for row in cells]


def page(
    first: Sequence[Found], second: Sequence[Found], none: int, meshes: Sequence[Refined], reduction: float
) -> str:
    """Return the page of the documentation.

    Parameters
    ----------
    first, second
        What was found, the best first: of all angles and lines, and of the best one with other damping, place of the force and mass.
    none
        How many could not be built or held.
    meshes, reduction
        The second bending on finer and finer meshes, and the error of the reduced frequencies.
    """
    whole = [f for f in first if f.score == ASKED]
    best = first[0]
    counts = [f"- {name}: {sum(f.holds()[name] for f in first)} of {len(first)}" for name in best.holds()]
    keys = [
        f"`{k} = {_toml(v)}`" for k, v in best.candidate.values.items() if k.startswith("part.") or k.endswith("share")
    ]
    closest = max((f for f in (*first, *second) if f.score == ASKED), key=_near, default=best)
    damping = 100 * float(read_study(SHIPPED).file.raw["damping"]["ratio"])
    held = f" ({none} more could not be built or held)" if none else ""
    lines = [
        "# A damper for the second bending mode",
        "",
        "*Written by `make pages NAME=second-damper`; do not edit.*",
        "",
        f"The second damper of {{cite:t}}`gastaldi2017` (sections 5.4 and 7, figures 9 to 11) works at the second bending mode of the same blades. This page describes the search for a damper that behaves like it; `examples/second_bending` is the result. The paper gives the behaviour of the damper, but not its angles and lines. `evidence/second_damper` varies these on the blades of `examples/two_blades` with elements {COARSER:g} times as large, with their damping ({damping:g} %) and the place of their force. The damper is a full prism of steel, {1e3 * LENGTH:g} mm long, with the section that follows from its lines and angles. R stands where the pull without friction would press L1 and L2 equally. *Seated* dampers begin from a static state that was found with {100 * (SHARES[1] or 0):g} % of the friction (`static_friction_share`), as if vibration had let them slide into place. The others begin from unstretched springs, as in the paper.",
        "",
        f"These properties are required, at the peaks of the responses with one harmonic at {STUCK:g} and at {', '.join(f'{r:g}' for r in (ONSET, *JUDGED))}, and how many of {len(first)} dampers show it{held}:",
        "",
        *counts,
        "",
        f"Definitions. L1 and L2 share the pull if neither carries less than {BALANCED:g} of the other. They stay closed if none of their points is open for more than {100 * (1 - CLOSED):.0f} % of the time. One harmonic is enough if its peaks are within {100 * ALIKE:g} % of those with five. The alert never asks if it predicts at most {100 * ALIKE:g} % along the whole responses at {PUBLISHED[0]:g} and {PUBLISHED[1]:g}; this is tested only where everything else holds.",
        "",
        f"All properties hold for {len(whole)}, {sum(f.candidate.share is None for f in whole)} of them not seated. Best first; *R slips*: share of the period, *peak*: over the force, of that in full stick, *alert*: largest predicted error at {PUBLISHED[0]:g} and {PUBLISHED[1]:g}:",
        "",
        *_table(first[:SHOWN]),
        "",
        f"`examples/second_bending` has the first of them: {', '.join(keys)}.",
        "",
        "## Other damping, place of the force and mass",
        "",
        "The first of the table, with other values of quantities that the paper does not give (damping ratio, place of the force as a share of the airfoil's span, mass over that of the full section):",
        "",
        *_table(second),
        "",
        "## Mesh and modes",
        "",
        f"The second bending mode is the lowest mode above the first pair that moves by more than nine tenths along the circumference. On the free blades, not reduced, it has {_meshes(meshes)}. Reduction with the study's fixed-interface modes changes the frequencies up to it, free and stuck, by at most {100 * reduction:.2f} %.",
        "",
        "## What no candidate shows",
        "",
        f"The paper finds the damper *quite close to the full stick case* at 11.7. None of the dampers with all properties is: the nearest ({named(closest.candidate)}) has {100 * closest.of_stuck(PUBLISHED[-1]):.0f} % of the peak in full stick. Slip must begin between 230 and 30. So at 11.7 the force is at least {30 / PUBLISHED[-1]:.1f} times that of the first slip, and the dissipation at R is large beside the damping of the blades, {damping:g} % here. With more damping the peak is nearer to that in full stick (see above). The frequency stays near: for the first damper of the table it falls by {_fall(best)} from full stick to 11.7.",
        "",
        _below(first),
        "",
    ]
    return "\n".join(lines)


def _meshes(meshes: Sequence[Refined]) -> str:
    told = [f"{m.hertz:.1f} Hz with {m.dofs} dofs (elements {m.factor:g} times those of the example)" for m in meshes]
    last = abs(meshes[-1].hertz / meshes[-2].hertz - 1)
    return f"{', '.join(told)}; the last refinement changes it by {100 * last:.2f} %"


def _near(found: Found) -> float:
    return -abs(1 - found.of_stuck(PUBLISHED[-1]))


def _fall(found: Found) -> str:
    """Return by how much the frequency of the peak falls from full stick to the published ratio, in percent."""
    return f"{100 * (1 - found.many[PUBLISHED[-1]].hertz / found.few[STUCK].hertz):.1f} %"


def _below(first: Sequence[Found]) -> str:
    """Say what becomes of the dampers that show all at the lowest ratio."""
    whole = [f for f in first if f.score == ASKED]
    glued = sum(f.few[LOWEST].glued for f in whole)
    alike = sum(f.off(LOWEST) <= ALIKE for f in whole)
    slips = [100 * f.few[LOWEST].slips[2] for f in whole]
    return (
        f"At {LOWEST:g}, far below the rig's ratios, the flat side of {glued} of these {len(whole)} still does not slip, and R slips for {min(slips):.0f} to "
        f"{max(slips):.0f} % of the period; one harmonic is within {100 * ALIKE:g} % of five for {alike} of them."
    )


def _toml(value: object) -> str:
    return str(list(value)) if isinstance(value, tuple) else str(value)

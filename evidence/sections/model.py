"""The example of two blades, its contact stiffness given per area, with any points on the sides of its damper."""

from dataclasses import dataclass
from functools import cache
from typing import Any

from evidence.models.two_blades import RATIO, SHIPPED, TwoBlades
from stickslip.analyses.forced_response.problem import question_of
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.model.rigid.dampers import middles
from stickslip.study.file.quantities import build
from stickslip.study.models.study import Study, read_study

STRIP = 0.001  # m, width of the strip of the curved side: only its product with the stiffness per area counts
COARSER = {"airfoil_size_m": 2.0, "foot_size_m": 2.0}  # of elements; platforms keep the example's
SIDES = ("flat", "curved")
STIFFNESSES = ("normal", "tangential", "axial")


@dataclass(frozen=True)
class Patch:
    """What the sides of the damper touch.

    Attributes
    ----------
    length
        Along y, m: the depth of the platforms.
    flat
        Distances from the apex between which the flat side touches, m: from its first line to its last one.
    """

    length: float
    flat: tuple[float, float]

    @property
    def areas(self) -> dict[str, float]:
        """Area of either side, m²."""
        return {"flat": self.length * (self.flat[1] - self.flat[0]), "curved": self.length * STRIP}

    def sections(self, count: int) -> tuple[float, ...]:
        """Return the middles of equal strips along y."""
        return middles(-self.length / 2, self.length / 2, count)

    def crowded(self, count: int) -> tuple[float, ...]:
        """Return unequal places along y, close together at one end: the k-th lies ((k + 1/2) / count)² of the length from it."""
        ends = (0.5 + y / self.length for y in self.sections(count))
        return tuple(self.length * (end**2 - 0.5) for end in ends)

    def lines(self, count: int) -> tuple[float, ...]:
        """Return the middles of equal strips of the flat side."""
        return middles(*self.flat, count)


@cache
def example() -> tuple[Study, Patch]:
    """Return the study, on a mesh that does not depend on the contact points, and what the damper touches."""
    study = read_study(SHIPPED)
    blades: Any = study.tables.part["blades"]
    damper: Any = study.tables.part["damper"]
    shape = build(BladePair, blades)
    sizes = {f"part.blades.{key}": getattr(blades, key) * by for key, by in COARSER.items()}
    angles = {f"part.damper.{s}_angle_deg": getattr(blades, f"{s}_angle_deg") for s in SIDES}
    study = study.replace(
        {
            **sizes,
            **angles,
            **{f"contact.{side}.pairing": "node_to_segment" for side in SIDES},
            "part.blades.nodes_at": [],
            "part.damper.apex_m": list(shape.wedge_apex),
        }
    )
    ends = damper.flat_distances_m[0], damper.flat_distances_m[-1]
    return study, Patch(blades.platform_depth_m, ends)


def points_of_example() -> dict[str, int]:
    """Return how many points either side has in the example."""
    damper: Any = example()[0].tables.part["damper"]
    sections = len(damper.sections_m)
    return {"flat": sections * len(damper.flat_distances_m), "curved": sections}


def stiffness(per: str) -> dict[str, Any]:
    """Return the keys of the contacts' stiffness.

    Parameters
    ----------
    per
        ``area``: that of the example's whole side over its area; ``interface``: of the whole side, in equal parts; ``point``: over the
        number of points in the example, with which all three agree.
    """
    study, patch = example()
    points = points_of_example()
    found: dict[str, Any] = {}
    if per == "area":
        found["part.damper.length_m"] = patch.length
        found["part.damper.flat_between_m"] = list(patch.flat)
        found["part.damper.curved_width_m"] = STRIP
    for side in SIDES:
        table: Any = study.tables.contact[side]
        found[f"contact.{side}.per"] = per
        for word in STIFFNESSES:
            key = f"contact.{side}.{word}_stiffness_n_per_m"
            whole = getattr(table, f"{word}_stiffness_n_per_m")
            if per == "area":
                found |= {key: None, f"{key}3": whole / patch.areas[side]}
            else:
                found[key] = whole / (points[side] if per == "point" else 1)
    return found


def blades_with(
    sections: tuple[float, ...], lines: tuple[float, ...] = (), per: str = "area", **values: Any
) -> TwoBlades:
    """Return the reduced example with other contact points.

    Parameters
    ----------
    sections
        Axial positions, m.
    lines
        Of the flat side: distances from the apex, m; none: the example's.
    per
        As of `stiffness`.
    values
        Of other keys of the study.
    """
    changed = {"part.damper.sections_m": list(sections)} | stiffness(per) | values
    if lines:
        changed["part.damper.flat_distances_m"] = list(lines)
    cases = example()[0].replace(changed).cases()
    ratios = tuple(float(case.values[RATIO]) for case in cases)
    return TwoBlades(question_of(cases[0], cases[0].build()), ratios, tuple(cases))

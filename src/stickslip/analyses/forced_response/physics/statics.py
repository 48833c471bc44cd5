"""Statics of the dampers of a model in words: which flanks can slip, and at which platform angles they cannot."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from stickslip.assembly.assembled import Assembled
from stickslip.response.damper_statics import ANGLES_DEG, DamperStatics, FlankLimits, flanks_of, statics_of
from stickslip.study.verdict import Verdict


def statics_of_dampers(model: Assembled) -> list[DamperStatics]:
    """Return the statics of all rigid dampers whose flanks are all pressed at rest."""
    tuned = model if model.blades is None else model.blades.tuned
    flanks = flanks_of(tuned.system, tuned.contacts.groups, tuned.static_force)
    found = [statics_of(name, own) for name, own in flanks.items()]
    return [one for one in found if one is not None]


def damper_lines(every: Sequence[DamperStatics]) -> Iterator[str]:
    """Yield lines on each damper and its flanks."""
    for one in every:
        held = " and ".join(f"{f.flank.name} with {f.flank.normal:.3g} N" for f in one.flanks)
        yield f"{one.name}: a pull of {one.pull:.4g} N presses {held}"
        for limits in one.flanks:
            yield f"{one.name}: {slip_sentence(limits)}"
            angles = angle_sentence(limits)
            if angles:
                yield f"{one.name}: {angles}"


def of_statics(model: Assembled) -> Iterator[Verdict]:
    """Yield a note on the flanks of each damper: which can slip, and at which platform angles they cannot."""
    for one in statics_of_dampers(model):
        why = "; ".join(_alike(one.flanks, slip_sentence))
        angles = _alike(one.flanks, angle_sentence)
        remedy = " ".join(f"{text[:1].upper()}{text[1:]}." for text in angles)
        yield Verdict("trusted", why=f"{one.name} in static equilibrium: {why}", remedy=remedy)


def _alike(flanks: Sequence[FlankLimits], told: Callable[[FlankLimits], str]) -> list[str]:
    """Return the sentences about flanks; flanks of which the same is said share one."""
    names: dict[str, list[str]] = {}
    for limits in flanks:
        if text := told(limits):
            names.setdefault(text.removeprefix(limits.flank.name), []).append(limits.flank.name)
    found = []
    for text, own in names.items():
        several = text if len(own) == 1 else text.replace(" is ", " are ", 1).replace("; it ", "; they ")
        found.append(f"{' and '.join(own)}{several}")
    return found


def slip_sentence(limits: FlankLimits) -> str:
    """Return whether a flank can slip, with the largest T/N in equilibrium."""
    flank, least = limits.flank, min(limits.most)
    if limits.slips:
        return f"{flank.name} can slip to and fro, T/N reaches the friction coefficient {flank.friction:.2g}"
    return f"{flank.name} cannot slip to and fro, T/N reaches only {least:.2g} of {flank.friction:.2g}"


def angle_sentence(limits: FlankLimits) -> str:
    """Return the platform angles at which a flank could not slip; empty for a flank that is not plane."""
    if not np.isfinite(limits.angle_deg):
        return ""
    own = f"{limits.flank.name} is inclined by {limits.angle_deg:.0f} degrees (0 is square to the pull)"
    ranges = [_range(low, high) for low, high in limits.held_deg]
    return f"{own}; it cannot slip {' and '.join(ranges)}" if ranges else f"{own}; it slips at any angle"


def _range(low: float, high: float) -> str:
    first, last = float(ANGLES_DEG[0]), float(ANGLES_DEG[-1])
    if low <= first and high >= last:
        return "at any angle"
    if low <= first:
        return f"below {high:.0f} degrees"
    return f"above {low:.0f} degrees" if high >= last else f"from {low:.0f} to {high:.0f} degrees"

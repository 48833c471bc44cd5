"""Sections 4.1 to 4.4: how harmonics are coupled, and what the error is taken over."""

import numpy as np

from evidence.figures.evidence import Evidence
from evidence.figures.solve import Pair
from evidence.figures.statements.statement import (
    LARGE,
    OVERLAP,
    SMALL,
    THRESHOLD,
    ZERO,
    Statement,
    judged,
    median,
    percent,
    span,
)
from stickslip.arrays import FloatArray


def statements_of_coupling(e: Evidence) -> list[Statement]:
    """Return the rows of eq. 17 and figure 1, of the error's metric and of the static term."""
    return [*_of_blocks(e), *_of_metric(e), _of_static_term(e)]


def _off(matrix: FloatArray, rows: slice = slice(None)) -> float:
    off = ~np.eye(len(matrix), dtype=bool)
    return float(np.max(matrix[rows][off[rows]]))


def _of_blocks(e: Evidence) -> list[Statement]:
    n = e.norms
    together, frozen, weak = _off(n.stuck), _off(n.frozen), _off(n.weak)
    dynamic = _off(n.stuck, slice(1, None))
    small, large = float(np.max(n.missing_weak)), float(np.max(n.missing))
    quiet = [p for p in e.slipping if p.predicted <= THRESHOLD]
    higher = [p.higher_predicted for p in quiet]
    return [
        Statement(
            section="4.1",
            place="Fig. 1a, eq. 17",
            claim="In full stick harmonics are not coupled: the Jacobian is block-diagonal",
            number="blank off the diagonal",
            own=f"largest block off the diagonal, a stuck contact being 1: sliders frozen where the static load leaves them (with {n.share:g} of the friction) {frozen:.2g}; "
            f"static and dynamic part found together {together:.2g}, of the forces of harmonics 1 and above {dynamic:.2g}",
            verdict=judged(frozen < ZERO) if (frozen < ZERO) == (together < ZERO) else "undecided",
            by=""
            if frozen >= ZERO
            else "in both conventions"
            if together < ZERO
            else f"block-diagonal up to {frozen:.2g} where the static state is found first, not where both are found together ({{doc}}`theory/contact`)",
            why=f"Even frozen sliders couple blocks by {frozen:.2g}.",
        ),
        Statement(
            section="4.1",
            place="Fig. 1b",
            claim="Where some contacts slip, blocks between different harmonics are not empty",
            number="shades only",
            own=f"largest block off the diagonal where one harmonic is just accepted: {weak:.3g} of a stuck contact",
            verdict=judged(weak > OVERLAP),
            why=f"{weak:.2g} is nothing beside 1.",
        ),
        Statement(
            section="4.2",
            place="Fig. 1c",
            claim="ΔJ is small where the coupling is weak, not where it is strong",
            number="shades only",
            own=f"largest block of ΔJ: {small:.3g} in the accepted case with the largest prediction, {large:.3g} where the error is largest at ratio {e.plan.strong:g}",
            verdict=judged(2 * small < large),
            by=f"{large / small:.2g} times",
            why=f"A contact that slips for a part of the period couples harmonics by up to its own stiffness, 1, however little it moves: {small:.2g} already where {percent(max(p.predicted for p in quiet))} are predicted.",
        ),
        Statement(
            section="4.2",
            claim="Where the coupling is weak, harmonics above one of q + Δq are negligible beside the first",
            own=f"{len(quiet)} accepted frequencies that slip: at the tip at most {percent(max(higher, default=np.nan), 2)}, median {percent(median(higher), 2)}",
            verdict="not tested" if not higher else judged(max(higher) < THRESHOLD),
            why=f"Largest {percent(max(higher, default=np.nan), 2)}.",
        ),
    ]


def _of_metric(e: Evidence) -> list[Statement]:
    some = e.slipping
    logs = np.log(np.array([[p.predicted, max(p.predicted0, ZERO)] for p in some]))
    alike = float(np.corrcoef(logs.T)[0, 1])
    ratio = median(list(np.exp(logs[:, 1] - logs[:, 0])))
    near = min(some, key=lambda p: abs(p.predicted - 0.035))
    least, most = float(np.min(near.predicted_contact)), float(np.max(near.predicted_contact))
    return [
        Statement(
            section="4.3",
            claim="Err0, of the static term, has a trend very similar to that of Err1",
            own=f"correlation of their logarithms {alike:.2f} over {len(some)} slipping frequencies",
            verdict=judged(alike > 0.8),
            why=f"Correlation {alike:.2f}; the mean of the tip moves by {percent(median([p.real0 for p in some]), 2)} (median) between one and five harmonics, its vibration by {percent(median([p.real for p in some]), 2)}.",
        ),
        Statement(
            section="4.3",
            claim="Err0 is less sensitive than Err1",
            own=f"median Err0/Err1 = {ratio:.2g}",
            verdict=judged(ratio < 1.0),
            why=f"The static displacement of the tip changes {ratio:.2g} times as much as its vibration.",
        ),
        Statement(
            section="4.3",
            claim="Errors at the contact dofs are consistent with those at the outputs",
            number="3.5 % at the tip, 2.6 to 4.1 % at the contacts",
            own=f"{percent(near.predicted)} at the outputs ({near.hertz:.2f} Hz, ratio {near.ratio:g}), {span(near.predicted_contact)} at the contacts",
            verdict=judged(least > near.predicted / 2 and most < 2 * near.predicted),
            by=_contact_share(e),
            why=f"At the contacts {least / near.predicted:.2g} to {most / near.predicted:.2g} times the error at the outputs.",
        ),
    ]


def _band(e: Evidence) -> list[Pair]:
    return [p for p in e.slipping if SMALL <= p.predicted <= LARGE]


def _contact_share(e: Evidence) -> str:
    share = [float(np.max(p.real_contact) / p.real) for p in _band(e)]
    if not share:
        return ""
    return f"in the 0.5 to 5 % band the largest actual error at a contact is {min(share):.2g} to {max(share):.2g} times that at the outputs"


def _of_static_term(e: Evidence) -> Statement:
    static = float(e.norms.weak[1, 0])
    return Statement(
        section="4.4",
        place="Fig. 1b, 1c",
        claim="The coupling of the static term with the harmonics is not negligible",
        number="shades only",
        own=f"mean displacement on forces of harmonic 1 where one harmonic is just accepted: {static:.3g} of a stuck contact",
        verdict=judged(static > OVERLAP),
        why=f"{static:.2g} beside 1.",
    )

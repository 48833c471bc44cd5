"""The sweep that the table [forced_response] becomes."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from stickslip.analyses.forced_response.table import ForcedResponse
from stickslip.assembly.forces import ANSWER
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.response.forced.choices import RUNGS, RelativeTo
from stickslip.response.forced.response import Sweep
from stickslip.study.file.harmonics import HIGHEST
from stickslip.units import HZ, RPM

MULTIPLE = 3  # of the highest harmonic that loads drive, which friction answers with
ALONE = 1e-3  # of a frequency that stands alone: half the width of its range


def sweep_of(settings: Any, engine_order: int | None, driven: Iterable[int] = (1,)) -> Sweep:
    """Return the sweep that a study's tables ask for.

    Parameters
    ----------
    settings
        With the tables ``forced_response``, ``harmonics`` and ``solver``.
    engine_order
        Of the frequency, for a response over speed; None: the loads have none.
    driven
        Harmonics that loads act in.

    Raises
    ------
    InputError
        If a response over speed is asked for and no load has an engine order.
    """
    table = settings.forced_response
    sweep = sweep_through(settings, table, _range(table, engine_order), driven)
    own = tuple(HZ * f for f in table.frequencies_hz or ())
    return replace(sweep, at=own, frequencies=table.frequencies or 0)


def sweep_through(settings: Any, table: Any, omega_range: tuple[float, float], driven: Iterable[int]) -> Sweep:
    """Return the sweep of a table with ``direction``, ``points`` and ``peak_points``, harmonics and solver as the study says.

    Parameters
    ----------
    settings
        With the tables ``harmonics`` and ``solver``.
    table
        Whose response it is.
    omega_range
        Lowest and highest frequency, rad/s.
    driven
        Harmonics that loads act in.
    """
    h = settings.harmonics
    low = h.beginning(driven)
    return Sweep(
        omega_range=omega_range,
        direction=table.direction,
        low=low,
        high="auto" if h.high == "auto" else h.high_harmonics,
        samples=h.samples,
        evaluator=settings.solver.evaluator,
        rescue=settings.solver.rescue,
        cap=max(min(RUNGS[-1] * math.gcd(*low), HIGHEST), MULTIPLE * low[-1]),
        threshold=h.alert_threshold_percent / 100,
        selection=h.chooser,
        passages=h.passages,
        error_harmonics=h.alert_harmonics,
        points=table.points,
        peak_points=table.peak_points,
    )


def measured(sweep: Sweep, model: Model) -> Sweep:
    """Return a sweep with the amplitudes that a model asks for, whose errors are those of the answer, or as published where the model names places over which they are taken."""
    relative_to: RelativeTo = "answer" if model.alert_over in ANSWER else "each"
    return replace(sweep, amplitude_of=model.amplitude_of, relative_to=relative_to)


def _range(table: ForcedResponse, engine_order: int | None) -> tuple[float, float]:
    """Return the lowest and the highest excitation frequency, rad/s."""
    if table.speed_rpm is not None:
        if not engine_order:
            raise input_error(
                "forced_response.over",
                "is speed, and no load has an engine order",
                "Give the loads engine_order, or a range frequency_hz.",
            )
        lowest, highest = (engine_order * RPM * n for n in table.speed_rpm)
        return lowest, highest
    given = table.frequency_hz or table.frequencies_hz or []
    lowest, highest = HZ * given[0], HZ * given[-1]
    if lowest == highest:
        return lowest * (1 - ALONE), highest * (1 + ALONE)
    return lowest, highest

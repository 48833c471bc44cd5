"""Time integration of limit cycles: whether a stable cycle is kept, and which of several unstable waves dominates."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.problem import MOST_IN_TIME
from stickslip.analyses.forced_response.stability.in_time import KICK, disturbed
from stickslip.analyses.limit_cycle.problem import Question
from stickslip.analyses.limit_cycle.records import Cycle, CycleBranch
from stickslip.analyses.vibrating import as_wave, coordinate
from stickslip.arrays import ComplexArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.self_excited.in_time import Marched, march_periods, mixed_start, wave_history
from stickslip.response.system import System
from stickslip.response.time.sectors import whole_wheel
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.study.store.progress import LOG
from stickslip.units import HZ, millimetres

STEPS = 512
FEW_STEPS = 256  # time steps of a period in the competition of waves, which takes hundreds of periods
SETTLED = 1e-7
SHARE = 0.3  # initial amplitude of a competing wave, as a share of its attracting cycle


def settle_cycles(question: Question, branch: CycleBranch) -> dict[str, Any]:
    """Return amplitude (m) and frequency (rad/s) in time after a start near each attracting cycle; NaN for other cycles."""
    amplitude, omega = np.full((2, len(branch.cycles)), np.nan)
    said = ""
    for i, cycle in enumerate(branch.cycles):
        if not cycle.attracting:
            continue
        try:
            marched = _from_cycle(question, branch, cycle)
        except StickslipError as error:
            said = str(error)
            continue
        if not marched.overflowed:
            amplitude[i], omega[i] = marched.amplitude[0], marched.frequency[0]
        LOG.info(
            f"time integration: {millimetres(amplitude[i], 5)} at {omega[i] / HZ:.4f} Hz where the balance has "
            f"{millimetres(cycle.amplitude, 5)} at {cycle.omega / HZ:.4f} Hz{_unconfirmed(cycle, marched)}"
        )
    return {"amplitude": amplitude, "omega": omega, "said": said}


def _unconfirmed(cycle: Cycle, marched: Marched) -> str:
    """Return the remark that time integration near an unstable cycle confirms nothing; empty for other cycles."""
    if cycle.stability != "unstable":
        return ""
    return (
        f"; that confirms nothing: the cycle is unstable, and {len(marched.first)} periods may be too few to leave it"
    )


def compete(question: Question, branches: Sequence[CycleBranch]) -> dict[str, Any]:
    """Return the result of a mixed start of all waves of a wheel that are unstable or have an attracting cycle."""
    there = [b for b in branches if b.wave_number != NO_WAVE and (b.ratio < 0.0 or b.attracting)]
    own = {"waves": np.array([b.wave_number for b in there], dtype=np.int64)}
    nothing = {"time": np.zeros(0), "amplitude": np.zeros((0, 0)), "sentence": "", "kept": "[]", "left_out": ""}
    if len({b.wave_number for b in there}) < 2:
        return own | nothing
    try:
        system = as_wave(question.model.system, there[0].wave_number)
        structure, contacts, load, outputs = in_time(system, question)
        motions = _beginnings(question, there)
    except StickslipError as error:
        return own | nothing | {"left_out": str(error)}
    omega = motions[0][1]
    rest = np.zeros((2, structure.n), dtype=complex)
    like = start_from_harmonics(rest, omega, contacts.gap_operator, contacts.laws)
    start = _kicked(mixed_start(motions, like), motions)
    marched = march_periods(structure, contacts, load, omega, outputs, start, question.asked.periods, FEW_STEPS)
    history = wave_history(marched)
    if not history.time.size:
        return own | nothing | {"left_out": f"it grew beyond all numbers in {len(marched.first)} periods"}
    return own | {
        "time": history.time,
        "amplitude": history.amplitude,
        "sentence": history.sentence,
        "kept": json.dumps(list(history.waves)),
        "left_out": "",
    }


def _beginnings(question: Question, branches: Sequence[CycleBranch]) -> list[tuple[ComplexArray, float]]:
    """Return initial amplitudes (n,) of all sectors and frequencies, rad/s, of the waves: a share of their attracting cycle.

    A wave without an attracting cycle begins as its mode, at the amplitude at which it begins to slip. If it never slips,
    the smallest such amplitude of the other waves is taken.
    """
    slips = [b.slip_amplitude for b in branches if np.isfinite(b.slip_amplitude)]
    found = []
    for branch in branches:
        if branch.attracting:
            cycle = branch.attracting[0]
            found.append((SHARE * _motion(question, branch, cycle)[1], cycle.omega))
            continue
        if not slips:
            raise StickslipError("no wave has an amplitude from which on it slips")
        amplitude = branch.slip_amplitude if np.isfinite(branch.slip_amplitude) else min(slips)
        system = as_wave(question.model.system, branch.wave_number)
        mode = next(m for m in question.modes(branch.wave_number) if m.number == branch.mode)
        shape = amplitude / abs(mode.shape[coordinate(system)]) * mode.shape
        full = np.array([np.zeros_like(shape), shape])
        found.append((whole_wheel(system).spread(full)[1], mode.omega))
    return found


def in_time(system: System, question: Question) -> tuple[LinearSide, Interface, HarmonicLoad, IntArray]:
    """Return the model for time integration, and the peak output of each sector.

    Raises
    ------
    StickslipError
        If the model is too large.
    """
    side = system.structure
    at = coordinate(system)
    if side.wheel is None:
        return side, system.interface, question.model.load, np.array([at])
    if side.n * side.wheel.sectors > MOST_IN_TIME:
        raise StickslipError(
            f"time integration marches all sectors, {side.n * side.wheel.sectors} coordinates, more than {MOST_IN_TIME}"
        )
    whole = whole_wheel(system)
    own = whole.structure.n // side.wheel.sectors
    static = np.tile(question.model.load.static[:own], side.wheel.sectors)
    places = at + own * np.arange(side.wheel.sectors)
    return whole.structure, whole.contacts, HarmonicLoad(static), places


def _from_cycle(question: Question, branch: CycleBranch, cycle: Cycle) -> Marched:
    system = as_wave(question.model.system, branch.wave_number)
    structure, contacts, load, outputs = in_time(system, question)
    motion, omega = _motion(question, branch, cycle), cycle.omega
    start = start_from_harmonics(motion, omega, contacts.gap_operator, contacts.laws)
    start = _kicked(start, [(motion[1], omega)])
    return march_periods(
        structure, contacts, load, omega, outputs, start, question.asked.periods, STEPS, settles=SETTLED
    )


def _motion(question: Question, branch: CycleBranch, cycle: Cycle) -> ComplexArray:
    """Return the (H+1, n) amplitudes of a cycle; all sectors of a wheel are included."""
    full = cycle.coefficients[..., 0] + 1j * cycle.coefficients[..., 1]
    if branch.wave_number == NO_WAVE:
        return full
    return whole_wheel(as_wave(question.model.system, branch.wave_number)).spread(full)


def _kicked(start: TransientStart, motions: Sequence[tuple[ComplexArray, float]]) -> TransientStart:
    """Return a start whose velocities are disturbed, differently in each coordinate."""
    size = sum(omega * np.abs(motion) for motion, omega in motions)
    return disturbed(start, np.asarray(size), KICK)

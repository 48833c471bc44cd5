"""What an analysis has found, in its record, is what its variables say, in their units: records made of plain numbers, no model is solved.

Each variable that a result may hold is asserted by some test: the last test here counts them.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from stickslip.analyses.all_motions.analysis import ALL_MOTIONS
from stickslip.analyses.all_motions.records import FOUND, found_motions
from stickslip.analyses.columns import described, variables
from stickslip.analyses.facts import ModelFacts
from stickslip.analyses.forced_response.records.dataset import with_measured
from stickslip.analyses.limit_cycle.analysis import LIMIT_CYCLE
from stickslip.analyses.limit_cycle.records import Cycle, CycleBranch
from stickslip.analyses.modal_synthesis.analysis import MODAL_SYNTHESIS
from stickslip.analyses.modal_synthesis.records import SynthesisLevel
from stickslip.analyses.nonlinear_mode.analysis import NONLINEAR_MODE
from stickslip.analyses.nonlinear_mode.records import END, ModeRecord
from stickslip.analyses.quasi_periodic.analysis import QUASI_PERIODIC
from stickslip.analyses.quasi_periodic.records import TwoFrequencies
from stickslip.analyses.residual_tractions.analysis import RESIDUAL_TRACTIONS
from stickslip.analyses.residual_tractions.records import TractionRecord
from stickslip.analyses.resonance.analysis import RESONANCE
from stickslip.analyses.run_up import records as of_run_up
from stickslip.analyses.run_up.analysis import RUN_UP
from stickslip.analyses.run_up.page import RunUpView, fast, fast_peaks
from stickslip.analyses.run_up.records import (
    OPEN,
    SLIP,
    LinePoint,
    RunUp,
    fast_run_up,
    line_of,
    points_of,
    static_forces,
)
from stickslip.analyses.waves.modes import wheel_modes_in
from stickslip.analyses.waves.records import Modes
from stickslip.analyses.waves.solve import STATIC, skin_note
from stickslip.analyses.waves.solve import _static as static_numbers
from stickslip.reduction.waves import wave
from stickslip.response.all_motions.basins import APERIODIC, DIVERGED, PERIODIC, Basins, share_interval
from stickslip.response.all_motions.found import AllMotions, AtFrequency, MotionAt, MotionBranch
from stickslip.response.bifurcations.side_branch import CLOSES
from stickslip.response.forced.response import OF_PEAK
from stickslip.response.residual_tractions.bounds import Bound
from stickslip.response.resonances.point import PeakPoint
from stickslip.solve.status import Status
from stickslip.study.analysis import named
from stickslip.study.models.measured import MeasuredPeaks, Quantity
from stickslip.study.questions import ANALYSES
from stickslip.study.store.archive import flat
from stickslip.study.store.netcdf import one_case
from stickslip.units import DEG, HZ, RPM

NAN = np.nan
NONE = np.zeros(0)
COORDINATES = {
    "retained": np.array([0, 2]),
    "retained_label": np.array(["a.x", "b.x"]),
    "outputs": np.array([2]),
    "output_label": np.array(["b.x"]),
    "concept": "extended energy balance",
}
SOURCES = [Path(__file__).parents[1] / "src" / "stickslip" / folder for folder in ("analyses", "study")]


def solved(records: Any, notes: Mapping[str, Any] | None = None, **settings: Any) -> Any:
    case = SimpleNamespace(label="", settings=SimpleNamespace(**settings))
    return [SimpleNamespace(case=case, records=records, notes=notes or {})]


def check(data: xr.Dataset | Mapping[str, Any], **expected: Any) -> None:
    """Assert that variables of the first case are as expected, text for text and number for number."""
    for name, value in expected.items():
        found = data[name].values
        found = found[0] if "case" in data[name].dims else found
        wanted = np.asarray(value)
        if wanted.dtype.kind in "US":
            assert found.tolist() == wanted.tolist(), name
        else:
            np.testing.assert_allclose(found, wanted, rtol=1e-12, err_msg=name)


def pairs(*values: complex) -> np.ndarray:
    """Return (…, 2) real and imaginary parts."""
    return np.array([[v.real, v.imag] for v in np.asarray(values, dtype=complex)])


def cycle_branch(k: int, cycles: int, harmonics: int) -> CycleBranch:
    own = np.arange(1.0, cycles + 1) + 10 * k
    moved = k + np.arange(cycles * harmonics * 3 * 2.0).reshape(cycles, harmonics, 3, 2)
    return CycleBranch(
        wave_number=k,
        mode=k + 1,
        omega=100.0 + k,
        ratio=-0.01 * (k + 1),
        slip_amplitude=1e-4 * (k + 1),
        amplitude=1e-3 * np.arange(1.0, 3 + k),
        motion_omega=90.0 + np.arange(2.0 + k),
        damping_ratio=0.1 * np.arange(2.0 + k),
        largest_damping_ratio=0.2 + k,
        largest_damping_amplitude=5e-4 + k,
        cycles=tuple(
            Cycle(
                amplitude=1e-3 * a,
                omega=200.0 + a,
                slope=a,
                harmonics=int(2 * a),
                change=0.01 * a,
                enough=True,
                coefficients=m,
                stability="stable",
                reason=f"why {k}",
                multiplier=0.5 * a,
                multiplier_error=0.05 * a,
                along=0.02 * a,
                growing_wave=3,
                growing_omega=300.0 + a,
            )
            for a, m in zip(own.tolist(), moved, strict=True)
        ),
        lost_cycles=k,
    )


def test_limit_cycles() -> None:
    first, second = cycle_branch(0, 1, 2), cycle_branch(4, 2, 3)
    notes = {
        "model": {"sectors": 6, "output": "b.x"},
        "coordinates": COORDINATES,
        "linear": {"wave": [0, 4], "hertz": [[1.0, 2.0], [3.0, 4.0]], "ratio": [[-0.1, 0.1], [-0.2, 0.2]]},
        "in_time.0": {"amplitude": 7e-3, "omega": 210.0},
        "in_time.1": {"amplitude": [8e-3, 9e-3], "omega": [220.0, 230.0]},
        "competition": {
            "time": [0.0, 1.0],
            "amplitude": [[1.0, 2.0], [3.0, 4.0]],
            "sentence": "wave 4 is left",
            "left_out": "no",
        },
    }
    data = LIMIT_CYCLE.dataset(solved([first, second], notes))
    assert data.attrs["failed"] == 0
    moved = np.zeros((3, 3, 3, 2))
    moved[0, :2], moved[1:] = first.cycles[0].coefficients, [c.coefficients for c in second.cycles]
    check(
        data,
        output="b.x",
        linear_wave=[0, 4],
        linear_frequency_hz=[[1.0, 2.0], [3.0, 4.0]],
        linear_damping_ratio=[[-0.1, 0.1], [-0.2, 0.2]],
        wave_number=[0, 4],
        nodal_diameter=[0, 2],
        mode=[1, 5],
        mode_frequency_hz=np.array([100.0, 104.0]) / HZ,
        mode_damping_ratio=[-0.01, -0.05],
        slip_amplitude=[1e-4, 5e-4],
        largest_damping_ratio=[0.2, 4.2],
        largest_damping_amplitude=[5e-4, 4.0005],
        problem=["", ""],
        lost_cycles=[0, 4],
        amplitude=1e-3 * np.array([[1, 2, *[NAN] * 4], np.arange(1, 7)]),
        frequency_hz=np.array([[90.0, 91.0, *[NAN] * 4], 90 + np.arange(6.0)]) / HZ,
        damping_ratio=0.1 * np.array([[0.0, 1.0, *[NAN] * 4], np.arange(6.0)]),
        cycle_branch=[0, 1, 1],
        cycle_amplitude=[1e-3, 0.041, 0.042],
        cycle_frequency_hz=np.array([201.0, 241.0, 242.0]) / HZ,
        cycle_slope=[1.0, 41.0, 42.0],
        cycle_harmonics=[2, 82, 84],
        cycle_change=[0.01, 0.41, 0.42],
        cycle_enough=[1, 1, 1],
        cycle_stability=["stable"] * 3,
        cycle_reason=["why 0", "why 4", "why 4"],
        cycle_multiplier=[0.5, 20.5, 21.0],
        cycle_multiplier_error=[0.05, 2.05, 2.1],
        cycle_along=[0.02, 0.82, 0.84],
        cycle_growing_wave=[3, 3, 3],
        cycle_growing_frequency_hz=np.array([301.0, 341.0, 342.0]) / HZ,
        cycle_time_amplitude=[7e-3, 8e-3, 9e-3],
        cycle_time_frequency_hz=np.array([210.0, 220.0, 230.0]) / HZ,
        retained_label=["a.x", "b.x"],
        output_label=["b.x"],
        retained_displacement=moved[:, :, [0, 2]],
        output_displacement=moved[:, :, [2]],
        time=[0.0, 1.0],
        wave_amplitude=[[1.0, 2.0], [3.0, 4.0]],
        outcome="wave 4 is left",
        outcome_missing="no",
    )


def test_amplitudes_without_a_motion_are_lost() -> None:
    branch = replace(cycle_branch(0, 0, 1), damping_ratio=np.array([NAN, 0.1]))
    alone = replace(branch, wave_number=-1)
    data = LIMIT_CYCLE.dataset(solved([alone], {"linear": {"wave": [-1], "hertz": [[1.0]], "ratio": [[0.1]]}}))
    assert data.attrs["failed"] == 1
    check(data, nodal_diameter=[-1], wave_number=[-1])
    missing = solved([branch], {"in_time.0": {"amplitude": [], "omega": []}, "model": {"sectors": 3}})
    assert "cycle_time_amplitude" not in LIMIT_CYCLE.dataset(missing)


def mode_records() -> Iterator[ModeRecord]:
    for k, (points, n) in enumerate(((2, 3), (3, 3))):
        for i in range(points):
            yield ModeRecord(
                5 * k,
                k + 1,
                "point",
                index=i,
                amplitude=1e-3 * (i + 1) + k,
                omega=50.0 + i + k,
                ratio=0.1 * (2 - abs(i - 1)) + k,
                modal_amplitude=3.0 + i + k,
                energy=4.0 + i + k,
                slipping=0.5 * i + k,
                open_for=0.25 * i + k,
                change=0.001 * i + k,
                motion=np.full((2 + i, n, 2), 1.0 + i + k),
                order=1 + i,
                status=Status.CONVERGED,
            )
        yield ModeRecord(
            5 * k,
            k + 1,
            END,
            mode_omega=60.0 + k,
            mode_ratio=0.01 + k,
            tolerance=0.5,
            end="gross slip",
            resonant=((), (0, 7, 0))[k],
            other_ratio=0.3 + k,
        )


def test_nonlinear_modes() -> None:
    data = NONLINEAR_MODE.dataset(
        solved(list(mode_records()), {"model": {"sectors": 6, "output": "b.x"}, "coordinates": COORDINATES})
    )
    first, second = np.arange(2.0), np.arange(3.0)

    def both(of: Any) -> np.ndarray:
        return np.array([[*of(first, 0), NAN], [*of(second, 1)]])

    motions = np.full((2, 3, 4, 3, 2), NAN)
    for k in range(2):
        for i in range(2 + k):
            motions[k, i] = 0.0
            motions[k, i, : 2 + i] = 1.0 + i + k
    check(
        data,
        output="b.x",
        wave_number=[0, 5],
        nodal_diameter=[0, 1],
        mode=[1, 2],
        mode_frequency_hz=np.array([60.0, 61.0]) / HZ,
        mode_damping_ratio=[0.01, 1.01],
        accuracy=[0.5, 0.5],
        end=["gross slip"] * 2,
        problem=["", ""],
        gross_slip_amplitude=[NAN, 1.001],
        # the largest of the second mode, 1.2, is on an internal resonance
        largest_damping_ratio=[0.2, 1.1],
        largest_damping_amplitude=[2e-3, 1.001],
        other_damping_ratio=[0.3, 1.3],
        resonant_harmonic=[[0, 0, -1], [0, 7, 0]],
        amplitude=both(lambda i, k: 1e-3 * (i + 1) + k),
        frequency_hz=both(lambda i, k: (50.0 + i + k) / HZ),
        damping_ratio=both(lambda i, k: 0.1 * (2 - abs(i - 1)) + k),
        modal_amplitude=both(lambda i, k: 3.0 + i + k),
        energy=both(lambda i, k: 4.0 + i + k),
        harmonics=[[1, 2, -1], [1, 2, 3]],
        status=[[0, 0, -1], [0, 0, 0]],
        slipping=both(lambda i, k: 0.5 * i + k),
        open_for=both(lambda i, k: 0.25 * i + k),
        change=both(lambda i, k: 0.001 * i + k),
        concept="extended energy balance",
        retained_label=["a.x", "b.x"],
        output_label=["b.x"],
        retained_displacement=motions[:, :, :, [0, 2]],
        output_displacement=motions[:, :, :, [2]],
    )
    assert data.attrs["failed"] == 0


def synthesis_level(level: float, **changes: Any) -> SynthesisLevel:
    own: dict[str, Any] = {
        "level": level,
        "answer": "trusted",
        "why": f"at {level:g}",
        "peak": 2e-3 * level,
        "peak_omega": 100.0,
        "detached_peak": 3e-3 * level,
        "detached_peak_omega": 120.0 + level,
        "foreign": 0.01 * level,
        "output": 0.02 * level,
        "gaps": 0.03 * level,
        "distance": 0.5 * level,
        "overlap": 0.04 * level,
        "growth": 0.9 * level,
        "harmonics": 0.05 * level,
        "resolved": 0.001 * level,
        "detached": int(level),
        "omega": np.array([90.0, 95.0, 100.0, 105.0, 110.0]),
        "amplitude": 1e-3 * level * np.array([0.5, 1.0, 2.0, 1.0, 0.5]),
        "curve": np.zeros(5, dtype=int),
        "stable": np.array([1, 1, 1, 0, 1]),
        "others": 0.01 * level * np.arange(5),
        "alone": np.array([0, 1, 1, 1, 0]),
        "direct_omega": np.array([100.0, 105.0, 110.0]),
        "direct_amplitude": 1e-3 * level * np.array([1.9, 1.25, 0.1]),
        "direct_peak": 1.6e-3 * level,
        "direct_peak_omega": 101.0,
        "seconds": 5.0 * level,
        "direct_seconds": 7.0 * level,
        "passage_omega": np.array([[90.0, 100.0, 110.0], [110.0, 100.0, 90.0]]),
        "passage_amplitude": 1e-3 * level * np.array([[0.5, 1.0, 1.5], [NAN, 1.2, 0.4]]),
        "passage_finished": np.array([1, 0]),
        "passage_change": np.array([0.01, 0.02]) * level,
        "changed": 0.002 * level,
    }
    return SynthesisLevel(**(own | changes))


def test_synthesised_responses() -> None:
    design = {
        "mode": 2,
        "mode_omega": 99.0,
        "mode_ratio": 0.003,
        "homogeneous": 1,
        "seconds": 11.0,
        "amplitude": [1e-3, 2e-3],
        "omega": np.array([98.0, 97.0]),
        "ratio": [0.01, 0.02],
        "level": [1.0, 3.0],
        "peak_omega": np.array([96.0, 95.0]),
        "cycles": [4e-3],
    }
    levels = [synthesis_level(1.0), synthesis_level(2.0, alone=np.array([0, 1, 0, 1, 0]))]
    asked = SimpleNamespace(passage_hz_per_s=(1.0, 2.0))
    data = MODAL_SYNTHESIS.dataset(
        solved(levels, {"design": design, "model": {"output": "b.x"}}, modal_synthesis=asked)
    )
    both = np.array([1.0, 2.0])
    rows = both[:, None]
    check(
        data,
        output="b.x",
        mode=2,
        mode_frequency_hz=99.0 / HZ,
        mode_damping_ratio=0.003,
        homogeneous=1,
        mode_seconds=11.0,
        backbone_amplitude=[1e-3, 2e-3],
        backbone_frequency_hz=np.array([98.0, 97.0]) / HZ,
        backbone_damping_ratio=[0.01, 0.02],
        resonance_level=[1.0, 3.0],
        resonance_frequency_hz=np.array([96.0, 95.0]) / HZ,
        cycle_amplitude=[4e-3],
        level=both,
        answer=["trusted"] * 2,
        why=["at 1", "at 2"],
        peak_amplitude=2e-3 * both,
        detached_peak_amplitude=3e-3 * both,
        detached_peak_frequency_hz=(120.0 + both) / HZ,
        peak_frequency_hz=[100.0 / HZ] * 2,
        foreign=0.01 * both,
        others_in_output=0.02 * both,
        others_in_gaps=0.03 * both,
        next_frequency=0.5 * both,
        overlap=0.04 * both,
        growth=0.9 * both,
        higher_harmonics=0.05 * both,
        resolved=0.001 * both,
        by_harmonics=0.002 * both,
        detached=[1, 2],
        seconds=5.0 * both,
        frequency_hz=np.array([[90.0, 95.0, 100.0, 105.0, 110.0]] * 2) / HZ,
        amplitude=1e-3 * rows * [0.5, 1.0, 2.0, 1.0, 0.5],
        curve=np.zeros((2, 5)),
        stable=[[1, 1, 1, 0, 1]] * 2,
        others=0.01 * rows * np.arange(5),
        alone=[[0, 1, 1, 1, 0], [0, 1, 0, 1, 0]],
        alone_from_hz=[95.0 / HZ, NAN],
        alone_to_hz=[105.0 / HZ, NAN],
        direct_frequency_hz=np.array([[100.0, 105.0, 110.0]] * 2) / HZ,
        direct_amplitude=1e-3 * rows * [1.9, 1.25, 0.1],
        direct_peak_amplitude=1.6e-3 * both,
        direct_peak_frequency_hz=[101.0 / HZ] * 2,
        direct_error=[0.25, 0.25],
        along_error=[-0.2, NAN],
        along_error_hz=[105.0 / HZ, NAN],
        direct_seconds=7.0 * both,
        passage_hz_per_s=[1.0, 2.0],
        passage_frequency_hz=np.array([[[90.0, 100.0, 110.0], [110.0, 100.0, 90.0]]] * 2) / HZ,
        passage_amplitude=1e-3 * both[:, None, None] * np.array([[0.5, 1.0, 1.5], [NAN, 1.2, 0.4]]),
        passage_peak_amplitude=1e-3 * rows * [1.5, 1.2],
        passage_peak_frequency_hz=np.array([[110.0, 100.0]] * 2) / HZ,
        passage_share=[[0.75, 0.6]] * 2,
        passage_finished=[[1, 0]] * 2,
        passage_change=rows * [0.01, 0.02],
    )
    without: dict[str, Any] = dict.fromkeys(("passage_omega", "passage_amplitude"), np.zeros((0, 600)))
    without |= dict.fromkeys(("passage_finished", "passage_change"), NONE)
    plain = MODAL_SYNTHESIS.dataset(
        solved(
            [synthesis_level(1.0, direct_omega=NONE, direct_amplitude=NONE, **without)],
            modal_synthesis=SimpleNamespace(passage_hz_per_s=()),
        )
    )
    assert not {"direct_error", "passage_change", "mode"} & set(plain)


def two_frequency_point(k: int, kind: str, indices: Any, time: float) -> TwoFrequencies:
    count = len(indices)
    return TwoFrequencies(
        first=20.0 + k,
        second=30.0 + k,
        kind=kind,
        why=f"why {k}",
        unknown="u" * k,
        indices=np.array(indices),
        unknowns=np.zeros((count, 1, 2)),
        combined=count - 1,
        amplitude=np.full((count, 2), 5.0 * (k + 1)),
        largest=np.array([5.0, 6.0]) + k,
        least=np.array([3.0, 4.0]) + k,
        rms=np.array([2.0, 1.0]) + k,
        extreme=np.array([8.0, 9.0]) + k,
        envelope=np.arange(4.0) + k,
        left_out=0.01 * (k + 1),
        slip=1e-3 * (k + 1),
        newton_iterations=7 + k,
        time_largest=np.array([time, 6.5]) * (k + 1),
        time_least=np.array([time, 4.5]) * (k + 1),
        time_off=0.001 * (k + 1),
    )


def test_two_frequencies() -> None:
    points = [
        two_frequency_point(0, "two loads", [(0, 0), (1, 0), (0, 1)], 5.5),
        two_frequency_point(1, "not found", [(0, 0)], 5.5),
    ]
    data = QUASI_PERIODIC.dataset(solved(points, {"model": {"output": ["b.x", "c.x"]}}))
    assert data.attrs["failed"] == 1
    amplitude = np.full((2, 3, 2), NAN)
    amplitude[0], amplitude[1, 0] = 5.0, 10.0
    check(
        data,
        output_name=["b.x", "c.x"],
        first_hz=np.array([20.0, 21.0]) / HZ,
        second_hz=np.array([30.0, 31.0]) / HZ,
        kind=["two loads", "not found"],
        why=["why 0", "why 1"],
        unknown=["", "u"],
        combined=[2, 0],
        left_out=[0.01, 0.02],
        slip=[1e-3, 2e-3],
        newton_iterations=[7, 8],
        largest=[[5.0, 6.0], [6.0, 7.0]],
        least=[[3.0, 4.0], [4.0, 5.0]],
        rms=[[2.0, 1.0], [3.0, 2.0]],
        extreme=[[8.0, 9.0], [9.0, 10.0]],
        envelope=[np.arange(4.0), np.arange(4.0) + 1],
        index=[[[0, 0], [1, 0], [0, 1]], [[0, 0]] * 3],
        amplitude=amplitude,
        time_largest=[[5.5, 6.5], [11.0, 13.0]],
        time_least=[[5.5, 4.5], [11.0, 9.0]],
        time_off=[0.001, 0.002],
    )
    untimed = [two_frequency_point(0, "two loads", [(0, 0)], NAN)]
    alone = QUASI_PERIODIC.dataset(solved([replace(untimed[0], time_largest=np.array([NAN, NAN]))]))
    assert not [name for name in alone if str(name).startswith("time_")]


def test_all_motions() -> None:
    branches = (
        MotionBranch(
            "sweep", "it leaves", np.array([10.0, 11.0, 12.0]), np.array([1.0, 2.0, 3.0]), np.zeros((3, 1, 1))
        ),
        MotionBranch("time", CLOSES, np.array([14.0, 13.0]), np.array([5.0, 4.0]), np.zeros((2, 1, 1))),
    )
    moved = np.zeros((1, 1), dtype=complex)
    ends = (0, 0, 1, APERIODIC, DIVERGED, DIVERGED, PERIODIC, PERIODIC, PERIODIC, 0)
    at = (
        AtFrequency(
            11.0,
            (
                MotionAt(1, 0.5, moved, "stable", 0.9, 0.01, 0.02),
                MotionAt(0, 0.25, moved, "unstable", 1.1, 0.03, np.inf),
            ),
            Basins(11.0, ends),
            6,
            True,
        ),
        AtFrequency(12.0, (), Basins(12.0, ()), 8, False),
    )
    found = AllMotions(branches, at, 14, 10, 3.5, 19, True, "not marched")
    data = ALL_MOTIONS.dataset(solved([], {FOUND: flat(found_motions(found, 60, "b.x"))}))
    shares = [share_interval(3, 10), share_interval(1, 10)]
    nothing = [NAN, NAN]
    check(
        data,
        output="b.x",
        frequency_hz=np.array([[10.0, 11.0, 12.0], [14.0, 13.0, NAN]]) / HZ,
        amplitude=[[1.0, 2.0, 3.0], [5.0, 4.0, NAN]],
        origin=["sweep", "time"],
        end=["it leaves", CLOSES],
        isola=[0, 1],
        peak_amplitude=[3.0, 5.0],
        peak_hz=np.array([12.0, 14.0]) / HZ,
        lowest_hz=np.array([10.0, 13.0]) / HZ,
        highest_hz=np.array([12.0, 14.0]) / HZ,
        searched_hz=np.array([11.0, 12.0]) / HZ,
        starts=[10, 0],
        aperiodic=[1, 0],
        diverged=[2, 0],
        unsolved=[3, 0],
        searched_tries=[6, 8],
        searched_spent=[1, 0],
        motion_branch=[[1, 0], [-1, -1]],
        motion_amplitude=[[0.5, 0.25], nothing],
        motion_stability=[["stable", "unstable"], ["", ""]],
        motion_multiplier=[[0.9, 1.1], nothing],
        motion_multiplier_error=[[0.01, 0.03], nothing],
        motion_change=[[0.02, np.inf], nothing],
        motion_count=[[3, 1], [-1, -1]],
        motion_share=[[0.3, 0.1], nothing],
        motion_share_low=[[s[0] for s in shares], nothing],
        motion_share_high=[[s[1] for s in shares], nothing],
        tries=14,
        seconds=3.5,
        solves=19,
        budget_solves=60,
        unmarched="not marched",
        spent=1,
    )


def peak_point(peak: int, value: float, amplitude: float, **changes: Any) -> PeakPoint:
    own: dict[str, Any] = {
        "value": value,
        "omega": 100.0 + value,
        "amplitude": amplitude,
        "phase": -np.pi / 2 + value,
        "slope": 0.1 * value,
        "curvature": -1.0,
        "energy": 2.0 * value,
        "friction": 1.5 * value,
        "below": 1e-3 * value,
        "coefficients": np.zeros((2, 1)),
        "status": Status.CONVERGED,
        "iterations": 3,
        "evaluations": 4,
        "peak": peak,
    }
    return PeakPoint(**(own | changes))


def test_resonances() -> None:
    """The second peak overtakes the first halfway between the values 1 and 2; the highest is lowest at the valley that is noted."""
    points = [
        peak_point(0, 1.0, 3.0),
        peak_point(0, 2.0, 1.0),
        peak_point(1, 2.0, 3.0),
        peak_point(1, 1.0, 1.0),
        peak_point(1, 3.0, 4.0, curvature=1.0),
        peak_point(0, 3.0, 9.0, status=Status.TOO_MANY_ITERATIONS),
    ]
    asked = SimpleNamespace(parameter="load.ratio", by="phase", values=(1.0, 2.0, 3.0))
    notes = {"smallest": {"value": 1.2, "amplitude": 1.5, "omega": 104.0}, "model": {"output": "b.x"}}
    data = RESONANCE.dataset(solved(points, notes, resonance=asked))
    known = np.array([[1.0, 2.0, NAN], [1.0, 2.0, 3.0]])
    check(
        data,
        output="b.x",
        parameter="load.ratio",
        by="phase",
        value=[[1.0, 2.0, 3.0]] * 2,
        frequency_hz=(100.0 + known) / HZ,
        amplitude=[[3.0, 1.0, NAN], [1.0, 3.0, 4.0]],
        phase_deg=(-np.pi / 2 + known) / DEG,
        energy=2.0 * known,
        friction_energy=1.5 * known,
        slope=0.1 * known,
        below=1e-3 * known,
        maximum=[[1, 1, -1], [1, 1, 0]],
        overtaking_value=[1.5],
        overtaking_before=[0],
        overtaking_after=[1],
        overtaking_amplitude=[2.0],
        smallest_value=1.2,
        smallest_amplitude=1.5,
        smallest_frequency_hz=104.0 / HZ,
    )
    assert data.attrs["failed"] == 1
    higher = RESONANCE.dataset(
        solved(points, {"smallest": {"value": 1.2, "amplitude": 2.5, "omega": 104.0}}, resonance=asked)
    )
    check(higher, smallest_value=1.5, smallest_amplitude=2.0, smallest_frequency_hz=NAN)
    visited = RESONANCE.dataset(
        solved(points[:1], {"smallest": {"value": 1.2, "amplitude": 3.5, "omega": 104.0}}, resonance=asked)
    )
    assert "smallest_value" not in visited


def traction_record(stage: Any, omega: float, amplitude: tuple[float, float, float], k: int = 0) -> TractionRecord:
    multipliers = np.full((3, 2, 2), NAN)
    multipliers[0, :, 0] = 0.1 + k, 0.2 + k
    multipliers[1, 0, 1] = 0.3 + k
    multipliers[2] = 0.4 + k
    errors = np.array([0.01, 0.02, 0.03]) + k
    none = np.zeros((2, 1), dtype=complex), np.zeros((2, 2))
    return TractionRecord(
        stage=stage,
        omega=omega,
        each=tuple(Bound(a, *none, m, e) for a, m, e in zip(amplitude, multipliers, errors.tolist(), strict=True)),
        springs=np.array(["L.1", "R.1"]),
        solves=5 + k,
        failures=k,
        branches=1 + k,
    )


def test_bounds_over_tractions() -> None:
    records = [
        traction_record("point", 10.0, (1.0, 0.5, 1.5)),
        traction_record("point", 12.0, (4.0, 2.0, 4.5), 1),
        traction_record("point", 14.0, (2.0, 1.0, 3.0), 2),
        traction_record("least", 12.0, (4.0, 2.2, 4.5), 3),
        traction_record("most", 13.0, (3.5, 1.9, 5.0), 4),
    ]
    confirmed = {
        "resolved_amplitude": [2.2, 5.0],
        "time_amplitude": [2.1, 4.9],
        "time_status": ["settled", ""],
        "confirmed": [1, 1],
    }
    notes = {"model": {"output": "b.x", "excitation_n": 7.0, "harmonics": 5}, "confirmed": confirmed}
    data = RESIDUAL_TRACTIONS.dataset(solved(records, notes))
    check(
        data,
        output="b.x",
        excitation_n=7.0,
        harmonics=5,
        frequency_hz=np.array([10.0, 12.0, 13.0, 14.0]) / HZ,
        reference_amplitude=[1.0, 4.0, 3.5, 2.0],
        least_amplitude=[0.5, 2.2, 1.9, 1.0],
        most_amplitude=[1.5, 4.5, 5.0, 3.0],
        stuck_springs=[[2, 1, 4]] * 4,
        solves=[5, 8, 9, 7],
        failures=[0, 3, 4, 2],
        branches=[1, 4, 5, 3],
        resonance_hz=np.array([12.0, 12.0, 13.0]) / HZ,
        resonance_amplitude=[4.0, 2.2, 5.0],
        harmonics_error=np.array([0.01, 0.02, 0.03]) + np.array([[0], [3], [4], [2]]),
        resonance_harmonics_error=[1.01, 3.02, 4.03],
        resonance_inside=[1, 1, 1],
        spring=["L.1", "R.1"],
        multiplier=[[[1.1, NAN], [1.2, NAN]], [[NAN, 3.3], [NAN, NAN]], [[4.4, 4.4], [4.4, 4.4]]],
        **confirmed,
    )
    ends = [
        *records[:3],
        traction_record("least", 10.0, (1.0, 2.2, 1.5)),
        traction_record("most", 14.0, (2.0, 1.0, 5.0)),
    ]
    check(RESIDUAL_TRACTIONS.dataset(solved(ends, {"model": {"harmonics": 5}})), resonance_inside=[1, 0, 0])
    lost = RESIDUAL_TRACTIONS.dataset(solved([traction_record("point", 10.0, (NAN, 0.5, 1.5))]))
    assert lost.attrs["failed"] == 1


def along(order: int, speeds: list[float], force: float) -> Any:
    static = np.zeros((len(speeds), 2, 3))
    static[:, :, 2] = -force * np.arange(1.0, len(speeds) + 1)[:, None]
    static[:, :, 0] = 99.0
    line = SimpleNamespace(speeds=np.array(speeds) * RPM)
    return SimpleNamespace(
        order=order, line=line, static_force=static, wave_number=order % 5, error=1e-6 * order, common=order > 2
    )


def run_up_point(error: float) -> LinePoint:
    return LinePoint(
        engine_order=3,
        speed_rpm=1000.0,
        frequency_hz=50.0,
        amplitude=np.array([1e-3]),
        converged=True,
        harmonic=1,
        error=error,
        dissipated_w=0.0,
        slipping=0.0,
        opening=0.0,
    )


def test_run_ups() -> None:
    lines = [along(2, [1000.0, 3000.0], 1.0), along(3, [1000.0, 2000.0, 3000.0], 10.0)]
    speeds, forces = static_forces(lines)
    assert speeds / RPM == pytest.approx([1000.0, 2000.0, 3000.0])
    np.testing.assert_allclose(forces, [[2.0, 3.0, 4.0], [20.0, 40.0, 60.0]], rtol=1e-12)
    top = SimpleNamespace(point=SimpleNamespace(omega=1200.0 * RPM * 3, stage="sweep"))
    rest = [SimpleNamespace(point=SimpleNamespace(omega=w * RPM * 3, stage="sweep")) for w in (1400.0, 1000.0)]
    response = SimpleNamespace(
        accepted=[rest[0], top, rest[1]], top=top, peak_amplitude=2e-3, peak_hz=60.0, failed=1, newton_steps=17
    )
    shown = np.array([[40.0, 80.0]]), np.array([[50.0, 90.0]]), forces[1]
    own = line_of(lines[1], response, 10, *shown)
    expected = {
        "engine_orders": 3,
        "wave_number": 3,
        "peak_amplitude": 2e-3,
        "peak_speed_rpm": 1200.0,
        "peak_frequency_hz": 60.0,
        "peak_point": 11,
        "peak_inside": 1,
        "failed": 1,
        "newton_steps": 17,
        "speed_error": 3e-6,
        "common_modes": 1,
    }
    assert {name: getattr(own, name.replace("orders", "order")) for name in expected} == pytest.approx(expected)
    edge = SimpleNamespace(**{**vars(response), "top": rest[0]})
    beside = line_of(lines[0], edge, 0, *shown)
    assert (beside.peak_inside, beside.common_modes, beside.peak_point) == (False, False, 2)
    none = SimpleNamespace(**{**vars(response), "top": None})
    assert (line_of(lines[0], none, 5, *shown).peak_inside, line_of(lines[0], none, 5, *shown).peak_point) == (
        False,
        -1,
    )
    slow = fast_run_up(
        own,
        50.0,
        np.array([1000.0, 1100.0, 1210.0]),
        np.array([1e-3, 3e-3, 2e-3]),
        harmonic=3,
        finished=True,
        neglected=0.01,
    )
    quick = fast_run_up(own, 500.0, np.array([1000.0, 1250.0]), np.array([1e-3, 1.5e-3]), harmonic=5, neglected=0.02)
    found = RunUp(lines=(own,), static_speed_rpm=speeds / RPM, fast=(slow, quick))
    data = RUN_UP.dataset(solved([], {of_run_up.FOUND: flat(replace(found, points=(run_up_point(0.5),) * 12))}))
    check(
        data,
        **{name: [value] for name, value in expected.items()},
        open_hz=[[[40.0, 80.0]]],
        stuck_hz=[[[50.0, 90.0]]],
        static_normal_n=[[20.0, 40.0, 60.0]],
        mode=[1, 2],
        fast_order=[3, 3],
        fast_rate_rpm_per_s=[50.0, 500.0],
        fast_peak_amplitude=[3e-3, 1.5e-3],
        fast_peak_speed_rpm=[1100.0, 1250.0],
        fast_ratio=[1.5, 0.75],
        fast_shift_rpm=[-100.0, 50.0],
        fast_harmonic=[3, 5],
        fast_finished=[1, 0],
        fast_neglected=[0.01, 0.02],
        fast_speed_rpm=[[1000.0, 1100.0, 1210.0], [1000.0, 1250.0, NAN]],
        fast_amplitude=[[1e-3, 3e-3, 2e-3], [1e-3, 1.5e-3, NAN]],
        static_speed_rpm=[1000.0, 2000.0, 3000.0],
    )
    assert data["fast_rate_rpm_per_s"].attrs["units"] == "rpm/s"
    named = replace(found, points=(run_up_point(0.5),) * 12, output_label=("tip.x",))
    view = RunUpView(one_case(RUN_UP.dataset(solved([], {of_run_up.FOUND: flat(named)})), 0))
    table, plot = fast_peaks(view), fast(view)
    assert table is not None
    assert plot is not None
    assert [row[2:] for row in table.rows] == [
        ["3 mm", "1.5", "1\u202f100", "−100", "1 %"],
        ["1.5 mm", "0.75", "1\u202f250", "50", "2 %"],
    ]
    assert "the smallest peak is 75 % of the steady one" in plot.caption


def test_points_of_a_run_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four contact points: two slip at some instant, one of them and another are open at some instant."""
    state = np.zeros((4, 2, 8), dtype=int)
    state[0, 1, 3], state[1, 0, :4], state[1, 0, 4:], state[2, :, 7] = SLIP, SLIP, OPEN, OPEN
    monkeypatch.setattr(of_run_up, "signals", lambda *_: SimpleNamespace(state=state))

    def point(rpm: float, energy: float | None, stage: str = "sweep") -> Any:
        fields = None if energy is None else SimpleNamespace(energy=np.array([energy, 2 * energy]))
        own = SimpleNamespace(omega=rpm * RPM * 3, stage=stage, converged=energy is not None, order=int(rpm / 100))
        return SimpleNamespace(
            point=own,
            fields=fields,
            own_error=rpm * 1e-5,
            audit_error=np.nan,
            amplitudes=lambda n: rpm * np.arange(1.0, n + 1),
        )

    line: Any = SimpleNamespace(order=3, problem=None, model=SimpleNamespace(output_labels=("a.x", "b.x")))
    response: Any = SimpleNamespace(accepted=[point(1000.0, 0.5), point(1200.0, None), point(1100.0, 0.25, OF_PEAK[0])])
    found = variables(RunUp(points=tuple(points_of(line, response))))
    rpm = np.array([1000.0, 1100.0, 1200.0])
    expected = {
        "points_order": [3, 3, 3],
        "speed_rpm": rpm,
        "frequency_hz": 3 * rpm / 60,
        "amplitude": rpm[:, None] * [1.0, 2.0],
        "converged": [1, 1, 0],
        "harmonic": [10, 11, 12],
        "error": 1e-5 * rpm,
        "dissipated_w": [1.5 * 50.0, 0.75 * 55.0, NAN],
        "slipping": [0.5, 0.5, NAN],
        "opening": [0.5, 0.5, NAN],
        "operating_lowest_rpm": NAN,
        "operating_highest_rpm": NAN,
    }
    assert set(found) == set(expected)
    for name, value in expected.items():
        np.testing.assert_allclose(found[name].values, value, rtol=1e-12, err_msg=name)
    # a branch that turns is told along it
    turned: Any = SimpleNamespace(accepted=[point(1000.0, 0.5), point(1200.0, 0.5), point(1100.0, 0.5)])
    assert [p.speed_rpm for p in points_of(line, turned)] == pytest.approx([1000.0, 1200.0, 1100.0])


def test_modes_of_a_wheel_whose_sectors_differ() -> None:
    """A mode in one sector has the localisation factor 1, one that is alike in all has 0, rounding below zero is nothing."""
    shares = np.array([[0.25] * 4, [0.0, 1.0, 0.0, -1e-17], [0.64, 0.16, 0.16, 0.04]])
    note = {"mistuned_hz": [10.0, 20.0, 30.0], "sector_share": shares, "wave_share": shares[:, ::-1]}
    others = np.sqrt((0.16 + 0.16 + 0.04) / 3)
    found = variables(Modes(wheel_modes=wheel_modes_in(note)))
    check(found, mistuned_hz=[10.0, 20.0, 30.0], sector_share=shares, wave_share=shares[:, ::-1])
    assert found["mode_localisation"].values == pytest.approx([0.0, 1.0, 1.0 - others / 0.8])
    assert wheel_modes_in(None) == ()


def test_measured_peaks() -> None:
    amplitude = Quantity(np.array([1e-3, 2e-3]), np.array([1e-4, NAN]), "m", "half-width")
    frequency = Quantity(np.zeros(0), np.zeros(0), "", "")
    found = MeasuredPeaks(
        "test.csv",
        "rig",
        "load.ratio",
        np.array([1.0, 5.0]),
        ("", "mu = 0.3"),
        amplitude,
        frequency,
        np.array([4.0, 6.0]),
    )
    data = with_measured(xr.Dataset(), found)
    check(
        data,
        measured_value=[1.0, 5.0],
        measured_others=["", "mu = 0.3"],
        measured_excitation_n=[4.0, 6.0],
        measured_amplitude=[1e-3, 2e-3],
        measured_amplitude_error=[1e-4, NAN],
    )
    assert "measured_frequency_hz" not in data
    assert data.attrs == {"measured_key": "load.ratio", "measured_file": "test.csv", "measured_source": "rig"}
    assert with_measured(data, None) is data


def test_static_numbers_of_a_model_and_its_skin() -> None:
    state: Any = SimpleNamespace(speed=500.0 * RPM, displacement=1e-3, strain=2e-3, rotation=3e-3)
    note = {**static_numbers(state), "stage_waves": [0, 3], "axis_origin": [1.0, 2.0, 3.0]}
    check(
        variables(ModelFacts(**note)),
        static_rpm=500.0,
        static_displacement_m=1e-3,
        static_strain=2e-3,
        static_rotation_rad=3e-3,
        stage_waves=[0, 3],
        axis_origin=[1.0, 2.0, 3.0],
    )
    assert all(np.isnan(static_numbers(None)[name]) for name in STATIC)
    skin = SimpleNamespace(points=np.eye(3), triangles=np.array([[0, 1, 2]]), cut=np.array([1]))
    model: Any = SimpleNamespace(skin=skin)
    check(variables(ModelFacts(**skin_note(model))), skin_point=np.eye(3), skin_triangle=[[0, 1, 2]], skin_cut=[1])


def test_waves_have_the_diameters_of_their_numbers() -> None:
    assert [wave(k, 6).nodal_diameter for k in range(6)] == [0, 1, 2, 3, 2, 1]


RECORDS = (ModelFacts, *(kind for name in ANALYSES for kind in named(name).answers))  # whose fields are columns


def written() -> set[str]:
    """Return the names of all variables that analyses write: columns, keys of tables, and of dictionaries whose values are variables."""
    names = {name for kind in RECORDS for name, *_ in described(kind)}
    for file in (path for folder in SOURCES for path in folder.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Dict):
                names |= {
                    str(key.value)
                    for key, value in zip(node.keys, node.values, strict=True)
                    if isinstance(key, ast.Constant)
                    and isinstance(value, ast.Call)
                    and ast.unparse(value.func) in ("variable", "Quantity")
                }
            table = isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict)
            if table and getattr(node.targets[0], "id", "") in ("NUMBERS", "QUANTITIES"):
                names |= {str(k.value) for k in node.value.keys if isinstance(k, ast.Constant)}
    return names


def asserted() -> set[str]:
    """Return what tests read by name, or hold against a value: texts, attributes, and names of arguments."""
    read = re.compile(r"[\"'](\w+)[\"']|\.(\w+)|\b(\w+)=")
    files = Path(__file__).parent.glob("test_*.py")
    return {word for file in files for found in read.findall(file.read_text(encoding="utf-8")) for word in found}


def test_every_variable_of_a_result_is_asserted_by_a_test() -> None:
    names = written()
    assert len(names) > 200
    assert sorted(names - asserted()) == []

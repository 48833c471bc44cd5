"""The ends of an optimisation curve: those of one Jenkins element in closed form, the words for each kind of damper, the page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_result import synthetic_result

import stickslip as ss
from stickslip.analyses.forced_response.page.optimisation import optimisation, where_friction_works
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.rules import not_periodic
from stickslip.analyses.forced_response.verdicts.working_range import (
    REGIMES,
    ContactsAtPeak,
    CurvePeak,
    contacts_at_peak,
    range_line,
    range_lines,
    range_sentences,
    regimes_of,
    sticks_at,
    with_regimes,
    working_range,
    working_ranges,
)
from stickslip.study.file.case_names import Naming

MASS, SPRING, DASHPOT, STIFFNESS, LIMIT = 1.0, 4e4, 4.0, 2e4, 2.0  # kg, N/m, N s/m, N/m, N
KEY = "load.shaker.force_n"
STUDY = f"""schema_version = 2
[part.mass]
shape = "lumped"
masses_kg = [{MASS}]
springs_n_per_m = [["ground", 1, {SPRING}]]
dashpots_n_s_per_m = [["ground", 1, {DASHPOT}]]
[contact]
brake = {{ between = ["mass.m1", "ground"], law = "jenkins", tangential_stiffness_n_per_m = {STIFFNESS}, slip_limit_n = {LIMIT} }}
[load.shaker]
on = "mass.m1"
force_n = 1.0
[forced_response]
frequency_hz = [30.0, 41.0]
points = 8
stability = "off"
[harmonics]
high = 1
selection = "always_low"
[output]
points = {{ mass = "mass.m1" }}
peak = "mass.x"
[vary]
{KEY} = FORCES
"""


def linear_peak(stiffness: float) -> float:
    """Amplitude over the force at the resonance of a mass on a spring and a dashpot."""
    omega, ratio = np.sqrt(stiffness / MASS), DASHPOT / 2 / np.sqrt(stiffness * MASS)
    return float(1 / (DASHPOT * omega * np.sqrt(1 - ratio**2)))


def jenkins_peak(force: float) -> float:
    """Largest amplitude at which the balance of one harmonic has a frequency, m."""
    amplitude = np.geomspace(1e-6, 1e-1, 200_000)
    share = np.minimum(1.0, LIMIT / (STIFFNESS * amplitude))
    angle = np.arccos(1 - 2 * share)
    real = SPRING + STIFFNESS * (angle - np.sin(2 * angle) / 2) / np.pi
    loss = 4 * LIMIT * (1 - share) / np.pi / amplitude
    omega2 = np.linspace(0.6, 1.6, 1500) * SPRING / MASS
    low, high = 0, amplitude.size - 1
    while high - low > 1:
        k = (low + high) // 2
        rest = np.abs(real[k] - MASS * omega2 + 1j * (loss[k] + DASHPOT * np.sqrt(omega2)))
        low, high = (k, high) if np.any(rest * amplitude[k] <= force) else (low, k)
    return float(amplitude[low])


@pytest.fixture(scope="module")
def brake(tmp_path_factory: pytest.TempPathFactory) -> ss.Result:
    onset = LIMIT / STIFFNESS / linear_peak(SPRING + STIFFNESS)
    forces = [0.99 * onset, 1.01 * onset, 2.4, 80.0]
    path = tmp_path_factory.mktemp("brake") / "study.toml"
    path.write_text(STUDY.replace("FORCES", str([float(f) for f in forces])))
    return ss.Study.from_file(path).run()


def test_a_jenkins_element_sticks_up_to_its_limit_and_no_further(brake: ss.Result) -> None:
    (own,) = working_ranges(brake["forced_response"])
    assert not own.falling
    assert own.regimes == ("stuck", "stiffens", "works", "lets go")
    assert own.stuck is not None
    assert own.stuck.size == pytest.approx(linear_peak(SPRING + STIFFNESS), rel=1e-4)


def test_the_regimes_of_a_jenkins_element_are_those_of_its_closed_form(brake: ss.Result) -> None:
    (own,) = working_ranges(brake["forced_response"])
    sizes = np.array([p.size for p in own.peaks])
    exact = np.array([jenkins_peak(p.value) / p.value for p in own.peaks])
    np.testing.assert_allclose(sizes, exact, rtol=2e-3)
    known = linear_peak(SPRING + STIFFNESS) / np.sqrt(2)
    below = exact <= known
    best = int(np.argmin(exact))
    lets_go = (np.arange(exact.size) > best) & (exact > min(known, np.sqrt(2) * exact[best]))
    expected = np.where(lets_go, "lets go", np.where(below, "works", "stiffens"))
    expected[0] = "stuck"
    assert list(own.regimes) == list(expected)
    # far beyond its limit the element is nearly gone: the resonance of the free system
    assert own.peaks[-1].size == pytest.approx(linear_peak(SPRING), rel=0.05)
    assert own.peaks[-1].hertz == pytest.approx(np.sqrt(SPRING / MASS) / 2 / np.pi, rel=2e-3)


def test_the_loss_of_a_sliding_element_saturates(brake: ss.Result) -> None:
    (own,) = working_ranges(brake["forced_response"])
    for p in own.of("works", "lets go"):
        assert p.loss == pytest.approx(4 * LIMIT * (p.amplitude - LIMIT / STIFFNESS), rel=2e-3)
    best, last = own.smallest, own.peaks[-1]
    grown = last.loss / last.amplitude / (best.loss / best.amplitude)
    assert f"over the amplitude grows {grown:.3g} times" in range_lines(brake["forced_response"])[2]
    assert grown < 2 < last.amplitude / best.amplitude


def test_the_run_says_where_friction_works(brake: ss.Result, tmp_path: Path) -> None:
    data = brake["forced_response"]
    (own,) = working_ranges(data)
    stuck, works, gone = range_lines(data)
    assert stuck.startswith(f"At force {own.peaks[0].value:g} N, the first value, all contacts stick")
    (only,) = own.of("works")
    assert works.startswith(f"Friction works at force {only.value:g} N: the peak per unit")
    assert gone.startswith(f"Out of the working range above force {only.value:g} N: ")
    assert "No contact sticks throughout the cycle" in gone
    flags = data["friction_regime"]
    assert [REGIMES[k] for k in flags.values] == list(own.regimes)
    assert str(flags.attrs["flag_meanings"]).split()[3] == "lets_go"
    page = tmp_path / "page.html"
    brake.report(page)
    assert stuck in page.read_text()


STICKS, SLIPS = ContactsAtPeak(1.0, True, True), ContactsAtPeak(0.6, False, True)
SLIDES = ContactsAtPeak(0.05, False, False)


def curve(*peaks: tuple[float, float, ContactsAtPeak]) -> list[CurvePeak]:
    return [CurvePeak(value, size, 100.0, contacts) for value, size, contacts in peaks]


def test_a_damper_that_never_takes_the_peak_down_hardly_damps() -> None:
    own = working_range(curve((5, 0.9, SLIPS), (20, 0.8, SLIPS), (250, 1.0, STICKS)))
    assert own is not None
    assert own.regimes == ("stuck", "stiffens", "stiffens")
    assert range_sentences(own)[-1] == (
        "Down to 5 the peak per unit of force stays within 20 % of the stuck system's: the contacts stiffen but hardly damp."
    )


def test_without_a_stuck_case_the_range_is_that_around_the_smallest_peak() -> None:
    peaks = curve((50, 1.0, SLIPS), (20, 0.3, SLIPS), (10, 0.25, SLIPS), (5, 0.3, SLIDES))
    own = working_range(peaks, "load.shaker.ratio")
    assert own is not None
    assert own.regimes == ("stiffens", "works", "works", "works")
    stuck, works, other = range_sentences(own)
    assert stuck.startswith("At no value do all contacts stick at the peak; ")
    assert "within 3 dB of the smallest one, at 10" in works
    assert other.startswith("The other end was not reached: at 5, the last value, ")
    assert range_line(own).startswith("friction works from 20 to 5 (within 3 dB of the smallest peak), ")
    stuck_end = replace(peaks[0], contacts=STICKS)
    known = working_range((stuck_end, *peaks[1:]), "load.shaker.ratio")
    assert known is not None
    assert range_line(known).startswith("friction works from 20 to 5 (3 dB below the stuck system's peak), ")


def test_a_peak_that_rises_above_the_stuck_one_is_no_work() -> None:
    peaks = curve((250, 1.0, STICKS), (20, 0.6, SLIPS), (5, 0.75, SLIDES), (2, 1.4, SLIDES))
    assert regimes_of(peaks) == ("stuck", "works", "lets go", "lets go")


def test_stretches_that_a_hump_parts_are_said_apart() -> None:
    before = working_range(
        curve((250, 1.0, STICKS), (100, 0.6, SLIPS), (50, 0.9, SLIPS), (20, 0.4, SLIPS), (5, 0.95, SLIDES))
    )
    after = working_range(
        curve((250, 1.0, STICKS), (100, 0.5, SLIPS), (50, 0.8, SLIPS), (20, 0.6, SLIPS), (5, 0.95, SLIDES))
    )
    for own in (before, after):
        assert own is not None
        _, works, gone = range_sentences(own)
        assert works.startswith("Friction works at 100 and at 20: ")
        assert gone.startswith("Out of the working range below 20: ")


def test_a_peak_that_never_falls_but_rises_is_not_said_to_stay_near() -> None:
    own = working_range(curve((250, 1.0, STICKS), (100, 0.8, SLIPS), (50, 2.5, SLIDES), (20, 3.2, SLIDES)))
    assert own is not None
    assert range_sentences(own)[-1] == (
        "Friction never takes the peak per unit of force 3 dB below the stuck system. It is smallest at 100, 80 % of the stuck system's, "
        "and largest at 20, 320 %."
    )


def test_contacts_that_are_open_all_the_time_do_not_stick() -> None:
    half = ContactsAtPeak(0.5, True, True)
    own = working_range(curve((250, 1.0, half), (100, 0.9, SLIDES), (20, 0.5, SLIDES)))
    assert own is not None
    assert range_sentences(own)[0].startswith("At 250, the first value, no contact slips, opens or closes")


def test_a_setting_of_the_computation_makes_no_curve() -> None:
    data = synthetic_result(ratios=(250, 50, 10, 5, 2), n=24)
    assert working_ranges(data)
    assert working_ranges(data.assign_coords(vary=["harmonics.high"])) == ()


def test_what_dissipates_is_not_stuck_and_what_does_not_is_no_friction() -> None:
    data = synthetic_result(ratios=(250, 50, 10, 5, 2), n=24)
    data["peak_state"] = data["peak_state"].where(data["case"] > 0, 0)
    assert working_ranges(data)[0].regimes[0] == "stuck"
    lossy = data.assign(dissipated_energy=data["dissipated_energy"] + 1.0)  # as dahl before slip
    assert "stuck" not in working_ranges(lossy)[0].regimes
    lossless = data.assign(dissipated_energy=0.0 * data["dissipated_energy"])
    assert working_ranges(lossless) == ()  # unilateral springs that open


@pytest.mark.parametrize(
    "peaks",
    [
        curve((1, 1.0, STICKS), (2, 1.0, STICKS), (3, 1.0, STICKS)),  # nothing slips
        curve((1, 1.0, STICKS), (2, 0.5, SLIPS)),  # too few
    ],
)
def test_what_has_no_ends_is_not_judged(peaks: list[CurvePeak]) -> None:
    assert working_range(peaks) is None


def two_blades() -> list[CurvePeak]:
    """Return peaks of two blades with a damper at the ratios 3, 5 and 10, where it lifts off and so sticks longest at 3."""
    told = [(3, 5.87, 0.81, 8.6e-4, 19.2), (5, 5.95, 0.65, 5.3e-4, 3.56), (10, 10.2, 0.77, 4.5e-4, 1.54)]
    return [
        CurvePeak(v, size, 180.0, ContactsAtPeak(share, False, False), x, per_m * x, force=442 / v)
        for v, size, share, x, per_m in told
    ]


@pytest.mark.parametrize(
    ("key", "end"),
    [
        ("load.shaker.ratio", "high"),
        ("contact.flat.friction_coefficient", "high"),
        ("contact.flat.tangential_stiffness_n_per_m", None),
        ("load.pull.force_n", None),  # the excitation does not grow with it
    ],
)
def test_the_stuck_end_is_told_by_what_is_varied_and_not_by_small_differences_of_the_share(
    key: str, end: str | None
) -> None:
    peaks = two_blades()
    assert sticks_at(peaks, key) == end
    found = working_range(peaks, key)
    assert found is not None
    own = replace(found, naming=Naming("ratio", ""))
    if end is None:
        (told,) = range_sentences(own)
        assert told.startswith("Where friction works cannot be told from these values of ratio: ")
    else:
        assert own.regimes == ("stiffens", "works", "works")
        assert "lies above ratio 10" in range_sentences(own)[0]
        assert "from ratio 5 to 3" in range_sentences(own)[1]


def test_the_stuck_end_of_forces_and_of_other_keys() -> None:
    grown = [replace(p, value=p.force) for p in two_blades()[::-1]]
    assert sticks_at(grown, "load.shaker.force_n") == "low"
    slides = replace(grown[-1], contacts=SLIDES)
    assert sticks_at([*grown[:-1], slides], "part.blades.pitch_m") == "low"
    apart = replace(grown[-1], contacts=ContactsAtPeak(0.0, True, False))  # none touches
    assert sticks_at([*grown[:-1], apart], "contact.flat.gap_m") == "low"


def test_nothing_is_shaded_where_the_stuck_end_is_not_known() -> None:
    data = synthetic_result(ratios=(10, 5, 3), n=24).assign_coords(vary=["contact.flat.gap_m"])
    data["peak_state"] = data["peak_state"].isel(case=[0, 0, 0]).assign_coords(case=data["case"])
    (own,) = working_ranges(data)
    assert not own.judged
    assert "friction_regime" not in with_regimes(data)
    plot = optimisation(Response(data))
    assert plot is not None
    assert not plot.figure.layout.shapes


def test_states_of_a_cycle() -> None:
    state = np.zeros((2, 2, 4), dtype=int)
    assert contacts_at_peak(state) == ContactsAtPeak(1.0, True, True)
    state[1] = 2  # open all the time: linear, and the other one holds
    assert contacts_at_peak(state) == ContactsAtPeak(0.5, True, True)
    state[1, :, 0] = 0  # it touches
    assert not contacts_at_peak(state).linear
    state[0, 1, 2] = 1  # one of two directions slips
    assert contacts_at_peak(state) == ContactsAtPeak(0.5, False, False)


def test_wrong_cases_are_left_out_and_named() -> None:
    data = synthetic_result(ratios=(250, 50, 10, 5, 2), n=24)
    before = working_ranges(data)[0]
    data["case_verdict"] = "case", [0, 0, 0, 0, 2]
    (own,) = working_ranges(data)
    assert len(own.peaks) == len(before.peaks) - 1
    assert range_lines(data)[-1].endswith("wrong or the peak no resonance: load.shaker.ratio = 2.")
    assert with_regimes(data)["friction_regime"].values[-1] == -1


def test_the_page_shades_where_friction_works() -> None:
    response = Response(synthetic_result(ratios=(250, 50, 10, 5, 2), n=24))
    (own,) = working_ranges(response.data)
    plot = optimisation(response)
    assert plot is not None
    assert plot.caption.endswith(": where friction works.")
    bands = plot.figure.layout.shapes
    assert len(bands) == 2  # amplitude and frequency
    values = [p.value for p in own.of("works")]
    assert bands[0].x0 < min(values)
    assert max(values) < bands[0].x1
    text = where_friction_works(response)
    assert text is not None
    assert len(text.items) == len(range_sentences(own))


def test_time_integration_of_a_point_beside_the_peak_doubts_that_point_alone() -> None:
    data = synthetic_result(ratios=(5,), n=12)
    peak = int(data["peak_point"][0])
    for at, hit in ((peak + 1, [peak + 1]), (peak, [peak])):
        row = {
            "case": 0,
            "frequency_hz": float(data["frequency_hz"][at]),
            "sentence": "1 Hz: it rings on",
            "settled": 0,
        }
        told = data.assign({f"not_periodic_{k}": ("not_periodic", [v]) for k, v in row.items()})
        (found,) = not_periodic(Curve(told, 0))
        assert (found.level, list(found.points)) == ("doubtful", hit)


def test_one_linear_peak_at_an_end_is_where_contacts_stick() -> None:
    """Only the very first or last peak is linear: the end is known from it alone, whatever is varied."""
    linear, slips = ContactsAtPeak(1.0, True, True), ContactsAtPeak(0.5, False, False)
    peaks = curve((1.0, 3.0, linear), (2.0, 2.0, slips), (3.0, 1.0, slips), (4.0, 2.0, slips))
    assert sticks_at(peaks, "part.blades.pitch_m") == "low"
    turned = [replace(p, value=5.0 - p.value) for p in peaks[::-1]]
    assert sticks_at(turned, "part.blades.pitch_m") == "high"

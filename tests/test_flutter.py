"""Flutter from a study file and from Python, against a whole wheel with a fluid of its own."""

import logging
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import lumped_fluid as fluid
import numpy as np
import pytest
import scipy.linalg
from test_assembly_wheel import SECTORS, sector_model, shrouded_sector

import stickslip as ss
from stickslip.analyses.page import report_html
from stickslip.analyses.waves.verdicts import others
from stickslip.assembly.assembling import assemble
from stickslip.assembly.build import flow_around
from stickslip.assembly.fluid.aero_forces import largest_displacements, phases
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.sides.mistuning import BladeMistuning, Mistuning
from stickslip.model.part import Part
from stickslip.model.structure import nodal_dofs
from stickslip.model.structure_file import save_structure
from stickslip.reduction import InfluenceCoefficients
from stickslip.response.rotating.flutter import flutter_of_wave
from stickslip.study.analysis import named
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("parts_once")

N = fluid.BLADES
HERTZ = np.linspace(0.05, 0.45, 33)

STUDY = """
schema_version = 2
[part.sector]
file = "sector.npz"
units = "SI"
plausible = false
sectors = 6
low_face = "cyclic_low"
high_face = "cyclic_high"
[aero]
file = "{file}"
reference_hz = 0.35
points = {{ blade = "sector.blade" }}
[flutter]
number = 2
"""


def sector():
    """The judge's disk as a sector: disk, blade, and the neighbour's disk without its mass."""
    ground, ring, blade = fluid.SPRINGS
    K = np.diag([ground + ring + blade, blade, ring])
    K[0, 1] = K[1, 0] = -blade
    K[0, 2] = K[2, 0] = -ring
    M = np.diag([*fluid.MASSES, 0.0])
    sets = {name: np.array([i]) for i, name in enumerate(("cyclic_low", "blade", "cyclic_high"))}
    dofs = ss.model.lumped(np.ones(3), np.eye(3)).dofs
    return ss.Structure(M, fluid.LOSS * K, K, dofs, sets)


def recorded_rows():
    """What a user records who moves blade 0 at some frequencies: the force on every blade."""
    rows = ["recorded_on,frequency_hz,real_n_per_m,imag_n_per_m"]
    for hertz in HERTZ:
        for blade, force in enumerate(fluid.recorded(2 * np.pi * hertz)):
            on = blade if 2 * blade <= N else blade - N
            rows.append(f"{on},{hertz:.17g},{force.real:.17g},{force.imag:.17g}")
    return rows


def influence(strength=fluid.STRENGTH):
    j = -np.arange(N)
    force = [fluid.recorded(2 * np.pi * hertz, strength) for hertz in HERTZ]
    values = np.array(force).reshape(1, HERTZ.size, N, 1, 1)
    return InfluenceCoefficients(j, values, 2 * np.pi * HERTZ)


def model(aero, **more):
    return ss.Model(parts={"sector": Part(structure=sector(), sectors=N)}, aerodynamics=aero, **more)


def of_blade(coefficients, reference=2.2):
    points = {"blade": ("sector.blade", None)}
    return Aerodynamics(influence=coefficients, reference=reference, points=points)


@pytest.mark.parametrize("kind", ["csv", "toml"])
def test_coefficients_recorded_with_one_moved_blade_give_the_eigenvalues_of_the_whole_wheel(
    kind: str, tmp_path: Path
) -> None:
    save_structure(sector(), tmp_path / "sector.npz")
    (tmp_path / "study.toml").write_text(STUDY.format(file=f"aero.{kind}"))
    rows = recorded_rows()
    if kind == "toml":
        columns = zip(*(row.split(",") for row in rows), strict=True)
        rows = [f"{name} = [{', '.join(cells)}]" for name, *cells in columns]
    (tmp_path / f"aero.{kind}").write_text("\n".join(rows))
    result = ss.Study.from_file(tmp_path / "study.toml").run()
    data = result.data["flutter"].isel(case=0)
    assert data["wave_number"].values.tolist() == list(range(N))
    for w, k in enumerate(data["wave_number"].values):
        exact = fluid.modes_of_wave(int(k))
        exact = exact[exact.real > -0.1]  # without those of the fluid
        values = [(-v.real / abs(v), v.imag / (2 * np.pi)) for v in exact]
        for m, (damping, hertz) in enumerate(values[-2:] if len(values) > 1 else values):
            mode = m if len(values) > 1 else 1
            # coefficients of iω at λ, whose real part is up to 5e-3 of it
            assert float(data["damping"][w, mode]) == pytest.approx(damping, rel=0.01)
            assert float(data["frequency_in_flow_hz"][w, mode]) == pytest.approx(hertz, rel=1e-4)
            # the blades' own damping adds LOSS φᵀKφ / 2 |λ| to that of the fluid, to first order
            own = fluid.LOSS * np.pi * float(data["frequency_hz"][w, mode]) ** 2 / hertz
            of_fluid = float(data["damping_by_eigenvalue"][w, mode])
            assert damping - of_fluid == pytest.approx(own, rel=0.03, abs=0.01 * abs(damping))
    # the curve goes through the waves
    for w, angle in enumerate(data["phase_angle_deg"].values):
        on_curve = [np.interp(angle, data["curve_angle_deg"], row) for row in data["curve_damping"]]
        np.testing.assert_allclose(on_curve, data["damping_by_energy"][w], rtol=1e-9)
    assert "the least stable is" in named("flutter").summary(result["flutter"])[0].title


def test_the_least_stable_wave_is_told_and_an_unstable_one_is_a_warning(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    shaken = replace(influence(), values=-influence().values)
    result = model(of_blade(shaken)).flutter(number=1)
    told = [str(v) for v in result.verdicts]
    (grows,) = (t for t in told if t.startswith("WARNING: ") and "grows: damping" in t)
    assert "flutters" in grows
    assert grows in capsys.readouterr().err
    assert result.conclusion == "1 warning, see the verdicts. Every answer is trusted."
    page = report_html(result.data)
    assert '<details class="box some"><summary>1 warning, see the verdicts.' in page
    assert '<b class="warning">WARNING:</b>' in page
    assert '<p class="answer danger">' in page
    data = result.data["flutter"].isel(case=0)
    w, m = int(data["least_wave"]), int(data["least_mode"])
    assert float(data["damping"][w, m]) == float(data["damping"].min()) < 0
    below = np.count_nonzero(data["damping"].values < float(data["required_damping"]))
    assert below > 1
    assert f"{below} waves and modes lie below the dashed line of " in page
    assert f"mode {m + 1} grows" in " ".join(told)
    calm = model(of_blade(influence())).flutter(number=1, required_percent=1.0)
    assert any("less damping than the 1 % required" in str(v) for v in calm.verdicts)
    assert float(calm.data["flutter"]["required_damping"].values[0]) == pytest.approx(0.01)
    rows = [(-0.2, 1, 0), (-0.1, 2, 0), (0.001, 3, 0)]
    assert others(rows, -0.2) == "; 2 waves grow in all"
    assert others([*rows, (-0.1, 2, 1)], -0.2) == "; 3 modes of 2 waves grow in all"
    assert others([(0.1, 1, 0), (0.2, 2, 0)], 0.1) == "; 2 waves have too little in all"
    assert others(rows[1:], -0.1) == ""


@pytest.mark.parametrize("wave", [1, 4])
def test_energy_method_and_eigenvalue_part_four_times_less_when_coefficients_are_halved(wave: int) -> None:
    """Two modes that the fluid couples, so that the shapes change as well."""
    rng = np.random.default_rng(8)
    values = rng.standard_normal((1, 1, 3, 2, 2)) + 1j * rng.standard_normal((1, 1, 3, 2, 2))
    off = []
    for share in (0.04, 0.02, 0.01):
        points = {"blade": ("sector.blade", None), "disk": ("sector.cyclic_low", None)}
        own = InfluenceCoefficients(np.array([-1, 0, 1]), share * values)
        aero = Aerodynamics(influence=own, reference=2.0, points=points)
        there = model(aero)
        moving = there.at(0.0, wave, "open")
        found = flutter_of_wave(moving, flow_around(there).on_structure(wave, moving), 2)
        off.append(found.by_eigenvalue - found.by_energy)
    for before, after in pairwise(off):
        assert np.all(np.abs(after) > 1e-7)
        np.testing.assert_allclose(before / after, 4.0, rtol=0.15)
    assert np.abs(off[0] / off[1] - 4).max() > np.abs(off[1] / off[2] - 4).max()


@pytest.mark.parametrize("number", range(N))
def test_free_decay_in_time_has_the_rate_and_the_direction_of_each_wave(number: int) -> None:
    """The whole wheel is let go in the shape of a wave; sector n + 1 leads sector n by θ, and it decays as the energy method says."""
    there = model(of_blade(influence()))
    moving = there.at(0.0, number, "open", with_damping=True)
    feedback = flow_around(there).on_structure(number, moving)
    wave = flutter_of_wave(moving, feedback, 2)
    bare = flutter_of_wave(moving, replace(feedback, patterns=0 * feedback.patterns), 2)
    omega, structural = wave.frequencies[1], bare.total[1]
    shape = mode(moving)
    phases = np.exp(2j * np.pi * number * np.arange(N) / N)
    u = np.outer(phases, shape).ravel()
    A = fluid.coupled()
    start = np.concatenate([u.real, (1j * omega * u).real, np.zeros(N)])
    periods = 40
    step = scipy.linalg.expm(A * 2 * np.pi / omega / 64)
    states = [start]
    for _ in range(64 * periods):
        states.append(step @ states[-1])
    blades = np.array(states)[:, 1 : 2 * N : 2]
    # the analytic signal of each blade, over the last ten periods and ten earlier ones
    turn = np.exp(-2j * np.pi * np.arange(640) / 64)
    early, late = (2 / 640 * turn @ blades[i : i + 640] for i in (640, 64 * periods - 640))
    lead = np.angle(late[1:] / late[:-1])
    np.testing.assert_allclose(np.exp(1j * lead), np.exp(2j * np.pi * number / N), atol=0.1)
    elapsed = (64 * periods - 1280) / 64 * 2 * np.pi / omega
    rate = np.log(np.abs(late / early)).mean() / elapsed
    predicted = -omega * (wave.by_energy[1] + structural)
    assert rate == pytest.approx(predicted, rel=0.03)


def mode(moving):
    """Return the second mode of a wave of the judge's disk."""
    K, M = (np.asarray(m)[:2, :2] for m in (moving.stiffness, moving.mass))
    return scipy.linalg.eigh(K, M)[1][:, 1]


def wrong(tmp_path: Path, rows: list[str], change: tuple[str, str] = ("", "")) -> str:
    """Return what a study says of a file of coefficients."""
    save_structure(sector(), tmp_path / "sector.npz")
    text = STUDY.format(file="aero.csv").replace(*change) if change[0] else STUDY.format(file="aero.csv")
    (tmp_path / "study.toml").write_text(text)
    (tmp_path / "aero.csv").write_text("\n".join(rows))
    with pytest.raises(ss.InputError) as told:
        read_study(tmp_path / "study.toml").model()
    return str(told.value)


@pytest.mark.parametrize(
    ("head", "row", "words"),
    [
        ("neighbour,real_per_s2,imag_n_per_m", "0,1,2", "real_per_s2.*points are in N/m.*real_n_per_m"),
        ("neighbur,real_n_per_m,imag_n_per_m", "0,1,2", "neighbur.*not known.*neighbour"),
        (
            "ibpa,real_n_per_m,imag_n_per_m",
            "0,1,2",
            "'ibpa', which is not known. The columns are one of neighbour, recorded_on, wave_number",
        ),
        (
            "phase_angle_deg,real_n_per_m,imag_n_per_m",
            "-180,1,2\n0,1,2\n180,1,2",
            "-180 and 180 degrees are the same angle. Leave one",
        ),
        ("note,real_n_per_m,imag_n_per_m", "0,1,2", "whose motion.*neighbour, recorded_on"),
        ("neighbour,real_n_per_m,phase_deg", "0,1,2", "real_n_per_m and phase_deg of the values"),
        ("neighbour,real_n_per_m,imag_n_per_m", "0.5,1,2", "line 2: neighbour: is no whole number, got '0.5'"),
        ("neighbour,real_n_per_m,imag_n_per_m", "0,one,2", "line 2: real_n_per_m.*'one'"),
        ("neighbour,real_n_per_m,imag_n_per_m", "7,1,2", "goes to 7, and the wheel has 6"),
        ("neighbour,real_n_per_m,imag_n_per_m", "0,1,2\n0,1,3", "line 3: says the same.*line 2"),
        ("neighbour,frequency_hz,real_n_per_m,imag_n_per_m", "0,1,1,2\n1,1,1,3\n0,2,1,2", "lacks.*neighbour 1, 2 Hz"),
        ("phase_angle_deg,real_n_per_m,imag_n_per_m", "0,1,2\n50,1,2", "not spread evenly"),
        (
            "neighbour,force_point,motion_point,real_n_per_m,imag_n_per_m",
            "0,blade,tip,1,2",
            "motion_point: is no point",
        ),
        ("neighbour,force_point,real_n_per_m,imag_n_per_m", "0,blade,1,2", "force_point and motion_point"),
    ],
)
def test_what_is_wrong_in_the_file_is_told_with_its_place(head: str, row: str, words: str, tmp_path: Path) -> None:
    told = wrong(tmp_path, [head, *row.split("\n")])
    assert re.search(words, told.replace("\n", " ")), told
    assert "aero.csv" in told


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("sectors = 6", "sectors = 1"), "no sector of a wheel"),
        (("[aero]", '[aero]\nclamped = "sector.blade"'), "clamped: is given for shapes"),
        (("[aero]", "[aero]\nlargest_displacement_m = 1.0"), "belongs to modes"),
        (("aero.csv", "other.csv"), "aero.file: there is no file"),
    ],
)
def test_what_is_wrong_in_the_table_is_told(change: tuple[str, str], words: str, tmp_path: Path) -> None:
    assert words in wrong(tmp_path, recorded_rows(), change)


def test_what_answers_are_compared_with_is_no_reason_to_solve_them_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A reference, engine orders, a margin and a damping that is asked for change what is said of modes, and no mode."""
    save_structure(sector(), tmp_path / "sector.npz")
    (tmp_path / "aero.csv").write_text("\n".join(recorded_rows()))
    path = tmp_path / "study.toml"

    def ran(modes: str, safe: str, flutter: str) -> tuple[ss.Result, str]:
        tables = f"{flutter}\n[modes]\n{modes}\n[safe]\nspeed_rpm = 6.0\nmodes = 2\n{safe}\n"
        path.write_text(STUDY.format(file="aero.csv") + tables)
        caplog.clear()
        with caplog.at_level(logging.INFO):
            found = ss.Study.from_file(path).run()
        return found, re.findall(r"jobs to do: \d", caplog.text)[0]

    before, said = ran("number = 2", "engine_orders = [1]", "")
    assert said == "jobs to do: 3"
    hertz = float(before["modes"].frequency_hz[0, 0, 0])
    (tmp_path / "ref.csv").write_text(f"nodal_diameter,mode,frequency_hz\n0,1,{1.01 * hertz!r}\n")
    compared = (
        'number = 2\nreference = "ref.csv"',
        "engine_orders = [2]\nmargin_percent = 7.0",
        "required_percent = 1.0",
    )
    after, said = ran(*compared)
    assert said == "jobs to do: 0"
    assert float(after["modes"].difference[0, 0, 0]) == pytest.approx(1 / 1.01 - 1, abs=1e-9)
    assert set(after["safe"].pair_engine_order.values.ravel().tolist()) == {2}
    assert float(after["safe"]["margin_percent"][0]) == 7.0
    assert float(after["flutter"]["required_damping"][0]) == pytest.approx(0.01)
    assert ran("number = 1", *compared[1:])[1] == "jobs to do: 1"


def test_flutter_without_coefficients_and_outside_of_their_table_is_refused() -> None:
    with pytest.raises(ss.InputError, match="needs aerodynamic coefficients"):
        model(None).flutter()
    narrow = influence()
    narrow = InfluenceCoefficients(narrow.distances, narrow.values[:, :3], narrow.frequencies[:3])
    with pytest.raises(ss.InputError, match=r"0\.05 to 0\.075 Hz, .* needs 0\.106249 to 0\.203573 Hz"):
        model(of_blade(narrow)).flutter(number=1)


def test_modes_of_unit_mass_and_of_a_largest_displacement_are_the_same_force() -> None:
    """G of mode 2 on all three forms of the same coefficients; between two modes their phases count."""
    own = np.array([[[-3e-4 - 2e-3j]], [[1e-3 - 4e-3j]], [[5e-4 + 1e-3j]]])[None, None]
    j = np.array([-1, 0, 1])
    unit = Aerodynamics(influence=InfluenceCoefficients(j, own), reference=2.0, modes=(2,))
    there = model(unit)
    moving = there.at(0.0, 1, "open")
    plain = flutter_of_wave(moving, flow_around(there).on_structure(1, moving), 2)
    assert plain.by_energy[0] == pytest.approx(0.0, abs=1e-15)
    theta = 2 * np.pi / N
    omega, L = plain.frequencies[1], own[0, 0, :, 0, 0]
    G = np.sum((L.real + 1j * omega / 2.0 * L.imag) * np.exp(1j * theta * j))  # frozen at 2 rad/s
    assert plain.by_energy[1] == pytest.approx(-G.imag / (2 * omega**2), rel=1e-12)
    largest = np.abs(mode(moving)).max()
    scaled = Aerodynamics(
        influence=InfluenceCoefficients(j, own * (0.002 / largest) ** 2),
        reference=2.0,
        modes=(2,),
        largest_displacement=0.002,
    )
    there = model(scaled)
    again = flutter_of_wave(moving, flow_around(there).on_structure(1, moving), 2)
    np.testing.assert_allclose(again.by_energy, plain.by_energy, rtol=1e-12, atol=1e-18)
    # the blade alone: one mass on its spring, in all waves
    alone = replace(unit, shapes="blade_alone", clamped="sector.cyclic_low", modes=(1,))
    pattern = flow_around(model(alone)).patterns(3)
    np.testing.assert_allclose(pattern[:, 0], [0.0, np.sqrt(fluid.MASSES[1]), 0.0])


def test_largest_displacements_are_those_of_nodes() -> None:
    dofs = nodal_dofs(np.zeros((2, 3)), np.arange(2))
    shapes = np.array([[3.0, 0], [4j, 0], [0, 0], [1, 0], [1, 0], [1, 2.0]])
    np.testing.assert_allclose(largest_displacements(dofs, shapes), [5.0, 2.0])


LAW = ss.UnilateralSpring(k_n=0.4, preload=0.3)


def driven(aero, order=4):
    """Blades driven by an engine order, whose disk stands on a spring that stays closed, under a static pull."""
    contact = ss.Contact(between=("sector.cyclic_low", "ground"), law=LAW, acts="normal")
    loads = {
        "gas": ss.Load(on="sector.blade", newton=0.02, engine_order=order),
        "pull": ss.Load(on="sector.blade", newton=0.05, harmonic=0, engine_order=0),
    }
    outputs = (ss.Output(name="tip", on="sector.blade"),)
    return model(aero, contacts={"stand": contact}, loads=loads, outputs=outputs)


@pytest.mark.parametrize("order", [2, 4])
def test_forced_response_is_that_of_the_whole_wheel_with_its_fluid(order: int) -> None:
    """Engine orders 2 and 4 drive the two directions of a nodal diameter; the coefficients are those of each frequency."""
    there = driven(of_blade(influence()), order)
    hertz = [0.3, 0.35, 0.36]
    result = there.forced_response(
        frequencies_hz=hertz, low=1, high=1, selection="always_low", peak_points=0, stability="off"
    )
    data = result.data["forced_response"]
    found = np.sort(np.unique(data["frequency_hz"].values))
    np.testing.assert_allclose(found[:3], hertz)
    n = 2 * N
    A = fluid.coupled()
    A[n + 2 * np.arange(N), 2 * np.arange(N)] -= LAW.k_n / fluid.MASSES[0]
    phases = np.exp(2j * np.pi * order * np.arange(N) / N)
    for i, own in enumerate(hertz):
        push = np.zeros(5 * N, dtype=complex)
        push[n + 2 * np.arange(N) + fluid.BLADE] = 0.02 * phases / fluid.MASSES[1]
        u = np.linalg.solve(2j * np.pi * own * np.eye(5 * N) - A, push)
        row = int(np.argmin(np.abs(data["frequency_hz"].values - own)))
        amplitude = float(np.ravel(data["amplitude"].values[row])[0])
        assert amplitude == pytest.approx(abs(u[fluid.BLADE]), rel=1e-5), i


def test_the_static_state_is_that_without_the_fluid() -> None:
    wet, dry = (assemble(driven(aero), 1) for aero in (of_blade(influence()), None))
    np.testing.assert_allclose(wet.static_gap, dry.static_gap, rtol=1e-9)
    np.testing.assert_allclose(wet.static_force, dry.static_force, rtol=1e-9)
    assert np.abs(wet.load.static - dry.load.static).max() > 1e-5


def test_a_mistuned_wheel_without_deviations_does_what_one_sector_does_in_the_flow() -> None:
    """Coefficients of one frequency, so that both have the frozen form; every sector a phase angle ahead, also in statics."""
    own = influence()
    own = InfluenceCoefficients(own.distances, own.values[:, 22:23])
    there = driven(of_blade(own), 4)
    whole = replace(there, mistuning=Mistuning())
    keys = {
        "frequencies_hz": [0.35, 0.36],
        "low": 1,
        "high": 1,
        "selection": "always_low",
        "peak_points": 0,
        "stability": "off",
    }
    one, every = (m.forced_response(**keys).data["forced_response"] for m in (there, whole))
    tuned, sectors = one["amplitude"].values, every["amplitude"].values
    assert sectors.shape[1] >= N
    np.testing.assert_allclose(sectors[:, :N], np.repeat(tuned[:, :1], N, axis=1), rtol=1e-8)
    dry, wet = (assemble(m, 1) for m in (replace(whole, aerodynamics=None), whole))
    np.testing.assert_allclose(wet.static_gap, dry.static_gap, rtol=1e-8)


@pytest.mark.parametrize("order", [1, 5])
def test_friction_in_a_flow_balanced_and_marched_in_time(order: int) -> None:
    """Blades that slip, engine orders that drive the two directions of a nodal diameter: the sectors of the wheel in time agree."""
    own = influence()
    aero = of_blade(InfluenceCoefficients(own.distances, 6 * own.values[:, 22:23]))
    rub = ss.Contact(between=("sector.blade", "ground"), law=ss.Jenkins(k_t=0.4, limit=0.01), acts="tangential")
    loads = {"gas": ss.Load(on="sector.blade", newton=0.02, engine_order=order)}
    outputs = (ss.Output(name="tip", on="sector.blade"),)
    there = model(aero, contacts={"rub": rub}, loads=loads, outputs=outputs)
    found = assemble(there, 7)
    omega = 2 * np.pi * 0.36
    sweep = ss.Sweep(
        omega_range=(omega, 1.0001 * omega), low=7, high=7, selection="always_low", frequencies=2, peak_points=0
    )
    problem = ss.response.forced_problem(found.system, found.load, sweep)
    point = ss.response.accepted_points(list(ss.forced_response(found.system, found.load, sweep)))[0]
    assert point.converged
    assert ss.response.fields(problem, point).energy.max() > 1e-4  # it slips
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    whole = ss.response.all_sectors(found.system, found.load)
    gaps, laws = whole.contacts.gap_operator, whole.contacts.laws
    start = ss.response.start_from_harmonics(whole.spread(motion), omega, gaps, laws)
    stepping = ss.response.TimeStepping(384, tolerance=1e-8, max_periods=300)
    shot = ss.response.shoot(
        whole.structure, gaps, laws, whole.load, omega, np.arange(whole.structure.n), start, stepping
    )
    assert shot.converged
    expected, size = whole.spread(motion)[:2], np.abs(motion[1]).max()
    assert np.abs(shot.harmonics[:2] - expected).max() < 2e-3 * size
    # the other direction is another answer
    other = assemble(replace(there, loads={"gas": replace(loads["gas"], engine_order=N - order)}), 7)
    mirrored = ss.response.accepted_points(list(ss.forced_response(other.system, other.load, sweep)))[0]
    far = ss.response.forced_problem(other.system, other.load, sweep).low.linear.recover(omega, mirrored.coefficients)
    assert abs(abs(far[1]).max() - size) > 1e-2 * size


EXAMPLE = Path(__file__).parents[1] / "examples" / "flutter"


def test_the_example_tells_its_margin_in_terminal_and_page(tmp_path: Path) -> None:
    """Some of its waves, and [modes] beside them, whose damped frequencies are those of [flutter]."""
    text = (EXAMPLE / "study.toml").read_text()
    text = text.replace("number = 1  ", "number = 1\nnodal_diameters = [0, 4, 5]  ")
    text = text.replace("disk_size_m = 0.030", "disk_size_m = 0.050").replace("= 0.014", "= 0.022")
    (tmp_path / "study.toml").write_text(text + "[modes]\nnumber = 1\nnodal_diameters = [5]\n")
    (tmp_path / "coefficients.csv").write_text((EXAMPLE / "coefficients.csv").read_text())
    result = ss.Study.from_file(tmp_path / "study.toml").run()
    flutter, modes = (result.data[name].isel(case=0) for name in ("flutter", "modes"))
    assert flutter["wave_number"].values.tolist() == [0, 4, 5, 15, 16]
    assert modes["wave_number"].values.tolist() == [5, 15]
    rows = [flutter["wave_number"].values.tolist().index(k) for k in (5, 15)]
    np.testing.assert_allclose(modes["damping"], flutter["damping"][rows], rtol=1e-9)
    np.testing.assert_allclose(modes["damped_hz"], flutter["frequency_in_flow_hz"][rows], rtol=1e-9)
    least = flutter["wave_number"].values[int(flutter["least_wave"])]
    assert least == 15
    assert float(flutter["damping"].min()) < 0
    assert any("ND 5 forward, mode 1 grows" in str(v) for v in result.verdicts)
    assert "ND 5 forward, mode 1" in named("flutter").summary(result["flutter"])[0].title
    assert any("in the flow" in t.title for t in named("modes").summary(result["modes"]))
    page = tmp_path / "page.html"
    result.report(page)
    html = page.read_text()
    for words in ("Least stable diagram", "Margins", "unstable", "In the flow", "least damping in the flow"):
        assert words in html


def test_mistuning_shares_the_damping_of_the_waves() -> None:
    """The sum of the decay rates stays, the least one of the blades rises (Kaza & Kielb 1982); without deviations they are the waves'."""
    own = influence()
    still = InfluenceCoefficients(own.distances, -own.values[:, 24:25])
    tuned = model(of_blade(still, float(own.frequencies[24])))
    waves = tuned.flutter(number=2).data["flutter"].isel(case=0)
    rates, blades_alone = [], []
    for spread in (0.0, 0.03):
        shares = spread * np.array([1, -1, 1, -1, 1, -1.0])
        blades = BladeMistuning(of="sector.blade", deviations=shares, quantity="stiffness")
        found = replace(tuned, mistuning=Mistuning(blades={"all": blades})).flutter(number=2)
        data = found.data["flutter"].isel(case=0)
        rates.append(data["wheel_damping"].values * 2 * np.pi * data["wheel_frequency_hz"].values)
        blades_alone.append(rates[-1][data["wheel_frequency_hz"].values > 0.3])
        least = float(data["wheel_damping"].values[0])
        assert least == data["wheel_damping"].min() < 0
        assert any("sectors differ has a least damping of" in str(v) for v in found.verdicts)
        if not spread:
            np.testing.assert_allclose(
                np.sort(data["wheel_damping"]), np.sort(waves["damping"].values.ravel()), rtol=1e-6
            )
    assert rates[1].sum() == pytest.approx(rates[0].sum(), rel=1e-4)
    least, before = blades_alone[1].min(), blades_alone[0].min()
    assert least > 1.02 * before


RING = """
schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 6
masses_kg = [0.85, 0.5]
names = ["disk", "blade"]
springs_n_per_m = [
  ["disk", "ground", 3.3e5], ["disk", "next.disk", 4.7e5], ["disk", "blade", 2.5e5], ["blade", "next.disk", 6.8e3],
]
[contact.shroud]
between = ["wheel.blade", "next.wheel.blade"]
law = "jenkins"
tangential_stiffness_n_per_m = 3e4
slip_limit_n = 1e6
[aero]
file = "c.csv"
reference_hz = 100
shapes = "wave"
contacts = "open"
[flutter]
"""


def test_the_phase_of_a_mode_is_that_of_the_sectors_own_dofs(tmp_path: Path) -> None:
    """The contact makes the sector hold copies of the neighbour's dofs, as large as its own and a phase angle ahead."""
    rows = [f"0,{a},{b},1.0,1.0" for a in (1, 2) for b in (1, 2)]
    head = "neighbour,force_mode,motion_mode,real_per_s2,imag_per_s2"
    (tmp_path / "c.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    (tmp_path / "study.toml").write_text(RING, encoding="utf-8")
    there = read_study(tmp_path / "study.toml").model()
    flow = flow_around(there)
    M = np.diag([0.85, 0.5])
    for k in range(6):
        ahead = np.exp(2j * np.pi * k / 6)
        K = np.diag([3.3e5 + 2.5e5, 2.5e5]).astype(complex)
        K[0, 1] = K[1, 0] = -2.5e5
        for value, row in ((4.7e5, [1 - ahead, 0]), (6.8e3, [ahead, -1])):
            K += value * np.outer(np.conj(row), row)
        shapes = scipy.linalg.eigh(K, M)[1]
        top = np.abs(shapes).argmax(axis=0)
        assert np.all(np.diff(np.sort(np.abs(shapes), axis=0), axis=0) > 0.01)  # no tie of its own
        leading = shapes[top, [0, 1]]
        moving = there.at(0.0, k, "open")
        patterns = flow.on_structure(k, moving).patterns
        np.testing.assert_allclose(patterns, M @ shapes * np.abs(leading) / leading, rtol=1e-9, atol=1e-9)


def test_rounding_does_not_choose_the_phase() -> None:
    shape = np.array([[3j, 3j], [2.0, 2.0], [-2.0, -2.0], [2j, 2j]])
    shape[2] *= 1 + np.array([1e-9, -1e-9])
    np.testing.assert_allclose(phases(shape, np.array([1, 2, 3])), [1.0, 1.0])
    shape[2] *= 1.001
    np.testing.assert_allclose(phases(shape, np.array([1, 2, 3])), [-1.0, -1.0])


def test_diagrams_of_still_fluid_and_equal_sectors_say_so() -> None:
    """The coefficients are those of 10 to 20 Hz, where no mode is."""
    base = sector_model(shrouded_sector())
    narrow = InfluenceCoefficients(np.array([0]), np.full((1, 2, 1, 1, 1), 1j), 2 * np.pi * np.array([10.0, 20.0]))
    aero = Aerodynamics(influence=narrow, reference=70.0, points={"tip": ("blade.tip", (0, 1, 0))})
    scatter = BladeMistuning(of="blade.tip", deviations=np.full(SECTORS, 0.1))
    plain = ss.Model(parts=base.parts)
    full = replace(plain, aerodynamics=aero, mistuning=Mistuning(blades={"all": scatter}))
    keys = {"engine_orders": [1, 2], "modes": 2}
    for name, more in (("safe", {"speed_rpm": 3000.0}), ("campbell", {"speeds_rpm": [0.0, 3000.0], "points": 2})):
        found, still = (getattr(m, name)(**keys, **more) for m in (full, plain))
        a, b = (r.data[name].to_dataset()["frequency_hz"].values for r in (found, still))
        np.testing.assert_array_equal(a, b)
        told = [v.why for v in found.verdicts if v.word == "note"]
        assert any("in still fluid" in why for why in told)
        assert any("all sectors alike" in why for why in told)
        assert not any("in still fluid" in v.why for v in still.verdicts)

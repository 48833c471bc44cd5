"""Friction coefficient and stiffness from hysteresis loops, against loops in closed form that share no code with the laws."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import stickslip as ss
from stickslip.cli import app
from stickslip.contact.law_steps import forces_along
from stickslip.errors import InputError
from stickslip.study.file.model.contacts import ContactTable

K, LIMIT = 2e7, 50.0


def cycles(amplitude: float, samples: int = 300, phase: float = 0.3) -> tuple[np.ndarray, ...]:
    """Return the displacement of two cycles, and 1 where it falls."""
    t = np.linspace(0, 4 * np.pi, samples, endpoint=False) + phase
    return amplitude * np.cos(t), np.sin(t) >= 0


def parallelogram(amplitude: float, samples: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Return the loop of a Jenkins element that has slipped both ways before: its two branches, written down."""
    x, falls = cycles(amplitude, samples)
    down = np.maximum(-LIMIT, LIMIT - K * (x.max() - x))
    up = np.minimum(LIMIT, -LIMIT + K * (x - x.min()))
    return x, np.where(falls, down, up)


def noisy(force: np.ndarray, seed: int = 0, size: float = 1.0) -> np.ndarray:
    return force + np.random.default_rng(seed).normal(0.0, size, force.size)


def said(fit: ss.contact.LoopFit) -> str:
    return "\n".join(fit.notes)


def test_a_loop_without_noise_is_found_again() -> None:
    x, force = parallelogram(8e-6)
    fit = ss.contact.fit_loops([(x + 3e-6, force + 7.0)], normal_load=100.0)
    assert fit.k_t == pytest.approx(K, rel=1e-9)
    assert fit.mu == pytest.approx(0.5, rel=1e-9)
    np.testing.assert_allclose(fit.fitted[0], force + 7.0, atol=1e-7)
    assert fit.law == ss.ElasticCoulomb(k_t=fit.k_t, k_w=0.0, k_n=0.0, mu=fit.mu, preload=100.0)


def test_the_covariance_is_the_scatter_of_many_fits() -> None:
    x, force = parallelogram(8e-6)
    fits = [ss.contact.fit_loops([(x, noisy(force + 3.0, seed))]) for seed in range(60)]
    found = np.array([[fit.k_t, fit.limit] for fit in fits])
    own = np.array([[fit.deviations["k_t"], fit.deviations["limit"]] for fit in fits])
    away = (found - [K, LIMIT]) / own
    assert (np.abs(away) < 2).mean() > 0.9
    # a standard deviation of 60 values is known to 9 %, a correlation of 0.45 to 0.1
    np.testing.assert_allclose(away.std(axis=0), 1.0, atol=0.27)
    np.testing.assert_allclose(away.mean(axis=0), 0.0, atol=3 / math.sqrt(60))
    told = np.mean([f.covariance[0, 1] / np.prod(o) for f, o in zip(fits, own, strict=True)])
    assert np.corrcoef(found.T)[0, 1] == pytest.approx(told, abs=0.3)
    # a wholly slipping sample tells the limit alone: 50.0 ± 1 N / sqrt(samples), of which some stick
    assert 1.0 < own[:, 1].mean() * math.sqrt(x.size) < 1.5


def test_a_loop_that_never_slips_tells_no_friction_coefficient() -> None:
    x, _ = cycles(2e-6)
    for force in (K * x, noisy(K * x)):
        fit = ss.contact.fit_loops([(x, force)], normal_load=100.0)
        assert fit.k_t == pytest.approx(K, abs=3 * fit.deviations["k_t"] + 1.0)
        assert math.isnan(fit.mu)
        assert fit.least[1] == pytest.approx(40.0, rel=0.01)
        assert "tell no friction coefficient" in said(fit)
        assert fit.law is None
    off = [ss.contact.fit_loops([(x, noisy(K * x, s))]).k_t / K - 1 for s in range(16)]
    assert np.std(off) == pytest.approx(fit.deviations["k_t"] / K, rel=0.5)


def test_noise_alone_makes_no_slip() -> None:
    x, _ = cycles(2e-6)
    fits = [ss.contact.fit_loops([(x, noisy(K * x, seed, 5.0))]) for seed in range(12)]
    assert all(math.isnan(fit.limit) for fit in fits)


def test_a_loop_that_always_slips_tells_no_stiffness() -> None:
    x, falls = cycles(8e-6)
    fit = ss.contact.fit_loops([(x, noisy(np.where(falls, -LIMIT, LIMIT)))], normal_load=100.0)
    assert math.isnan(fit.k_t)
    assert fit.mu == pytest.approx(0.5, abs=4 * fit.deviations["mu"])
    assert "tell no stiffness" in said(fit)
    # the spring must turn within the first steps after the motion has turned
    assert fit.least[0] > 100 * LIMIT / 8e-6


def test_slip_in_one_direction_tells_no_limit_beside_an_offset() -> None:
    x = np.linspace(0.0, 1e-5, 200)
    force = noisy(np.minimum(K * x, LIMIT))
    fit = ss.contact.fit_loops([(x, force + 20.0)])
    assert fit.k_t == pytest.approx(K, abs=4 * fit.deviations["k_t"])
    assert math.isnan(fit.limit)
    assert "one direction only" in said(fit)
    trusted = ss.contact.fit_loops([(x, force)], offset=False)
    assert trusted.limit == pytest.approx(LIMIT, abs=4 * trusted.deviations["limit"])
    slides = ss.contact.fit_loops([(x, noisy(np.full(200, LIMIT)))], offset=False)
    assert slides.limit == pytest.approx(LIMIT, abs=0.3)
    assert math.isnan(slides.k_t)
    assert "does not turn" in said(slides)


def test_machine_in_series_is_taken_out_where_it_is_given() -> None:
    x, force = parallelogram(8e-6)
    machine = 5e7
    measured = x + force / machine  # between places with the machine between them
    rigid = ss.contact.fit_loops([(measured, force)])
    assert rigid.k_t == pytest.approx(1 / (1 / K + 1 / machine), rel=1e-9)
    assert "cannot separate the contact from the machine" in said(rigid)
    noise = noisy(force)
    series, own = (ss.contact.fit_loops([(measured, noise)], machine_stiffness=k) for k in (None, machine))
    fit = ss.contact.fit_loops([(measured, force)], machine_stiffness=machine)
    assert fit.k_t == pytest.approx(K, rel=1e-9)
    assert "machine" not in said(fit)
    # the deviation by differences of the formula for two springs in series
    more = series.k_t + series.deviations["k_t"] * 1e-3
    slope = (1 / (1 / more - 1 / machine) - own.k_t) / 1e-3
    assert own.deviations["k_t"] == pytest.approx(slope, rel=1e-3)
    with pytest.raises(InputError, match=r"machine_stiffness: is 1e\+07 N/m, not above"):
        ss.contact.fit_loops([(measured, force)], machine_stiffness=1e7)


def test_without_a_normal_load_only_the_limit_is_told() -> None:
    x, force = parallelogram(8e-6)
    fit = ss.contact.fit_loops([(x, noisy(force))])
    assert math.isnan(fit.mu)
    assert fit.limit == pytest.approx(LIMIT, abs=4 * fit.deviations["limit"])
    assert "normal load is not given" in said(fit)
    loaded = ss.contact.fit_loops([(x, noisy(force))], normal_load=100.0, normal_load_deviation=10.0)
    assert loaded.deviations["mu"] == pytest.approx(0.05, rel=0.01)


def test_a_drifting_force_is_told_and_fitted() -> None:
    x, force = parallelogram(8e-6)
    drifting = noisy(force) + np.linspace(0.0, 10.0, x.size)
    plain = ss.contact.fit_loops([(x, drifting)])
    assert "fit with a drift" in said(plain)
    assert "follow each other" in said(plain)
    fit = ss.contact.fit_loops([(x, drifting)], drift=True)
    assert fit.k_t == pytest.approx(K, abs=4 * fit.deviations["k_t"])
    assert fit.residual == pytest.approx(1.0, rel=0.15)
    assert "drift" not in said(fit)


def test_a_drifting_displacement_hardly_changes_the_estimates() -> None:
    x, force = parallelogram(8e-6)
    fit = ss.contact.fit_loops([(x + np.linspace(0.0, 3.2e-6, x.size), force)])
    assert fit.k_t == pytest.approx(K, rel=0.02)
    assert fit.limit == pytest.approx(LIMIT, rel=0.003)


def test_noise_of_the_displacement_is_told() -> None:
    x, force = parallelogram(8e-6)
    fit = ss.contact.fit_loops([(noisy(x, size=1e-7), force)])
    assert "The displacement jumps by some 1e-07 m" in said(fit)
    assert "jumps" not in said(ss.contact.fit_loops([(x, noisy(force))]))


def test_a_loop_with_rounded_corners_is_told() -> None:
    """Three Jenkins elements side by side slip one after the other; the smallest sum of squares is still near."""
    x, falls = cycles(8e-6)
    force = np.zeros(x.size)
    for share in (0.5, 1.0, 1.5):
        limit = share * LIMIT / 3
        down = np.maximum(-limit, limit - K / 3 * (x.max() - x))
        up = np.minimum(limit, -limit + K / 3 * (x - x.min()))
        force += np.where(falls, down, up)
    fit = ss.contact.fit_loops([(x, noisy(force, size=0.3))])
    assert "say nothing of what the law leaves out" in said(fit)
    factor = float(re.search(r"factor of about ([\d.]+)", said(fit))[1])
    assert factor > 2
    assert fit.limit == pytest.approx(LIMIT, rel=0.05)
    assert 0.6 * K < fit.k_t < K


def test_recordings_have_offsets_of_their_own() -> None:
    loops = [parallelogram(a) for a in (8e-6, 2e-5)]
    shifted = [(x, noisy(f, i) + 30.0 * i) for i, (x, f) in enumerate(loops)]
    fit = ss.contact.fit_loops(shifted)
    assert fit.k_t == pytest.approx(K, abs=4 * fit.deviations["k_t"])
    assert fit.limit == pytest.approx(LIMIT, abs=4 * fit.deviations["limit"])
    assert fit.residual == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize("slips", [False, True])
def test_a_force_with_the_wrong_sign_is_refused(*, slips: bool) -> None:
    x, _ = cycles(2e-6)
    x, force = parallelogram(8e-6) if slips else (x, K * x)
    with pytest.raises(InputError, match=r"it would give energy\. Change the sign"):
        ss.contact.fit_loops([(x, -force)])


@pytest.mark.parametrize(
    ("loops", "message"),
    [
        ([], "loops: is empty"),
        ([(np.arange(5.0), np.arange(5.0))], r"loops\[0\]: has 5 samples"),
        ([(np.zeros(9), np.arange(9.0))], "displacement is 0 at every sample"),
        ([(np.arange(9.0), np.arange(8.0))], "shape"),
        ([(np.arange(9.0), np.full(9, np.nan))], "a force is not finite"),
    ],
)
def test_what_is_no_loop_is_refused(loops: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ss.contact.fit_loops(loops)


def test_a_walk_along_a_path_is_that_of_the_law() -> None:
    """First loading, unloading and reloading of a spring with a slider, and lift-off, by hand."""
    law = ss.ElasticCoulomb(k_t=2.0, k_w=0.0, k_n=1.0, mu=0.5, preload=4.0)
    gap = np.zeros((6, 3))
    gap[:, 0] = [0.5, 3.0, 2.5, 0.0, 0.0, 1.0]
    gap[:, 2] = [0.0, 0.0, 0.0, 0.0, 5.0, 0.0]
    force, state = forces_along(law, gap)
    np.testing.assert_allclose(force[:, 0], [1.0, 2.0, 1.0, -2.0, 0.0, 2.0])
    np.testing.assert_allclose(force[:, 2], [-4.0, -4.0, -4.0, -4.0, 0.0, -4.0])
    assert state[:, 0].tolist() == [0, 1, 0, 1, 2, 0]


def write(folder: Path, text: str) -> Path:
    path = folder / "loops.csv"
    path.write_text(text)
    return path


def recorded(folder: Path, seed: int = 1) -> Path:
    x, force = parallelogram(8e-6)
    rows = zip(1e6 * x, noisy(force, seed) + 2.0, strict=True)
    lines = [f"{i},{a:.6f},{b:.4f}" for i, (a, b) in enumerate(rows)]
    return write(folder, "\n".join(["# rig 3", "time_s,displacement_um,force_n", *lines, ""]))


def test_the_command_prints_estimates_and_lines_for_the_study(tmp_path: Path) -> None:
    words = ["fit", str(recorded(tmp_path)), "--normal-load", "100", "--normal-load-deviation", "1"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    value, off = map(float, re.search(r"friction coefficient\s+(\S+) ± (\S+)", done.output).groups())
    assert value == pytest.approx(0.5, abs=0.003)
    assert off == pytest.approx(0.005, rel=0.1)
    lines = done.output.split("study file\n")[1].split("\nFiles")[0]
    keys = tomllib.loads(lines)
    table = ContactTable.model_validate(keys | {"between": ["a.tip", "b.tip"], "normal_stiffness_n_per_m": 1e7})
    assert table.law == "elastic_coulomb"
    assert keys["tangential_stiffness_n_per_m"] == pytest.approx(K, rel=0.02)
    page = (tmp_path / "loops.fit.html").read_text()
    assert "Hysteresis loop and fit" in page
    assert "cannot separate the contact from the machine" in page


def test_without_a_load_the_lines_are_those_of_a_constant_limit(tmp_path: Path) -> None:
    page = tmp_path / "p.html"
    done = CliRunner().invoke(app, ["fit", str(recorded(tmp_path)), "--page", str(page)])
    keys = tomllib.loads(done.output.split("study file\n")[1].split("\nFiles")[0])
    ContactTable.model_validate(keys | {"between": ["a.tip", "b.tip"]})
    assert keys["law"] == "jenkins"
    assert keys["slip_limit_n"] == pytest.approx(LIMIT, abs=0.5)
    assert page.is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("displacement_um,force_n\n1,2\n3,x\n", "line 3: force_n: is no finite number, got 'x'"),
        ("displacement_um,force_n\n1,2\n3\n", "line 3: has 1 cells, the first line 2"),
        ("displacement,force_n\n1,2\n", "has no column displacement_m or .*Rename the column 'displacement'"),
        ("displacement_um;force_n\n1;2\n", "is one column.*Separate the columns by commas"),
        ("force_n,force_n\n1,2\n", "names the column 'force_n' twice"),
        ("displacement_um,displacement_m,force_n\n1,1,2\n", "has both displacement_m and displacement_um"),
        ("displacement_um,force_n\n", "holds no numbers"),
        (
            "loop,displacement_um,force_n\na,1,1\nb,2,2\na,3,3\n",
            "line 4: loop: comes back to an earlier recording, got 'a'",
        ),
        ("displacement_um,force_n\n1,2\n2,3\n", "loops.csv.0.: has 2 samples"),
    ],
)
def test_a_file_that_cannot_be_read_is_named_with_line_and_column(tmp_path: Path, text: str, message: str) -> None:
    done = CliRunner().invoke(app, ["fit", str(write(tmp_path, text))])
    assert done.exit_code == 2
    assert re.search(message, done.stderr), done.stderr


def test_recordings_of_a_file_are_told_apart(tmp_path: Path) -> None:
    path = write(tmp_path, "loop,displacement_mm,force_kn\na,1,1\na,2,2\nb,3,3\n")
    (x, force), (other, _) = ss.model.read_loops(path)
    np.testing.assert_allclose(x, [1e-3, 2e-3])
    np.testing.assert_allclose(force, [1e3, 2e3])
    assert other.size == 1


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_marks_and_line_ends_of_other_programs_are_read(tmp_path: Path, end: str) -> None:
    path = tmp_path / "loops.csv"
    path.write_bytes(b"\xef\xbb\xbf" + end.join(["Displacement_um, Force_N", "1, 2", "", "3,4"]).encode())
    ((x, force),) = ss.model.read_loops(path)
    np.testing.assert_allclose(x, [1e-6, 3e-6])
    np.testing.assert_allclose(force, [2.0, 4.0])


def test_the_page_of_the_documentation_runs(tmp_path: Path, monkeypatch, capsys) -> None:
    recorded(tmp_path)
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).parents[1] / "docs" / "measurements.md").read_text()
    names: dict[str, object] = {}
    exec(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)[0], names)  # our own page
    assert names["law"].mu == pytest.approx(0.5, abs=0.003)
    assert str(names["fit"].k_t) in capsys.readouterr().out

"""T/N at the contacts through the cycle at the peak: the figure against forces from another evaluation, its limits, marks and words."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import stickslip as ss
from stickslip.analyses.page import report_html
from stickslip.cli import app

MU, PRELOAD, K = 0.4, 4.0, 2e4


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> ss.Result:
    """A mass on springs that slides to and fro on two points, of which one lifts off in each cycle."""
    place = np.zeros((3, 3))
    nodes = ss.model.Dofs(np.array([0, 0, 0]), ("x", "y", "z"), place)
    body = ss.Structure(
        mass=np.eye(3),
        damping=6.0 * np.eye(3),
        stiffness=np.diag([3e4, 3e4, 6e5]),
        dofs=nodes,
        sets={"tip": np.array([0, 1, 2])},
    )
    law = ss.ElasticCoulomb(k_t=K, k_w=K, k_n=K, mu=MU)
    frame = {"between": ("body.tip", "ground"), "normal": (0.0, 0.0, -1.0), "tangent": (1.0, 0.0, 0.0)}
    model = ss.Model(
        parts={"body": ss.Part(structure=body)},
        contacts={
            "firm": ss.Contact(law=law, preload=10 * PRELOAD, **frame),
            "loose": ss.Contact(law=law, preload=PRELOAD, **frame),
        },
        loads={
            "along": ss.Load(on="body.tip", newton=12.0, direction=(1.0, 0.0, 0.0)),
            "across": ss.Load(on="body.tip", newton=150.0, direction=(0.0, 0.0, 1.0), phase=0.7),
        },
    )
    keys = {"low": 5, "high": 5, "selection": "always_high", "points": 8, "peak_points": 2, "stability": "off"}
    return model.forced_response((20.0, 45.0), folder=tmp_path_factory.mktemp("ratio"), **keys)


def curves(result: ss.Result) -> dict[str, np.ndarray]:
    figure = result.plot("friction_ratio_t")
    return {trace.name: np.array([trace.x, trace.y], dtype=float) for trace in figure.data if trace.x[0] is not None}


def test_the_curves_are_the_forces_of_the_law_marched_in_time(result: ss.Result) -> None:
    data = result["forced_response"]
    peak = int(data.peak_point.values[0]) if "peak_point" in data else int(np.argmax(data.amplitude.values[:, 0]))
    gap = data.gap.values[peak]  # harmonic, contact, direction, part
    amplitudes = gap[..., 0] + 1j * gap[..., 1]
    samples = data.sizes["sample"]
    turn = np.exp(2j * np.pi * np.outer(np.arange(samples) / samples, np.arange(len(gap))))
    for k, (name, preload) in enumerate((("firm", 10 * PRELOAD), ("loose", PRELOAD))):
        motion = np.real(np.einsum("sh,hd->sd", turn, amplitudes[:, k]))
        normal = np.maximum(0.0, preload - K * motion[:, 2])
        slider, tangential = 0.0, np.zeros(samples)
        for _ in range(8):  # Jenkins element by hand, until it repeats
            for s in range(samples):
                trial = K * (motion[s, 0] - slider)
                tangential[s] = np.clip(trial, -MU * normal[s], MU * normal[s])
                slider = motion[s, 0] - tangential[s] / K
        label = str(data.contact.values[k])
        time, drawn = curves(result)[label]
        assert (time[-1], drawn[-1]) == (1.0, pytest.approx(drawn[0], nan_ok=True))  # it is periodic
        at = np.rint(time * samples).astype(int) % samples
        closed = normal[at] > 1e-2 * preload
        assert closed.any(), name
        # events lie between the samples of the march: 256 of a period
        assert np.abs(drawn[closed] - (tangential / np.where(normal > 0, normal, np.nan))[at][closed]).max() < 0.02
        assert np.all(np.isnan(drawn[normal[at] == 0.0]))


def test_limits_open_marks_and_words(result: ss.Result) -> None:
    found = curves(result)
    data = result["forced_response"]
    firm, loose = (str(name) for name in data.contact.values)
    assert {f"{MU:+.3g}", f"{-MU:+.3g}", f"{loose} open"} < set(found)
    assert f"{firm} open" not in found
    assert np.all(found[f"{MU:+.3g}"][1] == MU)
    assert np.nanmax(np.abs(found[loose][1])) == pytest.approx(MU, rel=1e-6)  # it slips
    opened = data.peak_state.sel(contact=loose).values[0, 0] == 2
    times = np.flatnonzero(opened) / opened.size
    assert np.isin(np.round(found[f"{loose} open"][0], 6), np.round(times, 6)).all()
    assert data.peak_friction.values.tolist() == [[MU, MU]]
    page = report_html(result.data)
    assert "T/N at the contacts" in page
    assert f"Open during a part of the cycle: {loose}." in page
    assert f"its friction coefficient is {MU}" in page


def test_the_figure_goes_into_a_paper(result: ss.Result, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    target = tmp_path / "ratio.pdf"
    done = CliRunner().invoke(app, ["figure", str(result.path), "friction_ratio_t", "--to", str(target)])
    assert done.exit_code == 0, done.output
    assert target.stat().st_size > 1000


def test_results_without_friction_coefficients_are_drawn_without_limits(result: ss.Result) -> None:
    old = result.data.copy()
    old["forced_response"] = old["forced_response"].to_dataset().drop_vars("peak_friction")
    figure = ss.Result(old).plot("friction_ratio_t")
    names = [trace.name for trace in figure.data]
    assert f"{MU:+.3g}" not in names

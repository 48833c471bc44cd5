"""Code of a user that a study file names: allowed, refused, told, found again by workers and by resumed runs."""

import json
import re
import shutil
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import stickslip as ss
from stickslip.cli import app
from stickslip.study import own_code

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLES = Path(__file__).parents[1] / "examples"
STUDY = """
schema_version = 2
title = "Own code"
[part.bar]
shape = "lumped"
masses_kg = [1.0, 0.5]
names = ["base", "tip"]
springs_n_per_m = [["ground", "base", 2e4], ["base", "tip", 1e4]]
dashpots_n_s_per_m = [["ground", "base", 2.0], ["base", "tip", 1.0]]
[contact.friction]
between = ["bar.tip", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 4e3
slip_limit_n = 0.6
[load.shaker]
on = "bar.tip"
force_n = 1.0
[harmonics]
low = 1
high = 3
selection = "always_low"
[forced_response]
frequency_hz = [9.5, 22.0]
points = 6
peak_points = 2
stability = "off"
"""
STRATEGY = """
from dataclasses import dataclass
from pathlib import Path

import stickslip as ss

Path(__file__).with_name("imported").touch()
ALL = (0, 1, 2, 3)


@dataclass(frozen=True)
class Everything:
    threshold: float = 0.5
    verifies = True

    def judge(self, step):
        done = step.balance.harmonics == step.reference.harmonics
        return ss.harmonic.Verdict(0.0 if done else 1.0, None if done else ALL, following=step.smallest)


@dataclass(frozen=True)
class Lacking:
    threshold: float = 0.5
    verifies = True


@dataclass(frozen=True)
class Asking:
    threshold: float
    verifies = True

    def judge(self, step):
        raise KeyError("harmonic 7")


FAILING = Asking(0.5)
"""
CODE = """
from dataclasses import dataclass

import numpy as np

import stickslip as ss
from factors import FACTOR


def read(path, units):
    mass, stiffness, damping = (np.loadtxt(path)[i : i + 2] for i in (0, 2, 4))
    places = ss.model.Dofs(np.array([0, 1]), ("x", "x"), np.zeros((2, 3)))
    sets = {"base": np.array([0]), "tip": np.array([1])}
    return ss.Structure(FACTOR * mass, damping, stiffness, places, sets)


def wrong(path, units):
    return str(path)


def broken(path, units):
    raise ValueError("no such record")


@dataclass(frozen=True)
class Static:
    n_modes: int = 1
    in_words = "one fixed-interface mode"

    def of(self, structure, keep):
        return ss.craig_bampton(structure, keep, self.n_modes)


class Loose:
    in_words = "not a dataclass"

    def of(self, structure, keep):
        return structure
"""
MATRICES = "1 0\n0 0.5\n3e4 -1e4\n-1e4 1e4\n3 -1\n-1 1\n"
OWN_PART = 'shape = "lumped"(.|\n)*?dashpots.*'


@pytest.fixture(autouse=True)
def as_in_a_new_process() -> Iterator[None]:
    paths = list(sys.path)
    yield
    forget(paths)


def forget(paths: list[str]) -> None:
    own_code._imported.cache_clear()
    sys.path[:] = paths
    for name in ("mine", "parts", "factors", "failing", "own_law"):
        sys.modules.pop(name, None)


def write(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the study with some texts replaced, and the modules beside it."""
    folder.mkdir(exist_ok=True)
    text = STUDY
    for before, after in changes:
        text, count = re.subn(before, lambda _, new=after: new, text, count=1)
        assert count == 1, before
    (folder / "study.toml").write_text(text)
    (folder / "mine.py").write_text(STRATEGY)
    (folder / "parts.py").write_text(CODE)
    (folder / "factors.py").write_text("FACTOR = 1.0\n")
    (folder / "matrices.txt").write_text(MATRICES)
    return folder / "study.toml"


def chosen(address: str) -> tuple[str, str]:
    return ('"always_low"', f'"{address}"')


def read_by(address: str) -> tuple[str, str]:
    return OWN_PART, f'file = "matrices.txt"\nunits = "SI"\nplausible = false\nreader = "{address}"'


def invoke(*words: str | Path) -> Result:
    return CliRunner().invoke(app, list(map(str, words)))


def said(done: Result) -> str:
    return " ".join(done.output.split())


def peak(folder: Path) -> float:
    return float(ss.Result.from_file(folder / "results")["forced_response"].peak_amplitude.values[0])


@pytest.mark.parametrize("command", ["run", "check"])
def test_without_the_flag_nothing_is_imported(tmp_path: Path, command: str) -> None:
    study = write(tmp_path, chosen("mine:Everything"))
    done = invoke(command, study)
    assert done.exit_code == 2
    assert f"{study}: harmonics.selection: names code of your own" in said(done)
    assert "got 'mine:Everything'. If you trust it, add --allow-code" in said(done)
    assert not (tmp_path / "imported").exists()
    with pytest.raises(ss.InputError, match=r"allow_code=True"):
        ss.Study.from_file(study)
    assert not (tmp_path / "imported").exists()


def test_a_strategy_from_a_file_answers_as_its_object_does(tmp_path: Path) -> None:
    study = write(tmp_path, chosen("mine:Everything"))
    assert "Everything chooses between harmonics 1 and 3" in said(invoke("check", study, "--allow-code"))
    done = invoke("run", study, "--allow-code")
    assert done.exit_code == 0, done.output
    content = sha256((tmp_path / "mine.py").read_bytes()).hexdigest()
    assert f"own code: mine.py, SHA-256 {content}" in said(done)
    result = ss.Result.from_file(tmp_path / "results")
    data = result["forced_response"]
    assert data.attrs["selection"] == "Everything"
    assert json.loads(result.data.attrs["versions"])["mine.py"] == content
    page = (tmp_path / "results" / "report.html").read_text()
    assert "chosen by Everything" in page
    assert content in page
    from mine import Everything

    keys: dict[str, Any] = {"low": 1, "high": 3, "points": 6, "peak_points": 2, "stability": "off"}
    model = ss.Study.from_file(study, allow_code=True).model()
    same = model.forced_response((9.5, 22.0), selection=Everything(), **keys)["forced_response"]
    assert data.peak_amplitude.values[0] == same.peak_amplitude.values[0]
    # whatever reads the result imports nothing, and the code may be gone
    (tmp_path / "imported").unlink()
    (tmp_path / "mine.py").unlink()
    del sys.modules["mine"]
    two = (tmp_path / "results", tmp_path / "results", "--name", "one", "--name", "two")
    found = invoke("compare", *two, "--page", tmp_path / "both.html")
    assert found.exit_code == 0, found.output
    assert invoke("report", tmp_path / "results").exit_code == 0
    refused = invoke("export", tmp_path / "results")
    assert "A result imports no code" in said(refused)
    assert not (tmp_path / "imported").exists()
    assert "mine" not in sys.modules


def test_changed_code_is_told_and_computed_anew(tmp_path: Path) -> None:
    paths = list(sys.path)
    study = write(tmp_path, read_by("parts:read"))
    assert invoke("run", study, "--allow-code", "--no-report").exit_code == 0
    first = peak(tmp_path)
    assert "jobs to do: 0" in said(invoke("run", study, "--allow-code", "--no-report"))
    (tmp_path / "factors.py").write_text("FACTOR = 1.2\n")  # which parts.py imports
    refused = invoke("run", study, "--allow-code")
    assert "factors.py has changed since this Python imported it. Start Python again." in said(refused)
    forget(paths)
    again = invoke("run", study, "--allow-code", "--no-report")
    assert "factors.py has changed since the last run here: nothing of that run is used" in said(again)
    assert "jobs to do: 1" in said(again)
    assert abs(peak(tmp_path) / first - 1) > 0.01


def test_a_reader_and_a_reduction_of_ones_own_give_what_built_in_ones_give(tmp_path: Path) -> None:
    usual, own = tmp_path / "usual", tmp_path / "own"
    assert invoke("run", write(usual), "--no-report").exit_code == 0
    reduced = ("\\[contact.friction\\]", '[reduction]\nmethod = "parts:Static"\n[contact.friction]')
    done = invoke("run", write(own, read_by("parts:read"), reduced), "--allow-code", "--no-report")
    assert done.exit_code == 0, done.output
    assert "own code: factors.py" in said(done)
    # one mode beside the tip is all of two masses: the same motion in other coordinates, solved to 1e-8
    assert peak(own) == pytest.approx(peak(usual), rel=1e-6)


def test_a_law_from_a_file_answers_as_the_built_in_one_and_workers_find_it(tmp_path: Path) -> None:
    usual, own = tmp_path / "usual", tmp_path / "own"
    events = ("\\[load.shaker\\]", '[solver]\nevaluator = "intervals"\n[load.shaker]')
    assert invoke("run", write(usual, events), "--no-report").exit_code == 0
    law = (
        'law = "jenkins"(.|\n)*?slip_limit_n = 0.6',
        'law = "own_law:RateJenkins"\nparameters = { k_t = 4e3, limit = 0.6, per_velocity = 0.0 }',
    )
    vary = ("\\[forced_response\\]", "[vary]\ncontact.friction.parameters.per_velocity = [0.0, 2.0]\n[forced_response]")
    study = write(own, events, law, vary)
    shutil.copy(EXAMPLES / "own_law.py", own)
    done = invoke("run", study, "--allow-code", "--no-report")
    assert done.exit_code == 0, done.output
    sizes = ss.Result.from_file(own / "results")["forced_response"].peak_amplitude.values
    assert sizes[0] == pytest.approx(peak(usual), rel=1e-6)
    assert 0.2 * sizes[0] < sizes[1] < 0.8 * sizes[0]  # more friction at the same limit force
    both = ss.compare(usual / "results", own / "results", names=("usual", "own"))
    assert "own_law:RateJenkins" in both.inputs.to_string()
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        far = ss.Study.from_file(study, allow_code=True).run(executor=pool, folder=tmp_path / "far")
    assert far["forced_response"].peak_amplitude.values.tolist() == sizes.tolist()


def test_a_worker_refuses_code_that_changed_during_the_run(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("A = 1\n")
    sent = own_code.Shipped(tmp_path, {"mine.py": sha256(b"A = 1\n").hexdigest()})
    sent.importable()
    (tmp_path / "mine.py").write_text("A = 2\n")
    with pytest.raises(ss.StickslipError, match=r"mine.py has changed since the run began"):
        sent.importable()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (chosen("mine:"), "harmonics.selection: is no module path, got 'mine:'. Write my_module:Name"),
        (chosen("mien:Everything"), "harmonics.selection: there is no module mien, neither beside the study file"),
        (chosen("mine:Everythin"), "harmonics.selection: mine has no 'Everythin', got 'mine:Everythin'. Did you mean"),
        (chosen("mine:Lacking"), "harmonics.selection: Lacking of mine is no strategy: it has no 'judge', got 'mine:"),
        (chosen("mine:Asking"), "harmonics.selection: Asking() raises TypeError"),
        (
            chosen("mine:Asking"),
            "Give every parameter a default, or name an object of the module: ASKING = Asking(...)",
        ),
        (chosen("failing:Name"), "harmonics.selection: importing failing raises ZeroDivisionError: division by zero"),
        (chosen("failing:Name"), "Correct failing.py, line 2."),
        (chosen("random:Random"), "random.py stands beside the study file, and Python has loaded another random"),
        (
            ('"jenkins"', '"mine:Everything"'),
            "contact.friction.law: Everything of mine is no contact law: it has no 'ker",
        ),
        (
            ("slip_limit_n = 0.6", "slip_limit_n = 0.6\nparameters = { a = 1 }"),
            "parameters: is of a law of your own, and law is",
        ),
        (read_by("parts:wrong"), "part.bar.reader: parts:wrong returns a str. Return a stickslip.Structure or"),
        (
            read_by("parts:broken"),
            "part.bar.reader: parts:broken raises ValueError: no such record. See parts.py, line 22",
        ),
        (read_by("parts:FACTOR"), "part.bar.reader: FACTOR of parts is no function: it has no '__call__'"),
        (
            ("\\[load", '[reduction]\nmethod = "parts:Loose"\n[load'),
            "reduction.method: is a Loose, which is no dataclass",
        ),
    ],
)
def test_what_is_wrong_is_refused_by_name(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    study = write(tmp_path, change)
    (tmp_path / "failing.py").write_text("A = 1\nB = A / 0\n")
    (tmp_path / "random.py").write_text("Random = 1\n")
    done = invoke("check", study, "--allow-code")
    assert done.exit_code == 2, done.output
    assert told in said(done)


def test_an_error_in_the_code_is_no_fault_of_the_package(tmp_path: Path) -> None:
    study = write(tmp_path, chosen("mine:FAILING"))
    done = invoke("run", study, "--allow-code")
    assert done.exit_code == 2
    line = next(n for n, text in enumerate(STRATEGY.splitlines(), 1) if "KeyError" in text)
    assert "Asking.judge: raises KeyError: 'harmonic 7'." in said(done)
    assert f"See mine.py, line {line}." in said(done)


def test_parameters_of_a_law_are_refused_by_name(tmp_path: Path) -> None:
    law = (
        'law = "jenkins"(.|\n)*?slip_limit_n = 0.6',
        'law = "own_law:RateJenkins"\nparameters = { k_t = 4e3, limt = 0.6 }',
    )
    study = write(tmp_path, law)
    shutil.copy(EXAMPLES / "own_law.py", tmp_path)
    done = said(invoke("check", study, "--allow-code"))
    assert "contact.friction.parameters: RateJenkins is not made of {'k_t': 4000.0, 'limt': 0.6}" in done
    assert "Give what it takes: RateJenkins(k_t: float, limit: float, per_velocity: float)" in done


def test_two_folders_with_modules_of_one_name_need_two_processes(tmp_path: Path) -> None:
    one, other = (write(tmp_path / name, chosen("mine:Everything")) for name in ("one", "other"))
    ss.Study.from_file(one, allow_code=True)
    with pytest.raises(
        ss.InputError, match=r"mine.py stands beside the study file, and Python has loaded another mine"
    ):
        ss.Study.from_file(other, allow_code=True)


def test_python_takes_the_object_and_no_path(tmp_path: Path) -> None:
    model = ss.Study.from_file(write(tmp_path)).model()
    with pytest.raises(
        ss.InputError, match=r"is a module path, got 'mine:Everything'. In Python give the object itself"
    ):
        model.forced_response((9.5, 22.0), selection="mine:Everything")

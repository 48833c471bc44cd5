"""The three pages to start from: what they show runs as it stands, on models that are made small."""

import re
import shutil
import tomllib
from pathlib import Path

import pytest
from small_v2 import SECTOR_DECK, _written, write_four_masses
from typer.testing import CliRunner

from stickslip.api.study import Study
from stickslip.cli import app
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.study.questions import ANALYSES

pytestmark = pytest.mark.usefixtures("peak_alone")

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def blocks(page: str, language: str) -> list[str]:
    """Return the code of a page in a language, block by block."""
    text = (ROOT / "docs" / "start" / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def commands(page: str) -> list[list[str]]:
    """Return the words of the commands of a page."""
    lines = "".join(blocks(page, "console")).splitlines()
    assert all(line.startswith("$ ") for line in lines)
    return [line.partition("#")[0].split()[1:] for line in lines]


def told(words: list[str]) -> None:
    """Do a command."""
    if words[0] == "cp":
        shutil.copytree(words[2], words[3])
        return
    assert words[0] == "stickslip"
    found = CliRunner().invoke(app, words[1:])
    assert found.exit_code == 0, found.output


@pytest.mark.validation
def test_researcher(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(EXAMPLES)
    code = blocks("researcher", "python")
    assert len([line for line in code[0].splitlines() if line.strip()]) <= 30
    names: dict[str, object] = {}
    exec(compile("\n".join(code), "researcher.md", "exec"), names)  # our own page
    said = capsys.readouterr().out
    text = (ROOT / "docs" / "start" / "researcher.md").read_text(encoding="utf-8")
    hertz, metres = re.search(r"5\.0 +([\d.]+) +([\d.e-]+) +trusted", said).groups()
    assert f"{1e3 * float(metres):.2f} mm at {float(hertz):.2f} Hz" in text
    rows = re.findall(r"^(\w+) +(\d+) ([\d.]+) mm$", said, flags=re.MULTILINE)
    count, peak = {name: int(n) for name, n, _ in rows}, {name: size for name, _, size in rows}
    assert (
        f"One harmonic gives {peak['always_low']} mm and is doubtful, five give {peak['always_high']} mm. `guarded_alert` agrees with five "
        f"harmonics and is trusted, with {count['guarded_alert']} unknowns instead of {count['always_high']}. `grolet` gives {peak['grolet']} mm."
    ) in text
    assert peak["guarded_alert"] == peak["always_high"]
    own = re.findall(r"^(\w+): (\d+) unknowns, ([\d.]+) mm$", said, flags=re.MULTILINE)
    assert [(kind, size) for kind, _, size in own] == [("Unbalanced", peak["always_high"])]
    assert int(own[0][1]) < count["always_high"]
    pages = {"response.html", "strategies.html", "mine.html", "with_mine.html", "curve.csv"}
    assert {p.name for p in tmp_path.iterdir()} >= pages


def test_designer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, *others = commands("designer")
    told(first)
    text = Path("my_damper/study.toml").read_text(encoding="utf-8")
    wedge, flat, curved, vary, harmonics = blocks("designer", "toml")
    assert "[vary]\nload.shaker.ratio" in vary
    changed = re.sub(r"\[vary\].*?\n\n", vary + "\n", text, flags=re.DOTALL)
    changed = re.sub(r"\[harmonics\].*?\n\n", harmonics + "\n", changed, flags=re.DOTALL)
    Path("my_damper/study.toml").write_text(changed, encoding="utf-8")
    assert len(Study.from_file("my_damper/study.toml").cases) == 6
    own = re.sub(r"nodes_at = .*\n", "", text)
    own = re.sub(r"\[part\.damper\].*?\n\n", wedge + "\n", own, flags=re.DOTALL)
    for side, pair in (("flat", flat), ("curved", curved)):
        own = re.sub(rf"(\[contact\.{side}\]\n)between.*\n", rf"\g<1>{pair}", own)
    Path("my_damper/study.toml").write_text(own, encoding="utf-8")
    study = Study.from_file("my_damper/study.toml")
    x, z = BladePair().wedge_apex
    move = tomllib.loads(wedge)["part"]["damper"]["placed"]["move_m"]
    assert move == pytest.approx([x, 0.0, z], abs=1e-6)
    assert len(study.cases) == 9
    # the commands, on the smallest study in place of the blades
    shutil.rmtree("my_damper")
    write_four_masses(Path("my_damper"), {"forced_response.frequencies": "6", "forced_response.peak_points": "0"})
    for words in others:
        told(words)
    assert Path("both.html").is_file()
    assert Path("one.html").is_file()
    exec(compile("\n".join(blocks("designer", "python")), "designer.md", "exec"), {})


def test_analyst(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLES / "sector_deck" / "sector.inp", tmp_path)
    *whole, vary = blocks("analyst", "toml")
    Path("study.toml").write_text("\n".join([*whole, vary]), encoding="utf-8")
    assert len(Study.from_file("study.toml").cases) == 3
    inspect, _, few, _ = commands("analyst")  # the others are journeys of test_cli.py
    few_points = {k: v for k, v in SECTOR_DECK.items() if not k.startswith("safe.")}
    Path("study.toml").unlink()
    _written(tmp_path, "\n".join(whole), few_points)
    told(inspect)
    told(few)
    exec(compile("\n".join(blocks("analyst", "python")), "analyst.md", "exec"), {})


def test_the_task_map_has_every_question_and_every_command() -> None:
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    assert [name for name in ANALYSES if f"`[{name}]`" not in page] == []
    names = [c.name or c.callback.__name__ for c in app.registered_commands]
    assert [name for name in names if not re.search(rf"`stickslip {name}\b", page)] == []
    links = re.findall(r"\]\(([^)#]+)\)", page) + [f"../{e}" for e in re.findall(r"`(examples/\w+)`", page)]
    assert [link for link in links if not (ROOT / "docs" / link).exists()] == []
    told_of = page + (ROOT / "docs" / "journeys.md").read_text(encoding="utf-8")
    there = {study.parent.name for study in EXAMPLES.glob("*/study.toml")}
    assert there
    assert [name for name in there if f"examples/{name}" not in told_of] == []

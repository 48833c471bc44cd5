"""Parts of ``make validate`` are made of pieces: what was stopped goes on, and the page tells what has run."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from evidence import kernels
from evidence.pytest_run import ROOT
from evidence.validation import parts
from evidence.validation.parts import Part, Piece

Results = dict[str, Counter[str]]


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Results:
    """Put two parts of small pieces in place of the real ones; return what these give, which a test may change."""
    given: Results = {
        "a": Counter(passed=3),
        "b": Counter(passed=1, failed=1),
        "c": Counter(passed=2),
        "ran": Counter(),
    }

    def piece(name: str) -> Piece:
        def run(workers: int) -> Counter[str]:
            given["ran"][f"{name}{workers}"] += 1
            if given[name]["stopped"]:
                raise KeyboardInterrupt
            return given[name]

        return Piece(name, run)

    pieces = [piece("a"), piece("b")]
    first = Part("one thing", lambda: pieces, whole=True, notes=lambda: ["a remark"])
    monkeypatch.setattr(parts, "PARTS", {"first": first, "second": Part("another", lambda: [piece("c")])})
    monkeypatch.setattr(parts, "OUT", tmp_path / "out")
    monkeypatch.setattr(parts, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(parts, "commit", lambda: "0123abcd")
    monkeypatch.setattr(parts, "_files", lambda one: f"files of {one.name}")
    return given


def row(name: str) -> list[str]:
    (line,) = [x for x in parts.PAGE.read_text().splitlines() if x.startswith(f"| `{name}` |")]
    return [cell.strip() for cell in line.strip("|").split("|")][2:]


def test_the_page_counts_what_has_run_and_says_what_has_not(results: Results) -> None:
    parts.run("first", 2)
    assert results["ran"] == {"a2": 1, "b2": 1}
    counts = row("first")
    assert (counts[0], counts[2], counts[3:6]) == ("2 of 2", "`0123abcd`", ["4", "1", "0"])
    assert row("second")[0] == "has not run"
    assert parts.PAGE.read_text().endswith("\n\n- `first`: a remark.\n")
    parts.run("second", 2)
    assert results["ran"]["c1"] == 1  # a piece that takes one worker
    assert row("second")[0] == "1 of 1"


def test_what_has_failed_or_was_stopped_runs_again_and_nothing_else(results: Results) -> None:
    results["b"] = Counter(stopped=1)
    with pytest.raises(KeyboardInterrupt):
        parts.run("first", 1)
    assert row("first")[0] == "1 of 2"
    for again in (Counter(failed=1), Counter(passed=5), Counter(passed=9)):
        results["b"] = again
        parts.run("first", 1)
    assert results["ran"] == {"a1": 1, "b1": 3}
    assert row("first")[3:5] == ["8", "0"]
    parts.run("first", 1, fresh=True)
    assert results["ran"] == {"a1": 2, "b1": 4}


@pytest.mark.parametrize(("what", "value"), [("commit", lambda: "89abcdef"), ("_files", lambda _one: "others")])
def test_a_piece_runs_again_on_other_files_or_after_changes(
    results: Results, monkeypatch: pytest.MonkeyPatch, what: str, value: Callable[..., str]
) -> None:
    """A new commit alone, of which no file is a piece's, leaves it as it is."""
    if what == "commit":
        monkeypatch.setattr(parts, "commit", lambda: "0123abcd+")
    parts.run("second", 1)
    monkeypatch.setattr(parts, what, value)
    parts.run("second", 1)
    assert results["ran"]["c1"] == 2
    monkeypatch.setattr(parts, "commit", lambda: "fedcba98")
    parts.run("second", 1)
    assert results["ran"]["c1"] == 2


def test_a_part_that_ran_elsewhere_keeps_its_line(results: Results, tmp_path: Path) -> None:
    parts.run("first", 1)
    before = parts.PAGE.read_text().splitlines()
    for path in (tmp_path / "out" / "parts" / "first").iterdir():
        path.unlink()
    parts.run("second", 1)
    after = parts.PAGE.read_text().splitlines()
    kept = [line for line in before if "`first`" in line]
    assert len(kept) == 2
    assert set(kept) <= set(after)


def test_every_piece_has_files_and_a_name_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """The files exist at the last commit, by which a piece is told to have run."""
    monkeypatch.setattr(kernels, "loaded", lambda kernel: kernel)
    for name, part in parts.PARTS.items():
        pieces = part.pieces()
        assert len({piece.name for piece in pieces}) == len(pieces) > 0, name
        for piece in pieces:
            assert all((ROOT / file).exists() for file in piece.files), piece

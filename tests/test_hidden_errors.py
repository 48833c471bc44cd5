"""Several mistakes of a study file are told together, though one of them ends the check that finds the others."""

from pathlib import Path

import pytest

from stickslip.api.reading import read
from stickslip.errors import InputError
from stickslip.study.models.study import read_study

TEXT = (Path(__file__).parents[1] / "examples" / "four_masses" / "study.toml").read_text()
FORCE, NAME, LIMIT = "force_n = 5.0\n", 'on = "chain.m1"', "slip_limit_n = 2.0"
VARIED = "load.shaker.force_n = [1.0, 3.0, 5.0]"
NO_SET = "load.shaker.on: there is no set 'chain.m9'"
UNKNOWN = "contact.brake.slip_limit: unknown key 'slip_limit'"


def said(folder: Path, *changes: tuple[str, str]) -> list[str]:
    """Return the lines about a changed example, without its path, after a look at both ways to read it."""
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "tmp.b.m9" / "study.toml"  # names of the folder are no names of the study
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_study(path)
    with pytest.raises(InputError) as again:
        read(path)
    assert str(again.value) == str(caught.value)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


@pytest.mark.parametrize(
    ("changes", "starts"),
    [
        ([(FORCE, f"{FORCE}phaze = 3\n"), (NAME, 'on = "chain.m9"')], ["load.shaker.phaze: unknown key", NO_SET]),
        ([(LIMIT, "slip_limit_n = -2.0"), (NAME, 'on = "chain.m9"')], ["contact.brake.slip_limit_n: must be", NO_SET]),
        (
            [(VARIED, "load.shaker.forze_n = [1.0, 2.0]"), (LIMIT, "slip_limit = 2.0")],
            ["vary.load.shaker.forze_n: ", UNKNOWN],
        ),
        (
            [(VARIED, "load.shaker.force_n = 3"), (LIMIT, "slip_limit = 2.0")],
            ["vary.load.shaker.force_n: must", UNKNOWN],
        ),
        (
            [(VARIED, f"{VARIED}\ncontact.link.slip_limit_n = [1.0]"), (LIMIT, "slip_limit = 2.0")],
            ["vary: lists of one table", UNKNOWN],
        ),
        (
            [("frequency_hz = [8.0, 16.0]", "frequency_hz = [18.0, 16.0]\npoints = -3")],
            ["forced_response.points: must be", "forced_response.frequency_hz: must be the lower before the higher"],
        ),
        (
            [("[contact]", '[part.b]\nfile = "nix.inp"\nunits = "SI"\n[contact]'), (NAME, 'on = "chain.m9"')],
            ["part.b.file: there is no file", NO_SET],
        ),
    ],
)
def test_what_one_error_hides_is_told_with_it(
    tmp_path: Path, changes: list[tuple[str, str]], starts: list[str]
) -> None:
    lines = said(tmp_path, *changes)
    assert len(lines) == len(starts)
    for line, start in zip(lines, starts, strict=True):
        assert line.startswith(start)


@pytest.mark.parametrize(
    "change",
    [
        (
            "masses_kg = [1.0, 1.0, 1.0, 1.0]",
            "masses_kg = [1.0, -1.0, 1.0, 1.0]",
        ),  # the part goes, and its sets with it
        ("masses_kg", "mass_kg"),
        ('shape = "lumped" ', 'shape = "lump" '),
        (FORCE, "ratio_of = 3\n"),
        (LIMIT, "slip_limit_n = -2.0"),
        ('law = "jenkins"', 'law = "jenkin"'),
        ('points = { first = "chain.m1", last = "chain.m4" }', "points = 3"),
        ("[vary]", "[vary.load]"),
        ("schema_version = 2", "schema_version = 3"),
        ("schema_version = 2", ""),
    ],
)
def test_nothing_is_told_that_only_the_removal_of_a_wrong_key_makes_wrong(
    tmp_path: Path, change: tuple[str, str]
) -> None:
    lines = said(tmp_path, change)
    assert len(lines) == len({line.partition(": ")[0] for line in lines}) <= 2
    assert not any("'chain" in line or "no part" in line for line in lines)


def test_the_name_of_the_study_file_is_no_name_of_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table that lacks a key was taken for what the message's own 'brake.toml: ' spoke of."""
    text = TEXT.replace('law = "jenkins", ', "", 1).replace(NAME, 'on = "chain.m9"', 1)
    (tmp_path / "brake.toml").write_text(text)
    (tmp_path / "other.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    told = []
    for name in ("brake.toml", "other.toml"):
        with pytest.raises(InputError) as caught:
            read_study(Path(name))
        told.append([line.removeprefix(f"{name}: ") for line in str(caught.value).splitlines()])
    assert told[0] == told[1]
    assert len(told[0]) == 2

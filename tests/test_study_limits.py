"""Study files that no one means: refused in a moment, in few words, and all that is wrong of others is told at once."""

import gzip
import time
from pathlib import Path

import pytest
from small_v2 import write_four_masses

from stickslip.errors import InputError, input_error, together
from stickslip.study.file.toml import read_toml
from stickslip.study.models.cost import file_nodes
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study

HUGE = {
    "a key of many parts": (".".join("a" * 50_000) + " = 1", "more than 20 parts"),
    "quoted parts": ('"a".' * 100_000 + "a = 1", "more than 20 parts"),
    "tables": ("".join(f"[t{i}]\n" for i in range(90_000)), "has 90000 tables, more than 2000"),
    "keys": ("".join(f"k{i} = 1\n" for i in range(60_000)), "has 60000 keys, more than 5000"),
    "digits": ("a = 1\nschema_version = " + "9" * 5000, "line 2: has a number of over 400 digits"),
    "hexadecimal": ("a = 0x" + "f" * 9000, "has a number of over 400 digits"),
    "lists": ("a = " + "[" * 90_000, "over 20 lists or tables within each other"),
    "quotes": ('"' * 900_000, "is not valid TOML"),
    "bytes": ("#" * 1_000_001, "is larger than 1000000 bytes"),
    "comma": ("a = 1,5 # kg", "Write a point in decimal numbers: 1.5."),
    "date": ("a = 2020-13-45", "is not valid TOML"),
}


@pytest.mark.parametrize("kind", HUGE)
def test_what_would_take_the_parser_long_is_refused_before(tmp_path: Path, kind: str) -> None:
    content, said = HUGE[kind]
    path = tmp_path / "study.toml"
    path.write_text(content)
    began = time.process_time()
    with pytest.raises(InputError) as caught:
        read_toml(path)
    assert time.process_time() - began < 2.0
    assert said in str(caught.value)
    assert len(str(caught.value)) < 500


def test_texts_and_comments_may_hold_what_keys_may_not(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    dots, digits = "a." * 50, "9" * 5000
    text = f'# {dots} {digits} {"[" * 50}\ntitle = """{dots}\n[[[ \\" {digits}"""\nb = \'{dots}\'\n'
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    found, raw = read_toml(path)
    assert found == text  # without the mark and with one form of line ends
    assert raw["b"] == dots


def test_many_errors_are_told_in_two_kilobytes_and_counted() -> None:
    every = [input_error("f", f"wrong \x1b[31m {i}", "Do." * 300) for i in range(5000)]
    lines = str(together(every)).splitlines()
    assert len("\n".join(lines).encode()) <= 2000
    assert lines[-1] == f"... and {5001 - len(lines)} more."
    assert r"wrong \x1b[31m 0" in lines[0]


def test_an_error_is_one_line_whatever_the_names_in_it() -> None:
    error = input_error("a\nb.toml", "names\tc\nd", "Do\ne.")
    assert str(error) == r"a\nb.toml: names\tc\nd. Do\ne."
    assert str(together([error, error])).splitlines() == [str(error)] * 2


def test_all_that_is_wrong_of_harmonics_and_variations_is_told(tmp_path: Path) -> None:
    wrong = {
        "harmonics.high": "3",
        "harmonics.low": "5",
        "harmonics.samples": "16",
        "harmonics.strategy_threshold": "0.1",
    }
    with pytest.raises(InputError) as caught:
        read_study(write_four_masses(tmp_path / "harmonics", wrong))
    keys = [line.split(": ")[1] for line in str(caught.value).splitlines()]
    assert keys == ["harmonics.high", "harmonics.samples", "harmonics.strategy_threshold"]
    empty = {"vary.load.shaker.force_n": "[]", "vary.modes.number": "3", "vary.nothing": "[1]"}
    with pytest.raises(InputError) as caught:
        read_study(write_four_masses(tmp_path / "vary", empty))
    said = str(caught.value)
    assert "vary.load.shaker.force_n: is an empty list: there is nothing to compute" in said
    assert "vary.modes.number: must be a list of values, got 3" in said
    assert "vary.nothing: there is no key 'nothing'" in said
    values = {"vary.forced_response.points": '[4, -1, "many"]'}
    with pytest.raises(InputError) as caught:
        read_study(write_four_masses(tmp_path / "values", values))
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize("name", ["../evil", "a/b", "*", "\\u001b[31m", " x"])
def test_names_that_are_no_names_are_refused(tmp_path: Path, name: str) -> None:
    path = write_four_masses(tmp_path)
    path.write_text(path.read_text().replace("[part.chain]", f'[part."{name}"]'))
    with pytest.raises(InputError, match="is no name, got"):
        read_study(path)


BEYOND = {
    "forced_response.frequency_hz": ("[1e-300, 1e300]", ["[0]: is 1e-300", "[1]: is 1e+300"]),
    "part.chain.masses_kg": ("[1.0, 1e-300, 1.0, 1.0]", ["[1]: is 1e-300"]),
    "part.chain.springs_n_per_m": ('[["ground", 1, -1e31]]', ["[0][2]: is -1e+31"]),
    "load.shaker.force_n": ("9.9e-31", [": is 9.9e-31"]),
    "vary.load.shaker.force_n": ("[1.0, 1e300]", [": is 1e+300"]),
}


@pytest.mark.parametrize("key", BEYOND)
def test_numbers_that_no_quantity_is_are_refused_by_key(tmp_path: Path, key: str) -> None:
    """Range ends of 1e300 and masses of 1e-300 overflowed in one power or another, or gave other frequencies."""
    value, told = BEYOND[key]
    with pytest.raises(InputError) as caught:
        read_study(write_four_masses(tmp_path, {key: value}))
    lines = str(caught.value).splitlines()
    assert [line.split(key)[1].split(",")[0] for line in lines] == told
    assert all("between 1e-30 and 1e+30 in size. Check the unit." in line for line in lines)


def test_numbers_at_the_limits_run_without_a_fault(tmp_path: Path) -> None:
    few = {
        "forced_response.points": "2",
        "forced_response.peak_points": "0",
        "harmonics.high": "3",
        "harmonics.samples": "64",
    }
    extreme = {
        "forced_response.frequency_hz": "[1e-30, 1e30]",
        "part.chain.masses_kg": "[1e-30, 1.0, 1e30, 1.0]",
        "load.shaker.force_n": "1e30",
    }
    outcome = run_study(read_study(write_four_masses(tmp_path, few | extreme)))
    assert outcome.tree.attrs["complete"] == 1
    assert any(verdict.rank for verdict in outcome.verdicts)  # and nobody is told to trust it


@pytest.mark.parametrize("deck", ["calculix_wheel/wheel.inp", "own_blades/blade.inp", "sector_deck/sector.inp"])
@pytest.mark.parametrize("packed", [False, True])
def test_the_size_of_a_deck_tells_about_how_many_nodes_it_has(deck: str, packed: bool, tmp_path: Path) -> None:
    text = (Path(__file__).parent.parent / "examples" / deck).read_bytes()
    keyword, nodes = b"", 0
    for line in text.splitlines():
        keyword = line.upper() if line.startswith(b"*") else keyword
        nodes += keyword.startswith(b"*NODE") and not line.startswith(b"*") and b"PRINT" not in keyword
    path = tmp_path / ("deck.inp.gz" if packed else "deck.INP")
    path.write_bytes(gzip.compress(text) if packed else text)
    assert 0.7 < file_nodes(path) / nodes < 1.4  # decks with other columns are off by so much

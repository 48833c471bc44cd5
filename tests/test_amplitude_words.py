"""Amplitudes in sentences: none is no number, and none is longer than a machine can move."""

import re
from pathlib import Path

import numpy as np
import pytest

import stickslip
from stickslip.report.quantities import column, percent, quantity
from stickslip.units import metres, millimetres, millimetres_between


@pytest.mark.parametrize("size", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_has_words(size):
    assert metres(size) == millimetres(size) == "no finite amplitude"


def test_what_no_machine_can_have_has_words():
    assert metres(2.3e93) == millimetres(2.3e93) == "more than a kilometre"


def test_amplitudes_keep_their_digits():
    assert millimetres(1.23456e-3) == "1.235 mm"
    assert millimetres(1.23456e-3, 5) == "1.2346 mm"
    assert metres(0.0534883) == "5.34883e-02 m"
    assert millimetres_between(1e-3, 2.5e-3) == "1 to 2.5 mm"
    assert millimetres_between(1e-3, np.nan) == "1 mm to no finite amplitude"


def test_a_page_gives_no_amplitude_beyond_a_kilometre():
    assert quantity(2.3e93, "m") == "more than a kilometre"
    assert quantity(2.3e93, "N") != "more than a kilometre"
    unit, cells = column(np.array([1e-3, 2.3e93, np.nan]), "m")
    assert (unit, cells) == ("mm", ["1.000", "more than a kilometre", "–"])
    assert percent(2.3e95) == "over 100\u202f000 %"


def test_sentences_take_amplitudes_from_one_place():
    """No sentence of a response or an analysis formats metres as millimetres itself."""
    source = Path(stickslip.__file__).parent
    own = re.compile(r"\{1e3 \* [^{}]*:\.\d[eg]\} (mm|to \{)")
    found = [
        f"{path.relative_to(source)}: {line.strip()}"
        for folder in ("response", "analyses", "study")
        for path in (source / folder).rglob("*.py")
        for line in path.read_text().splitlines()
        if own.search(line)
    ]
    assert not found

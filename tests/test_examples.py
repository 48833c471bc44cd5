"""The README shows the example of the facade; the one of the lower layers runs, and finds the resonance."""

import ast
import re
import runpy
import tokenize
import warnings
from io import StringIO
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SHOWN = ROOT / "examples" / "two_blades_python.py"
EXAMPLE = ROOT / "examples" / "two_blades" / "in_python.py"


def test_readme_shows_the_example():
    shown = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    assert shown is not None
    written = SHOWN.read_text().replace("  # fmt: skip", "")
    assert written.endswith("\n\n" + shown.group(1))
    assert len(shown.group(1).splitlines()) <= 16  # fifteen lines and a blank one


def test_python_example_finds_the_damped_resonance(capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runpy.run_path(str(EXAMPLE), run_name="__main__")
    rows = re.findall(r"([\d.]+) Hz, (\d) harmonics: ([\d.]+) µm(.*)", capsys.readouterr().out)
    assert len(rows) > 40
    assert all(not state for *_, state in rows)
    hertz, _, peak = max(
        ((float(f), int(h), float(a)) for f, h, a, _ in rows), key=lambda row: row[2]
    )
    # near the blades stuck together (180.3 Hz)
    assert 180.0 < hertz < 182.0
    # friction at work: the stuck peak, 16.9 µm/N times 44.2 N, would be 747 µm
    assert 400.0 < peak < 500.0


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_no_example_is_longer_than_sixty_lines_of_code(path):
    text = path.read_text()
    told = set()  # lines of docstrings
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef) and ast.get_docstring(
            node
        ):
            told |= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    blank = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}  # fmt: skip
    code = {
        line
        for token in tokenize.generate_tokens(StringIO(text).readline)
        if token.type not in blank
        for line in range(token.start[0], token.end[0] + 1)
    }
    assert len(code - told) <= 60

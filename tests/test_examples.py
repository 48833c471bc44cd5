"""The README shows the example of the facade; the one of the lower layers runs, and finds the resonance."""

import ast
import re
import tokenize
import warnings
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

ROOT = Path(__file__).parents[1]
SHOWN = ROOT / "examples" / "two_blades_python.py"
EXAMPLE = ROOT / "examples" / "two_blades" / "in_python.py"


def test_readme_shows_the_example():
    shown = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    assert shown is not None
    written = SHOWN.read_text()
    assert written.endswith("\n\n" + shown.group(1))
    assert len(shown.group(1).splitlines()) <= 16  # fifteen lines and a blank one


@pytest.mark.validation
def test_python_example_finds_the_damped_resonance(capsys):
    """On a coarser mesh, whose resonances lie lower: the peak is that of the blades stuck together, damped by friction."""
    text = EXAMPLE.read_text()
    coarse = "ss.BladePair(airfoil_size=0.05, platform_size=0.02, foot_size=0.05)"
    assert text.count("ss.BladePair()") == 1
    text = text.replace("ss.BladePair()", coarse)
    names = {"__name__": "__main__"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(text, str(EXAMPLE), "exec"), names)  # our own example
    rows = re.findall(r"([\d.]+) Hz, (\d) harmonics: ([\d.]+) µm(.*)", capsys.readouterr().out)
    assert len(rows) > 40
    assert all(not state for *_, state in rows)
    hertz, _, peak = max(((float(f), int(h), float(a)) for f, h, a, _ in rows), key=lambda row: row[2])
    both, contacts = names["both"], names["contacts"]
    gaps = contacts.gap_operator
    stuck = both.stiffness + gaps.T @ (contacts.stuck_stiffness()[:, None] * gaps)
    first = np.sqrt(scipy.linalg.eigh(stuck, both.mass, eigvals_only=True)[0])
    assert hertz == pytest.approx(first / (2 * np.pi), rel=5e-3)
    dynamic = stuck - first**2 * both.mass + 1j * first * both.damping
    (tip,) = both.sets["blades.output"][:1]
    largest = 1e6 * abs(np.linalg.solve(dynamic, names["force"])[tip])
    assert 0.5 * largest < peak < 0.8 * largest, "friction at work"


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_no_example_is_longer_than_sixty_lines_of_code(path):
    text = path.read_text()
    told = set()  # lines of docstrings
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef) and ast.get_docstring(node):
            told |= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    blank = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    code = {
        line
        for token in tokenize.generate_tokens(StringIO(text).readline)
        if token.type not in blank
        for line in range(token.start[0], token.end[0] + 1)
    }
    assert len(code - told) <= 60

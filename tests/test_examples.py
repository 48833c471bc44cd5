"""The README shows the example of the facade; the one of the lower layers runs, and finds the resonance."""

import re
import runpy
import warnings
from pathlib import Path

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

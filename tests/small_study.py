"""A study that runs in seconds: the example on a coarse mesh, one load case that sticks."""

import re
from pathlib import Path

from stickslip.study.example import example_text

CHANGES = {
    "airfoil_size_m": "0.012",
    "platform_size_m": "0.012",
    "foot_size_m": "0.016",
    "ratios": "[2000]",
    "frequency_hz": "[185.0, 207.0]",
    "points": "8",
    "peak_points": "2",
    "samples": "64",
}


def write_small_study(folder: Path, **changes: str) -> Path:
    """Write the study into `folder`, which is made, with some keys changed."""
    text = example_text()
    for key, value in (CHANGES | changes).items():
        text, n = re.subn(rf"(?m)^{key} = [^#\n]*", f"{key} = {value} ", text)
        assert n == 1, f"{key} is {n} times in the example"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path

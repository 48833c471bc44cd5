"""A study of a bladed disk that runs in a second or two: the example on a coarse mesh with fewer modes and speeds."""

import re
from pathlib import Path

from stickslip.study.example import example_text

CHANGES = {
    "sectors": "8",
    "disk_size_m": "0.05",
    "platform_size_m": "0.03",
    "airfoil_size_m": "0.04",
    "number": "2",
    "# nodal_diameters": "[0, 2]",
    "points": "3",
    "speeds_rpm": "[0.0, 16000.0]",
    "engine_orders": "[2, 6]",
    "modes": "2",
}


def wheel_text(**changes: str) -> str:
    """Return the example with keys changed, those of several tables in each of them."""
    text = example_text("sector")
    for key, value in (CHANGES | changes).items():
        line = rf"(?m)^{re.escape(key)} = [^#\n]*"
        text, n = re.subn(line, f"{key.removeprefix('# ')} = {value} ", text)
        assert n >= 1, f"{key} is not in the example"
    begin, end = text.index("[model.sector.platform]"), text.index("[model.sector.airfoil]")
    return text[:begin] + text[end:]  # fewer nodes


def write_small_wheel(folder: Path, **changes: str) -> Path:
    """Write the study into `folder`, which is made, with some keys changed."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(wheel_text(**changes), encoding="utf-8")
    return path

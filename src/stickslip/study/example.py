"""The commented example study that ships with the package."""

from importlib.resources import files


def example_text() -> str:
    """Return the example study."""
    return files("stickslip.study").joinpath("example.toml").read_text(encoding="utf-8")

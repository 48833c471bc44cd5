"""Print what CHANGELOG.md tells of the version that pyproject.toml names; refuse one that is told nowhere alike."""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLACES = {  # where the version stands beside pyproject.toml
    "src/stickslip/__init__.py": r'^__version__ = "(.+)"$',
    "CITATION.cff": r"^version: (\S+)$",
    "recipe/recipe.yaml": r'^  version: "(.+)"$',
}


def version() -> str:
    """Return the version; ends the program where the places differ."""
    own: str = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for place, pattern in PLACES.items():
        found = re.findall(pattern, (ROOT / place).read_text(encoding="utf-8"), re.MULTILINE)
        if found != [own]:
            sys.exit(f"{place} says version {', '.join(found) or 'nothing'}, pyproject.toml {own}.")
    return own


def notes(changelog: str, of: str) -> str:
    """Return the section of a version; of what is not released yet where the version has none. Empty if there is neither."""
    sections = re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]
    told = {text.partition("\n")[0].strip().split(" ")[0]: text for text in sections}
    return told.get(of, told.get("Unreleased", "")).partition("\n")[2].strip()


def main() -> None:
    """Print the notes."""
    own = version()
    found = notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), own)
    if not found:
        sys.exit(f"CHANGELOG.md tells nothing of version {own}.")
    sys.stdout.write(f"# stickslip {own}\n\n{found}\n")


if __name__ == "__main__":
    main()

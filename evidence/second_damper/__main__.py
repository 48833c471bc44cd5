"""Look for a second damper and write docs/second_damper.md: ``python -m evidence.second_damper``."""

import sys
from pathlib import Path

from evidence.second_damper.mesh import FACTORS, reduction_error, refined
from evidence.second_damper.page import page
from evidence.second_damper.search import first_stage, searched, second_stage

PAGE = Path(__file__).parents[2] / "docs" / "second_damper.md"


def main() -> int:
    """Search, and write the page."""
    first, none = searched(first_stage())
    second, _ = searched(second_stage(first[0].candidate))
    best = first[0].candidate
    meshes = [refined(best, factor) for factor in FACTORS]
    text = page(first, second, none, meshes, reduction_error(best))
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

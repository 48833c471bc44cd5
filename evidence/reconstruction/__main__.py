"""Search, and write docs/reconstruction.md: ``python -m evidence.reconstruction``."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from evidence.reconstruction.candidates import CHOSEN, Candidate, candidates
from evidence.reconstruction.judge import cheap, costly
from evidence.reconstruction.page import page
from stickslip.errors import StickslipError

HERE = Path(__file__).parent
DOCS = HERE.parents[1] / "docs"


def main() -> None:
    """Judge every candidate cheaply and the best of them in full; what a folder holds already is not computed again."""
    parser = argparse.ArgumentParser(prog="python -m evidence.reconstruction", description=__doc__)
    parser.add_argument("--folder", type=Path, default=HERE / "out", help="for the results, one line a candidate")
    parser.add_argument("--best", type=int, default=24, help="how many are judged in full")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    rows = _judged(list(candidates()), given.folder / "cheap.jsonl", cheap)
    ranked = sorted(rows, key=lambda row: -_score(row))
    best = [Candidate(**_plain(row["candidate"])) for row in ranked[: given.best]]
    full = _judged(list(dict.fromkeys([*best, CHOSEN])), given.folder / "costly.jsonl", costly)
    (DOCS / "reconstruction.md").write_text(page(rows, full), encoding="utf-8")


def _judged(choices: list[Candidate], file: Path, judge: Any) -> list[dict[str, Any]]:
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {json.dumps(row["candidate"]): row for row in known}
    with file.open("a") as out:
        for number, choice in enumerate(choices):
            key = json.dumps(asdict(choice))
            if key in rows:
                continue
            row: dict[str, Any] = {"candidate": asdict(choice)}
            try:
                row |= judge(choice.build())
            except StickslipError as error:
                row |= {"words": {}, "error": str(error)}
            # through the file and back, so that a resumed search sees the same
            text = json.dumps(row)
            out.write(text + "\n")
            out.flush()
            rows[key] = json.loads(text)
            print(f"{number + 1} of {len(choices)}  {_score(row)} words  {key}", flush=True)
    return [rows[json.dumps(asdict(choice))] for choice in choices]


def _score(row: dict[str, Any]) -> int:
    return sum(row["words"].values())


def _plain(given: dict[str, Any]) -> dict[str, Any]:
    return {**given, "flat": tuple(given["flat"])}


if __name__ == "__main__":
    main()

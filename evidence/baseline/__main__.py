"""Compare with the baseline: ``python -m evidence.baseline [two_blades=FOLDER] [shrouded_sector=FOLDER]``.

Folders are those of results; without any, the studies are run. ``--store`` makes the folders the baseline.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import stickslip as ss
from evidence.baseline.compare import Finding, compare_forced, compare_table, differing
from evidence.baseline.results import read_nodes, timeless
from evidence.baseline.stored import store, stored
from evidence.models.two_blades import STUDY

HERE = Path(__file__).parent
STUDIES = {
    "two_blades": STUDY,
    "shrouded_sector": HERE / "shrouded_sector.toml",
}


def main() -> int:
    """Compare, print, and return 0 if all holds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="*", metavar="NAME=FOLDER")
    parser.add_argument("--store", action="store_true")
    asked = parser.parse_args()
    folders = dict(text.split("=", 1) for text in asked.folders)
    if asked.store:
        for name, folder in folders.items():
            store(name, read_nodes(Path(folder)))
        return 0
    if folders:
        return max(judge(name, Path(folder)) for name, folder in folders.items())
    return max([run_and_judge(name) for name in STUDIES])


def run_and_judge(name: str) -> int:
    """Run a study in a folder that is thrown away, and compare."""
    with TemporaryDirectory() as folder:
        ss.Study.from_file(STUDIES[name]).run(folder=folder)
        return judge(name, Path(folder))


def judge(name: str, folder: Path) -> int:
    """Print how the results in `folder` compare; return 0 if they hold."""
    digests, old = stored(name)
    new = {key: timeless(node) for key, node in read_nodes(folder).items()}
    holds = True
    for key in old:
        if key not in new:
            print(f"{name}/{key}: no such node in {folder}")
            holds = False
            continue
        other = differing(digests[key], new[key])
        if not other:
            print(f"{name}/{key}: all {len(digests[key])} variables identical to the last bit")
            continue
        print(
            f"{name}/{key}: {len(other)} of {len(digests[key])} variables not identical: ", end=""
        )
        print(", ".join(other))
        compare = compare_forced if key == "forced_response" else compare_table
        holds &= told(compare(old[key], new[key]))
    print(f"{name}: {'holds' if holds else 'DOES NOT HOLD'}")
    return 0 if holds else 1


def told(findings: list[Finding]) -> bool:
    """Print findings, and return whether all hold."""
    for one in findings:
        print(f"  {'holds' if one.holds else 'NO   '} {one.what}: {one.found}")
    return all(one.holds for one in findings)


if __name__ == "__main__":
    sys.exit(main())

"""Install the built wheel without extras in fresh environments and go the shortest journey with it: four masses from the study to the page.

Then ask it for what only an extra brings, a shape to be meshed and a deck: it must name the extra.

``wheel_journey.py DIST PYTHON ...``: the folder with the wheel, and interpreters or versions such as 3.12. Versions that are not on the
machine are named and left out. Dependencies are those of requirements.lock. All Pythons must find the
same peaks. Uses nothing but Python itself.
"""

import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
STUDY = ROOT / "examples" / "four_masses" / "study.toml"
LACKING = {"two_blades": "gmsh", "own_blades": "scikit-fem"}  # example -> the package that it lacks
SAME = 1e-6  # of a peak: other versions of NumPy and SciPy round in another order
PEAKS = """
import json, sys
import stickslip
result = stickslip.Result.from_file("results")
data = result.data["forced_response"]
own = stickslip.__file__
assert "site-packages" in own, own
numbers = {name: data[name].values.tolist() for name in ("peak_frequency_hz", "peak_amplitude")}
json.dump(numbers, sys.stdout)
"""


def main() -> None:
    """Go the journey with each Python; the exit code is 1 where one of them does not arrive."""
    dist, *asked = sys.argv[1:]
    (wheel,) = Path(dist).resolve().glob("*.whl")
    found = [(name, interpreter(name)) for name in asked]
    reference: dict[str, list[float]] = {}
    # a journey waits for the network and compiles by one process: as many at a time as there are cores
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        journeys = {name: pool.submit(timed, python, wheel) for name, python in found if python}
    for name, python in found:
        if python is None:
            print(f"Python {name} is not on this machine: the journey was not tried with it.")
            continue
        peaks, seconds = journeys[name].result()
        reference = reference or peaks
        differ = compare(peaks, reference)
        print(f"{name}: {seconds:.0f} s, peaks {peaks['peak_frequency_hz']} Hz")
        if differ:
            sys.exit(f"{name}: {differ}")
    if not reference:
        sys.exit("None of these Pythons is on this machine.")


def timed(python: str, wheel: Path) -> tuple[dict[str, list[float]], float]:
    """Return the peaks of a journey in a folder of its own, and the seconds it took."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        return journey(python, wheel, Path(folder)), time.perf_counter() - began


def interpreter(name: str) -> str | None:
    """Return the path of a Python; None where there is none, or only a shim of pyenv that leads nowhere."""
    version = re.fullmatch(r"\d+\.\d+", name)
    tried = [shutil.which(f"python{name}")] if version else [shutil.which(name)]
    if version and shutil.which("pyenv"):
        prefix = subprocess.run(["pyenv", "prefix", name], check=False, capture_output=True, text=True)
        tried.append(f"{prefix.stdout.strip()}/bin/python" if prefix.returncode == 0 else None)
    for path in map(os.path.abspath, filter(None, tried)):  # used from other folders
        said = subprocess.run([path, "-c", "import venv"], check=False, capture_output=True)
        if said.returncode == 0:
            return path
    return None


def journey(python: str, wheel: Path, folder: Path) -> dict[str, list[float]]:
    """Return the peaks that the wheel finds in an environment of its own, away from the sources."""
    environment = {k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "VIRTUAL_ENV"}}

    def done(*words: str) -> str:
        ended = subprocess.run(words, check=False, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)
        if ended.returncode:
            sys.exit(f"{' '.join(words)} ended with {ended.returncode}:\n{ended.stdout}")
        return ended.stdout

    pins = re.sub(r" \\(\n    --hash=\S+( \\)?)+", "", (ROOT / "requirements.lock").read_text())
    (folder / "pins.txt").write_text(pins)
    shutil.copy(STUDY, folder / "study.toml")
    done(python, "-m", "venv", "env")
    scripts = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
    own, command = str(scripts / "python"), str(scripts / "stickslip")
    pip = (own, "-m", "pip", "--quiet", "--disable-pip-version-check")
    done(*pip, "install", "--constraint", "pins.txt", f"stickslip @ {wheel.as_uri()}")
    done(*pip, "check")
    done(command, "check", "study.toml")
    done(command, "run", "study.toml")
    if (folder / "results" / "report.html").stat().st_size == 0:
        sys.exit("The page is empty.")
    peaks: dict[str, list[float]] = json.loads(done(own, "-c", PEAKS))
    for example, package in LACKING.items():
        study = ROOT / "examples" / example / "study.toml"
        ended = subprocess.run(
            (command, "check", str(study)), check=False, cwd=folder, env=environment, capture_output=True, text=True
        )
        wrong = not_refused(ended.returncode, ended.stdout + ended.stderr, package)
        if wrong:
            sys.exit(f"{example} without {package}: {wrong}")
    return peaks


def not_refused(code: int, said: str, package: str) -> str:
    """Return what is wrong with the end of a command that lacks a package of the extra ``fe``; empty where it is a clear refusal."""
    remedy = f"{package} is not installed. Use pip install 'stickslip[fe]'"
    if code and remedy in said and "fault" not in said and "Traceback" not in said:
        return ""
    return f"ended with {code} and did not only say {remedy!r}:\n{said}"


def compare(peaks: dict[str, list[float]], reference: dict[str, list[float]]) -> str:
    """Return how peaks differ from those of the first Python; empty where they do not."""
    off = [
        f"{name}: {a} instead of {b}"
        for name in ("peak_frequency_hz", "peak_amplitude")
        for a, b in zip(peaks[name], reference[name], strict=True)
        if not math.isclose(a, b, rel_tol=SAME)
    ]
    return "; ".join(off)


if __name__ == "__main__":
    main()

"""Runs of pytest in a process of their own, and their counts."""

import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
COUNT = re.compile(r"(\d+) (passed|failed|skipped|errors?)\b")


def counted(words: Iterable[object], environment: Mapping[str, str] | None = None) -> Counter[str]:
    """Run pytest with arguments, show what it says, and return how many tests `passed`, `failed` and were `left_out`.

    Its variables are those of this process, or the `environment`. A run that ends without a summary counts as one failure.
    """
    command = [sys.executable, "-m", "pytest", *map(str, words)]
    last = ""
    with subprocess.Popen(
        command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ if environment is None else environment),
    ) as running:
        assert running.stdout is not None
        for line in running.stdout:
            print(line, end="", flush=True)
            last = line if COUNT.search(line) else last
    found = Counter({word: int(number) for number, word in COUNT.findall(last)})
    failed = found["failed"] + found["error"] + found["errors"]
    if running.returncode and not failed:
        failed = 1
    return Counter(passed=found["passed"], failed=failed, left_out=found["skipped"])

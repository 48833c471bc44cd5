"""Each refusal in the sources has words that some test reads; what none reads may be swapped, cut or wrong for ever."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[1]
RAISE = ("input_error", "custom_error")
RUN = 3  # words in a row, or all of a shorter text of two
# 30 of 1,270 on 29 November; it may only fall
UNREAD = 30


def words(text: str) -> list[str]:
    return re.sub(r"[\"'\s]+", " ", text.replace(r"\n", " ").replace("\\", "")).lower().split()


def runs(text: str, length: int) -> Iterator[tuple[str, ...]]:
    own = words(text)
    return zip(*(own[k:] for k in range(length)), strict=False)


@cache
def read_by_tests() -> frozenset[tuple[str, ...]]:
    """Return all runs of two and three words in the tests; texts that go on in another line are one."""
    files = [path.read_text(encoding="utf-8") for path in sorted(Path(__file__).parent.glob("*.py"))]
    whole = re.sub(r'"\s*\n\s*r?f?"', "", "\n".join(files))
    own = words(whole)
    return frozenset([*pairwise(own), *zip(own, own[1:], own[2:], strict=False)])


def texts_in(node: ast.AST) -> list[str]:
    """Return the texts of an expression, cut at its values."""
    return [n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and isinstance(n.value, str)]


def refusals() -> Iterator[tuple[str, list[str]]]:
    """Yield place and texts of each refusal with words of its own: others pass on the words of an error or of an argument."""
    for path in sorted((ROOT / "src").rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if not any(f"{name}(" in source for name in RAISE):
            continue
        calls, named = [], {}
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in RAISE:
                calls.append(node)
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                named.setdefault(node.targets[0].id, []).extend(texts_in(node.value))
        for call in calls:
            inside = [n.id for given in call.args for n in ast.walk(given) if isinstance(n, ast.Name)]
            texts = [*texts_in(call), *(text for name in inside for text in named.get(name, ()))]
            if any(len(words(text)) >= 2 for text in texts):
                yield f"{path.relative_to(ROOT)}:{call.lineno}", texts


def is_read(text: str) -> bool:
    known = read_by_tests()
    return len(words(text)) >= 2 and any(run in known for run in runs(text, min(RUN, len(words(text)))))


def test_each_refusal_is_read_by_a_test() -> None:
    found = list(refusals())
    assert len(found) > 1000
    unread = [place for place, texts in found if not any(map(is_read, texts))]
    assert len(unread) <= UNREAD, "\n".join(["No test reads the words of:", *unread])


def test_words_are_found_across_values_and_lines() -> None:
    assert is_read("each refusal in the sources")
    assert not is_read(" ".join(("no", "such", "words", "stand", "here")[::-1]))

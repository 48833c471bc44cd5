"""What the command and its pages say, without how long things took, where files lie and which version wrote them."""

import difflib
import re
from collections.abc import Iterable, Sequence
from itertools import groupby, pairwise

TIME = "<time>"
MAX_LINES = 40  # of a difference that is printed
MAX_LETTERS = 240  # of a line that is printed

# How long something took, as the command, its log and its page say it.
_SECONDS = re.compile(r"(?<![\w.])\d[\d.]*(?:e[+-]?\d+)? (?:k?s|ms|min|hours|days)\b")
_STAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\+00:00|Z)?")
_VERSION = re.compile(r"(stickslip )\d+(?:\.\d+)+[\w.+]*")
_SHARES = re.compile(r"(: )[\d.]+ % in the contact laws, [\d.]+ % in linear algebra, [\d.]+ % in the rest")
_COMPILED = re.compile(r"compil(?:ing|ed) (?:the )?contact laws")
_PROGRESS = re.compile(r"^  .*(?: \d+ %|, (?:\d+ min )?\d+ s)$")  # a line a minute of a job that lasts
# the heads of columns that hold such times
_TIMED = re.compile(r"^(?:(?:contact|linear|rest|time) \(s\)|seconds)$")

_HEAD, _ROW, _BORDER = "┃", "│", re.compile(r"^[┏┡└┣├━─┳╇┴╋┼┓┩┘┫┤ ]+$")


def timeless(text: str) -> str:
    """Return a text without times of the clock and versions."""
    text = _STAMP.sub(TIME, _VERSION.sub(rf"\1{TIME}", text))
    return _SECONDS.sub(TIME, _SHARES.sub(rf"\1{TIME}", text))


def terminal_lines(text: str) -> list[str]:
    """Return the lines of a terminal or a log; of tables with a column of times their rows without them.

    The width of a time changes those of the other columns, and so where they are broken. Hence the rows of such a table
    are put together again, one a line.
    """
    kept = [line for line in text.splitlines() if not (_COMPILED.search(line) or _PROGRESS.match(line))]
    lines: list[str] = []
    for kind, group in groupby(kept, _kind_of_line):
        own = list(group)
        lines += _table(own) if kind else own
    return [timeless(line) for line in lines]


def _kind_of_line(line: str) -> bool:
    return line[:1] in (_HEAD, _ROW) or (bool(line.strip()) and _BORDER.match(line) is not None)


def _table(lines: Sequence[str]) -> list[str]:
    head = _joined([_cells(line, _HEAD) for line in lines if line.startswith(_HEAD)])
    timed = [i for i, cell in enumerate(head) if _TIMED.match(cell)]
    if not timed:
        return list(lines)
    rows: list[list[list[str]]] = []
    for line in lines:
        if line.startswith(_ROW):
            cells = _cells(line, _ROW)
            if any(cells[i] for i in timed) or not rows:
                rows.append([])
            rows[-1].append(cells)
    shown = [_joined(row) for row in rows]
    for row in shown:
        for i in timed:
            row[i] = TIME
    return [" | ".join(row) for row in [head, *shown]]


def _cells(line: str, border: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip(border).split(border)]


def _joined(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the cells of rows below each other as those of one row."""
    return [" ".join(part for part in column if part) for column in zip(*rows, strict=True)]


_HTML_TABLE = re.compile(r"<table\b.*?</table>", re.DOTALL)
_HTML_ROW = re.compile(r"<tr\b.*?</tr>", re.DOTALL)
_HTML_CELL = re.compile(r"(<t[hd]\b[^>]*>)(.*?)(</t[hd]>)", re.DOTALL)
_HTML_TAG = re.compile(r"<[^>]*>")
_SCRIPT = re.compile(r"<script\b.*?</script>", re.DOTALL)


def page_lines(html: str) -> list[str]:
    """Return a page as lines, a tag or a piece of text each, without times; the data of its figures are kept whole."""
    lines: list[str] = []
    at = 0
    for script in _SCRIPT.finditer(html):
        lines += _markup(html[at : script.start()]) + script.group().splitlines()
        at = script.end()
    return lines + _markup(html[at:])


def _markup(html: str) -> list[str]:
    text = timeless(_HTML_TABLE.sub(lambda found: _without_times(found.group()), html))
    return [line for line in re.sub(r"(<[^>]*>)", r"\n\1\n", text).splitlines() if line.strip()]


def _without_times(table: str) -> str:
    rows = _HTML_ROW.findall(table)
    heads = [_HTML_TAG.sub("", cell[1]).strip() for cell in _HTML_CELL.findall(rows[0])] if rows else []
    timed = {i for i, head in enumerate(heads) if _TIMED.match(head)}
    if not timed:
        return table

    def row(found: re.Match[str]) -> str:
        count = iter(range(len(heads) + 1))

        def cell(one: re.Match[str]) -> str:
            text = TIME if next(count) in timed and one.group(1).startswith("<td") else one.group(2)
            return one.group(1) + text + one.group(3)

        return _HTML_CELL.sub(cell, found.group())

    return _HTML_ROW.sub(row, table)


def differing_lines(what: str, old: Sequence[str], new: Sequence[str]) -> list[str]:
    """Return a unified diff of lines, cut to what one reads; empty where all are equal."""
    if list(old) == list(new):
        return []
    diff = list(difflib.unified_diff(old, new, f"old {what}", f"new {what}", lineterm="", n=1))
    shown = [_cut(line) for line in _brought_near(diff)]
    more = len(shown) - MAX_LINES
    return shown[:MAX_LINES] + ([f"... and {more} lines more"] if more > 0 else [])


def _brought_near(diff: Iterable[str]) -> list[str]:
    """Return a diff in which a long line begins shortly before the place where it differs from its partner."""
    lines = list(diff)
    for i, (first, second) in enumerate(pairwise(lines)):
        if first[:1] == "-" and second[:1] == "+" and min(len(first), len(second)) > MAX_LETTERS:
            same = next((k for k, (a, b) in enumerate(zip(first[1:], second[1:], strict=False)) if a != b), 0)
            start = max(same - MAX_LETTERS // 4, 0)
            lines[i], lines[i + 1] = (f"{one[0]}...{one[1 + start :]}" for one in (first, second))
    return lines


def _cut(line: str) -> str:
    return line if len(line) <= MAX_LETTERS else f"{line[:MAX_LETTERS]}..."

"""Tables as HTML."""

from collections.abc import Sequence

_SHOWN = 60  # rows of a table on the page; the rest is in the file


def html_table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    numeric: bool = True,
    worded: bool = False,
) -> str:
    """Return a table; the cells are HTML already, and set flush right from the second column if numeric, but for a last column of words."""
    kind = f' class="numeric{" worded" if worded else ""}"' if numeric else ""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    top = f"<thead><tr>{top}</tr></thead>" if head else ""
    return f'<div class="wide"><table{kind}>{top}<tbody>{body}</tbody></table></div>'


def shortened(
    head: Sequence[str], rows: Sequence[Sequence[str]], word: str, *, worded: bool = False
) -> str:
    """Return the first rows of a table of numbers, and say how many are left out."""
    rest = len(rows) - _SHOWN
    more = f"<p>The other {rest} {word} are in the result file.</p>" if rest > 0 else ""
    return html_table(head, rows[:_SHOWN], worded=worded) + more

"""Reading of study files in steps: errors are reported before heavy libraries are imported."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stickslip.api.study import Study


def read(path: Path, tell: Callable[[str], None] | None = None, *, allow_code: bool = False) -> "Study":
    """Read a study file for the command line, and set BLAS to one thread unless the user chose a number.

    Parameters
    ----------
    path
        The study file.
    tell
        Function that takes the line on size and time of a check, before heavy libraries are imported.
    allow_code
        Whether the file may name modules of the user.

    Raises
    ------
    InputError
        Naming every problem of the file, one a line.
    """
    from stickslip.model.blas_threads import one_blas_thread
    from stickslip.study.file.toml import read_toml

    one_blas_thread()
    read_toml(path)
    from stickslip.study.models.checked_file import checked_file

    file = checked_file(path, allow_code=allow_code)
    if tell is not None:
        from stickslip.study.models.beforehand import before_check

        tell(before_check(file))
    from stickslip.api.study import Study
    from stickslip.study.models.study import judged

    return Study(judged(file))

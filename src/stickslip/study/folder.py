"""The results folder: made, tried out and locked before anything long begins."""

import os
import shutil
from pathlib import Path

from stickslip.errors import InputError, input_error

NEEDED_BYTES = 200_000_000  # results, journal and mesh of a usual run
JOURNAL, RESULT, REPORT, LOG = "journal.sqlite", "result.nc", "report.html", "run.log"
MESHES = ("blades.vtu", "blades.msh")
OWN = (JOURNAL, JOURNAL + "-journal", RESULT, "result.nc.part", REPORT, LOG, *MESHES)


def prepare_folder(folder: Path, *, fresh: bool, own: tuple[str, ...] = OWN) -> None:
    """Make the folder, empty it of an earlier run if `fresh`, and make sure that a run's files fit into it.

    Parameters
    ----------
    folder
        To be made; its parents too.
    fresh
        Remove the files named in `own`.
    own
        What this kind of run writes.

    Raises
    ------
    InputError
        If it cannot be made or written, or the disk is nearly full.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if fresh:
            # only what a run writes: a folder may hold the user's own files
            for name in own:
                (folder / name).unlink(missing_ok=True)
        trial = folder / ".stickslip-trial"
        with trial.open("wb") as stream:
            stream.write(b"x")
            os.fsync(stream.fileno())
        trial.unlink()
    except OSError as error:
        raise _unwritable(folder, error) from None
    free = shutil.disk_usage(folder).free
    if free < NEEDED_BYTES:
        raise input_error(
            f"output folder {folder}",
            f"its disk has {free / 1e6:.0f} MB free, a run needs up to {NEEDED_BYTES / 1e6:.0f} MB",
            "Make room, or put the study on another disk.",
        )


def _unwritable(folder: Path, error: OSError) -> InputError:
    return input_error(
        f"output folder {folder}",
        f"cannot be written ({error.strerror})",
        "Change its permissions, or name another folder under [output].",
    )

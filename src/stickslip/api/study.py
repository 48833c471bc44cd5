"""A study file in Python."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from hashlib import sha256
from html import escape
from os.path import realpath
from pathlib import Path
from typing import Any

from stickslip.analyses.forced_response.problem import HARMONICS, IN_TIME
from stickslip.api.model import Model
from stickslip.api.result import Result, result_of
from stickslip.api.screen import by_default
from stickslip.model.blas_threads import one_loaded_blas_thread
from stickslip.study.check import check_study
from stickslip.study.models.study import Study as Content
from stickslip.study.models.study import read_study
from stickslip.study.outcome import Outcome
from stickslip.study.run import Shard, run_study


@dataclass(frozen=True, eq=False)
class _Elsewhere(Content):
    """A study with a results folder outside its own."""

    place: Path = Path()

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.place


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Questions about models, read from a file.

    Parameters
    ----------
    content
        The validated content of the file.
    """

    content: Content

    @classmethod
    def from_file(cls, path: str | Path, *, allow_code: bool = False) -> "Study":
        """Read a study file.

        Parameters
        ----------
        path
            The file.
        allow_code
            Whether it may name modules of yours, ``selection = "my_module:Mine"``: they are imported and run.

        Raises
        ------
        InputError
            Naming every problem of the file, one a line.
        """
        return cls(read_study(Path(path), allow_code=allow_code))

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.content.folder

    @property
    def cases(self) -> tuple[str, ...]:
        """Labels of the cases of [vary]; one empty label without it."""
        return tuple(case.label for case in self.content.file.cases)

    def run(
        self,
        *,
        workers: int = 1,
        only: Sequence[str] = (),
        fresh: bool = False,
        verify: bool = False,
        verify_harmonics: bool = False,
        folder: str | Path | None = None,
        executor: str | Executor = "",
        shard: str | None = None,
    ) -> Result:
        """Answer the questions of the study. An interrupted run continues with the unfinished jobs.

        During the run BLAS uses one thread, as on the command line, so that results agree to the last bit. This works for the BLAS in the wheels
        of NumPy and SciPy, unless an environment variable sets a number. For another BLAS set OMP_NUM_THREADS=1 before NumPy is imported.

        Parameters
        ----------
        workers
            Number of processes; the numbers do not depend on it.
        only
            Names of the analyses to answer; all of the study if empty.
        fresh
            Delete earlier results and start again.
        verify, verify_harmonics
            Compare with time integration, and with twice as many harmonics.
        folder
            Folder of the results; left out: the folder named in the study.
        executor
            Executor of the jobs: empty for this machine, ``dask=tcp://…``, ``slurm``, ``flux``, ``executorlib``, or an
            executor with the interface of `concurrent.futures`, such as ``client.get_executor(pure=False)`` of a Dask
            client. All machines use the same folder.
        shard
            ``"2/5"``: the second of five runs that share the jobs. Each run is started by itself.

        Raises
        ------
        InputError
            If the study, its files or its folder do not allow a run; raised before any long computation.
        """
        return result_of(
            answers(
                self,
                workers=workers,
                only=only,
                fresh=fresh,
                verify=verify,
                verify_harmonics=verify_harmonics,
                folder=folder,
                executor=executor,
                shard=shard,
            )
        )

    def check(self) -> tuple[str, ...]:
        """Build every model, find its static state and natural frequencies, and estimate the cost; return warnings.

        Raises
        ------
        InputError
            If the study cannot be run.
        """
        with by_default():
            return tuple(check_study(self.content))

    def replace(self, values: Mapping[str, Any]) -> "Study":
        """Return the study with other values of some keys. Its results go to a folder of their own.

        Parameters
        ----------
        values
            Key of the file -> value: ``{"contact.flat.friction_coefficient": 0.4}``.

        Raises
        ------
        InputError
            If a key is unknown, a value is refused, or the key is varied; then replace ``vary``.
        """
        said = [f"{key} = {value!r}" for key, value in sorted(values.items())]
        mark = sha256("\n".join(said).encode()).hexdigest()[:8]
        named = {"output.folder": f"{self.content.tables.output.folder}-{mark}"}
        changed = self.content.replace({**named, **values})
        text = "\n".join([self.content.text, "# replaced in Python", *(f"# {line}" for line in said), ""])
        return Study(replace(changed, file=replace(changed.file, text=text)))

    def model(self, case: int = 0) -> Model:
        """Return the model of a case, with a method for each analysis."""
        made = self.content.model(case)
        return Model(**{f.name: getattr(made, f.name) for f in fields(made)})

    def __repr__(self) -> str:
        tables = self.content.tables
        contacts = f", contacts {', '.join(tables.contact)}" if tables.contact else ""
        lines = [
            f"Study: {self.content.title}",
            f"  file: {self.content.path}",
            f"  parts {', '.join(tables.part)}{contacts}",
            f"  asks for {', '.join(self.content.asked) or 'nothing'}",
            f"  results: {self.folder}",
        ]
        if len(self.cases) > 1:
            lines.insert(4, f"  {len(self.cases)} cases: {self.cases[0]} ... {self.cases[-1]}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def answers(  # noqa: PLR0913
    study: Study,
    *,
    workers: int = 1,
    only: Sequence[str] = (),
    fresh: bool = False,
    verify: bool = False,
    verify_harmonics: bool = False,
    folder: str | Path | None = None,
    executor: str | Executor = "",
    shard: str | None = None,
) -> Outcome:
    """Run a study and return the result with its lines for the terminal; arguments as in `Study.run`."""
    asked = {IN_TIME: verify, HARMONICS: verify_harmonics}
    checks = [name for name, wanted in asked.items() if wanted]
    names = [only] if isinstance(only, str) else list(only)
    content = study.content
    if folder is not None:
        content = _Elsewhere(content.file, content.memo, Path(realpath(folder)))
    share = None if shard is None else Shard.read(shard)
    with by_default(workers), one_loaded_blas_thread():
        return run_study(content, only=names, workers=workers, kind=executor, shard=share, fresh=fresh, checks=checks)

"""The commands. Everything heavy is imported inside them, so that ``--help`` is quick."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from stickslip import __version__
from stickslip.errors import InputError, StickslipError, input_error

if TYPE_CHECKING:
    from stickslip.study.structure_study import Command
    from stickslip.study.structure_summary import StructureSummary
    from stickslip.study.summary import RunSummary

PLAIN_WIDTH = 130  # columns of a table that is not on a terminal
DONE, NOT_CONVERGED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    help="Vibration of bladed disks coupled by friction joints.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Kind = Literal["blades", "sector", "file"]
StudyKind = Annotated[
    Kind,
    typer.Option(
        "--kind",
        help="blades: two blades and a damper; sector: a bladed disk; file: one from a finite-element program.",
    ),
]
Fresh = Annotated[
    bool,
    typer.Option(
        "--fresh",
        help="Start over: remove what this command wrote into the results folder, and no other file.",
    ),
]
Report = Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")]


def main() -> None:
    """Entry point of the ``stickslip`` command."""
    app()


class ScreenSink:
    """Progress on a terminal as a bar, elsewhere as plain lines.

    Parameters
    ----------
    console
        Where to write.
    progress
        The bar, or None where the output is no terminal.
    """

    def __init__(self, console: Console, progress: Progress | None) -> None:
        self._console = console
        self._progress = progress
        self._task = None if progress is None else progress.add_task("model", total=1.0, state="")

    def say(self, text: str) -> None:
        """Write a line."""
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def begin(self, title: str) -> None:
        """Start a load case."""
        if self._progress is None or self._task is None:
            self.say(title)
        else:
            self._progress.reset(self._task, description=title, total=1.0, state="")

    def advance(self, fraction: float, text: str) -> None:
        """Move the bar, or write the line."""
        if self._progress is None or self._task is None:
            self.say(f"  {text}")
        else:
            self._progress.update(self._task, completed=fraction, state=text)


@app.callback(invoke_without_command=True)
def common(
    *,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and leave.")
    ] = False,
) -> None:
    """Vibration of bladed disks coupled by friction joints."""
    if version:
        typer.echo(f"stickslip {__version__}")
        raise typer.Exit


@app.command()
def run(
    study: StudyFile,
    *,
    verify: Annotated[
        bool, typer.Option("--verify", help="Integrate in time at three frequencies and compare.")
    ] = False,
    verify_harmonics: Annotated[
        bool,
        typer.Option(
            "--verify-harmonics",
            help="Predict at every frequency what twice as many harmonics would change, in amplitude and phase.",
        ),
    ] = False,
    fresh: Fresh = False,
    report: Report = True,
) -> None:
    """Run a study of two blades and a damper; an interrupted run goes on where it stopped."""
    with _errors_as_text():
        from stickslip.study.threads import one_blas_thread

        one_blas_thread()
        from stickslip.study.run import run_study

        with _screen() as sink:
            summary = run_study(
                study,
                verify_in_time=verify,
                verify_harmonics=verify_harmonics,
                fresh=fresh,
                sink=sink,
            )
        files = [*summary.files]
        if report:
            files.append(_write_report(summary.result))
        _print_summary(summary, files)
    raise typer.Exit(NOT_CONVERGED if summary.failed else DONE)


@app.command()
def check(study: StudyFile) -> None:
    """Do everything but the computation: read, mesh, reduce, place the damper or pair the cyclic faces."""
    with _errors_as_text():
        from stickslip.study.schema import read_toml
        from stickslip.study.structure_study import is_structure_study

        with _screen() as sink:
            if is_structure_study(read_toml(study)[1]):
                from stickslip.study.structure_run import check_structure

                warnings = check_structure(study, sink)
            else:
                from stickslip.study.run import check_study

                warnings = check_study(study, sink)
        console = _console()
        for text in warnings:
            console.print(f"WARNING: {text}", markup=False, highlight=False, soft_wrap=True)
        console.print(f"{study}: good to run", markup=False, highlight=False)


@app.command()
def new(
    name: Annotated[Path, typer.Argument(help="A folder to make.")], *, kind: StudyKind = "blades"
) -> None:
    """Write a commented example study to NAME/study.toml."""
    with _errors_as_text():
        from stickslip.study.example import example_text

        target = name / "study.toml"
        try:
            name.mkdir(parents=True, exist_ok=True)
            with target.open("x", encoding="utf-8", newline="\n") as stream:
                stream.write(example_text(kind))
        except FileExistsError:
            raise input_error(
                str(target), "exists already", "Give another name: nothing is overwritten."
            ) from None
        except OSError as error:
            raise input_error(
                str(target),
                f"cannot be written ({error.strerror})",
                "Give a folder you may write to.",
            ) from None
        if kind == "file":
            typer.echo(
                f"{target} written. Next: name your model's file in it, stickslip check {target}"
            )
            return
        command = "run" if kind == "blades" else "modes"
        typer.echo(f"{target} written. Next: stickslip {command} {target}")


@app.command()
def report(
    result: Annotated[
        Path, typer.Argument(metavar="RESULT", help="A result's file, or the folder that holds it.")
    ],
) -> None:
    """Write the HTML report of a result."""
    with _errors_as_text():
        folder = result if result.is_dir() else result.parent
        of_wheel = any((folder / f"{c}.nc").is_file() for c in ("modes", "campbell", "safe"))
        if of_wheel and (result.is_dir() or result.name != "result.nc"):
            page = _write_wheel_report(result)
        else:
            page = _write_report(result / "result.nc" if result.is_dir() else result)
        typer.echo(f"{page} written")


@app.command()
def modes(study: StudyFile, *, fresh: Fresh = False, report: Report = True) -> None:
    """Find natural frequencies and mode shapes of a bladed disk for each nodal diameter."""
    _run_structure(study, "modes", fresh=fresh, report=report)


@app.command()
def campbell(study: StudyFile, *, fresh: Fresh = False, report: Report = True) -> None:
    """Follow the frequencies of a bladed disk over the speed and find where engine orders meet them."""
    _run_structure(study, "campbell", fresh=fresh, report=report)


@app.command()
def safe(study: StudyFile, *, fresh: Fresh = False, report: Report = True) -> None:
    """Say which modes of a bladed disk engine orders can excite at a speed (SAFE diagram)."""
    _run_structure(study, "safe", fresh=fresh, report=report)


@app.command()
def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file of a finite-element model.")],
    *,
    units: Annotated[
        str, typer.Option(help="Its unit system: SI, mm-t-s, mm-kg-s, mm-kg-ms, inch-lbf-s, ...")
    ] = "SI",
    frequencies: Annotated[
        int, typer.Option(min=0, max=200, help="Natural frequencies to compute.")
    ] = 10,
    mesh: Annotated[
        Path | None, typer.Option(help="Where the nodes lie, beside matrices that do not say.")
    ] = None,
) -> None:
    """Say what is in a file of a finite-element model: dofs, sets, mass, size, first frequencies."""
    with _errors_as_text():
        from stickslip.study.inspect_file import inspect_file

        with _screen() as sink:
            lines = inspect_file(file, units, frequencies, mesh, sink)
        for line in lines:
            _console().print(line, markup=False, highlight=False, soft_wrap=True)


@app.command()
def schema(*, kind: StudyKind = "blades") -> None:
    """Print the JSON Schema of study files."""
    from stickslip.study.schema import json_schema
    from stickslip.study.structure_study import structure_schema

    typer.echo(json_schema() if kind == "blades" else structure_schema())


def _run_structure(study: Path, command: "Command", *, fresh: bool, report: bool) -> None:
    """Run a command for bladed disks and print what it found."""
    with _errors_as_text():
        from stickslip.study.structure_run import run_structure

        with _screen() as sink:
            summary = run_structure(study, command, fresh=fresh, sink=sink)
        files = [*summary.files]
        if report:
            files.append(_write_wheel_report(summary.result))
        _print_structure(summary, files)


@contextmanager
def _errors_as_text() -> Iterator[None]:
    """Turn the package's errors into text and an exit code."""
    try:
        yield
    except StickslipError as error:
        typer.echo(str(error), err=True)
        stopped = type(error).__name__ == "Interrupted"
        raise typer.Exit(
            INTERRUPTED
            if stopped
            else BAD_INPUT
            if isinstance(error, InputError)
            else NOT_CONVERGED
        ) from None
    except KeyboardInterrupt:
        typer.echo("Interrupted.", err=True)
        raise typer.Exit(INTERRUPTED) from None


def _console() -> Console:
    """Return the screen, or a wide page where the output goes to a file."""
    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)


@contextmanager
def _screen() -> Iterator[ScreenSink]:
    """Give a sink, with a bar where the output is a terminal."""
    console = _console()
    if not console.is_terminal:
        yield ScreenSink(console, None)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[state]}"),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        yield ScreenSink(console, progress)


def _write_report(result: Path) -> Path:
    from stickslip.report.page import write_report

    target = result.with_name("report.html")
    write_report(result, target)
    return target


def _write_wheel_report(result: Path) -> Path:
    from stickslip.report.wheel_page import write_wheel_report

    target = (result if result.is_dir() else result.parent) / "report.html"
    write_wheel_report(result, target)
    return target


def _print_structure(summary: "StructureSummary", files: list[Path]) -> None:
    console = _console()
    for found in summary.tables:
        table = Table(title=found.title, title_justify="left")
        for name in found.head:
            table.add_column(name, justify="right")
        for cells in found.rows:
            table.add_row(*cells)
        console.print(table)
    _print_lines(console, "Warnings", list(summary.warnings))
    _print_lines(console, "Files", [str(f) for f in files])


def _print_lines(console: Console, title: str, texts: list[str]) -> None:
    if texts:
        console.print(f"\n{title}", markup=False, highlight=False)
    for text in texts:
        console.print(f"  {text}", markup=False, highlight=False, soft_wrap=True)


def _print_summary(summary: "RunSummary", files: list[Path]) -> None:
    console = _console()
    console.print(_table(summary))
    asked = f"Where {summary.chooser.name} asked for more harmonics"
    _print_lines(console, asked, list(summary.choices))
    _print_lines(console, "Against twice as many harmonics", list(summary.doubts))
    _print_lines(console, "Against time integration", [c.sentence for c in summary.checks])
    _print_lines(console, "Warnings", list(summary.warnings))
    if summary.failed:
        told = (
            f"{summary.failed} of the points: marked in the result and in the report, not filled in"
        )
        _print_lines(console, "Not converged", [told])
    _print_lines(console, "Files", [str(f) for f in files])


def _table(summary: "RunSummary") -> Table:
    table = Table(title="Forced response")
    names = (
        "F_CL/F_HE",
        "peak mm",
        "at Hz",
        "points",
        f"H = {summary.chooser.low_name}",
        summary.more,
        "failed",
        "Newton",
        "unknowns",
    )
    for name in (*names, "contact s", "linear s", "rest s"):
        table.add_column(name, justify="right")
    for r in summary.rows:
        counts = (
            r.points, r.points_low, r.points_high, r.points_failed, r.newton_steps, r.unknowns,
        )  # fmt: skip
        table.add_row(
            f"{r.ratio:g}",
            f"{1e3 * r.peak_amplitude:.5g}",
            f"{r.peak_frequency_hz:.3f}",
            *(str(c) for c in counts),
            *(f"{s:.2f}" for s in r.seconds),
        )
    return table

"""The commands. Everything heavy is imported inside them, so that ``--help`` is quick."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

from stickslip import __version__
from stickslip.api.printed import (
    TRACEBACK,
    console,
    output_that_may_fail,
    say,
    say_answers,
    say_columns,
    say_lines,
    say_table,
    unforeseen,
)
from stickslip.api.reading import read
from stickslip.api.screen import Screen, on_screen
from stickslip.errors import InputError, StickslipError, input_error

FILES_TOLD = 4  # files of an export that are listed
MANY_CASES = 12  # of a study, whose page takes 7 s of CPU; a page of 33 took 62 s by the clock (28 Nov 2026)
DONE, NOT_CONVERGED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    help="Vibration of bladed disks coupled by friction joints.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Kind = Literal["blades", "damper", "own_blades", "sector", "wheel", "mistuned", "file", "masses"]
StudyKind = Annotated[
    Kind,
    typer.Option(
        "--kind",
        help="blades (two blades and a damper), damper (the same, with other dampers to choose), own_blades (blades from a deck, which is "
        "written beside it), sector (a meshed bladed disk with shrouds), wheel (a blisk of masses with a friction ring, by nodal diameters), "
        "mistuned (a wheel of unlike blades), file (your finite-element model) or masses (four masses on springs, the smallest study).",
    ),
]
OtherMachines = Annotated[
    str, typer.Option(metavar="KIND", help="dask=ADDRESS, slurm, flux or executorlib: docs/cluster.md.")
]
Share = Annotated[
    str | None, typer.Option(metavar="I/N", help="Do one share of the jobs; the last share to end joins the results.")
]
AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code",
        help='Import and run modules that the file names (selection = "my_module:Mine"). Only for files that you trust.',
    ),
]


def main() -> None:
    """Entry point of the ``stickslip`` command."""
    with output_that_may_fail():
        app()


@app.callback(invoke_without_command=True)
def common(*, version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False) -> None:
    """Vibration of bladed disks coupled by friction joints."""
    if version:
        typer.echo(f"stickslip {__version__}")
        raise typer.Exit


@app.command()
def run(
    study: StudyFile,
    *,
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="NAME", help="Answer this analysis alone; may be repeated.")
    ] = None,
    workers: Annotated[
        int, typer.Option("--workers", min=1, max=256, help="Processes; the numbers stay the same.")
    ] = 1,
    executor: OtherMachines = "",
    shard: Share = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="Integrate in time at three frequencies and compare.")
    ] = False,
    verify_harmonics: Annotated[
        bool,
        typer.Option(
            "--verify-harmonics",
            help="Predict at every frequency what more harmonics would change, in amplitude and phase.",
        ),
    ] = False,
    fresh: Annotated[
        bool,
        typer.Option("--fresh", help="Delete earlier results and start again; other files in the folder stay."),
    ] = False,
    results: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results; by default beside the study.")
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")] = True,
    allow_code: AllowCode = False,
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Show progress of every point and check, and every verdict."),
    ] = False,
) -> None:
    """Run the analyses of a study; an interrupted run continues where it stopped."""
    with _errors_as_text():
        with on_screen(Screen(console(), workers, warnings=False, verbose=verbose)):
            content = read(study, allow_code=allow_code)
            from stickslip.api.study import answers

            outcome = answers(
                content,
                workers=workers,
                only=only or (),
                fresh=fresh,
                verify=verify,
                verify_harmonics=verify_harmonics,
                folder=results,
                executor=executor,
                shard=shard,
            )
        if outcome.waits:
            raise typer.Exit(DONE)
        from stickslip.api.result import result_of

        result = result_of(outcome)
        if report and len(content.cases) > MANY_CASES:
            typer.echo(f"writing the page of {len(content.cases)} cases")
        files = [*result.files, *([result.report()] if report else [])]
        from stickslip.study.verdict import in_lines, stored

        for table in (t for tables in outcome.summaries.values() for t in tables):
            if verbose or not table.detail:
                say_table(table.title, table.head, table.rows, table.lines)
        points = result.failed - len(stored(result.data.attrs))  # jobs set aside are no points
        told = in_lines(result.verdicts, every=verbose)
        say_answers(told, points, files, result.conclusion)
    raise typer.Exit(NOT_CONVERGED if result.failed else DONE)


@app.command()
def check(study: StudyFile, *, allow_code: AllowCode = False) -> None:
    """Prepare a study without solving it: read, mesh, reduce, static state, natural frequencies."""
    with _errors_as_text():
        with on_screen(Screen(console())):
            doubts = read(study, say, allow_code=allow_code).check()
        say(f"{study}: good to run{f', {len(doubts)} doubtful' * bool(doubts)}")


@app.command()
def new(name: Annotated[Path, typer.Argument(help="A folder to make.")], *, kind: StudyKind = "blades") -> None:
    """Write a commented example study to NAME/study.toml."""
    with _errors_as_text():
        from stickslip.study.file.example import example_decks, example_text
        from stickslip.study.store.atomic_write import unwritable, write_whole

        target, decks = name / "study.toml", example_decks(kind)
        for place in (target, *(name / deck for deck in decks)):
            if os.path.lexists(place):
                raise input_error(str(place), "exists already", "Give another name: nothing is overwritten.")
        try:
            name.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(target, error) from None
        for deck, content in decks.items():
            write_whole(name / deck, content)
        write_whole(target, example_text(kind).encode())
        step = "name your model's file in it, then " if kind == "file" else ""
        typer.echo(f"{target} written. Next: {step}stickslip check {target}")
        typer.echo(f"and when that is good to run: stickslip run {target}")


@app.command()
def report(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result's file, or the folder that holds it.")],
) -> None:
    """Write the HTML report of a result."""
    with _errors_as_text():
        from stickslip.analyses.page import report_file

        typer.echo(f"{report_file(result)} written")


@app.command()
def export(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result's file, or the folder that holds it.")],
    *,
    to: Annotated[
        Literal["vtu", "frd", "uff", "csv"],
        typer.Option(help="vtu for ParaView, frd for CalculiX's viewer, uff for test software, csv: stress alone."),
    ] = "vtu",
    case: Annotated[int, typer.Option(min=0, help="Number of the case of \\[vary], from 0.")] = 0,
    hz: Annotated[
        float | None, typer.Option(help="The point nearest to this frequency, Hz; by default the peak.")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=1000, help="Instants of the period (vtu).")] = 24,
    wheel: Annotated[bool, typer.Option("--wheel", help="Write all sectors, not one.")] = False,
    out: Annotated[Path | None, typer.Option(help="The folder; by default beside the file.")] = None,
    units: Annotated[str, typer.Option(help="Unit system of an frd file, such as mm-t-s.")] = "SI",
    of: Annotated[Path | None, typer.Option(help="Folder of the study, if the result was moved.")] = None,
    analysis: Annotated[
        str, typer.Option(help="forced_response, nonlinear_mode or limit_cycle; by default the first.")
    ] = "",
    number: Annotated[int, typer.Option(min=0, help="Number of the mode or limit cycle, from 0.")] = 0,
    amplitude_mm: Annotated[
        float | None, typer.Option(help="Amplitude on a nonlinear mode, mm; by default the most damped motion.")
    ] = None,
) -> None:
    """Write how every node and contact moves, for ParaView and other programs."""
    with _errors_as_text():
        from stickslip.api.result import Result

        with on_screen(Screen(console())):
            files = Result.from_file(result).export(
                to,
                out,
                case=case,
                hz=hz,
                steps=steps,
                wheel=wheel,
                units=units,
                of=of,
                analysis=analysis,
                number=number,
                amplitude_mm=amplitude_mm,
            )
        more = f"and {len(files) - FILES_TOLD} more" if len(files) > FILES_TOLD else ""
        say_lines("Files", [*map(str, files[:FILES_TOLD]), *filter(None, [more])])


@app.command()
def figure(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result's file, or the folder that holds it.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="The figure; left out: which there are.")] = "",
    *,
    to: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A pdf, svg, eps or png file; left out: NAME.pdf.")
    ] = None,
    width: Annotated[str, typer.Option(help="Such as 85mm, 8.5cm, 3.35in or 242pt.")] = "85mm",
    style: Annotated[str, typer.Option(help="A style of matplotlib, by name or file: fonts, sizes, axes.")] = "",
    case: Annotated[int | None, typer.Option(min=0, help="Which case of \\[vary], where one is shown.")] = None,
) -> None:
    """Write a figure for a paper: vectors, in the width of a column."""
    with _errors_as_text():
        from stickslip.api.figures import export_figure

        typer.echo(f"{export_figure(result, name, to, width, style, case)} written")


@app.command()
def compare(
    compared: Annotated[
        list[Path],
        typer.Argument(
            metavar="A B ...",
            help="Results (files, folders, or study files that were run), and CSV files with frequency_hz and amplitude_um "
            "(_mm, _m, _um_per_n ...) of a measurement or another program.",
        ),
    ],
    *,
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="A name for each, in the same order; by default folder and file names."),
    ] = None,
    page: Annotated[Path, typer.Option(help="The page to write.")] = Path("comparison.html"),
) -> None:
    """Compare designs on one page: peaks, responses, optimisation curves, modes and inputs."""
    with _errors_as_text():
        from stickslip.api.comparison import compare as compared_designs
        from stickslip.api.table import cells

        found = compared_designs(*compared, names=name or ())
        for title, (head, rows) in (
            ("Peaks", found.peaks_in_words()),
            ("What differs", (list(found.inputs), cells(found.inputs))),
        ):
            if rows:
                say_columns(title, head, rows)
        if found.same:
            say("The designs are the same: nothing differs in their inputs, nor in their peaks.")
        say_lines("Files", [str(found.report(page))])


@app.command()
def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file of a finite-element model.")],
    *,
    units: Annotated[str, typer.Option(help="Its unit system: SI, mm-t-s, mm-kg-s, mm-kg-ms, inch-lbf-s, ...")] = "SI",
    frequencies: Annotated[int, typer.Option(min=0, max=200, help="Natural frequencies to compute.")] = 10,
    mesh: Annotated[Path | None, typer.Option(help="File with node positions, for matrices without them.")] = None,
) -> None:
    """Show the content of a finite-element model file: dofs, sets, mass, size, first frequencies."""
    with _errors_as_text():
        from stickslip.study.inspect_file import inspect_file

        with on_screen(Screen(console())):
            lines = inspect_file(file, units, frequencies, mesh)
        for line in lines:
            say(line)


@app.command()
def fit(
    loops: Annotated[
        Path, typer.Argument(metavar="LOOPS.csv", help="Columns displacement_um (_mm, _m) and force_n (_kn).")
    ],
    *,
    normal_load: Annotated[
        float | None, typer.Option(metavar="N", help="Constant normal force; by default not known.")
    ] = None,
    normal_load_deviation: Annotated[float, typer.Option(metavar="N", help="Its standard deviation.")] = 0.0,
    machine_stiffness: Annotated[
        float | None,
        typer.Option(metavar="N/m", help="Stiffness of the machine in series with the contact; by default rigid."),
    ] = None,
    offset: Annotated[
        bool, typer.Option("--offset/--no-offset", help="Whether the force may have an unknown offset.")
    ] = True,
    drift: Annotated[bool, typer.Option("--drift", help="Let the force drift, linearly in time.")] = False,
    page: Annotated[
        Path | None, typer.Option(help="The page to write; by default LOOPS.fit.html beside the file.")
    ] = None,
) -> None:
    """Fit friction coefficient and tangential stiffness to measured hysteresis loops."""
    with _errors_as_text():
        from stickslip.study.fit_file import estimates, fit_file, study_lines

        with on_screen(Screen(console())):
            found = fit_file(
                loops,
                normal_load=normal_load,
                normal_load_deviation=normal_load_deviation,
                machine_stiffness=machine_stiffness,
                offset=offset,
                drift=drift,
            )
        from stickslip.report.loop_fit import write_loop_page

        target = page or loops.with_suffix(".fit.html")
        told, lines = estimates(found), study_lines(found)
        write_loop_page(found, loops, target, told, lines)
        for line in told:
            say(line)
        say_lines("Not identified by these loops, or doubtful", [f"{n}." for n in found.notes])
        say_lines("For the table of a contact in the study file", lines)
        say_lines("Files", [str(target)])


@app.command(name="compile")
def compile_() -> None:
    """Compile contact laws and time steps once after installing; without it the first run takes a minute or two more."""
    with _errors_as_text():
        from stickslip.model.blas_threads import one_blas_thread
        from stickslip.response.precompile import compile_ahead

        one_blas_thread()
        say("Compiling contact laws and time steps. What is compiled is kept if this is stopped.")
        for done, left in compile_ahead(os.cpu_count() or 1):
            say(f"compiled: {done}{f', {left} left' * (left > 0)}")


@app.command()
def keys(
    table: Annotated[
        str,
        typer.Argument(
            metavar="TABLE",
            help="For example forced_response or contact.elastic_coulomb. Without it all tables are listed.",
        ),
    ] = "",
) -> None:
    """Show the keys of a table of the study file with defaults and meanings."""
    with _errors_as_text():
        from stickslip.study.file.keys import table_keys, tables_of_file

        for found in table_keys(table) if table else [tables_of_file()]:
            head = ("key", "default", "meaning") if table else ("table or key", "", "meaning")
            kept = [k for k in range(3) if head[k]]
            rows = [[row[k] for k in kept] for row in found.rows]
            say_columns(found.title, [head[k] for k in kept], rows)


@app.command()
def schema() -> None:
    """Print the JSON Schema of study files."""
    from stickslip.study.file.tables import json_schema

    typer.echo(json_schema())


@contextmanager
def _errors_as_text() -> Iterator[None]:
    """Turn the package's errors into text and an exit code."""
    try:
        yield
    except StickslipError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(_code(error)) from None
    except KeyboardInterrupt:
        typer.echo("Interrupted.", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except Exception as error:
        if TRACEBACK in os.environ:
            raise
        typer.echo(unforeseen(error), err=True)
        raise typer.Exit(NOT_CONVERGED) from None


def _code(error: StickslipError) -> int:
    if type(error).__name__ == "Interrupted":
        return INTERRUPTED
    return BAD_INPUT if isinstance(error, InputError) else NOT_CONVERGED

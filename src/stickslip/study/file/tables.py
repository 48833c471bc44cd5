"""All tables of a study file, including the tables of the analyses."""

import json
from functools import cache
from typing import Any, Literal

from pydantic import BaseModel, Field, create_model

from stickslip.contact.compiled import Evaluator
from stickslip.response.forced.choices import Rescue
from stickslip.study.file.harmonics import Harmonics
from stickslip.study.file.model.aero import AeroTable
from stickslip.study.file.model.contacts import ContactTable, JoinTable
from stickslip.study.file.model.loads import Limits, LoadTable, Operation, Output, Retention, Rotation
from stickslip.study.file.model.material import DampingTable, MaterialTable, StudyReduction, TemperatureTable
from stickslip.study.file.model.mistuning import MistuningTable
from stickslip.study.file.model.parts import AnyPart, Copy
from stickslip.study.file.model.strength import Stress
from stickslip.study.file.section import FilePath, Name, Section
from stickslip.study.questions import ANALYSES, loaded


class Measured(Section):
    """Measured peaks, drawn with error bars over the optimisation curves."""

    file: FilePath = Field(
        description="CSV file of the measured peaks: a column named like the varied key, and columns such as peak_amplitude_um, "
        "peak_amplitude_std_um, peak_frequency_hz"
    )
    source: str = Field(
        "",
        max_length=200,
        description="where the points come from, such as a rig, a date or a report: shown on the page and kept in the result",
    )


VERSION = 2
OF_THE_MODEL = frozenset(
    {
        "part",
        "material",
        "temperature",
        "damping",
        "reduction",
        "contact",
        "join",
        "load",
        "rotation",
        "retention",
        "aero",
        "mistuning",
    }
)


class Solver(Section):
    """Computation of contact forces, and the effort for a frequency that does not converge."""

    evaluator: Evaluator = Field(
        "events",
        description="how piecewise-linear laws are evaluated over a period: events (exact transition times, no sampling error), "
        "intervals (transitions on the time samples) or march (sample by sample)",
    )
    globalisation: Literal["line_search", "dogleg", "levenberg_marquardt"] = Field(
        "line_search",
        description="what Newton's method of [forced_response] does where a full step does not reduce the residual: line_search shortens it, "
        "dogleg bends it towards the gradient (Powell), levenberg_marquardt damps directions of small singular values",
    )
    rescue: Rescue = Field(
        "all",
        description="what follows where a frequency of [forced_response] does not converge. all: homotopies and other globalisations, up to 300 Newton steps at a point of 60 unknowns, then a start from a periodic motion in time; in_time: the corrector from several starts and from the motion in time, without a branch between listed frequencies, for strong lift-off of many contacts; off: nothing more than the corrector",
    )


class Tables(Section):
    """All tables of a study file except the tables of the analyses."""

    schema_version: Literal[2] = Field(description="schema_version = 2, the version of the file's layout")
    title: str = Field("", max_length=200, description="a title of one line")
    part: dict[Name, AnyPart] = Field(min_length=1, description="the tables [part.NAME], one for each part")
    material: MaterialTable | None = Field(None, description="the table [material], of all parts without their own")
    temperature: TemperatureTable | None = Field(
        None, description="the table [temperature], of all meshed parts without their own"
    )
    damping: DampingTable | None = Field(None, description="the table [damping], of all parts without their own")
    reduction: StudyReduction | None = Field(None, description="the table [reduction], of all parts without their own")
    contact: dict[Name, ContactTable] = Field(  # type: ignore[valid-type]
        default_factory=dict, description="the tables [contact.NAME]"
    )
    join: dict[Name, JoinTable] = Field(
        default_factory=dict, description="the tables [join.NAME], of surfaces tied for good"
    )
    load: dict[Name, LoadTable] = Field(default_factory=dict, description="the tables [load.NAME]")
    rotation: Rotation = Field(default_factory=Rotation, description="the table [rotation]")
    operation: Operation = Field(default_factory=Operation, description="the table [operation], where the machine runs")
    stress: Stress = Field(default_factory=Stress, description="the table [stress], strength of the material")
    aero: AeroTable | None = Field(None, description="the table [aero], of aerodynamic influence coefficients")
    mistuning: dict[Name, MistuningTable] = Field(
        default_factory=dict, description="the tables [mistuning.NAME], of what differs from sector to sector"
    )
    output: Output = Field(  # validated even if omitted: its default folder may be a link that leads elsewhere
        {}, validate_default=True, description="the table [output]"
    )
    harmonics: Harmonics = Field(default_factory=Harmonics, description="the table [harmonics]")
    solver: Solver = Field(default_factory=Solver, description="the table [solver]")
    retention: Retention = Field(default_factory=Retention, description="the table [retention]")
    limits: Limits = Field(default_factory=Limits, description="the table [limits]")
    measured: Measured | None = Field(None, description="the table [measured], of peaks from a test")
    vary: Any = Field(
        None,
        description="the table [vary], or several [[vary]]: keys of the file and the lists of their values; the lists of one table "
        "run together, several tables multiply; name = [...] names the cases of a table",
    )


@cache
def study_tables(own: tuple[tuple[str, type[BaseModel]], ...] = ()) -> type[Tables]:
    """Return the class of the whole file, with one optional table for each analysis.

    Parameters
    ----------
    own
        Names and tables of the user's analyses, which the file names itself.
    """
    tables = {name: loaded(home.table) for name, home in ANALYSES.items() if home.table}
    tables |= {name: with_address(table) for name, table in own}
    asked: dict[str, Any] = {
        name: (table | None, Field(None, description=f"the table [{name}]")) for name, table in tables.items()
    }
    made: type[Tables] = create_model(
        "StudyTables", __base__=Tables, __doc__="Everything a study file may hold.", **asked
    )
    return made


@cache
def with_address(table: type[BaseModel]) -> type[BaseModel]:
    """Return the table of a user's analysis with its key ``analysis``, by which the file names the analysis."""
    address: Any = (str, Field(description="the analysis, my_module:NAME"))
    made: type[BaseModel] = create_model(table.__name__, __base__=table, __doc__=table.__doc__, analysis=address)
    return made


def asked_of(tables: Tables) -> tuple[str, ...]:
    """Return the names of the analyses whose tables are in the file, the user's own last."""
    names = [name for name in type(tables).model_fields if name not in Tables.model_fields]
    return tuple(name for name in names if getattr(tables, name) is not None)


def json_schema() -> str:
    """Return the JSON Schema of study files."""
    return json.dumps(study_tables().model_json_schema(), indent=2)


def original(tables: Tables, name: str) -> Any:
    """Return the table of a part; for a copy, the table of its original."""
    table = tables.part[name]
    return original(tables, table.of) if isinstance(table, Copy) else table

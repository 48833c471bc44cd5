"""Keys that tables of analyses by waves share."""

from typing import Annotated, Literal

from pydantic import Field

from stickslip.study.file.section import Section

Speed = Annotated[float, Field(ge=0, le=1e7)]  # rpm
Order = Annotated[int, Field(ge=1, le=1000)]
Diameter = Annotated[int, Field(ge=0, le=1000)]


class WaveTable(Section):
    """Table of an analysis of small vibrations."""

    contacts: Literal["static", "stuck", "open"] = Field(
        "static",
        description="what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open",
    )

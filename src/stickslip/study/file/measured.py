"""The table [measured]: peaks from a test, drawn over the optimisation curves."""

from pydantic import Field

from stickslip.study.file.section import FilePath, Section


class Measured(Section):
    """Measured peaks, drawn over the optimisation curves with their error bars."""

    file: FilePath = Field(
        description="CSV file of the measured peaks: a column named like the varied key, and columns such as peak_amplitude_um, "
        "peak_amplitude_std_um, peak_frequency_hz"
    )
    source: str = Field(
        "",
        max_length=200,
        description="where the points come from, such as a rig, a date or a report: shown on the page and kept in the result",
    )

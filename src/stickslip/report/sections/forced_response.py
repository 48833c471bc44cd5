"""Forced responses on the page."""

from stickslip.report.forced import tables
from stickslip.report.forced.bifurcations import bifurcations
from stickslip.report.forced.bodies import bodies, energy
from stickslip.report.forced.choice import choice
from stickslip.report.forced.contact import chosen_case, hysteresis_t, hysteresis_w, state_map
from stickslip.report.forced.curves import frequency_response, low_order, optimisation
from stickslip.report.forced.errors import error_scatter, errors
from stickslip.report.forced.harmonics import kept_harmonics
from stickslip.report.forced.head import cards
from stickslip.report.forced.not_periodic import amplitudes_in_time, statistics_in_time
from stickslip.report.forced.orders import of_each_order
from stickslip.report.forced.stability import stability
from stickslip.report.forced.surface import surface_map
from stickslip.report.forced.wheel import blades, peaks_of_blades, statistics, wheel_at_peak
from stickslip.report.forced.wheel_motion import wheel_in_motion
from stickslip.report.forced.working import what_is_needed, where_friction_works
from stickslip.report.response import NEEDED, Response
from stickslip.report.section import Block, Section

SECTION: Section = Section(
    "forced_response",
    NEEDED,
    Response,
    (
        Block("response", "Forced response", (frequency_response, of_each_order)),
        Block("optimisation", "Optimisation curves", (optimisation, where_friction_works, what_is_needed)),
        Block("wheel", "Blades of the wheel", (blades, peaks_of_blades, wheel_at_peak, wheel_in_motion, statistics)),
        Block(
            "contact",
            "Contacts at the peak",
            (chosen_case, state_map, surface_map, hysteresis_t, hysteresis_w, energy, bodies),
        ),
        Block("cases", "Cases", (tables.peaks,)),
        Block(
            "checks",
            "Checks",
            (
                stability,
                bifurcations,
                amplitudes_in_time,
                statistics_in_time,
                tables.time_integration,
                tables.retention,
            ),
        ),
        Block(
            "harmonics",
            "Harmonics: where more were needed, and what they cost",
            (choice, kept_harmonics, errors, error_scatter, low_order, tables.more_harmonics, tables.attempts),
            folded=True,
        ),
    ),
    cards=cards,
)

"""Keys of the methods of a model, made from the tables of the study file by `python docs/generate.py`.

Editors complete them, and type checkers compare names, types and required keys.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, Required, TypedDict

from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.selection.strategy import Strategy


class HarmonicsKeys(TypedDict, total=False):
    """Keys of [harmonics]."""

    low: int | Sequence[int] | IntArray
    """harmonics of the first passage, as the highest of all, 1 to 200, or as a list such as [1, 3]; left out: the harmonics that loads drive, which is 1 except for loads with a harmonic or several engine orders; default 1"""
    high: Literal["auto"] | int | Sequence[int] | IntArray
    """auto: harmonics are raised (5, 9, 15, 25, 41) until the judgement of each point is quiet, and audited. A number, 1 to 200, or a list such as [1, 3, 5] sets the highest harmonics kept, as published; default 'auto'"""
    samples: int
    """time samples of a period, 16 to 8192; default 256"""
    selection: (
        Literal[
            "jacobian_alert",
            "guarded_alert",
            "goal_oriented",
            "grolet",
            "jaumouille",
            "laxalde",
            "maple",
            "suess_jacobian",
            "suess_spectral",
            "always_low",
            "always_high",
        ]
        | Strategy
    )
    """what chooses the harmonics of a frequency: jacobian_alert, guarded_alert, goal_oriented, grolet, jaumouille, laxalde, maple, suess_jacobian, suess_spectral, always_low, always_high; or my_module:Name, a strategy of your own, with --allow-code; default 'guarded_alert'"""
    passages: Literal["double", "single"]
    """double: finish the response with few harmonics, then repeat what needs more; single: settle each frequency before the next one, as selections that predict the next frequency always do; default 'double'"""
    alert_threshold_percent: float
    """a percentage greater than zero: frequencies whose predicted error is larger get more harmonics (for selections that predict an error); default 5.0"""
    strategy_threshold: float | None
    """threshold of a selection whose indicator is no error, greater than zero; left out: as in its source"""
    per_dof: bool
    """harmonics chosen for each retained coordinate by itself, as in the sources (for maple and grolet); default False"""
    similarity: bool
    """true: at every point of [forced_response] the Jacobians with the first and with the most harmonics are compared (ΔJ and Γ of Gastaldi and Berruti), and their blocks between harmonics stored at the peak; up to 2000 unknowns; default False"""
    repeats: bool
    """solve a frequency again until it has the harmonics predicted for it (for grolet, laxalde, suess_spectral and suess_jacobian); default False"""
    alert_harmonics: Sequence[int] | IntArray | None
    """harmonics whose error is taken, 0 for the static part; left out: the harmonics that the excitation drives"""


class SolverKeys(TypedDict, total=False):
    """Keys of [solver]."""

    evaluator: Literal["intervals", "march", "events"]
    """how piecewise-linear laws are evaluated over a period: events (exact transition times, no sampling error), intervals (transitions on the time samples) or march (sample by sample); default 'events'"""
    globalisation: Literal["line_search", "dogleg", "levenberg_marquardt"]
    """what Newton's method of [forced_response] does where a full step does not reduce the residual: line_search shortens it, dogleg bends it towards the gradient (Powell), levenberg_marquardt damps directions of small singular values; default 'line_search'"""
    rescue: Literal["all", "in_time", "off"]
    """what follows where a frequency of [forced_response] does not converge. all: homotopies and other globalisations, up to 300 Newton steps at a point of 60 unknowns, then a start from a periodic motion in time; in_time: the corrector from several starts and from the motion in time, without a branch between listed frequencies, for strong lift-off of many contacts; off: nothing more than the corrector; default 'all'"""


class LimitsKeys(TypedDict, total=False):
    """Keys of [limits]."""

    memory_gb: float
    """memory in GB that a run may take, greater than zero; default 4.0"""
    work_s: float
    """estimated seconds that one case of an analysis may take on one core, greater than zero; default 7200.0"""
    job_s: float | None
    """seconds after which a job, one case of one analysis, is ended and set aside, greater than zero; left out: none"""
    job_memory_gb: float | None
    """memory in GB at which the process of a job is ended, and at the second time the job set aside, greater than zero; left out: none"""


class OperationKeys(TypedDict, total=False):
    """Keys of [operation]."""

    operating_hz: Sequence[float] | FloatArray | None
    """operating range [lowest, highest] of the excitation in Hz, for [forced_response], [campbell], [safe] and [run_up]"""
    operating_rpm: Sequence[float] | FloatArray | None
    """operating speeds [lowest, highest] in rpm, for [campbell], [safe] and [run_up], and for [forced_response] with an engine order"""


class StressKeys(TypedDict, total=False):
    """Keys of [stress]."""

    fatigue_limit_pa: float | None
    """stress amplitude in Pa that is endured at R = -1; it asks for stress and margin"""
    fatigue_limit_r0_pa: float | None
    """stress amplitude in Pa, half of the range, that is endured at R = 0, for a criterion"""
    torsion_limit_pa: float | None
    """shear stress amplitude in Pa that is endured under alternating torsion, for a criterion"""
    ultimate_pa: float | None
    """tensile strength in Pa, for goodman and gerber"""
    yield_pa: float | None
    """0.2 % proof stress in Pa: where the static stress is larger there is no margin; for soderberg"""
    fracture_pa: float | None
    """true fracture strength in Pa, for morrow"""
    walker_exponent: float | None
    """Walker's exponent γ, for walker, up to 1"""
    over_temperature: Sequence[Mapping[str, object]] | None
    """the tables [[stress.over_temperature]]: limits at rising temperatures of the nodes; linear between, constant below, refused above"""
    card: Mapping[str, Mapping[str, object]]
    """the tables [stress.card.NAME], limits of the part NAME; the limits of [stress] hold for all other parts; default {}"""
    mean_stress: Literal["goodman", "gerber", "soderberg", "morrow", "walker"]
    """line of the Haigh diagram from the fatigue limit to the static limit; default 'goodman'"""
    criterion: Literal["crossland", "sines", "findley", "dang_van"] | None
    """criterion for multiaxial fatigue instead of a line of the Haigh diagram: crossland, dang_van or findley (with torsion_limit_pa or fatigue_limit_r0_pa), or sines (with fatigue_limit_r0_pa)"""
    above_yield: Literal["void", "shakedown"]
    """where the elastic static stress is above yield. void: there is no margin; shakedown: the mean stress is at most yield less the amplitude; default 'void'"""
    credit_in_compression: bool
    """whether a compressive mean stress raises the allowed amplitude; default False"""
    apart_m: float | None
    """distance in m from contacts, joins, supports and loaded nodes within which stress is listed apart, as elastic stress is singular there; left out: one element"""


class ForcedResponseKeys(HarmonicsKeys, SolverKeys, LimitsKeys, OperationKeys, StressKeys, total=False):
    """Keys of [forced_response], [harmonics], [solver], [limits], [operation] and [stress]."""

    frequency_hz: Sequence[float] | FloatArray | None
    """the range [lowest, highest] in Hz, the lower frequency first"""
    frequencies_hz: Sequence[float] | FloatArray | None
    """frequencies of your own in Hz instead of a range, growing"""
    method: Literal["balance", "shooting"]
    """balance: harmonic balance; shooting: each motion is found in time, as a state that repeats after a period, with multipliers and without harmonics, at equally spaced or listed frequencies; default 'balance'"""
    steps_per_period: int | None
    """time steps in a period for method = 'shooting', 64 to 65536; left out: 1024"""
    over: Literal["frequency", "speed"]
    """frequency: at the one speed of [rotation]; speed: along speed_rpm, at the engine order times the speed, with matrices and static loads from [rotation]; default 'frequency'"""
    speed_rpm: Sequence[float] | FloatArray | None
    """the range [lowest, highest] of speeds in rpm, for over = 'speed'"""
    direction: Literal["up", "down"]
    """up: from the lowest frequency to the highest; down: back, which finds other motions beside folds; default 'up'"""
    points: int
    """smallest number of points of the first passage, 2 to 10000; default 40"""
    peak_points: int
    """most points added to resolve the peak, 0 to 100; default 8"""
    frequencies: int | None
    """number of equally spaced frequencies to step through, 2 to 10000; left out: the branch is followed, with more points where it turns (a single passage then steps through as many as points says)"""
    stability: Literal["auto", "peak", "off", "all"]
    """where stability is examined, by Floquet multipliers. auto: at the peak, the ends, beside folds and where the transitions of the cycle change, then at all other points up to 500 rows of the matrices, for larger ones within the work of the solutions; peak: at the peak alone; all: at every point; off: nowhere; default 'auto'"""
    stability_s: float
    """estimated time of an examination of stability, in seconds, above which none is begun; a wheel has its own limits. Greater than zero; default 60.0"""
    bifurcations: Literal["off", "folds", "all", "branches"]
    """bifurcations located along the branch. folds: where it turns back; all: period doublings, Neimark-Sacker bifurcations and branch points, too, by the multipliers at every point; branches: all, and the periodic motions that leave there are followed; default 'off'"""
    not_periodic: Literal["in_time", "off"]
    """what to do where no stable periodic motion is found. in_time: give envelope, statistics and spectrum of the motion in time, at the peak or the nearest such points; off: nothing; default 'in_time'"""
    not_periodic_s: float
    """work that each such motion may take, in seconds of 4e9 operations, counted in steps and rows: as many periods on a busy machine as on an idle one; greater than zero; default 5.0"""
    not_periodic_points: int
    """most points of a case that are marched so, 1 to 10000: the peak first, then the nearest to it; default 2"""
    static_friction_share: float | None
    """share of the friction coefficients, above 0 to 1, that carries the static load in a static solution first; sliders then stay there, and the rest is left for the vibration. Left out: springs start unstretched, and static and dynamic part are found together"""


class NonlinearModeKeys(SolverKeys, total=False):
    """Keys of [nonlinear_mode] and [solver]."""

    modes: Sequence[int] | IntArray
    """numbers of the modes that are followed, by frequency with contacts stuck, from 1; default [1]"""
    wave_numbers: Sequence[int] | IntArray | None
    """wave numbers of a wheel, 0 to n - 1 with n sectors (k below n/2 travels backward, n - k forward); left out: the wave of the loads' engine order, without loads all"""
    amplitude_mm: Sequence[float] | FloatArray | None
    """the range [lowest, highest] of the amplitude of the peak output, as long as the motion has the shape of the linear mode; left out: from where nothing slips to 300 times where slip begins, or on to gross slip; springs that neither slip nor open need it"""
    points: int
    """least number of points, 5 to 1000; default 30"""
    harmonics: int
    """least number of harmonics, 1 to 200; default 5"""
    most_harmonics: int
    """up to which harmonics are raised where frequency or damping ratio ask for it, 1 to 200; default 23"""
    accuracy_percent: float
    """relative change of frequency or damping ratio by more harmonics below which these are enough; default 0.1"""
    to_gross_slip: bool
    """whether a mode ends where every contact that can slip has slipped, of several sliders all of them, or opened; default False"""
    concept: Literal["periodic", "decaying"]
    """definition of the mode, by periodic motions sustained by mass-proportional negative damping (Krack 2015) or by decaying motions (Laxalde and Thouverez 2009); both agree for small damping; default 'periodic'"""


class ModalSynthesisKeys(SolverKeys, total=False):
    """Keys of [modal_synthesis] and [solver]."""

    mode: int
    """number of the mode, by frequency with contacts stuck, from 1; default 1"""
    levels: Sequence[float] | FloatArray
    """factors on the harmonic loads, one response each; default [1.0]"""
    frequency_hz: Sequence[float] | FloatArray | None
    """the range [lowest, highest] of the responses; left out: around their peaks"""
    direct: bool
    """whether each response is solved directly as well, as [forced_response] does, to show the error; default False"""
    passage_hz_per_s: Sequence[float] | FloatArray
    """rates at which the frequency is swept through the range, each level at each of them; left out: none; default []"""
    passage_down: bool
    """whether the frequency falls in these passages; default False"""
    amplitude_mm: Sequence[float] | FloatArray | None
    """the range [lowest, highest] of the amplitude of the nonlinear mode at the peak output; left out: from where nothing slips to 300 times where slip begins"""
    points: int
    """least number of points of the nonlinear mode, 5 to 1000; default 30"""
    harmonics: int
    """harmonics of the nonlinear mode, 1 to 200; default 5"""
    most_harmonics: int
    """up to which harmonics are raised where they change the nonlinear mode or the direct response, 1 to 200; default 23"""
    accuracy_percent: float
    """relative change of frequency or damping ratio by more harmonics below which these are enough; default 0.1"""


class QuasiPeriodicKeys(TypedDict, total=False):
    """Keys of [quasi_periodic]."""

    frequency_hz: Sequence[float] | FloatArray | None
    """the range [lowest, highest] in Hz of the first frequency, the frequency of all loads without their own"""
    frequencies_hz: Sequence[float] | FloatArray | None
    """first frequencies of your own in Hz instead of a range, growing"""
    points: int
    """first frequencies in the range, 2 to 1000; default 10"""
    second_hz: float | None
    """frequency in Hz near which a second tone is sought where no load has its own frequency; left out: near modes that grow with contacts stuck and near the multipliers of the forced motion"""
    second_wave: int | None
    """wave number of the second tone on a tuned wheel; left out: the wave that grows most"""
    harmonics: int
    """sums |j| + |k| of combined frequencies j f1 + k f2 that are kept at first, 1 to 31; default 3"""
    most_harmonics: int
    """up to which sum combined frequencies are added where contact forces move them, 1 to 31; default 15"""
    accuracy_percent: float
    """root mean square of what is left out, in percent of the motion of the contacts, below which combined frequencies are enough; default 1.0"""
    in_time: bool | None
    """whether each motion is compared with time integration, which also tells whether it is left; for single structures; left out: where that is estimated to take less than half a minute"""


class LimitCycleKeys(SolverKeys, total=False):
    """Keys of [limit_cycle] and [solver]."""

    wave_numbers: Sequence[int] | IntArray | None
    """wave numbers of a wheel, 0 to n - 1 with n sectors (k below n/2 travels backward, n - k forward); left out: waves that are unstable with contacts stuck"""
    modes: Sequence[int] | IntArray | None
    """numbers of modes, by frequency with contacts stuck, from 1; left out: the unstable ones among the first 6, of a mistuned wheel 6 of each sector"""
    amplitude_mm: Sequence[float] | FloatArray | None
    """the range [lowest, highest] of the amplitude of the peak output; left out: from where nothing slips to 300 times where slip begins"""
    points: int
    """least number of amplitudes in the range, 5 to 1000; default 30"""
    harmonics: int
    """harmonics of the curve over the amplitude, 1 to 200; default 5"""
    most_harmonics: int
    """up to which harmonics of each limit cycle are raised until it stays, 1 to 200; default 41"""
    accuracy_percent: float
    """change of amplitude and frequency by twice the harmonics below which these are enough; default 0.001"""
    in_time: bool
    """compare stable limit cycles with time integration, and integrate all unstable waves together to see which one wins; --verify does the same; default False"""
    periods: int
    """most periods of a time integration, 50 to 100000; default 400"""


class ResonanceKeys(SolverKeys, total=False):
    """Keys of [resonance] and [solver]."""

    frequency_hz: Required[Sequence[float] | FloatArray]
    """the range [lowest, highest] in Hz in which peaks are looked for at the first and the last value"""
    parameter: Required[str]
    """what varies: a key of the model, such as contact.flat.friction_coefficient, load.shaker.force_n or rotation.speed_rpm; or excitation, static_load (factors on all loads), or a field of the contact laws as Python names it, such as mu"""
    values: Sequence[float] | FloatArray | None
    """values of the parameter in the order in which they are visited"""
    span: Sequence[float] | FloatArray | None
    """first and last value of the parameter, in place of values; the curve is followed by arc length round folds, which takes minutes over a key of the model where a contact begins to slip at the peak"""
    points: int
    """least number of points of a span, 2 to 1000; default 30"""
    by: Literal["horizontal_tangent", "phase_quadrature", "variable_phase"]
    """what makes a peak: horizontal_tangent (the largest amplitude), phase_quadrature (90° behind the force) or variable_phase (with the phase of the largest amplitude beside the last peak); default 'horizontal_tangent'"""
    peaks: int
    """most peaks that are followed, the highest first, 1 to 20; default 3"""
    harmonic: int | None
    """harmonic whose amplitude peaks, such as 3 of a superharmonic resonance; left out: what the loads drive"""
    periods: int
    """periods of the loads after which the motion repeats itself, 1 to 20: 2 or more are subharmonic resonances, whose lowest harmonic peaks; default 1"""
    harmonics: int
    """harmonics that are kept, 1 to 200; default 5"""


class AllMotionsKeys(SolverKeys, total=False):
    """Keys of [all_motions] and [solver]."""

    frequency_hz: Required[Sequence[float] | FloatArray]
    """the range [lowest, highest] in Hz of the sweep and of all branches"""
    at_hz: Sequence[float] | FloatArray | None
    """frequencies in Hz that are searched; left out: `frequencies` of them, in the middle of equal parts of the range"""
    frequencies: int
    """number of frequencies that are searched, 1 to 200; default 5"""
    solves: int
    """budget of deflated solves, starts in time and points of branches together: nothing new begins after it, branches end; deflation leaves half of it to time integration; default 10000"""
    harmonics: int
    """harmonics that are kept, 1 to 200; default 7"""
    points: int
    """least number of points of the sweep; default 40"""
    tries: int
    """deflated solves in a row that find nothing new before a frequency is left, 1 to 10000; default 12"""
    starts: int
    """random states at each frequency that are integrated in time; 0: none, and no basins; default 20"""
    modes: int
    """lowest modes, contacts stuck, in which the random states are drawn; no more than there are degrees of freedom; default 2"""
    spread: float
    """largest modal amplitude of a random state, in units of the largest of the motions that are known; default 1.5"""
    periods: int
    """periods of the loads in one of the motion, 1 to 20: 3 to search motions of a third of the frequency, too; default 1"""
    most_periods: int
    """periods after which a start that does not settle is given up; default 1000"""
    steps: int
    """time steps in a period of the motion; default 512"""
    seed: int
    """a whole number that the random states and starts are made from; default 0"""


class ResidualTractionsKeys(SolverKeys, LimitsKeys, total=False):
    """Keys of [residual_tractions], [solver] and [limits]."""

    frequency_hz: Required[Sequence[float] | FloatArray]
    """the range [lowest, highest] in which the bounds are computed, Hz; it should hold the resonance"""
    points: int
    """frequencies in the range, 3 to 2000; default 25"""
    harmonics: int
    """harmonics of the motions, 1 to 200; default 5"""
    starts: int
    """random starts of the search at each frequency, beside its fixed starts, 0 to 10000; default 4"""
    seed: int
    """seed of the random starts; default 0"""
    in_time: bool
    """whether both ends of the resonance are followed in time with the tractions they stand for; a tuned wheel is not; default True"""


class ModesKeys(TypedDict, total=False):
    """Keys of [modes]."""

    contacts: Literal["static", "stuck", "open"]
    """what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open; default 'static'"""
    number: int
    """number of modes of each nodal diameter, 1 to 200; default 6"""
    nodal_diameters: Sequence[int] | IntArray | None
    """nodal diameters, a list of whole numbers from 0 to half the number of sectors; left out: all"""
    shapes: bool
    """store the mode shapes on the skin: true or false; default True"""
    reference: str | None
    """CSV file of frequencies to compare with, relative to the study; columns nodal_diameter, mode (1 is the lowest), frequency_hz, and speed_rpm if it shall be told where that is another speed"""
    reference_case: str | None
    """keep only the rows of the reference whose column 'case' has this value"""


class CampbellKeys(OperationKeys, total=False):
    """Keys of [campbell] and [operation]."""

    contacts: Literal["static", "stuck", "open"]
    """what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open; default 'static'"""
    speeds_rpm: Required[Sequence[float] | FloatArray]
    """the range [lowest, highest] of the speed in rpm, the lower first"""
    points: int
    """number of speeds in the range, 2 to 1000; default 9"""
    engine_orders: Required[Sequence[int] | IntArray]
    """engine orders, a list of whole numbers from 1"""
    modes: int
    """number of modes that are followed, 1 to 100; default 4"""
    nodal_diameters: Sequence[int] | IntArray | None
    """nodal diameters; left out: the ones that the engine orders excite"""


class FlutterKeys(TypedDict, total=False):
    """Keys of [flutter]."""

    contacts: Literal["static", "stuck", "open"]
    """what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open; default 'static'"""
    number: int | None
    """number of modes of each wave, 1 to 200; left out: up to the highest that [aero] has coefficients of"""
    nodal_diameters: Sequence[int] | IntArray | None
    """nodal diameters, a list of whole numbers from 0 to half the number of sectors; left out: all. Both directions of each are looked at"""
    required_percent: float
    """damping ratio in % that every wave must have, structural damping included; 0: none may grow; default 0.0"""


class SafeKeys(OperationKeys, total=False):
    """Keys of [safe] and [operation]."""

    contacts: Literal["static", "stuck", "open"]
    """what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open; default 'static'"""
    speed_rpm: float | None
    """speed in rpm, above zero; left out: as in [rotation]"""
    engine_orders: Required[Sequence[int] | IntArray]
    """engine orders, a list of whole numbers from 1"""
    margin_percent: float
    """a mode that an engine order would meet within this change of speed is called a near resonance, in percent; default 5.0"""
    modes: int
    """number of modes of each nodal diameter, 1 to 200; default 6"""


class RunUpKeys(HarmonicsKeys, SolverKeys, LimitsKeys, OperationKeys, total=False):
    """Keys of [run_up], [harmonics], [solver], [limits] and [operation]."""

    speeds_rpm: Required[Sequence[float] | FloatArray]
    """the range [lowest, highest] of the speed in rpm, above zero, the lower first"""
    engine_orders: Sequence[int] | IntArray | None
    """engine orders, a list of whole numbers from 1; all harmonic loads take each in turn. Left out: the loads act together, with their own orders"""
    points: int
    """smallest number of points of each engine order, 2 to 10000; default 40"""
    peak_points: int
    """most points added to resolve the peak of each, 0 to 100; default 8"""
    direction: Literal["up", "down"]
    """up: from the lowest speed to the highest; down: back, which finds other motions beside folds; default 'up'"""
    modes: int
    """number of natural frequencies shown beside the response, 1 to 100; default 4"""
    rate_rpm_per_s: Sequence[float] | FloatArray | None
    """list of rates in rpm a second at which the speed is swept in addition. The peak of a fast run-up is as a rule lower than the steady peak, and comes later in the direction of the sweep; it may be slightly above where the steady curve has a notch that a sweep passes over; left out: steady motions alone"""
    tolerance: float
    """largest relative error of squares of natural frequencies, and of the static load, between the speeds at which the model is assembled; a smaller one takes more speeds, above 0 to 0.01; default 1e-06"""

"""Journal records at one level of the loads."""

from dataclasses import dataclass

from stickslip.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class SynthesisLevel:
    """The response at a level.

    Parameters
    ----------
    level
        Factor on the harmonic loads.
    answer
        ``trusted``, ``doubtful``, ``refused`` (other modes take part: nothing is shown), or ``beyond`` (the nonlinear mode ends below the peak, or begins above it).
    why
        What that rests on, in words.
    peak, peak_omega
        Largest amplitude of the output in the first harmonic, m, on the curve that a sweep meets, and its frequency, rad/s; NaN where there is none to be shown.
    detached_peak, detached_peak_omega
        The same of the detached curves; NaN without any.
    foreign, output, gaps, distance, overlap, growth, harmonics
        See `Isolation`, at the peak.
    linear
        1 where nothing slips.
    resolved
        Relative change of the peak if every second point of the nonlinear mode is left out.
    detached
        Number of curves that do not hang together with small amplitudes.
    omega, amplitude, curve, stable
        (p,) of the response: rad/s, m, number of its curve, 1 where it is stable in this mode.
    others
        (p,) motion of the other modes over that of the mode, at the output or in the gaps.
    alone
        (p,) 1 where the mode answers alone: see `Along`.
    direct_omega, direct_amplitude
        (q,) of the direct solution, in the order of its branch; empty where it was not asked for.
    direct_peak, direct_peak_omega
        Its peak; NaN where there is none.
    seconds, direct_seconds
        What either took, s of the processor.
    passage_omega, passage_amplitude
        (rates, moments) frequency, rad/s, and amplitude of the output, m, while the frequency is swept; NaN where it did not begin.
    changed
        Relative change of frequency or damping ratio of the nonlinear mode at the peak, the larger one, that more harmonics are foretold to make.
    passage_finished, passage_change
        (rates,) 1 where a passage came to its end, and the relative change of the amplitude in a radian.
    """

    level: float
    answer: str
    why: str
    peak: float
    peak_omega: float
    detached_peak: float
    detached_peak_omega: float
    foreign: float
    output: float
    gaps: float
    distance: float
    overlap: float
    growth: float
    harmonics: float
    linear: int
    resolved: float
    detached: int
    omega: FloatArray
    amplitude: FloatArray
    curve: IntArray
    stable: IntArray
    others: FloatArray
    alone: IntArray
    direct_omega: FloatArray
    direct_amplitude: FloatArray
    direct_peak: float
    direct_peak_omega: float
    seconds: float
    direct_seconds: float
    passage_omega: FloatArray
    passage_amplitude: FloatArray
    passage_finished: IntArray
    passage_change: FloatArray
    changed: float = float("nan")

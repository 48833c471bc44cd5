"""Free decay of a chain of masses with friction springs to the ground, step by step: frequency and damping over the amplitude, with no harmonics at all.

Shares no code with the package: central differences with a small step, sliders moved by their return map.
"""

import itertools
from dataclasses import dataclass

import numpy as np

Rows = np.ndarray


@dataclass(frozen=True)
class Decay:
    """Periods of a motion that decays: between upward zero crossings of the last mass.

    Attributes
    ----------
    amplitude
        (periods,) of its first harmonic over each period and the next one, geometric mean.
    omega, ratio
        (periods,) rad/s, and logarithmic decrement from each period to the next over 2π.
    """

    amplitude: Rows
    omega: Rows
    ratio: Rows


def free_decay(
    stiffness: Rows, damping: Rows, springs: Rows, limits: Rows, start: Rows, periods: int, steps: int
) -> Decay:
    """March unit masses from rest at a displacement.

    Parameters
    ----------
    stiffness, damping
        (n, n).
    springs, limits
        (n,) of the friction spring of each mass, free of force where it starts from zero.
    start
        (n,) displacement, reached slowly from zero.
    periods, steps
        How many periods, and steps in each, of the first mode with stuck springs.
    """
    stuck = stiffness + np.diag(springs)
    omega = float(np.sqrt(np.linalg.eigvalsh(stuck)[0]))
    h = 2.0 * np.pi / omega / steps
    slider = np.zeros(len(start))

    def friction(x: Rows) -> Rows:
        force = springs * (x - slider)
        over = np.abs(force) > limits
        if np.any(over):
            moved = np.sign(force) * limits
            slider[over] = (x - moved / np.where(springs > 0.0, springs, 1.0))[over]
            force = np.where(over, moved, force)
        return np.asarray(force)

    left = np.linalg.inv(np.eye(len(start)) + 0.5 * h * damping)
    back = np.eye(len(start)) - 0.5 * h * damping
    friction(start)
    x = start.copy()
    # from rest: symmetric about the start
    before = x + 0.5 * h * h * (-stiffness @ x - friction(x))
    last = np.empty(periods * steps)
    for i in range(last.size):
        last[i] = x[-1]
        pull = -stiffness @ x - friction(x)
        x, before = left @ (2.0 * x - back @ before + h * h * pull), x
    return _read(last, h)


def _read(x: Rows, h: float) -> Decay:
    rising = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    share = -x[rising] / (x[rising + 1] - x[rising])
    crossings = (rising + share) * h
    time = np.arange(x.size) * h
    sizes = []
    for begin, end in itertools.pairwise(crossings):
        at = np.linspace(begin, end, 513)[:-1]
        own = np.interp(at, time, x)
        turn = np.exp(-2j * np.pi * np.arange(512) / 512)
        sizes.append(2.0 * abs(np.mean(own * turn)))
    sizes_ = np.array(sizes)
    spans = np.diff(crossings)
    omega = 4.0 * np.pi / (spans[:-1] + spans[1:])
    ratio = np.log(sizes_[:-1] / sizes_[1:]) / (2.0 * np.pi)
    return Decay(np.sqrt(sizes_[:-1] * sizes_[1:]), omega, ratio)

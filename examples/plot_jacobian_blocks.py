r"""
Which harmonics act on which
============================

The Jacobian of harmonic balance has a block for each pair of harmonics: :math:`\partial r^h/\partial q^k`. In full stick only the diagonal
is there, and each harmonic lives for itself. Slip and lift-off couple them. Here are the norms of the blocks for two blades with a wedge
between them, at a solution with one harmonic, as Gastaldi and Berruti (2017) draw them in their figure 1; the last column shows
:math:`\Delta J` (their eq. 20), the part that a solution with harmonics 0 and 1 neglects.

It uses the layers below ``ss.Model``, to show the blocks of the Jacobian.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm

import stickslip as ss

# %%
# Blade, damper, blade: the lumped system of Ferhatoglu and Zucca (2021), x and y of each blade and of the damper, pressed by 120 N.

stiffness = np.diag([3e5] * 4 + [0.0, 0.0])
for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
    stiffness[[a, b], [a, b]] += k
    stiffness[[a, b], [b, a]] -= k
mass, damping = np.array([1.0, 1, 1, 1, 0.1, 0.1]), np.diag([20.0, 20, 20, 20, 0, 0])
structure = ss.model.lumped(mass, stiffness, damping)
cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
gap = np.zeros((6, 6))  # rows t, w, n of two contacts
for contact, (blade, turn) in enumerate(((0, sin), (2, -sin))):
    local = np.array([[cos, turn], [turn, -cos]])
    gap[[3 * contact, 3 * contact + 2], 4:] = local
    gap[[3 * contact, 3 * contact + 2], blade : blade + 2] = -local
load = ss.HarmonicLoad(120.0 * np.eye(6)[5], {1: -1j * np.array([0, -20.0, 5, 0, 0, 0])})


def solved(hertz, mu):
    """Return the problem and its solutions with one harmonic and with five at a frequency, coming from 1 Hz below."""
    law = ss.ElasticCoulomb(k_t=3e5, k_w=0.0, k_n=3e5, mu=mu)
    interface = ss.Interface(("left", "right"), (law, law), gap)
    system = ss.System(structure, interface, outputs=np.arange(4), free=np.array([4, 5]))
    alert = ss.harmonic.JacobianAlert(threshold=-1.0)  # repeat whatever it says
    omega = 2 * np.pi * (hertz - 1.0), 2 * np.pi * hertz
    sweep = ss.Sweep(omega_range=omega, high=5, selection=alert, frequencies=5, peak_points=0)
    points = list(ss.forced_response(system, load, sweep))
    low, high = (next(p for p in points[::-1] if p.stage == s) for s in ("low", "high"))
    return ss.response.forced_problem(system, load, sweep), low, high


# %%
# Coordinates are scaled so that each answers a unit of motion with a unit of force while the contacts stick; a block of norm 1 is as
# stiff as that. Rows are forces, columns motions.
#
# Two kinds of stick have to be told apart. With :math:`\mu = 3` the contacts never slid: the diagonal is all there is. With
# :math:`\mu = 0.5` the left one slides in the first period to where the load pushes it, and sticks from then on. Its mean force depends on the
# place where it stopped and so on all harmonics: the first row. None but the static one feels it.

cases = {"never slid": (155.0, 3.0), "slid into place": (155.0, 0.5), "weak": (220.0, 0.5), "strong": (161.0, 0.5)}
pictures, rows = {}, []
for name, (hertz, mu) in cases.items():
    problem, low, high = solved(hertz, mu)
    balance = problem.high
    x, exact = (balance.unknowns(p.coefficients) for p in (low, high))
    norms = ss.harmonic.harmonic_block_norms
    pictures[f"$J$, {name}: {hertz:g} Hz, $\\mu$ = {mu:g}"] = norms(balance, x, low.omega)
    if name in {"weak", "strong"}:
        pictures[f"$\\Delta J$, {name}"] = norms(balance, x, low.omega, "missing", low.support)
    alike = ss.harmonic.jacobian_similarity(balance, x, exact, low.omega)
    rows.append((name, 100 * low.predicted_error, 100 * problem.real_error(low, high), alike))

figure, axes = plt.subplots(2, 3, figsize=(13, 8.2), layout="constrained")
scale, titles = LogNorm(1e-2, 40.0), list(pictures)
for ax, i in zip(axes.flat, [0, 2, 3, 1, 4, 5], strict=True):  # stick on the left, then weak above strong
    title, norms = titles[i], pictures[titles[i]]
    image = ax.imshow(np.ma.masked_less(norms, 1e-9), norm=scale, cmap="YlGnBu")
    for (h, k), value in np.ndenumerate(norms):
        if value > 1e-9:
            ax.text(k, h, f"{value:.2g}", ha="center", va="center", color="w" if value > 1.0 else "k")
    ax.set(
        title=title,
        xlabel="motion in harmonic $k$",
        ylabel="force in harmonic $h$",
        xticks=range(len(norms)),
        yticks=range(len(norms)),
    )
figure.colorbar(image, ax=axes, label="norm of the block", shrink=0.7)
plt.show()

# %%
# How alike the Jacobians of one and of five harmonics are, beside the error that the alert predicts. :math:`\Delta J\%` and
# :math:`\Gamma = J^{-1}\tilde J` (eq. 30 and 31) say that something changes, not whether it matters.

print("                 predicted   real   dJ%   trace of Gamma  mean  zeros off the diagonal")
for name, predicted, true, alike in rows:
    print(f"{name:15s}  {predicted:8.3f} % {true:6.3f} % {100 * alike.change:5.2f}", end="  ")
    print(f"{alike.trace:8.3f} of {alike.size}  {alike.mean_diagonal:.4f}  {100 * alike.zero_share:.1f} %")

r"""
All contact laws, by their loops
================================

Every law of the registry under the same motion: an ellipse in the contact plane, in three sizes, of which the force along t is drawn
over the gap along t. Contacts under a preload are pressed and relieved at the same time. The last picture shows normal forces.

It uses the layers below ``ss.Model``, to show the laws by themselves.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.contact.laws import LAWS

# %%
# One example a law. Displacements in µm, forces in N, so stiffnesses in N/µm: a law knows no units, only agreement.

examples = {
    "bonded": ss.Bonded(k_t=1.0, k_w=1.0, k_n=1.0),
    "unilateral_spring": ss.UnilateralSpring(k_n=1.0, preload=0.4),
    "cubic_spring": ss.CubicSpring(cubic_t=0.5, cubic_n=0.5, k_t=0.3, k_n=0.3),
    "polynomial_spring": ss.PolynomialSpring(along_t=(0.6, 0.4, 0.2), along_n=(0.6, 0.4, 0.2)),
    "jenkins": ss.Jenkins(k_t=2.0, limit=1.0, k_n=1.0),
    "elastic_coulomb": ss.ElasticCoulomb(k_t=2.0, k_w=2.0, k_n=1.0, mu=0.8, preload=1.0),
    "coupled_coulomb": ss.CoupledCoulomb(k_t=2.0, k_n=1.0, mu=0.8, preload=1.0),
    "regularised_coulomb": ss.RegularisedCoulomb(mu=0.8, transition_velocity=0.2, k_n=1.0, preload=1.0),
    "dahl": ss.Dahl(k_t=2.0, limit=1.0, k_n=1.0),
    "bouc_wen": ss.BoucWen(k_t=2.0, beta=1.5, gamma=0.5, alpha=0.1, exponent=2.0, k_n=1.0),
    "iwan": ss.Iwan(k_t=2.0, limit=1.0, k_n=1.0, population=ss.contact.UniformBand(n_sliders=30)),
}
assert list(examples) == list(LAWS)


def period(law, size, *, along):
    """Evaluate a law under ``size cos τ`` along one direction."""
    gap = np.zeros((5, 3))  # rows 1, cos, sin, cos 2, sin 2; columns t, w, n
    if along == "n":
        gap[1, 2] = size
    else:
        gap[1, 0], gap[2, 1] = size, 0.6 * size  # an ellipse in the contact plane
        if hasattr(law, "preload"):
            gap[2, 2] = 0.5  # relieved on the way back
    return ss.harmonic.contact_forces(gap, ss.contact.compile_contacts([law]), 1024)


# %%
# The loops. A law without tangential force shows a flat line, one without memory a curve without area.

figure, axes = plt.subplots(4, 3, figsize=(9.0, 11.0), layout="constrained", sharex=True)
for axis, (name, law) in zip(axes.flat, examples.items(), strict=False):
    for size, colour in ((0.5, "#9ecae1"), (1.0, "#4292c6"), (1.5, "#08306b")):
        at = period(law, size, along="t")
        gap, force = (np.append(values[0, 0], values[0, 0, 0]) for values in (at.gap, at.force))
        axis.plot(gap, force, color=colour, lw=1.3)
    axis.set_title(name, fontsize=10)
    axis.axhline(0.0, color="0.8", lw=0.6, zorder=0)
    axis.axvline(0.0, color="0.8", lw=0.6, zorder=0)
axis = axes.flat[len(examples)]
for name, style in (("bonded", "-"), ("unilateral_spring", "--"), ("cubic_spring", "-."), ("polynomial_spring", ":")):
    at = period(examples[name], 1.5, along="n")
    order = np.argsort(at.gap[0, 2])
    axis.plot(at.gap[0, 2, order], at.force[0, 2, order], style, lw=1.3, label=name)
axis.set_title("normal force $-N$", fontsize=10)
axis.legend(fontsize=7)
figure.supxlabel("gap, µm (tangential; last picture: normal)")
figure.supylabel("contact force, N")

# %%
# The energy lost in one cycle of the largest loop, :math:`\oint \mathbf{T}\cdot d\mathbf{g}`; springs return what they got.

for name, law in examples.items():
    at = period(law, 1.5, along="t")
    moves = 0.5 * (np.roll(at.gap[0], -1, axis=1) - np.roll(at.gap[0], 1, axis=1))
    print(f"{name:20s} {np.sum(at.force[0] * moves):9.5f} N µm")
plt.show()

"""The judge of one planar contact: closed forms, a fine march of first order, and itself at another tolerance."""

import math

import numpy as np
import pytest

from evidence.judges.planar_contact import Contact, judged


def drawn_gaps(seed, lift=0.8):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((7, 3)) * [1.0, 1.0, lift] / np.array([[1], [1], [1], [2], [2], [3], [3]])


@pytest.mark.parametrize("ratio", [0.9, 1.5, 2.0, 5.0])
def test_a_circle_has_its_closed_form(ratio):
    gaps = np.zeros((7, 3))
    gaps[1, 0] = gaps[2, 1] = ratio
    found = judged(gaps, Contact(k_t=1.0, k_n=0.0, mu=1.0, preload=1.0)).coefficients
    slips = ratio > 1.0
    exact = complex(1 / ratio**2, math.sqrt(1 - 1 / ratio**2) / ratio) if slips else 1.0
    assert abs(complex(found[1, 0], -found[2, 0]) / ratio - exact) < 1e-12
    assert abs(complex(found[2, 1], found[1, 1]) / ratio - exact) < 1e-12
    assert np.max(np.abs(found[3:])) < 1e-12


def test_one_tangent_alone_loses_the_work_of_a_jenkins_spring():
    gaps = np.zeros((3, 3))
    gaps[1, 1] = 3.0
    found = judged(gaps, Contact(k_t=9.0, k_w=2.0, k_n=0.0, mu=0.5, preload=4.0)).coefficients
    limit, k, amplitude = 2.0, 2.0, 3.0
    # work over a period = -π A S_1 of the force, and 4 F (A - F/k)
    assert -np.pi * amplitude * found[2, 1] == pytest.approx(4 * limit * (amplitude - limit / k), rel=1e-11)
    assert np.all(np.abs(found[:, 0]) < 1e-14)


def marched(gaps, contact, samples, periods):
    """Return the coefficients by steps of the closest point of first order, written apart from everything else."""
    tau = 2 * np.pi * np.arange(samples) / samples
    h = np.arange(1, len(gaps) // 2 + 1)
    basis = np.ones((samples, len(gaps)))
    basis[:, 1::2], basis[:, 2::2] = np.cos(np.outer(tau, h)), np.sin(np.outer(tau, h))
    kt, kw = contact.springs
    normal = np.maximum(0.0, contact.preload - contact.k_n * (basis @ gaps[:, 2]))
    limits, x, y = (contact.mu * normal).tolist(), (basis @ gaps[:, 0]).tolist(), (basis @ gaps[:, 1]).tolist()
    out = np.empty((samples, 2))
    sx = sy = 0.0
    for _ in range(periods):
        before = (sx, sy)
        for i in range(samples):
            a, b, limit = kt * (x[i] - sx), kw * (y[i] - sy), limits[i]
            if limit == 0.0:
                a = b = 0.0
            elif math.hypot(a, b) > limit:
                m = 0.0
                for _ in range(50):  # |(limit + k m)^-1 trial| = 1
                    p, q = a / (limit + kt * m), b / (limit + kw * m)
                    size = math.hypot(p, q)
                    steep = -(p * p * kt / (limit + kt * m) + q * q * kw / (limit + kw * m)) / size
                    change = size * (1.0 - size) / steep
                    m += change
                    if abs(change) < 1e-15 * (1.0 + m):
                        break
                p, q = a / (limit + kt * m), b / (limit + kw * m)
                a, b = limit * p, limit * q
            out[i] = a, b
            sx, sy = x[i] - a / kt, y[i] - b / kw
        if math.hypot(sx - before[0], sy - before[1]) < 1e-9:
            break
    weights = basis * (2.0 / samples)
    weights[:, 0] *= 0.5
    return weights.T @ out


@pytest.mark.parametrize("k_w", [None, 0.4, 2.5])
@pytest.mark.parametrize("preload", [1.5, 3.0])
def test_a_fine_march_leads_to_the_same_force(k_w, preload):
    gaps = drawn_gaps(5)
    contact = Contact(k_t=1.0, k_w=k_w, k_n=1.0, mu=0.5, preload=preload)
    exact = judged(gaps, contact).coefficients[:, :2]
    coarse, fine = (marched(gaps, contact, n, 70) for n in (512, 1024))
    error = np.max(np.abs(fine - exact))
    assert error < 8e-3
    assert np.max(np.abs(2 * fine - coarse - exact)) < max(0.05 * error, 3e-5)


@pytest.mark.parametrize("seed", [0, 3])
def test_another_tolerance_changes_nothing(seed):
    gaps = drawn_gaps(seed)
    contact = Contact(k_t=1.0, k_w=[None, 0.4][seed % 2], k_n=1.0, mu=0.5, preload=1.5)
    fine, coarse = (judged(gaps, contact, tolerance=t) for t in (1e-12, 1e-9))
    assert np.max(np.abs(fine.coefficients - coarse.coefficients)) < 3e-10
    assert [e[1:] for e in fine.events] == [e[1:] for e in coarse.events]

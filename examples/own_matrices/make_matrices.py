"""Write the matrices of a chain of twenty masses to chain.npz: what any program can do with its own."""

from pathlib import Path

import numpy as np

N, MASS, STIFFNESS = (20, 0.5, 2e5)  # masses of 0.5 kg, springs of 2e5 N/m, the first one to the ground

K = STIFFNESS * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
K[-1, -1] = STIFFNESS
np.savez(Path(__file__).with_name("chain.npz"), mass=MASS * np.eye(N), stiffness=K)

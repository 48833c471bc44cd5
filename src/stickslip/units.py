"""Units of engineers and the SI units of the library: frequencies, speeds, angles, lengths."""

import math

HZ = 2 * math.pi  # rad/s
RPM = 2 * math.pi / 60  # rad/s
DEG = math.pi / 180  # rad
MM = 1e-3  # m

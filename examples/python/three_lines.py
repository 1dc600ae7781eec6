#!/usr/bin/env python3
"""Arrays to attitude in three lines. Needs strapd alone; a sensor turned by a quarter about z, with bias and noise, is made up here."""

import numpy as np

rng = np.random.default_rng(7)
t = np.arange(0.0, 20.0, 0.005)  # s
moving = (t > 5) & (t <= 7)
gyr = np.where(moving[:, None], [0.0, 0.0, np.pi / 4], 0.0) + [0.01, -0.02, 0.005] + rng.normal(0, 0.002, (len(t), 3))  # rad/s
acc = np.array([0.0, 0.0, 9.81]) + rng.normal(0, 0.05, (len(t), 3))  # m/s^2

# ---- the three lines
import strapd  # noqa: E402

att = strapd.estimate(gyr, acc, t=t)
print(att)

# ---- and what there is to see
w, x, y, z = att.q[-1]
print(f"turned about z by {np.degrees(2 * np.arctan2(z, w)):.2f} deg, sigma {np.degrees(att.sigma[-1, 2]):.2f}")
print(f"bias {att.bias.round(4)} +- {att.bias_sigma.round(4)} rad/s")

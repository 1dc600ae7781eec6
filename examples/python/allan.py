#!/usr/bin/env python3
"""Allan deviation of a gyro at rest, from a recording or made up: angle random walk and bias instability.

    allan.py [RECORDING [TOPIC]]

Without a recording an hour of a sensor of known noise is simulated, and what comes out stands beside what was put in. Needs strapd
alone. (`strapd allan` does more: intervals of confidence, a plot, the flags for it.)
"""

import sys

import numpy as np
import strapd

#: deg/sqrt(h), deg/h: what is simulated.
MADE_UP = {"arw": 0.15, "bias_instability": 2.0}
#: Of flicker noise with the bias instability B, the Allan deviation at its lowest is 0.664 B.
FLICKER = np.sqrt(2 * np.log(2) / np.pi)


def deviation(rate, rate_hz, per_decade=10):
    """Averaging times (s) and overlapping Allan deviations, in the unit of the rate, of one axis."""
    angle = np.concatenate([[0.0], np.cumsum(rate)]) / rate_hz
    most = len(rate) // 9
    sizes = np.unique(np.logspace(0, np.log10(most), int(per_decade * np.log10(most)) + 1).astype(int))
    taus, found = sizes / rate_hz, []
    for size in sizes:
        change = angle[2 * size :] - 2 * angle[size:-size] + angle[: -2 * size]
        found.append(np.sqrt(0.5 * np.mean(change**2)) / (size / rate_hz))
    return taus, np.array(found)


def main(words):
    if words:
        samples = strapd.read(*words[:2])
        print(samples)
    else:
        samples = strapd.simulate("random", rms=0.0, rate_hz=100, duration=3600, noise=MADE_UP, seed=3)
    rate_hz = 1e9 / np.median(np.diff(samples.t))
    print(f"{rate_hz:.6g} Hz, {samples.t_s[-1] / 60:.1f} minutes; axis: angle random walk, deg/sqrt(h); bias instability, deg/h (at s)")
    for axis, rate in zip("xyz", samples.gyr.T):
        rate = rate[np.isfinite(rate)]
        taus, found = deviation(rate - rate.mean(), rate_hz)
        # White noise falls with 1/sqrt(tau): its level is that of the shortest times.
        white = taus < 1.0
        arw = np.degrees(np.exp(np.mean(np.log(found[white] * np.sqrt(taus[white]))))) * 60
        lowest = np.argmin(found)
        print(f"{axis}: {arw:.4f}; {np.degrees(found[lowest]) * 3600 / FLICKER:.3f} (at {taus[lowest]:.0f})")
    if not words:
        print(f"put in: {MADE_UP['arw']}; {MADE_UP['bias_instability']}")


if __name__ == "__main__":
    main(sys.argv[1:])

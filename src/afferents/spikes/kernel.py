"""Steps of spiking units, compiled; units are the inner loop, so many are computed at once."""

import numpy as np

from afferents.compiled import compiled

PEAK_MV = np.float32(30.0)
"""An Izhikevich unit that comes so far has fired."""


@compiled()
def izhikevich(current, row, weight, state, step_ms, a, b, c, d, fired_step, fired_unit):
    """Advance Izhikevich units; return how many spikes there were, or -1 if they don't fit.

    v' = 0.04 v^2 + 5 v + 140 - u + I, u' = a (b v - u), in ms; at the peak v = c, u = u + d.
    """
    n_units, n = current.shape[1], 0
    v, u = state[0], state[1]
    last = current.shape[0] - 1
    for step in range(len(row)):
        now, then, w = current[row[step]], current[min(row[step] + 1, last)], weight[step]
        for i in range(n_units):
            drive = now[i] + w * (then[i] - now[i])
            x = v[i]
            slope = (np.float32(0.04) * x + np.float32(5.0)) * x + np.float32(140.0) - u[i] + drive
            v[i] = x + step_ms * slope
            u[i] += step_ms * a * (b * x - u[i])
        for i in range(n_units):
            if v[i] >= PEAK_MV:
                if n == len(fired_step):
                    return -1
                fired_step[n], fired_unit[n] = step, i
                n += 1
                v[i] = c
                u[i] += d
    return n


@compiled()
def leaky(current, row, weight, state, decay, refractory, fired_step, fired_unit, fired_part):
    """Advance leaky units; return how many spikes there were. All must fit into `fired_step`.

    tau v' = I - v, solved exactly over a step of constant current; at v = 1 the unit fires, goes
    back to 0 and rests. `fired_part` is how far into the step the threshold was crossed.
    """
    n_units, n = current.shape[1], 0
    # rest: steps of it that are left; below 1, that part of the next step is still rest
    v, rest = state[0], state[1]
    last = current.shape[0] - 1
    for step in range(len(row)):
        now, then, w = current[row[step]], current[min(row[step] + 1, last)], weight[step]
        for i in range(n_units):
            if rest[i] >= 1:
                rest[i] -= 1
                continue
            drive = now[i] + w * (then[i] - now[i])
            share, kept = np.float32(1), decay
            if rest[i] > 0:
                share -= rest[i]
                kept = decay**share
                rest[i] = 0
            after = drive + (v[i] - drive) * kept
            if after < 1:
                v[i] = after
                continue
            crossed = 1 - share + np.log((drive - v[i]) / (drive - 1)) / -np.log(decay)
            fired_step[n], fired_unit[n], fired_part[n] = step, i, crossed
            n += 1
            v[i] = 0
            rest[i] = max(refractory - (1 - crossed), 0)
    return n

"""The kernel of the skin: its equations, see `skin`, for all nodes, step by step, in Numba."""

from typing import NamedTuple

import numpy as np
from numba import njit

N_SIDE = 19
"""Pins a side (paper, section 2.1)."""
ROW = N_SIDE + 2
"""Nodes in a row with those of the margin."""
FIRST, SPAN = ROW + 1, (N_SIDE - 1) * ROW + N_SIDE
"""The first inner node, and how many there are from it to the last."""
STATES = 13
_UX, _UY, _VX, _VY, _ZX, _ZY, _D, _NX, _NY, _Q, _P, _FX, _FY = range(0, STATES * ROW**2, ROW**2)


class Constants(NamedTuple):
    """The constants of `skin.Skin` as the kernel wants them: float32, forces as accelerations."""

    dt: np.float32
    per_along: np.float32
    per_across: np.float32
    k_n: np.float32
    relaxing: np.float32
    relax: np.float32
    k: np.float32
    k_c: np.float32
    c: np.float32
    spread: np.float32
    accelerate: np.float32
    m_s: np.float32
    m_k: np.float32
    per_stribeck: np.float32
    s0: np.float32
    s1: np.float32
    s2: np.float32


_kernel = njit(cache=True, fastmath=True, error_model="numpy")
_part = njit(fastmath=True, error_model="numpy", inline="always")
"""Sums are reordered as suits the processor: the same machine gives the same numbers. So that
the compiler works on many nodes at once, all states lie in one array at constant distances, and
the loops run from 0 over all nodes between the first and the last inner one, margin included."""


@_part
def _meet(state, heights, width, offset, depth, x, y, gap, k):
    """How deep every node is pressed in, and on what slope.

    Apart from `_press`, since it jumps about in the map.
    """
    for j in range(SPAN):
        along = offset + (x[j] + state[_UX + FIRST + j]) * k.per_along
        across = (y[j] + state[_UY + FIRST + j]) * k.per_across
        a, b = np.int32(along), np.int32(across)
        fa, fb = along - np.float32(a), across - np.float32(b)
        here = np.uint32(a * width + b)
        below = np.uint32(here + width)
        near_step = heights[here + np.uint32(1)] - heights[here]
        far_step = heights[below + np.uint32(1)] - heights[below]
        near = heights[here] + fb * near_step
        far = heights[below] + fb * far_step
        state[_D + FIRST + j] = depth - gap[j] + near + fa * (far - near)
        state[_NX + FIRST + j] = (near - far) * k.per_along
        state[_NY + FIRST + j] = -(near_step + fa * (far_step - near_step)) * k.per_across


@_part
def _press(state, speed, k):
    """Pressure and friction of every node."""
    zero, one, tiny = np.float32(0), np.float32(1), np.float32(1e-12)
    for j in range(SPAN):
        d = max(state[_D + FIRST + j], zero)
        q = state[_Q + FIRST + j]
        q += k.relax * (d - q)
        p = max(k.k_n * (d + k.relaxing * (d - q)), zero)
        wx, wy = speed - state[_VX + FIRST + j], -state[_VY + FIRST + j]
        w = np.sqrt(wx * wx + wy * wy + tiny)
        v = w * k.per_stribeck
        loss = k.s0 * w / (k.m_k + (k.m_s - k.m_k) / (one + v * v))
        # Implicit in z: never beyond what the friction can hold, at any step.
        hold = one / (one + loss * k.dt)
        zx = (state[_ZX + FIRST + j] + wx * k.dt) * hold
        zy = (state[_ZY + FIRST + j] + wy * k.dt) * hold
        rub_x = k.s0 * zx + k.s1 * (wx - loss * zx) + k.s2 * wx
        rub_y = k.s0 * zy + k.s1 * (wy - loss * zy) + k.s2 * wy
        state[_FX + FIRST + j] = p * (rub_x + state[_NX + FIRST + j])
        state[_FY + FIRST + j] = p * (rub_y + state[_NY + FIRST + j])
        state[_ZX + FIRST + j] = zx
        state[_ZY + FIRST + j] = zy
        state[_Q + FIRST + j] = q
        state[_P + FIRST + j] = p


@_part
def _move(state, k):
    """In-plane motion of every node in one step: velocities first, then places."""
    four = np.float32(4)
    for j in range(SPAN):
        ux, uy = state[_UX + FIRST + j], state[_UY + FIRST + j]
        around_x = (
            state[_UX + FIRST - 1 + j]
            + state[_UX + FIRST + 1 + j]
            + state[_UX + FIRST - ROW + j]
            + state[_UX + FIRST + ROW + j]
        )
        around_y = (
            state[_UY + FIRST - 1 + j]
            + state[_UY + FIRST + 1 + j]
            + state[_UY + FIRST - ROW + j]
            + state[_UY + FIRST + ROW + j]
        )
        push_x = k.spread * (state[_P + FIRST - 1 + j] - state[_P + FIRST + 1 + j])
        push_y = k.spread * (state[_P + FIRST - ROW + j] - state[_P + FIRST + ROW + j])
        pull_x = k.k_c * (around_x - four * ux) - k.k * ux + push_x
        pull_y = k.k_c * (around_y - four * uy) - k.k * uy + push_y
        vx, vy = state[_VX + FIRST + j], state[_VY + FIRST + j]
        state[_VX + FIRST + j] = (
            vx + (pull_x + k.accelerate * state[_FX + FIRST + j] - k.c * vx) * k.dt
        )
        state[_VY + FIRST + j] = (
            vy + (pull_y + k.accelerate * state[_FY + FIRST + j] - k.c * vy) * k.dt
        )
    for j in range(SPAN):
        state[_UX + FIRST + j] += state[_VX + FIRST + j] * k.dt
        state[_UY + FIRST + j] += state[_VY + FIRST + j] * k.dt


@_part
def _free_edges(state):
    """Give the outermost nodes neighbours like themselves: nothing pulls from outside."""
    last = ROW * (ROW - 1)
    for s in (_UX, _UY, _P):
        for i in range(ROW):
            state[s + i] = state[s + ROW + i]
            state[s + last + i] = state[s + last - ROW + i]
        for r in range(ROW):
            state[s + r * ROW] = state[s + r * ROW + 1]
            state[s + r * ROW + ROW - 1] = state[s + r * ROW + ROW - 2]


@_part
def _heard(state, weight, s):
    """Return the weighted sum of a state over the nodes."""
    total = 0.0
    for j in range(SPAN):
        total += weight[j] * state[s + FIRST + j]
    return total


@_part
def _take_frame(state, since, frame):
    """Write places, depth and pressure, `since` s before the end of the step."""
    for r in range(N_SIDE):
        for i in range(N_SIDE):
            j = r * ROW + i
            frame[0, r, i] = state[_UX + FIRST + j] - since * state[_VX + FIRST + j]
            frame[1, r, i] = state[_UY + FIRST + j] - since * state[_VY + FIRST + j]
            frame[2, r, i] = max(state[_D + FIRST + j], np.float32(0))
            frame[3, r, i] = state[_P + FIRST + j]


@_kernel
def advance(
    state,
    heights,
    width,
    offset,
    speed,
    depth,
    x,
    y,
    gap,
    weight,
    frame_steps,
    k,
    frames,
    sounds,
):
    """Move the skin on by as many steps as `offset` has, in place.

    Parameters
    ----------
    state
        All states of all nodes, changed in place, shape (STATES * ROW^2,).
    heights, width
        The map of heights, flat, and the length of its rows.
    offset, speed, depth
        Place on the map (rows), speed (mm/s) and depth (mm) at each step.
    x, y, gap, weight
        Of the nodes: place from the edge of the map, gap to the drum (mm), loudness.
    frame_steps
        When frames are taken, in steps, ascending.
    k
        Constants.
    frames
        Filled with displacement along x and y, depth and pressure, (n_frames, 4, row, column).
    sounds
        Filled with the rates of pressure and tangential force, (n_steps, 2).
    """
    pressed, pulled = _heard(state, weight, _P), _heard(state, weight, _FX)
    frame = 0
    for step in range(len(offset)):
        _meet(state, heights, width, offset[step], depth[step], x, y, gap, k)
        _press(state, speed[step], k)
        _free_edges(state)
        _move(state, k)
        before = pressed, pulled
        pressed, pulled = _heard(state, weight, _P), _heard(state, weight, _FX)
        sounds[step, 0], sounds[step, 1] = (pressed - before[0]) / k.dt, (pulled - before[1]) / k.dt
        while frame < len(frame_steps) and frame_steps[frame] < step + 1:
            _take_frame(state, np.float32((step + 1 - frame_steps[frame]) * k.dt), frames[frame])
            frame += 1

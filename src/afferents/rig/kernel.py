"""The kernel of the skin: its equations, see `skin`, for all nodes, step by step, in Numba.

What a node does by itself is the same for any layout; what neighbours do to it is written once for
the square lattice, which is fast, and once for the nodes of any `mesh`.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from afferents.compiled import compiled

N_SIDE = 19
"""Pins a side (paper, section 2.1)."""
ROW = N_SIDE + 2
"""Nodes in a row with those of the margin."""
FIRST, SPAN = ROW + 1, (N_SIDE - 1) * ROW + N_SIDE
"""The first inner node, and how many there are from it to the last."""
STATES = 13
_UX, _UY, _VX, _VY, _ZX, _ZY, _D, _NX, _NY, _Q, _P, _FX, _FY = range(STATES)
_PLANE = ROW**2
"""Values of one state, those of the margin among them."""
_NODES = FIRST, SPAN, _PLANE


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
    s0: np.float32
    s1: np.float32


_kernel = compiled(fastmath=True, error_model="numpy")
_part = njit(fastmath=True, error_model="numpy", inline="always")
"""Sums are reordered as suits the processor: the same machine gives the same numbers. So that
the compiler works on many nodes at once, all states lie in one array at constant distances, and
the loops run from 0 over all nodes between the first and the last inner one, margin included."""


@_part
def _meet(state, nodes, maps, width, offset, depth, x, y, gap, k, cell, corners):
    """How deep every node is pressed in, on what slope, and how soon its bristles give way.

    In three passes, so that the compiler works on many nodes at once in all but the one that jumps
    about in the maps. `cell` and `corners` are room for what lies between: where each node is in
    the maps, how far into that cell (two planes), the heights of its corners (four), and by how
    much its bristles give way per mm of slip, as a share.
    """
    first, span, plane = nodes
    heights, per_slip = maps
    last_row = np.int32(len(heights) // width - 2)
    for j in range(span):
        along = offset + (x[j] + state[_UX * plane + first + j]) * k.per_along
        across = (y[j] + state[_UY * plane + first + j]) * k.per_across
        # Skin that comes apart may be anywhere: it is refused later, and reads no other memory.
        a = min(max(np.int32(along), np.int32(0)), last_row)
        b = min(max(np.int32(across), np.int32(0)), width - np.int32(2))
        cell[j] = np.uint32(a * width + b)
        corners[j], corners[span + j] = along - np.float32(a), across - np.float32(b)
    for j in range(span):
        here = cell[j]
        below = np.uint32(here + width)
        corners[2 * span + j] = heights[here]
        corners[3 * span + j] = heights[here + np.uint32(1)]
        corners[4 * span + j] = heights[below]
        corners[5 * span + j] = heights[below + np.uint32(1)]
        corners[6 * span + j] = per_slip[here]
    for j in range(span):
        fa, fb = corners[j], corners[span + j]
        near_step = corners[3 * span + j] - corners[2 * span + j]
        far_step = corners[5 * span + j] - corners[4 * span + j]
        near = corners[2 * span + j] + fb * near_step
        far = corners[4 * span + j] + fb * far_step
        state[_D * plane + first + j] = depth - gap[j] + near + fa * (far - near)
        state[_NX * plane + first + j] = (near - far) * k.per_along
        state[_NY * plane + first + j] = -(near_step + fa * (far_step - near_step)) * k.per_across


@_part
def _press(state, nodes, speed, k, corners):
    """Pressure and friction of every node."""
    first, span, plane = nodes
    zero, one, tiny = np.float32(0), np.float32(1), np.float32(1e-12)
    for j in range(span):
        d = max(state[_D * plane + first + j], zero)
        q = state[_Q * plane + first + j]
        q += k.relax * (d - q)
        p = max(k.k_n * (d + k.relaxing * (d - q)), zero)
        wx, wy = speed - state[_VX * plane + first + j], -state[_VY * plane + first + j]
        w = np.sqrt(wx * wx + wy * wy + tiny)
        loss = w * corners[6 * span + j]
        # Implicit in z: never beyond what the friction can hold, at any step.
        hold = one / (one + loss * k.dt)
        zx = (state[_ZX * plane + first + j] + wx * k.dt) * hold
        zy = (state[_ZY * plane + first + j] + wy * k.dt) * hold
        rub_x = k.s0 * zx + k.s1 * (wx - loss * zx)
        rub_y = k.s0 * zy + k.s1 * (wy - loss * zy)
        state[_FX * plane + first + j] = p * (rub_x + state[_NX * plane + first + j])
        state[_FY * plane + first + j] = p * (rub_y + state[_NY * plane + first + j])
        state[_ZX * plane + first + j] = zx
        state[_ZY * plane + first + j] = zy
        state[_Q * plane + first + j] = q
        state[_P * plane + first + j] = p


@_part
def _move(state, k):
    """In-plane motion of every node in one step: velocities first, then places."""
    four = np.float32(4)
    for j in range(SPAN):
        ux, uy = state[_UX * _PLANE + FIRST + j], state[_UY * _PLANE + FIRST + j]
        around_x = (
            state[_UX * _PLANE + FIRST - 1 + j]
            + state[_UX * _PLANE + FIRST + 1 + j]
            + state[_UX * _PLANE + FIRST - ROW + j]
            + state[_UX * _PLANE + FIRST + ROW + j]
        )
        around_y = (
            state[_UY * _PLANE + FIRST - 1 + j]
            + state[_UY * _PLANE + FIRST + 1 + j]
            + state[_UY * _PLANE + FIRST - ROW + j]
            + state[_UY * _PLANE + FIRST + ROW + j]
        )
        push_x = k.spread * (
            state[_P * _PLANE + FIRST - 1 + j] - state[_P * _PLANE + FIRST + 1 + j]
        )
        push_y = k.spread * (
            state[_P * _PLANE + FIRST - ROW + j] - state[_P * _PLANE + FIRST + ROW + j]
        )
        pull_x = k.k_c * (around_x - four * ux) - k.k * ux + push_x
        pull_y = k.k_c * (around_y - four * uy) - k.k * uy + push_y
        vx, vy = state[_VX * _PLANE + FIRST + j], state[_VY * _PLANE + FIRST + j]
        state[_VX * _PLANE + FIRST + j] = (
            vx + (pull_x + k.accelerate * state[_FX * _PLANE + FIRST + j] - k.c * vx) * k.dt
        )
        state[_VY * _PLANE + FIRST + j] = (
            vy + (pull_y + k.accelerate * state[_FY * _PLANE + FIRST + j] - k.c * vy) * k.dt
        )
    for j in range(SPAN):
        state[_UX * _PLANE + FIRST + j] += state[_VX * _PLANE + FIRST + j] * k.dt
        state[_UY * _PLANE + FIRST + j] += state[_VY * _PLANE + FIRST + j] * k.dt


@_part
def _free_edges(state):
    """Give the outermost nodes neighbours like themselves: nothing pulls from outside."""
    last = ROW * (ROW - 1)
    for s in (_UX * _PLANE, _UY * _PLANE, _P * _PLANE):
        for i in range(ROW):
            state[s + i] = state[s + ROW + i]
            state[s + last + i] = state[s + last - ROW + i]
        for r in range(ROW):
            state[s + r * ROW] = state[s + r * ROW + 1]
            state[s + r * ROW + ROW - 1] = state[s + r * ROW + ROW - 2]


@_part
def _heard(state, nodes, weight, s):
    """Return the weighted sum of a state over the nodes."""
    total = 0.0
    first, span, plane = nodes
    for j in range(span):
        total += weight[j] * state[s * plane + first + j]
    return total


@_part
def _take_frame(state, since, frame):
    """Write places, depth, pressure and friction, `since` s before the end of the step."""
    for r in range(N_SIDE):
        for i in range(N_SIDE):
            j = r * ROW + i
            frame[0, r, i] = (
                state[_UX * _PLANE + FIRST + j] - since * state[_VX * _PLANE + FIRST + j]
            )
            frame[1, r, i] = (
                state[_UY * _PLANE + FIRST + j] - since * state[_VY * _PLANE + FIRST + j]
            )
            frame[2, r, i] = max(state[_D * _PLANE + FIRST + j], np.float32(0))
            frame[3, r, i] = state[_P * _PLANE + FIRST + j]
            frame[4, r, i] = state[_FX * _PLANE + FIRST + j]
            frame[5, r, i] = state[_FY * _PLANE + FIRST + j]


@_kernel
def advance(
    state,
    maps,
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
    maps, width
        Of heights (mm) and of how much bristles give way (share per mm of slip), both flat; and
        the length of their rows.
    offset, speed, depth
        Place on the map (rows), speed (mm/s) and depth (mm) at each step.
    x, y, gap, weight
        Of the nodes: place from the edge of the map, gap to the drum (mm), loudness.
    frame_steps
        When frames are taken, in steps, ascending.
    k
        Constants.
    frames
        Filled with displacement along x and y, depth, pressure, and friction along x and y,
        (n_frames, 6, row, column).
    sounds
        Filled with the rates of pressure and tangential force, (n_steps, 2).
    """
    pressed, pulled = _heard(state, _NODES, weight, _P), _heard(state, _NODES, weight, _FX)
    cell, corners = np.empty(len(x), np.uint32), np.empty(7 * len(x), np.float32)
    frame = 0
    for step in range(len(offset)):
        _meet(state, _NODES, maps, width, offset[step], depth[step], x, y, gap, k, cell, corners)
        _press(state, _NODES, speed[step], k, corners)
        _free_edges(state)
        _move(state, k)
        before = pressed, pulled
        pressed, pulled = _heard(state, _NODES, weight, _P), _heard(state, _NODES, weight, _FX)
        sounds[step, 0], sounds[step, 1] = (pressed - before[0]) / k.dt, (pulled - before[1]) / k.dt
        while frame < len(frame_steps) and frame_steps[frame] < step + 1:
            _take_frame(state, np.float32((step + 1 - frame_steps[frame]) * k.dt), frames[frame])
            frame += 1


@_part
def _move_mesh(state, n, neighbour, coupling, push, k):
    """In-plane motion of every node in one step: velocities first, then places."""
    for j in range(n):
        ux, uy, p = state[_UX * n + j], state[_UY * n + j], state[_P * n + j]
        pull_x, pull_y = -k.k * ux, -k.k * uy
        for i in range(neighbour.shape[1]):
            other, stiff = neighbour[j, i], k.k_c * coupling[j, i]
            fall = k.spread * (state[_P * n + other] - p)
            pull_x += stiff * (state[_UX * n + other] - ux) + fall * push[j, i, 0]
            pull_y += stiff * (state[_UY * n + other] - uy) + fall * push[j, i, 1]
        vx, vy = state[_VX * n + j], state[_VY * n + j]
        state[_VX * n + j] = vx + (pull_x + k.accelerate * state[_FX * n + j] - k.c * vx) * k.dt
        state[_VY * n + j] = vy + (pull_y + k.accelerate * state[_FY * n + j] - k.c * vy) * k.dt
    for j in range(n):
        state[_UX * n + j] += state[_VX * n + j] * k.dt
        state[_UY * n + j] += state[_VY * n + j] * k.dt


@_part
def _take_mesh_frame(state, n, since, frame):
    """Write places, depth, pressure and friction, `since` s before the end of the step."""
    for j in range(n):
        frame[0, j] = state[_UX * n + j] - since * state[_VX * n + j]
        frame[1, j] = state[_UY * n + j] - since * state[_VY * n + j]
        frame[2, j] = max(state[_D * n + j], np.float32(0))
        frame[3, j] = state[_P * n + j]
        frame[4, j] = state[_FX * n + j]
        frame[5, j] = state[_FY * n + j]


@_kernel
def advance_mesh(
    state,
    maps,
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
    neighbour,
    coupling,
    push,
    frames,
    sounds,
):
    """Move the skin on by as many steps as `offset` has, in place.

    As `advance`, with states (STATES * n_nodes,), values of the nodes (n_nodes,), what `mesh.Mesh`
    says of their neighbours, and frames (n_frames, 6, n_nodes).
    """
    n = len(x)
    nodes = 0, n, n
    pressed, pulled = _heard(state, nodes, weight, _P), _heard(state, nodes, weight, _FX)
    cell, corners = np.empty(len(x), np.uint32), np.empty(7 * len(x), np.float32)
    frame = 0
    for step in range(len(offset)):
        _meet(state, nodes, maps, width, offset[step], depth[step], x, y, gap, k, cell, corners)
        _press(state, nodes, speed[step], k, corners)
        _move_mesh(state, n, neighbour, coupling, push, k)
        before = pressed, pulled
        pressed, pulled = _heard(state, nodes, weight, _P), _heard(state, nodes, weight, _FX)
        sounds[step, 0], sounds[step, 1] = (pressed - before[0]) / k.dt, (pulled - before[1]) / k.dt
        while frame < len(frame_steps) and frame_steps[frame] < step + 1:
            since = np.float32((step + 1 - frame_steps[frame]) * k.dt)
            _take_mesh_frame(state, n, since, frames[frame])
            frame += 1

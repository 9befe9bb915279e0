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
_INNER = tuple(state * _PLANE + FIRST for state in range(STATES))
"""Where the inner nodes of each state begin."""


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
    ux, uy, vx, vy = _INNER[_UX], _INNER[_UY], _INNER[_VX], _INNER[_VY]
    p, fx, fy = _INNER[_P], _INNER[_FX], _INNER[_FY]
    for j in range(SPAN):
        x, y = state[ux + j], state[uy + j]
        around_x = state[ux - 1 + j] + state[ux + 1 + j] + state[ux - ROW + j] + state[ux + ROW + j]
        around_y = state[uy - 1 + j] + state[uy + 1 + j] + state[uy - ROW + j] + state[uy + ROW + j]
        push_x = k.spread * (state[p - 1 + j] - state[p + 1 + j])
        push_y = k.spread * (state[p - ROW + j] - state[p + ROW + j])
        pull_x = k.k_c * (around_x - four * x) - k.k * x + push_x
        pull_y = k.k_c * (around_y - four * y) - k.k * y + push_y
        state[vx + j] += (pull_x + k.accelerate * state[fx + j] - k.c * state[vx + j]) * k.dt
        state[vy + j] += (pull_y + k.accelerate * state[fy + j] - k.c * state[vy + j]) * k.dt
    for j in range(SPAN):
        state[ux + j] += state[vx + j] * k.dt
        state[uy + j] += state[vy + j] * k.dt


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
def _move_mesh(state, n, mesh, k):
    """In-plane motion of every node in one step: velocities first, then places."""
    neighbour, coupling, push = mesh
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
def _heard(state, nodes, weight, s):
    """Return the weighted sum of a state over the nodes."""
    total = 0.0
    first, span, plane = nodes
    for j in range(span):
        total += weight[j] * state[s * plane + first + j]
    return total


@_part
def _take_frame(state, plane, pins, since, frame):
    """Write places, depth, pressure and friction, `since` s before the end of the step."""
    for i in range(len(pins)):
        j = pins[i]
        frame[0, i] = state[_UX * plane + j] - since * state[_VX * plane + j]
        frame[1, i] = state[_UY * plane + j] - since * state[_VY * plane + j]
        frame[2, i] = max(state[_D * plane + j], np.float32(0))
        frame[3, i] = state[_P * plane + j]
        frame[4, i] = state[_FX * plane + j]
        frame[5, i] = state[_FY * plane + j]


@_kernel
def advance(state, maps, width, motion, places, weight, pins, mesh, frame_steps, k, frames, sounds):
    """Move the skin on by as many steps as `motion` has, in place.

    Parameters
    ----------
    state
        All states of all nodes, changed in place: (STATES * ROW^2,), of a mesh (STATES * n_nodes,).
    maps, width
        Of heights (mm) and of how much bristles give way (share per mm of slip), both flat; and
        the length of their rows.
    motion
        Place on the map (rows), speed (mm/s) and depth (mm) at each step.
    places, weight
        Of the nodes: place from the edge of the map along x and y and gap to the drum, mm; and
        loudness.
    pins
        Which nodes are pins, by their place in a state.
    mesh
        Neighbours, couplings and pushes of `mesh.Mesh`; None for the square lattice.
    frame_steps
        When frames are taken, in steps, ascending.
    k
        Constants.
    frames
        Filled with displacement along x and y, depth, pressure, and friction along x and y,
        (n_frames, 6, n_pins).
    sounds
        Filled with the rates of pressure and tangential force, (n_steps, 2).
    """
    offset, speed, depth = motion
    x, y, gap = places
    nodes = _NODES if mesh is None else (0, len(x), len(x))
    pressed, pulled = _heard(state, nodes, weight, _P), _heard(state, nodes, weight, _FX)
    cell, corners = np.empty(len(x), np.uint32), np.empty(7 * len(x), np.float32)
    frame = 0
    for step in range(len(offset)):
        _meet(state, nodes, maps, width, offset[step], depth[step], x, y, gap, k, cell, corners)
        _press(state, nodes, speed[step], k, corners)
        if mesh is None:
            _free_edges(state)
            _move(state, k)
        else:
            _move_mesh(state, len(x), mesh, k)
        before = pressed, pulled
        pressed, pulled = _heard(state, nodes, weight, _P), _heard(state, nodes, weight, _FX)
        sounds[step, 0], sounds[step, 1] = (pressed - before[0]) / k.dt, (pulled - before[1]) / k.dt
        while frame < len(frame_steps) and frame_steps[frame] < step + 1:
            since = np.float32((step + 1 - frame_steps[frame]) * k.dt)
            _take_frame(state, nodes[2], pins, since, frames[frame])
            frame += 1

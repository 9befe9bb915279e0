"""The skin on one drum: what moves it, and what comes out of it, step by step.

`rig.skin` says what the skin is and by which equations it moves; `rig.kernel` advances them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.rig.kernel import FIRST, N_SIDE, ROW, SPAN, STATES, Constants, advance, advance_mesh
from afferents.rig.skin import MN_PER_MG, PHYSICS_RATE_HZ, Skin
from afferents.rig.surface import WIDTH_MM, Surface

Floats = NDArray[np.float32]

_MARGIN_MM = WIDTH_MM / 2
_NO_CONTACT_MM = 1e3


class Motion(NamedTuple):
    """What drives the skin, a value a physics step each, shape (n_steps,).

    Attributes
    ----------
    slide_mm
        How far the surface has moved, measured on the map of heights, mm.
    speed_mm_s
        Its speed, mm/s.
    depth_mm
        How far the fingertip would be pressed into the surface at its middle, mm.
    """

    slide_mm: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]
    depth_mm: NDArray[np.float64]


class SkinResponse(NamedTuple):
    """What comes out of the skin.

    Attributes
    ----------
    displacement_mm
        In-plane, (n_frames, n_nodes, 2), mm.
    inward_mm
        How far the skin is pushed in, (n_frames, n_nodes), mm.
    pressure_mn
        (n_frames, n_nodes), mN.
    wrench
        Force on the whole tip and torque about its middle, (n_frames, 6), N and N m. As an arm
        sees it that slides along its x: x against the drum's way, y down the picture, z from the
        drum to the skin.
    pressure_rate, shear_rate
        Weighted sums over the nodes at each step: rate of the pressure (mN/s) and of the
        tangential force (mN/s) along the slide, (n_steps,).
    """

    displacement_mm: Floats
    inward_mm: Floats
    pressure_mn: Floats
    wrench: NDArray[np.float64]
    pressure_rate: NDArray[np.float64]
    shear_rate: NDArray[np.float64]


class SkinOnDrum:
    """The lattice on one drum; its state lives from one `run` to the next.

    Parameters
    ----------
    skin
        Constants.
    surface
        What the nodules feel (`surface.soft_maximum`).
    tilt
        Slopes of the drum against the skin along x and y, rad.
    lateral_mm
        How far the drum stands off along y, mm.
    weight
        How loudly each node sounds in the microphone, shape (n_nodes,).
    rate_hz
        Physics steps a second.
    """

    def __init__(
        self,
        skin: Skin,
        surface: Surface,
        tilt: tuple[float, float],
        lateral_mm: float,
        weight: NDArray[np.float64],
        rate_hz: float = PHYSICS_RATE_HZ,
    ) -> None:
        """Start free of contact and at rest."""
        self.skin = skin
        self.surface = surface
        self.rate_hz = rate_hz
        self._mesh, rest = skin.mesh, skin.rest_mm()
        nodes = ROW**2 if self._mesh is None else len(rest)
        self._state = np.zeros(STATES * nodes, np.float32)
        self._x = self._lay_out(rest[:, 0] + _MARGIN_MM, _MARGIN_MM)
        self._y = self._lay_out(rest[:, 1] - lateral_mm + _MARGIN_MM, _MARGIN_MM)
        # How much later than the middle each node meets the drum, mm.
        x, y = rest.T
        round_ = x**2 / 2 * (1 / skin.radius_mm + 1 / skin.tip_radius_mm) + y**2 / (
            2 * skin.tip_radius_mm
        )
        lower = np.where(skin.nodules(), 0.0, skin.recess_mm if skin.nodular else 0.0)
        gap_mm = np.asarray(round_ + tilt[0] * x + tilt[1] * y + lower)
        self._gap = self._lay_out(gap_mm, _NO_CONTACT_MM)
        self._weight = self._lay_out(weight, 0.0)
        # The maps' beginning follows once more after their end, so that no node must wrap.
        again = math.ceil(2 * _MARGIN_MM / surface.pitch_mm[0]) + 2
        per_slip = skin.bristle_per_mm / skin.friction / np.asarray(surface.grip)
        self._maps = tuple(
            np.concatenate([one, one[:again]]).astype(np.float32).ravel()
            for one in (surface.height_mm, np.broadcast_to(per_slip, surface.height_mm.shape))
        )

    def _lay_out(self, value: NDArray[np.float64], outside: float) -> Floats:
        """Return values of the nodes; round the lattice a row of imagined nodes, laid out flat."""
        if self._mesh is not None:
            return value.astype(np.float32)
        square = value.reshape(N_SIDE, N_SIDE)
        flat = np.pad(square, 1, constant_values=outside).astype(np.float32).ravel()
        return flat[FIRST : FIRST + SPAN].copy()

    def run(self, motion: Motion, frame_steps: NDArray[np.float64]) -> SkinResponse:
        """Move the skin on by as many steps as `motion` has.

        Parameters
        ----------
        frame_steps
            When frames are taken, in steps from the first, ascending, shape (n_frames,); what
            lies between two steps is interpolated.
        """
        skin, n_frames, n_nodes = self.skin, len(frame_steps), self.skin.n_nodes
        mesh = self._mesh
        form = (N_SIDE, N_SIDE) if mesh is None else (n_nodes,)
        frames = np.zeros((n_frames, 6, *form), np.float32)
        sounds = np.zeros((len(motion.slide_mm), 2))
        pitch_mm = self.surface.pitch_mm
        # Positions on the map, from the edge of the lattice's margin on.
        offset = np.mod(-motion.slide_mm - _MARGIN_MM, self.surface.length_mm) / pitch_mm[0]
        given = (
            self._state,
            self._maps,
            np.int32(self.surface.height_mm.shape[1]),
            offset.astype(np.float32),
            motion.speed_mm_s.astype(np.float32),
            motion.depth_mm.astype(np.float32),
            self._x,
            self._y,
            self._gap,
            self._weight,
            np.asarray(frame_steps, np.float64),
            _scale_constants(skin, pitch_mm, self.rate_hz),
        )
        if mesh is None:
            advance(*given, frames, sounds)
        else:
            advance_mesh(*given, mesh.neighbour, mesh.coupling, mesh.push, frames, sounds)
        flat = frames.reshape(n_frames, 6, n_nodes)
        if mesh is not None:  # what the kernel knows is the pressure of a node of the lattice
            flat[:, 3:] *= mesh.share.astype(np.float32)
        # Pressure and friction along x and y, each as its sum, and times x, times y.
        arms = np.column_stack([np.ones(n_nodes), skin.rest_mm()]).astype(np.float32)
        pressed, along, across = np.moveaxis(flat[:, 3:] @ arms, 1, 0)
        force = -along[:, 0], across[:, 0], pressed[:, 0]
        torque = pressed[:, 2], pressed[:, 1], along[:, 2] - across[:, 1]
        return SkinResponse(
            np.moveaxis(flat[:, :2], 1, 2),
            flat[:, 2],
            flat[:, 3],
            np.stack([*force, *torque], axis=1) * ([1e-3] * 3 + [1e-6] * 3),
            sounds[:, 0],
            sounds[:, 1],
        )


def _scale_constants(skin: Skin, pitch_mm: tuple[float, float], rate_hz: float) -> Constants:
    per_mass = MN_PER_MG / skin.mass_mg
    frequency = math.sqrt(skin.shear_mn_mm * per_mass)
    values = (
        1 / rate_hz,
        1 / pitch_mm[0],
        1 / pitch_mm[1],
        skin.normal_mn_mm,
        skin.relaxing_share,
        1 - math.exp(-1 / (rate_hz * skin.relaxation_s)),
        skin.shear_mn_mm * per_mass,
        skin.coupling_mn_mm * per_mass,
        2 * skin.damping_ratio * frequency,
        skin.spread_mm / (2 * skin.pitch_mm) * per_mass,
        per_mass,
        skin.bristle_per_mm,
        skin.bristle_damping_s_mm,
    )
    return Constants(*(np.float32(value) for value in values))

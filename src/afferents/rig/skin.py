"""The skin: a lattice of pins, pressed on a drum and dragged along by friction.

Each node is a pin with its share of skin: 19 x 19 in a square lattice, or any others (`mesh`). In
the normal direction it is penetrated by the drum, and a standard linear solid turns penetration
into pressure. In its plane it is a damped mass on a spring, coupled to its neighbours, pushed
outwards where the pressure falls off, and dragged by friction with a bristle model. Stick and slip
are not put in; they come out.

    penetration  d_i = depth - x_i^2 / 2R - y_i^2 / 2R_tip - tilt - recess_i + h(x_i + u_i - s)
    pressure     p_i = k_n max(0, d_i + a (d_i - q_i)),   dq_i/dt = (d_i - q_i) / tau
    bristles     dz/dt = w - s0 |w| z / (m g(x_i)),       w = drum velocity - du_i/dt
    tangential   F_i = p_i (s0 z + s1 dz/dt - grad h)
    motion       m d2u_i/dt2 = F_i - k u_i - c du_i/dt + k_c sum_j (u_j - u_i) - b grad p_i

with s the slide of the drum in mm, h what a nodule feels of the surface, g the surface's grip
there, R the radius of drum and tip together, and sums over the four neighbours. The last term of
F is the slope of the surface, whose normal force does not point straight up. Bristles are those
of Canudas de Wit, Olsson, Astrom & Lischinsky (IEEE Trans. Autom. Control 40:419, 1995), their
friction m alike at rest and at any speed: that of dry rubber rises by tens of percent a decade of
speed at most (Grosch, Proc. R. Soc. A 274:21, 1963; Vorvolakos & Chaudhury, Langmuir 19:6778,
2003). In its plane an elastic layer is at most a third as stiff as in its normal (G / H against
at least 3 G / H), which `shear_mn_mm` over `normal_mn_mm` (1 + `relaxing_share`) is.

`rig.kernel` advances the equations; `SkinOnDrum` gives it what moves the skin on one drum, and
takes what comes out.
"""

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from afferents.rig.kernel import FIRST, N_SIDE, ROW, SPAN, STATES, Constants, advance
from afferents.rig.mesh import Mesh, build_mesh
from afferents.rig.surface import WIDTH_MM, Surface

PHYSICS_RATE_HZ = 8820.0
"""Steps a second: a fifth of the microphone's sample rate, 98 to a frame at 90 fps."""
_OUTERMOST_MM = WIDTH_MM / 2 - 4
"""Pins farther out would leave the drum where it stands off."""
FEWEST_PINS = 4
_TIP = 21
"""There is one fingertip: what its pins are like is drawn from this seed, and no other.

The first whose draw is level at the bumps' wavelengths (x = 2 to 6 mm), so that the tip's own grain
does not look like a pattern.
"""
MN_PER_MG = 1e6
"""1 mN accelerates 1 mg by 1e6 mm/s^2."""
_MARGIN_MM = WIDTH_MM / 2
_NO_CONTACT_MM = 1e3
Floats = NDArray[np.float32]


class Skin(BaseModel):
    """Constants of the skin.

    Attributes
    ----------
    pitch_mm
        Distance of the pins, mm (paper, section 2.1). Where `pins_mm` says where they are, the
        constants are those of a node that has a square of this side for its share.
    pins_mm
        Where the pins stand, mm from the axis, x along the slide; None for the lattice of 19 x 19.
    radius_mm, tip_radius_mm
        Radius of the drum (paper, section 2.2) and of the tip's own curvature, mm.
    footprint_mm
        Diameter of the nodules under every second pin, mm. The paper's have 2 mm.
    nodular, flat_mm
        Whether there are nodules; what the skin bridges where there are none, mm: twice the
        thickness of a sheet of skin and the width of what it rests on.
    recess_mm
        How much less deep pins without a nodule stand, mm.
    bridging_per_mm
        Stiffness of the skin against bending into gaps, see `surface.soft_maximum`.
    pin_depth_mm
        How deep in the gel the pins' inner ends stand, which the camera sees, mm.
    pin_unequal
        How unlike the pins tip, standard deviation of their gain; cast pins differ in length,
        thickness and angle. The tip, and so its gains, is the same in all sessions.
    normal_mn_mm
        Normal stiffness of a node, k_n, mN/mm.
    relaxing_share, relaxation_s
        Share a of the pressure that relaxes, and its time constant tau, s.
    mass_mg
        Of a node.
    shear_mn_mm, coupling_mn_mm
        In-plane stiffness k to the ground and k_c to each neighbour, mN/mm.
    damping_ratio
        Of a node on its ground spring.
    spread_mm
        Outward push b: mm, times the pressure's fall per mm in mN.
    friction
        m, on a smooth surface; see `Surface.friction_factor` and `Surface.grip`.
    bristle_per_mm, bristle_damping_s_mm
        s0 (1/mm) and s1 (s/mm).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    pitch_mm: float = Field(1.2, gt=0)
    # Left out of what is written down where there are none, as sessions always were.
    pins_mm: tuple[tuple[float, float], ...] | None = Field(
        None, min_length=FEWEST_PINS, exclude_if=lambda pins: pins is None
    )
    radius_mm: float = Field(40.0, gt=0)
    tip_radius_mm: float = Field(55.0, gt=0)
    footprint_mm: float = Field(1.5, gt=0)
    nodular: bool = True
    flat_mm: float = Field(4.0, gt=0)
    recess_mm: float = Field(0.35, ge=0)
    bridging_per_mm: float = Field(3.3, gt=0)
    pin_depth_mm: float = Field(3.6, gt=0)
    pin_unequal: float = Field(0.2, ge=0, le=0.3)
    normal_mn_mm: float = Field(1.0, gt=0)
    relaxing_share: float = Field(1.2, ge=0)
    relaxation_s: float = Field(0.048, gt=0)
    mass_mg: float = Field(4.0, gt=0)
    shear_mn_mm: float = Field(0.72, gt=0)
    coupling_mn_mm: float = Field(9.2, ge=0)
    damping_ratio: float = Field(8.0, ge=0)
    spread_mm: float = Field(3.3, ge=0)
    friction: float = Field(0.68, gt=0)
    bristle_per_mm: float = Field(48.0, gt=0)
    bristle_damping_s_mm: float = Field(0.008, ge=0)

    @model_validator(mode="after")
    def _stays_on_the_drum(self) -> Self:
        if self.pins_mm is None and (N_SIDE - 1) * self.pitch_mm > WIDTH_MM - 4:
            raise ValueError(f"the lattice must fit on a drum of {WIDTH_MM:g} mm")
        if self.pins_mm is not None and np.abs(self.pins_mm).max() > _OUTERMOST_MM:
            raise ValueError(f"pins must stand within {_OUTERMOST_MM:g} mm of the axis")
        return self

    @property
    def n_nodes(self) -> int:
        """Pins."""
        return N_SIDE**2 if self.pins_mm is None else len(self.pins_mm)

    @property
    def mesh(self) -> Mesh | None:
        """Neighbours of the pins; None for the lattice."""
        return None if self.pins_mm is None else build_mesh(self.pins_mm, self.pitch_mm)

    def rest_mm(self) -> NDArray[np.float64]:
        """Return the pins at rest: (n_nodes, 2), mm from the axis.

        In the order of `pins_mm`; those of the lattice row by row (y), then x.
        """
        if self.pins_mm is not None:
            return np.array(self.pins_mm)
        place = (np.arange(N_SIDE) - (N_SIDE - 1) / 2) * self.pitch_mm
        y, x = np.meshgrid(place, place, indexing="ij")
        return np.stack([x.ravel(), y.ravel()], axis=1)

    def nodules(self) -> NDArray[np.bool_]:
        """Return which pins stand on a nodule, (n_nodes,).

        None where the skin is flat. Of the lattice every second one, chequered; of other layouts
        all, as on the fingerprint of Cramphorn, Ward-Cherrier & Lepora (Soft Robotics 2017).
        """
        if not self.nodular:
            return np.zeros(self.n_nodes, bool)
        if self.pins_mm is not None:
            return np.ones(self.n_nodes, bool)
        row, column = np.indices((N_SIDE, N_SIDE))
        return np.asarray((row + column).ravel() % 2 == 0)

    def gains(self) -> NDArray[np.float64]:
        """Return how far each pin tips, over the mean, (n_nodes,); within two deviations."""
        drawn = np.random.default_rng(_TIP).standard_normal(self.n_nodes)
        return np.asarray(1 + self.pin_unequal * np.clip(drawn, -2, 2))

    def stiffest_per_s(self, deepest_mm: float) -> float:
        """Return an upper bound of the fastest oscillation, rad/s.

        Ground spring, neighbours swinging against it (four of the lattice: 8 k_c), and the bristles
        of a node pressed `deepest_mm` deep.
        """
        pressure = self.normal_mn_mm * (1 + self.relaxing_share) * deepest_mm
        mesh = self.mesh
        against = 8 if mesh is None else 2 * float(mesh.coupling.sum(axis=1).max())
        stiffness = (
            self.shear_mn_mm + against * self.coupling_mn_mm + self.bristle_per_mm * pressure
        )
        return math.sqrt(stiffness * MN_PER_MG / self.mass_mg)


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
        self._pins = np.arange(nodes)
        if self._mesh is None:
            self._pins = self._pins.reshape(ROW, ROW)[1:-1, 1:-1].ravel()
        # How much later than the middle each node meets the drum, mm.
        x, y = rest.T
        round_ = x**2 / 2 * (1 / skin.radius_mm + 1 / skin.tip_radius_mm) + y**2 / (
            2 * skin.tip_radius_mm
        )
        lower = np.where(skin.nodules(), 0.0, skin.recess_mm if skin.nodular else 0.0)
        gap_mm = np.asarray(round_ + tilt[0] * x + tilt[1] * y + lower)
        self._places = (
            self._lay_out(x + _MARGIN_MM, _MARGIN_MM),
            self._lay_out(y - lateral_mm + _MARGIN_MM, _MARGIN_MM),
            self._lay_out(gap_mm, _NO_CONTACT_MM),
        )
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
        skin, mesh, n_nodes = self.skin, self._mesh, self.skin.n_nodes
        frames = np.zeros((len(frame_steps), 6, n_nodes), np.float32)
        sounds = np.zeros((len(motion.slide_mm), 2))
        pitch_mm = self.surface.pitch_mm
        # Positions on the map, from the edge of the lattice's margin on.
        offset = np.mod(-motion.slide_mm - _MARGIN_MM, self.surface.length_mm) / pitch_mm[0]
        advance(
            self._state,
            self._maps,
            np.int32(self.surface.height_mm.shape[1]),
            tuple(one.astype(np.float32) for one in (offset, motion.speed_mm_s, motion.depth_mm)),
            self._places,
            self._weight,
            self._pins,
            None if mesh is None else (mesh.neighbour, mesh.coupling, mesh.push),
            np.asarray(frame_steps, np.float64),
            _scale_constants(skin, pitch_mm, self.rate_hz),
            frames,
            sounds,
        )
        if mesh is not None:  # what the kernel knows is the pressure of a node of the lattice
            frames[:, 3:] *= mesh.share.astype(np.float32)
        # Pressure and friction along x and y, each as its sum, and times x, times y.
        arms = np.column_stack([np.ones(n_nodes), skin.rest_mm()]).astype(np.float32)
        pressed, along, across = np.moveaxis(frames[:, 3:] @ arms, 1, 0)
        force = -along[:, 0], across[:, 0], pressed[:, 0]
        torque = pressed[:, 2], pressed[:, 1], along[:, 2] - across[:, 1]
        return SkinResponse(
            np.moveaxis(frames[:, :2], 1, 2),
            frames[:, 2],
            frames[:, 3],
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

"""Print every constant of the rig, its value and where it comes from.

python studies/rig_constants.py
"""

from afferents.rig import Rig

SOURCES = {
    "drum.diameter_mm": "paper, 2.2",
    "drum.bump_height_mm": "paper, 2.2",
    "drum.bump_ratio": "chosen to fit the lines of g; Figure 3 prints d, and was not seen",
    "drum.print_sd_mm": "chosen to fit the skirts round the lines of g",
    "drum.prints": "chosen: the session's seed, or --reprint",
    "drum.patch_sd_mm": "chosen",
    "drum.patch_mm": "chosen",
    "drum.grip_sd": "chosen to fit how SA-I of g changes from image to image",
    "drum.grip_mm": "chosen to fit how SA-I of g changes from image to image",
    "skin.pitch_mm": "paper, 2.1",
    "skin.radius_mm": "the drum's (paper, 2.2)",
    "skin.tip_radius_mm": "chosen to fit the size of the dark spot and the crescent in SA-I",
    "skin.footprint_mm": "chosen to fit the weights of k = 1 to 4 in g; the paper has 2 mm",
    "skin.nodular": "paper, 2.1; --nodules off",
    "skin.flat_mm": "chosen: twice the thickness of the skin and what it rests on",
    "skin.recess_mm": "chosen to fit the grain of RA-I",
    "skin.bridging_per_mm": "chosen to fit the weights of k = 1 to 4 in g",
    "skin.pin_depth_mm": "chosen to fit how little of the pattern is in the images",
    "skin.pin_unequal": "chosen to fit how SA-I differs from pin to pin",
    "skin.normal_mn_mm": "chosen: sets the unit of force and nothing else",
    "skin.relaxing_share": "chosen to fit the weights of k = 1 to 4 at different speeds",
    "skin.relaxation_s": "chosen to fit the weights of k = 1 to 4; soft silicones have 20 to 50 ms",
    "skin.mass_mg": "chosen: 1.2 x 1.2 mm of 2.6 mm silicone at 1.07 mg/mm3",
    "skin.shear_mn_mm": "chosen: a third of the normal stiffness, the most of an elastic layer",
    "skin.coupling_mn_mm": "chosen to fit the spatial autocorrelation of SA-I and RA-I",
    "skin.damping_ratio": "chosen to fit RA-I of g: the skin creeps back within 40 ms",
    "skin.spread_mm": "chosen to fit the dark spot in SA-I",
    "skin.friction": "chosen to fit SA-I; alike at all speeds, as dry rubber's is",
    "skin.bristle_per_mm": "chosen: bristles bend 0.02 mm before they slip",
    "skin.bristle_damping_s_mm": "chosen: damps the bristles' own swing",
    "mounting.indentation_mm": "paper, 2.2",
    "mounting.indentation_sd_mm": "chosen: mounted by hand, once a session",
    "mounting.tilt_rad": "chosen: mounted by hand, once a session",
    "mounting.lateral_mm": "chosen: mounted by hand, once a session",
    "mounting.friction_sd": "chosen: one material a session",
    "mounting.friction_change_sd": "chosen: dust",
    "mounting.remount": "chosen: the paper, 2.2, only keeps the depth when drums change",
    "mounting.any_angle": "chosen: the drum stopped anywhere after the run before",
    "mounting.contact_at_rest": "chosen: SA-I fits better so; what the paper did is not said",
    "mounting.camera_mm": "chosen to fit the dark spot in SA-I",
    "mounting.jitter_s": "chosen",
    "mounting.clock_sd_s": "chosen",
    "drive.eccentricity_mm": "chosen to fit how SA-I varies within a recording",
    "drive.ripple": "chosen to fit the width of the lines",
    "drive.motor_ripple": "chosen",
    "drive.drift_mm": "chosen",
    "drive.back_mm": "chosen to fit SA-I's likeness 20 frames later",
    "drive.back_spread": "chosen: anything up to twice as far",
    "microphone.x_mm": "chosen: off to the side, across the slide",
    "microphone.y_mm": "chosen; the paper's is in the rim of a pad 40 mm wide",
    "microphone.depth_mm": "chosen to fit the weights of k = 1 to 4 in g",
    "microphone.shear_share": "chosen to fit the weights of k = 1 to 4 in g",
    "microphone.low_hz": "chosen to fit the loudness of a and g below 8 Hz",
    "microphone.high_hz": "chosen to fit the floor from 60 to 300 Hz",
    "microphone.corner_hz": "chosen to fit g's loudness against speed",
    "microphone.gain_per_mn_s": "chosen so that no drum of the paper's is clipped",
    "microphone.motor": "chosen to fit the smooth drum's loudness",
    "microphone.mains": "chosen: below the lines",
    "microphone.noise": "chosen to fit the floor of the smooth drum",
    "microphone.room_noise": "chosen",
    "camera.width": "paper, 2.1",
    "camera.height": "paper, 2.1",
    "camera.fps_hz": "paper, 2.1",
    "camera.px_per_mm": "chosen so that all pins stay in the picture",
    "camera.roll_deg": "published code: 6.2 degrees",
    "camera.barrel": "chosen",
    "camera.marker_diameter_mm": "published detector: areas of 95 to 180 px2",
    "camera.marker_grey": "chosen",
    "camera.skin_grey": "chosen",
    "camera.blur_px": "chosen",
    "camera.falloff": "chosen",
    "camera.noise_grey": "chosen",
    "camera.marker_noise_px": "chosen to fit RA-I of a: its level, and that pins go their own ways",
    "camera.marker_unequal": "chosen to fit how unlike pins are in RA-I of a",
    "camera.jpeg_quality": "chosen: coding moves a marker by 0.04 px (rms), which its noise hides",
}
"""Where every constant comes from."""


def constants_table() -> str:
    """Return every constant, its value and where it comes from, as markdown."""
    rows = ["| constant | value | source |", "|---|---|---|"]
    constants = {
        f"{section}.{name}": value
        for section, fields in Rig().model_dump().items()
        for name, value in fields.items()
    }
    if set(constants) != set(SOURCES):
        raise SystemExit(f"no source for, or no longer there: {set(constants) ^ set(SOURCES)}")
    rows += [f"| `{name}` | {value} | {SOURCES[name]} |" for name, value in constants.items()]
    return "\n".join(rows)


if __name__ == "__main__":
    print(constants_table())

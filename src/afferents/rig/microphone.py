"""The microphone in the gel: from the forces on the skin to a 16-bit stereo wav.

    heard = band-pass(sum_i w_i (dp_i/dt + share dF_i/dt)) + motor + mains + noise

with pressures p and tangential forces F of the nodes, and weights w that fall off with the
distance from the microphone. The gel passes some 5 to 200 Hz (published spectra: hardly
anything above 300 Hz), and smooths from `corner_hz` on, so that there the forces are heard.
"""

from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.signal import butter, resample_poly, sosfilt

from afferents.errors import InputError

SAMPLE_RATE_HZ = 44100
"""Of the paper's recordings."""
_FULL_SCALE = 32767
_MOTOR_LINES = 8


class RigMicrophone(BaseModel):
    """Where the microphone is and what it passes.

    Attributes
    ----------
    x_mm, y_mm, depth_mm
        Where it sits behind the skin, mm from the axis and mm deep in the gel. The paper's sits in
        the rim of a pad 40 mm wide, farther out than the 12 mm chosen here.
    shear_share
        Loudness of tangential force over pressure.
    low_hz, high_hz
        Band that the gel and the amplifier pass (half power), Hz; first order below, second
        above.
    corner_hz
        Below it the microphone hears how fast the force changes, above it the force itself, Hz.
    gain_per_mn_s
        Full scale 1 per mN/s: set so that no recording of the paper's drums is clipped.
    motor, mains, noise, room_noise
        Line of the drive, 50 Hz mains, and noise of the sensor's and of the room's channel
        (standard deviation or amplitude, of full scale). The motor's lines grow with the square
        of the speed; the strength is that at 100 mm/s.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    x_mm: float = 0.0
    y_mm: float = 12.0
    depth_mm: float = Field(2.7, gt=0)
    shear_share: float = Field(0.24, ge=0)
    low_hz: float = Field(5.4, gt=0)
    high_hz: float = Field(200.0, gt=0)
    corner_hz: float = Field(3.1, gt=0)
    gain_per_mn_s: float = Field(0.08, gt=0)
    motor: float = Field(0.0011, ge=0)
    mains: float = Field(0.00014, ge=0)
    noise: float = Field(0.0043, ge=0)
    room_noise: float = Field(0.003, ge=0)

    def weights(self, rest_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how loudly each node sounds, shape (n_nodes,), sum 1.

        The mean stress, which is what sound is, under a point force on an incompressible
        half-space: h / (r^2 + h^2)^(3/2) (of the stresses in Johnson, Contact Mechanics, 1985,
        equation 3.19).
        """
        off = rest_mm - np.array([self.x_mm, self.y_mm])
        weight = (1 + (off**2).sum(axis=1) / self.depth_mm**2) ** -1.5
        return np.asarray(weight / weight.sum())


def heard(
    pressure_rate: NDArray[np.float64],
    shear_rate: NDArray[np.float64],
    rate_hz: float,
    microphone: RigMicrophone,
) -> NDArray[np.float64]:
    """Return what the gel passes to the microphone, full scale 1, at 44.1 kHz.

    Parameters
    ----------
    pressure_rate, shear_rate
        See `SkinResponse`, mN/s, shape (n_steps,).
    rate_hz
        Steps a second; a whole fraction of 44.1 kHz.
    """
    force = (pressure_rate + microphone.shear_share * shear_rate) * microphone.gain_per_mn_s
    low = butter(1, microphone.low_hz, "highpass", fs=rate_hz, output="sos")
    corner = butter(1, microphone.corner_hz, "lowpass", fs=rate_hz, output="sos")
    high = butter(2, microphone.high_hz, "lowpass", fs=rate_hz, output="sos")
    passed = sosfilt(np.concatenate([low, corner, high]), force)
    return np.asarray(resample_poly(passed, SAMPLE_RATE_HZ, round(rate_hz)))


def disturbances(
    motor_turns: NDArray[np.float64],
    loudness: NDArray[np.float64],
    microphone: RigMicrophone,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return motor, mains and noise of the sensor's channel, full scale 1, shape (n_samples,).

    Parameters
    ----------
    motor_turns
        Turns of the motor at each sample at 44.1 kHz.
    loudness
        Of the motor, that is the speed over 100 mm/s, at each sample.
    """
    time = np.arange(len(motor_turns)) / SAMPLE_RATE_HZ
    phase = rng.uniform(0, 2 * np.pi, _MOTOR_LINES + 1)
    motor = np.zeros(len(time))
    for k in range(1, _MOTOR_LINES + 1):
        motor += np.sin(2 * np.pi * k * motor_turns + phase[k]) / k
    motor *= microphone.motor * loudness**2
    mains = microphone.mains * np.sin(2 * np.pi * 50 * time + phase[0])
    return np.asarray(motor + mains + rng.normal(0, microphone.noise, len(time)))


def write_wav(path: Path, room: NDArray[np.float64], sensor: NDArray[np.float64]) -> None:
    """Write 16-bit stereo: the room, then the sensor (published layout).

    Raises
    ------
    InputError
        If the sensor's channel is louder than full scale.
    """
    loudest = float(np.abs(sensor).max(initial=0))
    if loudest >= 1:
        raise InputError(
            f"{path}: expected a sound within full scale, found {loudest:.2f} of it; lower "
            "gain_per_mn_s"
        )
    stereo = np.rint(np.stack([np.clip(room, -1, 1), sensor], axis=1) * _FULL_SCALE)
    with path.open("wb") as file:
        soundfile.write(file, stereo.astype(np.int16), SAMPLE_RATE_HZ, "PCM_16", format="WAV")

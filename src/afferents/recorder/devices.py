"""The devices of a plan: real ones, or those of a dry run."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from afferents.devices.base import MicrophoneSettings
from afferents.devices.table import CAMERAS, DRIVES, MICROPHONES, device_of
from afferents.errors import InputError
from afferents.recorder import rehearsal
from afferents.recorder.files import LONGEST_BYTES, SAMPLE_BYTES
from afferents.recorder.plan import Clock, Plan
from afferents.recorder.rehearsal import Bench
from afferents.recorder.run import Devices


def devices_of(plan: Plan, path: Path) -> Devices:
    """Return the devices that a plan names, unopened.

    Raises
    ------
    InputError
        If a kind or an option is unknown or wrong, or a speed is outside the drive's limits.
    """
    sound = plan.microphone
    if any(map(_is_simulated, (plan.camera, sound or {}, plan.drive))):
        raise InputError(
            f"{path}: expected real devices, found kind = '{rehearsal.NAME}'; give --dry-run, or "
            "name real ones"
        )
    return Devices(
        device_of(CAMERAS, plan.camera, f"{path}, [camera]"),
        None if sound is None else device_of(MICROPHONES, sound, f"{path}, [microphone]"),
        device_of(DRIVES, plan.drive, f"{path}, [drive]"),
        Clock(),
    )


def simulated_devices(plan: Plan, path: Path, bench: Bench) -> Devices:
    """Return devices of a dry run in place of those that a plan names.

    Tables of the kind ``simulated`` keep their options, with the faults that they ask for; the
    others are checked, and replaced.
    """
    _check_real(plan, path)
    sound = plan.microphone
    return Devices(
        device_of(rehearsal.cameras(bench), _simulated(plan.camera), f"{path}, [camera]"),
        None
        if sound is None
        else device_of(rehearsal.microphones(bench), _simulated(sound), f"{path}, [microphone]"),
        device_of(rehearsal.drives(bench), _simulated(plan.drive), f"{path}, [drive]"),
        bench.clock,
    )


def _check_real(plan: Plan, path: Path) -> None:
    """Check what a plan says of real devices, which a dry run replaces."""
    if not _is_simulated(plan.camera):
        device_of(CAMERAS, plan.camera, f"{path}, [camera]")
    if plan.microphone is not None and not _is_simulated(plan.microphone):
        device_of(MICROPHONES, plan.microphone, f"{path}, [microphone]")
    if not _is_simulated(plan.drive):
        device_of(DRIVES, plan.drive, f"{path}, [drive]")


def _is_simulated(table: Mapping[str, Any]) -> bool:
    return table.get("kind") == rehearsal.NAME


def _simulated(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what a table says of a simulated device; of a real one, that one stands in."""
    return table if _is_simulated(table) else {"kind": rehearsal.NAME}


def _check_sound(settings: MicrophoneSettings, plan: Plan, path: Path) -> None:
    """Refuse a channel that is not there, and runs longer than a wav can be."""
    channel = plan.sensor_channel
    if channel is not None and channel >= settings.channels:
        raise InputError(
            f"{path}: expected sensor_channel below {settings.channels}, as the microphone has "
            f"channels, found {channel}"
        )
    longest_s = LONGEST_BYTES / (settings.rate_hz * settings.channels * SAMPLE_BYTES)
    if plan.total_s > longest_s:
        raise InputError(
            f"{path}: expected runs of at most {longest_s / 3600:.1f} h, as long as a wav of this "
            f"sound can be, found {plan.total_s / 3600:.1f} h; take shorter runs and more "
            "repetitions"
        )


@contextmanager
def opened(devices: Devices, plan: Plan, path: Path) -> Iterator[Devices]:
    """Open the devices, and let them go whatever happens; the drive stops first.

    Raises
    ------
    InputError
        If one can't be opened or set, or a speed is outside the drive's limits, or the plan wants
        a channel that is not there or runs longer than a wav can be.
    """
    with ExitStack() as stack:
        stack.enter_context(devices.camera)
        if devices.microphone is not None:
            stack.enter_context(devices.microphone)
            _check_sound(devices.microphone.settings, plan, path)
        stack.enter_context(devices.drive)
        limits = devices.drive.limits
        for speed in plan.speeds_mm_s:
            if not limits.lowest_mm_s <= speed <= limits.highest_mm_s:
                raise InputError(
                    f"{path}: expected speeds from {limits.lowest_mm_s:g} to "
                    f"{limits.highest_mm_s:g} mm/s, as the drive can hold, found {speed:g}"
                )
        yield devices

"""The command that lists what can be recorded with."""

from dataclasses import asdict

from rich.table import Table

from afferents.cli.printing import say
from afferents.cli.shared import Json


def devices(as_json: Json = False) -> None:
    """List cameras with their formats and rates, microphones, serial ports and drives."""
    from afferents.devices import find_devices

    found = find_devices()
    table = Table(show_header=False, box=None)
    for camera in found.cameras:
        table.add_row("camera", camera.device, camera.name)
        for mode in camera.modes:
            rates = ", ".join(f"{rate:g}" for rate in mode.fps_hz)
            table.add_row("", "", f"{mode.format} {mode.width} x {mode.height} at {rates}")
    for one in found.microphones:
        what = f"{one.name}: {one.channels} channel(s), {one.rate_hz:g} Hz"
        table.add_row("microphone", one.device, what)
    for port in found.ports:
        table.add_row("serial port", port.port, port.name)
    for drive in found.drives:
        table.add_row("kind of drive", drive, "")
    absent = [
        f"No {name}."
        for name, there in (
            ("camera", found.cameras),
            ("microphone", found.microphones),
            ("serial port", found.ports),
        )
        if not there and not any(note.startswith(name) for note in found.notes)
    ]
    say(as_json, asdict(found), table, *absent, *found.notes)

"""The microphone through PortAudio itself: a tone played into PulseAudio's null sink is heard.

The server is the test's own: its folder, its socket, its ALSA settings. It needs no user's session,
no D-Bus and no sound card, and runs as root in a container too.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path

import numpy as np
import pytest
import soundfile
from simulated_drum import until

from afferents.recordings.run_log import BlockRow
from afferents.recordings.sound_clock import sound_clock

pytestmark = pytest.mark.system

RATE_HZ, TONE_HZ, SECONDS = 44_100, 1234.0, 1.0
NEEDED = ("pulseaudio", "pactl", "paplay")
REQUIRED = "AFFERENTS_REQUIRE_SOUND_SERVER"
ALSA = Path("/usr/share/alsa/alsa.conf")
PLUGIN = "alsa-lib/libasound_module_pcm_pulse.so"
TO_PULSE = "pcm.!default { type pulse }\nctl.!default { type pulse }\n"

HEAR = """
import sys
import numpy as np
from afferents.lab.devices import MICROPHONES, make_device

times, parts, bad = [], [], 0
table = {"kind": "portaudio", "rate_hz": 44100.0, "channels": 2}
with make_device(MICROPHONES, table, "[microphone]") as microphone:
    settings = microphone.settings
    for block in microphone.blocks():
        times.append(block.time_s)
        parts.append(block.samples)
        bad += block.overflowed
        if sum(map(len, parts)) >= float(sys.argv[2]) * 44100:
            microphone.end()
np.savez(sys.argv[1], time_s=times, lengths=[*map(len, parts)], samples=np.concatenate(parts),
         overflows=bad, rate_hz=settings.rate_hz)
"""


def missing():
    """Return what is not there of what the test needs."""
    there = any(Path("/usr/lib").glob(f"*/{PLUGIN}")) or (Path("/usr/lib") / PLUGIN).is_file()
    found = {name: shutil.which(name) for name in NEEDED}
    found |= {"ALSA's plugin for PulseAudio": there and ALSA.is_file()}
    found |= {"PortAudio": find_library("portaudio")}
    found |= {"sounddevice": importlib.util.find_spec("sounddevice")}
    return ", ".join(name for name, where in found.items() if not where)


@pytest.fixture
def sink(tmp_path_factory):
    """The environment in which ALSA's only device is the monitor of a null sink."""
    if lacking := missing():
        if os.environ.get(REQUIRED):
            pytest.fail(f"no {lacking} on this machine, and {REQUIRED} is set")
        packages = "pulseaudio pulseaudio-utils libasound2-plugins libportaudio2"
        pytest.skip(f"no {lacking} on this machine: apt-get install {packages}")
    folder = tmp_path_factory.mktemp("pulse")
    socket, home = folder / "native", folder / "home"
    home.mkdir()
    (folder / "asound.conf").write_text(TO_PULSE)
    own = {"HOME": home, "XDG_RUNTIME_DIR": folder, "PULSE_SERVER": f"unix:{socket}"}
    own |= {"ALSA_CONFIG_PATH": f"{ALSA}:{folder / 'asound.conf'}", "PULSE_LATENCY_MSEC": 30}
    environment = {**os.environ, **{key: str(value) for key, value in own.items()}}
    modules = (
        f"module-native-protocol-unix auth-anonymous=1 socket={socket}",
        f"module-null-sink sink_name=gel rate={RATE_HZ} channels=2",
    )
    options = ["-n", "--daemonize=no", "--system=false", "--use-pid-file=no"]
    options += ["--exit-idle-time=-1"]
    options += [part for module in modules for part in ("-L", module)]
    with (folder / "log").open("w") as log:
        server = subprocess.Popen(
            ["pulseaudio", *options], env=environment, stdin=subprocess.DEVNULL,
            stdout=log, stderr=log,
        )  # fmt: skip
    try:
        assert until(lambda: told(environment, "info")), (folder / "log").read_text()
        yield environment
    finally:
        server.kill()
        server.wait()


def told(environment, *asked):
    """Return what the server says, nothing if it does not answer."""
    answer = subprocess.run(["pactl", *asked], env=environment, capture_output=True)
    return answer.stdout.strip() if answer.returncode == 0 else b""


def test_a_tone_played_is_the_tone_recorded(sink, tmp_path):
    at = np.arange(round(60 * RATE_HZ)) / RATE_HZ
    tone = 0.5 * np.sin(2 * np.pi * TONE_HZ * at)
    soundfile.write(tmp_path / "tone.wav", np.stack([0.2 * tone, tone], axis=1), RATE_HZ)
    # The player keeps seconds in hand: on a busy machine the tone is not to break off.
    player = ["paplay", "--device=gel", "--latency-msec=2000", tmp_path / "tone.wav"]
    playing = subprocess.Popen(player, env={**sink, "PULSE_LATENCY_MSEC": "2000"})
    try:
        assert until(lambda: told(sink, "list", "short", "sink-inputs"))
        command = [sys.executable, "-c", HEAR, tmp_path / "heard.npz", str(SECONDS + 0.5)]
        subprocess.run(command, env=sink, check=True, timeout=120, capture_output=True)
    finally:
        playing.kill()
        playing.wait()
    with np.load(tmp_path / "heard.npz") as heard:
        said = {name: heard[name] for name in heard.files}
    assert (said["rate_hz"], said["overflows"]) == (RATE_HZ, 0)
    assert set(said["lengths"].tolist()) == {441}
    # A sound server stamps single blocks to tens of milliseconds. A straight line through the first
    # of them says when the sound began, nearly as that through all does: within a millisecond on a
    # quiet machine, and within 50 on one whose processors are all busy.
    first = np.cumsum([0, *said["lengths"][:-1]])
    rows = [BlockRow(t, int(n), 441, False) for t, n in zip(said["time_s"], first, strict=True)]
    begun_s = [sound_clock(rows[:n], RATE_HZ).start_s for n in (60, len(rows))]
    assert begun_s[0] == pytest.approx(begun_s[1], abs=0.3)
    sound = said["samples"][-round(SECONDS * RATE_HZ) :].astype(float)
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound))[:, None], axis=0))
    hz = np.fft.rfftfreq(len(sound), 1 / RATE_HZ)
    assert hz[spectrum.argmax(axis=0)] == pytest.approx(TONE_HZ, abs=1)
    # The tone is all there is (a lost block would break it off), the second channel five times as
    # loud, at the level it was played.
    near = np.abs(hz - TONE_HZ) < 5
    assert ((spectrum[near] ** 2).sum(axis=0) > 0.99 * (spectrum**2).sum(axis=0)).all()
    assert sound.std(axis=0) == pytest.approx(32767 * np.array([0.1, 0.5]) / 2**0.5, rel=0.05)

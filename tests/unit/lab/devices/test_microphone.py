"""The microphone against a PortAudio that is none: times, overflows, and one that vanishes."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.lab.devices import MICROPHONES, DeviceError, PortAudioMicrophone, make_device
from afferents.lab.devices.base import Block
from afferents.lab.live import Microphone, Sound, Trouble

LATENCY_S = 0.012


class PortAudio:
    """As much of `sounddevice` as is used; its clock began 1000 s before ours."""

    PortAudioError = RuntimeError

    def __init__(self, clock=True, most_channels=2):
        self.clock, self.opened, self.started_anew = clock, [], 0
        self.most_channels = most_channels

    def query_devices(self, device=None):
        there = [{"name": "Gel microphone", "max_input_channels": 2}]
        return there if device is None else there[0]

    def _terminate(self):
        self.started_anew += 1

    def _initialize(self):
        pass

    def InputStream(  # noqa: N802  # as sounddevice calls it
        self, *, samplerate, device, channels, blocksize, dtype, callback
    ):
        assert dtype == "int16"
        if samplerate == 48_000:
            raise self.PortAudioError("Invalid sample rate")
        if channels > self.most_channels:
            raise self.PortAudioError("Invalid number of channels")
        stream = SimpleNamespace(
            device=device or 0, samplerate=samplerate, channels=channels, start=lambda: None, n=0,
            close=lambda: None,
        )  # fmt: skip

        def give(overflow=False):
            """One block, as PortAudio's thread would give it."""
            numbers = stream.n + np.arange(blocksize, dtype=np.int16)
            samples = np.repeat(numbers[:, None], channels, axis=1)
            stream.n += blocksize
            stream.taken_s = time.monotonic() - LATENCY_S
            now = stream.taken_s + LATENCY_S + 1000 if self.clock else 0.0
            times = SimpleNamespace(
                inputBufferAdcTime=now - LATENCY_S if self.clock else 0.0, currentTime=now
            )
            callback(samples, blocksize, times, SimpleNamespace(input_overflow=overflow))

        stream.give = give
        self.opened.append(stream)
        return stream


@pytest.fixture
def opened(monkeypatch):
    """Open a microphone of a PortAudio, and return it and the stream behind it."""

    def opened(portaudio, **options):
        monkeypatch.setattr("afferents.lab.devices.portaudio.import_portaudio", lambda: portaudio)
        usual = {"block_s": 0.01, "rate_hz": 10_000.0, "settle_s": 0.0}
        microphone = PortAudioMicrophone(PortAudioMicrophone.Options(**usual | options))
        microphone.open()
        return microphone, portaudio.opened[-1]

    return opened


def taken(microphone, give, n):
    """The first n blocks, given from another thread."""
    threading.Timer(0.2, give).start()  # when it is listened to
    blocks = []
    for block in microphone.blocks():
        blocks.append(block)
        if len(blocks) == n:
            microphone.end()
    return blocks


@pytest.mark.system  # in real time
def test_blocks_carry_the_converter_s_time_on_our_clock(opened):
    microphone, stream = opened(PortAudio())
    truth = []

    def give():
        for _ in range(20):
            stream.give()
            truth.append(stream.taken_s)
            time.sleep(0.002)

    blocks = taken(microphone, give, 20)
    # The quickest of ten arrivals tells, not one that a busy machine was late for.
    np.testing.assert_allclose([b.time_s for b in blocks[10:]], truth[10:], atol=2e-3)
    np.testing.assert_array_equal(np.concatenate([b.samples for b in blocks])[:, 1], range(2000))
    assert blocks[0].samples.dtype == np.int16
    assert microphone.settings.name == "Gel microphone"
    assert (microphone.settings.rate_hz, microphone.settings.channels) == (10_000, 2)
    assert not any(b.overflowed for b in blocks)
    microphone.close()


def test_what_is_heard_just_after_opening_is_thrown_away(opened):
    microphone, stream = opened(PortAudio(), settle_s=0.3)
    stream.give()
    stream.give()
    over = threading.Event()

    def give():
        while not over.wait(0.01):
            stream.give()

    (block,) = taken(microphone, give, 1)
    over.set()
    assert block.samples[0, 0] >= 200


def test_what_was_lost_before_anybody_listened_is_no_loss(opened):
    microphone, stream = opened(PortAudio(), buffer_s=0.1, block_s=0.025)
    for _ in range(6):  # four fit: somebody changes the drum
        stream.give()
    (block,) = taken(microphone, stream.give, 1)
    assert not block.overflowed


def test_a_converter_without_a_clock_is_counted(opened):
    microphone, stream = opened(PortAudio(clock=False))
    blocks = taken(microphone, lambda: [stream.give() for _ in range(10)], 10)
    np.testing.assert_allclose(np.diff([b.time_s for b in blocks]), 0.01)


def test_what_the_card_loses_is_said_of_the_block_after_it(opened):
    microphone, stream = opened(PortAudio())
    blocks = taken(microphone, lambda: [stream.give(n == 3) for n in range(6)], 6)
    assert [b.overflowed for b in blocks] == [False] * 3 + [True] + [False] * 2


def test_a_writer_that_is_slow_loses_whole_blocks_and_knows_of_it(opened):
    microphone, stream = opened(PortAudio(), buffer_s=0.1, block_s=0.025)
    threading.Timer(0.2, stream.give).start()
    blocks = microphone.blocks()
    held = [next(blocks)]
    for _ in range(6):  # four fit
        stream.give()
    held += [next(blocks) for _ in range(4)]
    stream.give()
    held.append(next(blocks))
    assert [b.samples[0, 0] // 250 for b in held] == [0, 1, 2, 3, 4, 7]
    assert [b.overflowed for b in held] == [False] * 5 + [True]


def test_one_that_gives_nothing_is_lost(opened, monkeypatch):
    monkeypatch.setattr("afferents.lab.devices.portaudio.SILENT_S", 0.2)
    microphone, _ = opened(PortAudio())
    with pytest.raises(DeviceError, match=r"lost \(it gives no sound\)"):
        next(microphone.blocks())


def test_a_rate_that_it_has_not_is_refused(opened):
    with pytest.raises(InputError, match=r"48000 Hz with 2 channel.*there are: Gel microphone"):
        opened(PortAudio(), rate_hz=48_000.0)
    with pytest.raises(InputError, match=r"kind = one of portaudio, found 'alsa'"):
        make_device(MICROPHONES, {"kind": "alsa"}, "[microphone]")


@pytest.mark.parametrize("has", [1, 2])
def test_live_hears_the_last_channel_of_two_or_the_only_one(monkeypatch, has):
    portaudio = PortAudio(most_channels=has)
    monkeypatch.setattr("afferents.lab.devices.portaudio.import_portaudio", lambda: portaudio)
    live = Microphone("default", 10_000)
    (stream,) = portaudio.opened
    assert stream.channels == has
    samples = np.stack([np.full(100, 16384, np.int16), np.zeros(100, np.int16)], axis=1)[:, -has:]
    monkeypatch.setattr(live._source, "blocks", lambda: iter([Block(0.0, samples, False)]))
    (heard,) = live._take()
    np.testing.assert_array_equal(heard.samples, np.zeros((100, 1), np.float32))
    live.close()


def test_live_hears_by_the_same_source(monkeypatch):
    monkeypatch.setattr("afferents.lab.devices.portaudio.SILENT_S", 1.0)
    monkeypatch.setattr("afferents.lab.live.sensors.AGAIN_S", 0.01)
    portaudio = PortAudio()
    monkeypatch.setattr("afferents.lab.devices.portaudio.import_portaudio", lambda: portaudio)
    options = PortAudioMicrophone.Options(rate_hz=10_000.0, channels=1, settle_s=0.0)
    live = Microphone("default", 10_000, 1, PortAudioMicrophone(options))

    def give(stream):
        return lambda: [stream.give(n == 2) for n in range(4)]

    def give_until_closed():
        while not over.wait(0.02):
            portaudio.opened[-1].give()

    threading.Timer(0.3, give(portaudio.opened[0])).start()
    heard, said, over = [], [], threading.Event()
    for event in live.events():
        if isinstance(event, Trouble):
            said.append(event.what)
            if "no sound" in event.what:  # it opens again, and gives as before
                threading.Thread(target=give_until_closed).start()
        elif isinstance(event, Sound):
            heard.append(event)
            if len(heard) == 8:
                live.close()
                over.set()
    assert portaudio.started_anew == 1
    assert "overrun" in said[0]
    assert "no sound" in said[1]
    assert heard[0].samples.dtype == np.float32
    np.testing.assert_allclose(heard[1].samples[:, 0], np.arange(100, 200) / 32768)

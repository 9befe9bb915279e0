"""The page and the command line, as programs and as people meet them."""

import json
import os
import shutil
import signal
import socket
import time
import urllib.error
import urllib.request

import cv2
import numpy as np
import pytest
import soundfile
import torch
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.sync.client import connect

from afferents.models.card import CARD, WEIGHTS
from afferents.models.classifiers import build
from afferents.models.export import export
from afferents.models.folder import Deployed, save_weights

from .conftest import LIVE

pytestmark = pytest.mark.system

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SECONDS = 15
PATIENCE_S = 60
"""Nothing here should take a tenth of it, on a machine that has nothing else to do."""
SHAKE = np.sin(2 * np.pi * np.arange(20) / 20)


@pytest.fixture(scope="module")
def recording(make_video, tmp_path_factory):
    """A touch of some seconds: rest, then a pull and a shake; a hum with harmonics."""
    folder = tmp_path_factory.mktemp("recording")
    n = np.arange(90 * SECONDS)
    make_video(
        folder / "video.mp4", 4 * np.clip((n - 10) / 4, 0, 1) + SHAKE[n % len(SHAKE)] * (n > 10)
    )
    time_s = np.arange(8000 * SECONDS) / 8000
    hum = sum(0.2 / k * np.sin(2 * np.pi * 20 * k * time_s) for k in (1, 2, 3))
    hum += 0.002 * np.random.default_rng(0).normal(size=len(hum))
    soundfile.write(folder / "audio.wav", np.stack([0 * hum, hum], axis=1), 8000)
    return folder


class Running:
    """`afferents live --web` in a process of its own."""

    def __init__(self, launch, recording, *arguments, files=None):
        command = ["live", "--web", "--port", "0", *arguments]
        sources = ["--video", f"replay:{recording}", "--audio", f"replay:{recording}"]
        self.process = launch([*command, *sources], imports=LIVE, files=files)
        said = iter(self.process.stderr.readline, "")
        page = next(line for line in said if line.startswith("Page: "))
        self.url = page.removeprefix("Page: ").strip()

    def socket(self, query="", **options):
        address = self.url.replace("http", "ws", 1).split("?")[0].rstrip("/")
        return connect(f"{address}/feel{query}", max_size=None, close_timeout=1, **options)

    def stop(self):
        self.process.terminate()
        self.process.wait(PATIENCE_S)


@pytest.fixture(scope="module")
def running(launch, recording, models):
    page = Running(launch, recording, "--model", models["sa-se"], "--model", models["vib-te-aug"])
    yield page
    page.stop()


def states(visitor, enough):
    """What comes until `enough` is true of it: states and pictures."""
    found, pictures, end_s = [], [], time.monotonic() + PATIENCE_S
    while not enough(found, pictures):
        assert time.monotonic() < end_s, f"it did not come to that: {found[-1:]}"
        message = visitor.recv(timeout=PATIENCE_S)
        if isinstance(message, bytes):
            pictures.append(message)
        elif (message := json.loads(message))["type"] == "state":
            found.append(message)
    return found, pictures


def several(found, _):
    """Tell whether states keep coming."""
    return len(found) > 10


def fresh(state):
    """Return the models that feel something now."""
    return {percept["model"] for percept in state["percepts"] if percept["fresh"]}


def felt_and_heard(found, pictures):
    """Tell whether both models felt, and a picture and a whole second of sound came."""
    models = set().union(*map(fresh, found[-10:]))
    heard = [state["audio"] for state in found if (state["audio"] or {}).get("amplitude")]
    return pictures and models == {"sa-se", "vib-te-aug"} and heard and "sa1" in found[-1]["video"]


def test_a_visitor_gets_models_states_and_pictures(running):
    with running.socket() as visitor:
        hello = json.loads(visitor.recv(timeout=PATIENCE_S))
        assert [m["model"] for m in hello["models"]] == ["sa-se", "vib-te-aug"]
        assert hello["models"][0]["textures"] == ["1", "2", "3"]
        found, pictures = states(visitor, felt_and_heard)
    # Not always: a busy processor is late for some.
    images = [p for state in found for p in state["percepts"] if p["model"] == "sa-se"]
    felt = next(p for p in reversed(images) if p["fresh"])
    assert sum(felt["probabilities"].values()) == pytest.approx(1)
    assert np.array(found[-1]["video"]["sa1"]).shape == (19, 19)
    assert len(found[-1]["video"]["markers"]) == 361
    spectrum = next(s["audio"] for s in reversed(found) if (s["audio"] or {}).get("amplitude"))
    assert np.argmax(spectrum["amplitude"]) * spectrum["step_hz"] == pytest.approx(20)
    image = cv2.imdecode(np.frombuffer(pictures[-1], np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image.shape == (480, 640)


def test_rubbish_a_second_and_a_slow_visitor_harm_nobody(running):
    with running.socket() as good, running.socket() as rude, running.socket() as slow:
        rude.send("{]" * 1000)
        rude.send(bytes(range(256)) * 100)
        rude.send(json.dumps({"type": "hello", "models": None}))
        states(good, several)
        states(rude, lambda found, _: found)
        with running.socket() as loud:
            loud.send("x" * (1 << 20))
            with pytest.raises(ConnectionClosed):
                states(loud, lambda *_: False)
        states(good, several)
        assert slow.recv(timeout=PATIENCE_S)


def test_a_crowd_takes_neither_the_stream_nor_the_terminal(launch, recording, models):
    """120 connections that ask for nothing, where a process may open 64 files."""
    running = Running(launch, recording, "--model", models["sa-se"], files=64)
    try:
        address = running.url.removeprefix("http://").split(":")
        crowd = [socket.create_connection(address, timeout=PATIENCE_S) for _ in range(120)]
        end_s = time.monotonic() + PATIENCE_S
        while True:  # until those who had a place have lost it
            try:
                assert status_of(running.url) == 200
                with running.socket() as good:
                    states(good, lambda found, _: found and found[-1]["percepts"])
                break
            except (OSError, AssertionError, WebSocketException):
                assert time.monotonic() < end_s
                time.sleep(0.5)
        assert running.process.poll() is None
        for visitor in crowd:
            visitor.close()
        running.process.send_signal(signal.SIGINT)
        assert running.process.wait(PATIENCE_S) == 130
        assert running.process.stderr.read().count("\n") <= 2
    finally:
        running.process.kill()


def status_of(url, host=None):
    request = urllib.request.Request(url, headers={"Host": host} if host else {})
    try:
        return urllib.request.urlopen(request, timeout=PATIENCE_S).status
    except urllib.error.HTTPError as error:
        return error.code


def test_pages_of_others_are_sent_away(running):
    assert status_of(running.url) == 200
    assert status_of(f"{running.url}/page/live.js") == 200
    assert status_of(f"{running.url}/page/../server.py") == 404
    assert status_of(running.url, host="evil.example") == 400
    with pytest.raises(InvalidStatus), running.socket(origin="http://evil.example"):
        pass


def test_another_address_asks_for_a_token(run, launch, recording, models):
    asked = ("live", "--model", models["sa-se"], "--video", f"replay:{recording}", "--web")
    code, _, said = run(*asked, "--host", "0.0.0.0", "--port", 0)
    assert code == 2
    assert "--host: expected this machine's own address without --token, found 0.0.0.0" in said
    code, _, said = run(*asked, "--token", "short")
    assert (code, "at least 8 characters" in said) == (2, True)
    word = "correct-horse"
    page = Running(
        launch, recording, "--model", models["sa-se"], "--host", "0.0.0.0", "--token", word
    )
    try:
        base = page.url.split("/?")[0].replace("0.0.0.0", "127.0.0.1")
        assert page.url.endswith(f"?token={word}")
        assert (status_of(base), status_of(f"{base}/?token={word}")) == (403, 200)
        with pytest.raises(InvalidStatus), page.socket("?token=wrong-word"):
            pass
        with page.socket(f"?token={word}") as visitor:
            assert json.loads(visitor.recv(timeout=PATIENCE_S))["type"] == "hello"
    finally:
        page.stop()


def test_a_port_that_is_taken(run, recording, models):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, said = run(
            "live", "--model", models["sa-se"], "--video", f"replay:{recording}", "--web",
            "--port", port,
        )  # fmt: skip
    assert code == 2
    assert f"--port {port}: expected an address of this machine that is free" in said


def test_json_lines_and_the_terminal(run, session, sounds, models):
    code, out, _ = run(
        "live", "--model", models["ra-ste"], "--model", models["vib-te-aug"], "--json",
        "--speed", "max", "--video", f"replay:{session}/2/40", "--audio", f"replay:{sounds}/2/40",
    )  # fmt: skip
    assert code == 0
    percepts = [json.loads(line) for line in out.splitlines()]
    assert [p["model"] for p in percepts].count("ra-ste") == 25
    assert [p["model"] for p in percepts].count("vib-te-aug") == 5
    assert all(p["fresh"] for p in percepts)
    code, out, _ = run("live", "--model", models["ra-ste"], "--video", f"replay:{session}/2/40")
    assert code == 0
    assert "ra-ste" in out


@pytest.fixture(scope="module")
def browser():
    if CHROMIUM is None:
        if os.environ.get("AFFERENTS_REQUIRE_BROWSER"):
            pytest.fail("no chromium on this machine, and AFFERENTS_REQUIRE_BROWSER is set")
        pytest.skip("no chromium on this machine: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


def visit(browser, url):
    page = browser.new_page(viewport={"width": 1280, "height": 1100})
    page.set_default_timeout(PATIENCE_S * 1000)
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.on("console", lambda m: page.faults.append(m.text) if m.type == "error" else None)
    page.goto(url)
    return page


def says(page, place, *words):
    """Wait until what stands in a place of the page holds all words."""
    page.wait_for_function(
        """([place, words]) => {
          const there = [...document.querySelectorAll(place)].map((e) => e.textContent).join("; ");
          return words.every((word) => there.includes(word));
        }""",
        arg=[place, words],
    )


def test_the_page_in_a_browser(launch, browser, recording, models, tmp_path):
    running = Running(
        launch, recording, "--model", models["sa-se"], "--model", models["vib-te-aug"]
    )
    try:
        page = visit(browser, running.url)
        felt = page.locator("article").nth(0).locator(".felt")
        page.wait_for_function(
            "['1', '2', '3'].includes(document.querySelector('.felt')?.dataset.felt)"
        )
        says(page, "#comb", "20.0 Hz")
        says(page, "#link", "live")
        assert page.locator("article h2").all_text_contents() == ["SA-SE", "vib-TE augmented"]
        says(page, "#frames", "frames/s")
        page.wait_for_function("document.querySelector('.counts').textContent")
        page.screenshot(path=tmp_path / "page.png")
        picture = cv2.imread(str(tmp_path / "page.png"))
        assert picture.shape == (1100, 1280, 3)
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500
        page.keyboard.press("m")
        page.wait_for_selector("#mark[aria-pressed=false]")
        page.keyboard.press("Space")
        page.wait_for_selector("#pause[aria-pressed=true]")
        latency = page.locator(".counts").nth(0)
        held = latency.text_content()
        time.sleep(0.5)
        assert latency.text_content() == held
        page.keyboard.press("Space")
        page.wait_for_function(
            "held => document.querySelector('.counts').textContent !== held", arg=held
        )
        running.stop()
        says(page, "#link", "lost")
        page.wait_for_selector("article.stale")
        assert felt.text_content()
        assert [fault for fault in page.faults if "ERR_CONNECTION" not in fault] == []
        page.close()
    finally:
        running.stop()


def test_the_page_of_who_only_looks(launch, browser, recording, tmp_path):
    """On a wide screen and on a telephone's: nothing of models, nothing beyond the edge."""
    running = Running(launch, recording)
    try:
        for width, height in ((1280, 900), (390, 844)):
            page = visit(browser, running.url)
            page.set_viewport_size({"width": width, "height": height})
            says(page, "#comb", "20.0 Hz")
            says(page, "#quality", "361 of 361", "frames/s", "dBFS", "clipped")
            says(page, "#sensor", "361 bright markers were found")
            says(page, "#fired", "SA ", "RA ", "PC ")
            says(page, "#title", "What the sensor shows")
            page.wait_for_selector("#models", state="hidden")
            says(page, "#ra1-scale", "px")
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            page.screenshot(path=tmp_path / f"{width}.png", full_page=True)
            assert page.faults == []
            page.close()
    finally:
        running.stop()


@pytest.fixture(scope="module")
def hundred(models, tmp_path_factory):
    """A model of a hundred textures that has learnt nothing."""
    folder = tmp_path_factory.mktemp("hundred") / "m"
    folder.mkdir()
    known = models["vib-te-aug"].with_suffix("")
    card = json.loads((known / CARD).read_text())
    card["textures"] = [f"cloth {i}" for i in range(100)]
    (folder / CARD).write_text(json.dumps(card))
    network = build("vibration-net", 100, (1, 200), seed=1)
    deployed = Deployed(network, 100, card["scale"])
    deployed.limit = torch.tensor(1e9)
    save_weights(deployed, folder / WEIGHTS)
    export(folder, folder / "m.onnx")
    return folder / "m.onnx"


def test_the_page_with_a_hundred_textures(launch, browser, recording, hundred):
    running = Running(launch, recording, "--model", hundred)
    try:
        page = visit(browser, running.url)
        page.wait_for_function("document.querySelector('.felt')?.dataset.felt?.startsWith('cloth')")
        page.wait_for_function("document.querySelectorAll('.bars .track').length === 20")
        page.get_by_role("button", name="All 100").click()
        page.wait_for_function("document.querySelectorAll('.bars .track').length === 100")
        page.wait_for_selector("#camera", state="hidden")
        assert page.faults == []
        page.close()
    finally:
        running.stop()

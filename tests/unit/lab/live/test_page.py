"""The page and the command line, as programs and as people meet them."""

import json
import signal
import socket
import time
import urllib.error
import urllib.request

import cv2
import numpy as np
import pytest
import soundfile
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from .conftest import LIVE

pytestmark = pytest.mark.system

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

    def __init__(self, launch, recording, *arguments, sources=None):
        sources = sources or ["--video", f"replay:{recording}", "--audio", f"replay:{recording}"]
        self.begin(launch, ["live", "--web", *arguments, *sources], imports=LIVE)

    def begin(self, launch, command, **how):
        self.process = launch([*command, "--port", "0"], **how)
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
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, said = run(*asked, "--port", port)
    assert code == 2
    assert f"--port {port}: expected an address of this machine that is free" in said
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


def test_json_lines_and_the_terminal(does, session, sounds, models):
    lines = does(
        "live", "--model", models["ra-ste"], "--model", models["vib-te-aug"], "--json",
        "--speed", "max", "--video", f"replay:{session}/2/40", "--audio", f"replay:{sounds}/2/40",
    )  # fmt: skip
    said = [json.loads(line)["model"] for line in lines.splitlines()]
    assert (said.count("ra-ste"), said.count("vib-te-aug")) == (26, 5)  # one at rest
    asked = ("--model", models["ra-ste"], "--video", f"replay:{session}/2/40")
    assert "ra-ste" in does("live", *asked)


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
    slowly = "--speed", "0.2"  # which a busy machine, too, keeps up with
    both = "--model", models["sa-se"], "--model", models["vib-te-aug"]
    running = Running(launch, recording, *slowly, *both)
    try:
        page = visit(browser, running.url)
        page.wait_for_function(
            "['1', '2', '3'].includes(document.querySelector('.felt')?.dataset.felt)"
        )
        says(page, "#comb", "20.0 Hz")
        assert page.locator("article h2").all_text_contents() == ["SA-SE", "vib-TE augmented"]
        says(page, "#frames", "frames/s")
        page.wait_for_function("document.querySelector('.counts').textContent")
        page.screenshot(path=tmp_path / "page.png")
        picture = cv2.imread(str(tmp_path / "page.png"))
        assert picture.shape == (1100, 1280, 3)
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500
        page.keyboard.press("m")
        page.wait_for_selector("#mark[aria-pressed=false]")
        assert page.faults == []
        page.close()
    finally:
        running.stop()


def test_a_page_is_held_goes_on_and_says_what_is_lost(launch, browser, models):
    running = Running(launch, None, "--model", models["sa-se"], sources=["--video", "rig"])
    try:
        page = visit(browser, running.url)
        says(page, "#link", "live")
        page.wait_for_function("document.querySelector('.counts').textContent")
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
        assert page.locator(".felt").text_content()
        assert [fault for fault in page.faults if "ERR_CONNECTION" not in fault] == []
        page.close()
    finally:
        running.stop()


def test_the_page_of_who_only_looks(launch, browser, recording):
    running = Running(launch, recording)
    try:
        page = visit(browser, running.url)
        says(page, "#comb", "20.0 Hz")
        says(page, "#quality", "361 of 361", "frames/s", "dBFS", "clipped")
        says(page, "#sensor", "361 bright markers were found")
        says(page, "#fired", "SA ", "RA ", "PC ")
        page.wait_for_selector("#models", state="hidden")
        says(page, "#ra1-scale", "px")
        page.get_by_role("button", name="Set rest").click()
        says(page, "#quality", "rest was")  # set or, as the skin moves, not
        assert page.faults == []
        page.close()
    finally:
        running.stop()


def test_a_recording_that_has_ended_is_played_again(launch, browser, recording):
    running = Running(launch, recording, "--speed", "4")
    try:
        page = visit(browser, running.url)
        ask = urllib.request.Request(f"{running.url}/do/again", method="POST")
        with pytest.raises(urllib.error.HTTPError, match="409"):
            urllib.request.urlopen(ask, timeout=PATIENCE_S)  # it still runs
        says(page, "#link", "the source has ended")
        page.get_by_role("button", name="Play again").click()
        says(page, "#link", "live")
        says(page, "#quality", "361 of 361", "dBFS")
        says(page, "#link", "the source has ended")
        page.close()
    finally:
        running.stop()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("outlet", ["--json", "--web"])
def test_a_signal_ends_it(launch, models, session, outlet, number):
    command = ["live", "--model", models["sa-se"], outlet]
    source = ["--video", "rig"] if outlet == "--json" else ["--video", f"replay:{session}/1/20"]
    running = launch([*command, *source, "--port", "0"], imports=LIVE)
    begun, sign = (running.stdout, "{") if outlet == "--json" else (running.stderr, "Page: ")
    next(line for line in iter(begun.readline, "") if line.startswith(sign))
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    assert said.splitlines()[-1] == "afferents: stopped; what is finished is kept"
    assert "Warning" not in said
    assert running.returncode == 128 + number

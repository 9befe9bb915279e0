"""A rehearsal with a page: camera, sound, what is to be done, and three things to ask for."""

import json
import time
import urllib.error
import urllib.request

import pytest

from .test_page import PATIENCE_S, Running, says, visit

pytestmark = pytest.mark.system

PLAN = """
textures = ["0", "4"]
speeds_mm_s = [60]
seconds = 4.0
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""
ASKS = "document.querySelector('#say').textContent.startsWith('change the drum to')"


class Rehearsal(Running):
    """`afferents record --dry-run --web` in a process of its own."""

    def __init__(self, launch, folder, *arguments):
        (folder / "PLAN.toml").write_text(PLAN)
        plan = [folder / "PLAN.toml", folder / "S"]
        self.begin(launch, ["record", *plan, "--dry-run", "--web", *arguments])

    def ask(self, what, query="", **headers):
        address = f"{self.url.split('?')[0].rstrip('/')}/do/{what}{query}"
        try:
            request = urllib.request.Request(address, b"", headers)
            return urllib.request.urlopen(request, timeout=PATIENCE_S).status
        except urllib.error.HTTPError as error:
            return error.code


def until(visitor, true, seen=lambda _: True):
    """The first state of which something is true, and of what the camera sees."""
    late = time.monotonic() + PATIENCE_S
    while time.monotonic() < late:
        message = visitor.recv(timeout=PATIENCE_S)
        state = {} if isinstance(message, bytes) else json.loads(message)
        if state.get("type") == "state" and true(state["recording"]) and seen(state["video"]):
            return state
    raise AssertionError("it did not come to that")


def test_next_redo_and_stop(launch, tmp_path):
    running = Rehearsal(launch, tmp_path, "--token", "a long word")
    word = "?token=a%20long%20word"
    try:
        assert running.ask("next") == 403
        assert running.ask("next", word, Origin="http://elsewhere.example") == 403
        assert running.ask("dance", word) == 409
        with running.socket(word) as visitor:
            state = until(visitor, lambda r: r["can"] == ["next", "stop"])
            assert state["recording"]["say"].startswith("change the drum to ")
            assert running.ask("redo", word) == 409
            assert running.ask("next", word) == 200
            until(visitor, lambda r: "redo" in r["can"])
            assert running.ask("redo", word) == 200
            until(visitor, lambda r: any("requested once more" in n for n in r["notes"]))
            state = until(visitor, lambda r: r["done"] == 1 and "next" in r["can"])
            assert state["recording"]["attempt"] == 1  # what was asked for is not counted
            assert running.ask("redo", word) == 200  # of the run that was accepted
            until(visitor, lambda r: r["done"] == 0 and "next" in r["can"])  # its drum, again
            assert running.ask("next", word) == 200
            state = until(visitor, lambda r: r["done"] == 1 and "next" in r["can"])
            assert state["recording"]["say"].startswith("change the drum to ")
            until(visitor, lambda r: True, lambda video: len(video.get("markers", ())) == 361)
            assert running.ask("stop", word) == 200
        assert running.process.wait(PATIENCE_S) == 130
    finally:
        running.stop()
    said = json.loads((tmp_path / "S/session.json").read_text())
    assert list(said["runs"]) in (["0/60"], ["4/60"])
    aside = (tmp_path / "S/.aside").glob("*/*/why.json")
    why = [json.loads(path.read_text())["why"] for path in aside]
    # On a busy machine runs lose frames and are repeated as well.
    assert sorted(one for one in why if not one.startswith("frames: ")) == [
        "accepted, and another was recorded in its place", "it was requested once more",
    ]  # fmt: skip


def test_the_page_in_a_browser(launch, browser, tmp_path):
    running = Rehearsal(launch, tmp_path)
    try:
        page = visit(browser, running.url)
        page.wait_for_function(ASKS)
        page.keyboard.press("Enter")
        recorded = "document.querySelector('#plan').value === 1"
        page.wait_for_function(f"{recorded} && {ASKS}", timeout=60000)
        page.wait_for_selector("#do-redo:enabled")  # the run that was accepted, once more
        page.on("dialog", lambda asked: asked.accept())
        page.keyboard.press("s")
        assert running.process.wait(PATIENCE_S) == 130
        says(page, "#link", "is over")
        says(page, "#say", "stopped: what is finished is kept")
        assert page.faults == []
    finally:
        running.stop()

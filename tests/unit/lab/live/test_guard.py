"""Visitors who come in crowds, dawdle, shout or never listen: real sockets, a real server."""

import json
import logging
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import time
import urllib.request
from contextlib import ExitStack, closing, suppress
from http.client import HTTPException
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from afferents.lab.live.web import application
from afferents.lab.live.web.server import one_line_errors

FILES = 64
PATIENCE_S = 60
"""Nothing here should take a tenth of it, on a machine that has nothing else to do."""
SERVED = Path(__file__).parent / "served.py"
HEAD = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
UPGRADE = (
    b"GET /feel HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="counts files in /proc")


class Served:
    """A page in a process of its own, which may have `FILES` files open."""

    def __init__(self, said_in, places=0):
        self.said_in = said_in
        with said_in.open("w") as said:
            command = [sys.executable, SERVED, str(FILES), str(places)]
            self.process = subprocess.Popen(command, stderr=said)
        until(lambda: self.describe().startswith("Page: http") and self.describe().endswith("\n"))
        self.url = self.describe().removeprefix("Page: ").strip()
        self.address = ("127.0.0.1", int(self.url.rpartition(":")[2]))
        self.count()
        until(lambda: self.visitors() == 0)
        self.files_at_rest = self.files()

    def describe(self):
        return self.said_in.read_text()

    def files(self):
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))

    def visitors(self):
        """Return how many connections are open."""
        there = psutil.Process(self.process.pid).net_connections("tcp")
        return sum(one.status != psutil.CONN_LISTEN for one in there)

    def memory_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.partition("VmRSS:")[2].split()[0]) / 1024

    def visit(self, said=b""):
        visitor = socket.create_connection(self.address, timeout=PATIENCE_S)
        with suppress(ConnectionError):
            visitor.sendall(said)
        return visitor

    def shaken_hands(self, said):
        """Return a web socket over which something is said."""
        visitor = self.visit(UPGRADE)
        assert visitor.recv(12) == b"HTTP/1.1 101"
        with suppress(ConnectionError):
            visitor.sendall(said)
        return visitor

    def onlooker(self):
        return connect(self.url.replace("http", "ws") + "/feel", max_size=None, close_timeout=1)

    def count(self):
        """Return how far the stream has come, as a good visitor hears at last."""
        found = []
        assert until(lambda: found.append(self._count()) or True)
        return found[0]

    def _count(self):
        with urllib.request.urlopen(self.url, timeout=PATIENCE_S) as page:
            assert b"afferents" in page.read()
        with self.onlooker() as visitor:
            while True:
                message = visitor.recv(timeout=PATIENCE_S)
                found = {} if isinstance(message, bytes) else json.loads(message)
                if found.get("predictions"):
                    return found["predictions"][0]["time_s"]

    def is_as_before(self):
        """Tell whether all is over: a good visitor is served, and no file is open any more."""
        self.count()
        assert self.describe().count("\n") <= 2  # its address, and the first thing that went wrong
        return until(lambda: self.files() <= self.files_at_rest)


def until(what):
    """Wait for something to be true, and tell whether it was."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        with suppress(OSError, HTTPException, WebSocketException):
            if what():
                return True
        time.sleep(0.05)
    return False


def is_closed(visitor):
    """Tell whether a visitor, who hears whatever is said, is let go at last."""
    with closing(visitor), suppress(ConnectionError):
        while visitor.recv(1 << 16):
            pass
    return True


def reset(visitor):
    visitor.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    visitor.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    page = Served(tmp_path_factory.mktemp("served") / "said.txt")
    memory_mb = page.memory_mb()
    yield page
    assert page.memory_mb() < memory_mb + 50
    page.process.send_signal(signal.SIGINT)
    assert page.process.wait(PATIENCE_S) == 130
    assert page.describe().count("\n") <= 2


@pytest.mark.system
@pytest.mark.parametrize("said", [b"", HEAD])
def test_a_crowd_takes_neither_the_stream_nor_the_terminal(served, said):
    before = served.count()
    crowd = [served.visit(said) for _ in range(120)]
    assert served.files() <= FILES
    answers = []
    for visitor in crowd:
        with suppress(ConnectionError):
            answers.append(visitor.recv(1000))
        visitor.close()
    assert any(b"503 Service Unavailable" in answer for answer in answers)
    assert served.is_as_before()
    assert served.count() > before


def drip(visitor, what):
    """Say a byte at a time, until hung up on; tell whether it was."""
    end_s = time.monotonic() + PATIENCE_S
    visitor.settimeout(0.1)
    while time.monotonic() < end_s:
        try:
            visitor.sendall(what)
            if not visitor.recv(1 << 16):
                return True
        except TimeoutError:
            continue
        except ConnectionError:
            return True
    return False


@pytest.mark.system
@pytest.mark.parametrize(
    "begun",
    [
        HEAD,
        HEAD.replace(b"GET", b"POST") + b"Content-Length: 1000000\r\n\r\n",
        HEAD.replace(b"GET", b"POST") + b"Transfer-Encoding: chunked\r\n\r\n",
        HEAD + b"Expect: 100-continue\r\nContent-Length: 1000000\r\n\r\n",
    ],
)
def test_a_head_or_a_body_that_never_ends(served, begun):
    with served.visit(begun) as slow:
        assert drip(slow, b"1")
    assert served.is_as_before()


def rubbish():
    """Return what sensible visitors do not say."""
    rng = os.urandom
    return {
        "noise": rng(4000),
        "tls": bytes.fromhex("16030100c8010000c40303") + rng(196) + b"\r\n\r\n",
        "http/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        "a long header": HEAD + b"X: " + b"x" * 200_000 + b"\r\n\r\n",
        "many headers": HEAD + b"X: x\r\n" * 20_000 + b"\r\n",
        "a long path": HEAD.replace(b"/ ", b"/" + b"x" * 10_000 + b" ") + b"\r\n",
        "a null byte": HEAD.replace(b"/ ", b"/page/%00 ") + b"\r\n",
        "not utf-8": HEAD.replace(b"/ ", b"/page/%ff?token=%ff ") + b"\r\n",
        "a bad chunk": HEAD + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n" + rng(100),
        "pipelined": (HEAD + b"\r\n") * 2000,
        "many headers, upgraded": UPGRADE[:-2] + b"X: x\r\n" * 500 + b"\r\n",
        "a long header, upgraded": UPGRADE[:-2] + b"X: " + b"x" * 12_000 + b"\r\n\r\n",
        "an odd origin": UPGRADE[:-2] + b"Origin: http://[\r\n\r\n",
    }


def rubbish_frames():
    """Return what sensible visitors do not say over a web socket."""
    mask = bytes(4)
    return {
        "frames of noise": b"\xff" + os.urandom(4000),
        "not masked": b"\x81\x02xx",
        "a huge frame": b"\x82\xff\x7f" + os.urandom(4000),
        "unending parts": b"\x01\x80" + mask + (b"\x00\x80" + mask) * 50_000,
        "texts that are none": (b"\x81\x82" + mask + b"\xff\xfe") * 50_000,
        "pings": (b"\x89\xfd" + mask + b"x" * 125) * 1000,
    }


@pytest.mark.system
@pytest.mark.parametrize("what", [*rubbish(), *rubbish_frames()])
def test_rubbish_is_answered_by_hanging_up(served, what):
    frames = what in rubbish_frames()
    said = (rubbish() | rubbish_frames())[what]
    visit = served.shaken_hands if frames else served.visit
    for _ in range(5):
        reset(visit(said))
        with visit(said) as gone, suppress(OSError):  # it may have been hung up on
            gone.shutdown(socket.SHUT_WR)
    assert is_closed(visit(said))
    assert served.is_as_before()


@pytest.mark.system
def test_a_web_socket_that_never_reads(served):
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
    deaf.connect(served.address)
    with deaf, served.onlooker() as good:
        deaf.sendall(UPGRADE)
        assert deaf.recv(12) == b"HTTP/1.1 101"
        assert until(lambda: served.files() <= served.files_at_rest + 1)
        assert is_closed(deaf)
        good.recv(timeout=PATIENCE_S)
    assert served.is_as_before()


def test_places_are_taken_and_given_up(tmp_path):
    served = Served(tmp_path / "said.txt", places=3)
    try:
        with ExitStack() as inside:
            for _ in range(3):
                inside.enter_context(served.onlooker()).recv(timeout=PATIENCE_S)
            with served.visit() as late:
                assert late.recv(1000).startswith(b"HTTP/1.1 503")
        assert served.is_as_before()
        # The end waits neither for who asks nothing nor for who takes nothing.
        with served.visit(HEAD), served.visit(UPGRADE):
            assert until(lambda: served.visitors() == 2)
            served.process.send_signal(signal.SIGINT)
            assert served.process.wait(PATIENCE_S) == 130
    finally:
        served.process.kill()


def test_what_goes_wrong_is_told_once_in_a_line(capsys):
    with one_line_errors():
        for name in ("asyncio", "uvicorn.error", "uvicorn.error"):
            logging.getLogger(name).warning("a visitor did something")
            try:
                raise ValueError("of\nlines")
            except ValueError:
                logging.getLogger(name).exception("Failed\nat length")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("Page: Failed: ValueError('of\\nlines')")


@pytest.mark.parametrize(
    ("files", "places"), [(64, 16), (2, 1), (100_000, 64), (resource.RLIM_INFINITY, 64)]
)
def test_places_by_the_files_that_may_be_open(monkeypatch, files, places):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (files, files))
    assert application.count_places() == places

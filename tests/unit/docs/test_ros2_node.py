"""The ROS 2 node of the documentation, up to where ROS begins: what it makes of real percepts."""

import importlib.util
import json
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

NODE = Path(__file__).parents[3] / "docs" / "ros2" / "percept_node.py"


@pytest.fixture(scope="module")
def node():
    spec = importlib.util.spec_from_file_location("percept_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def lines(does, small_session):
    """What is seen of a clip and heard of its sound, without a model."""
    video, audio = (small_session / "1" / "20" / name for name in ("video.mp4", "audio.wav"))
    asked = ("--json", "--speed", "max", "--video", video, "--audio", audio)
    return does("live", *asked).splitlines()


def test_percepts_become_messages(node, lines):
    found = list(node.messages(lines))
    percepts = [json.loads(line) for line in lines]
    states = [message.data for message in found if message.topic == "camera/state"]
    assert states == [one["state"] for one in percepts if one["model"] == "camera"]
    assert "camera" in {message.topic.split("/")[0] for message in found}
    whole = [json.loads(message.data) for message in found if message.topic.endswith("/percept")]
    assert whole == percepts


def test_probabilities_have_the_names_of_their_textures(node):
    percept = {"model": "ra-ste", "state": "texture", "texture": "4", "novelty": 0.5}
    percept["probabilities"] = {"2": 0.25, "4": 0.75}
    found = {m.topic: m for m in node.messages([json.dumps(percept), '{"model": "ra-s', ""])}
    assert found["ra_ste/probabilities"][2:] == ([0.25, 0.75], "2,4")
    assert found["ra_ste/texture"].data == "4"
    assert found["ra_ste/novelty"].data == 0.5
    assert len(found) == 5


@pytest.mark.system
def test_lines_of_another_computer_are_printed(lines):
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            visitor, _ = server.accept()
            with visitor:
                visitor.sendall(("\n".join(lines) + "\n").encode())

        threading.Thread(target=serve, daemon=True).start()
        port = server.getsockname()[1]
        command = [sys.executable, NODE, "--print", "--connect", f"127.0.0.1:{port}"]
        said = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    topics = [json.loads(line)["topic"] for line in said.stdout.splitlines()]
    assert topics.count("camera/percept") + topics.count("microphone/percept") == len(lines)

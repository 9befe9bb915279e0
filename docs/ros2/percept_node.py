"""A ROS 2 node that publishes what `afferents live --json` recognises.

    afferents live --model touch.onnx --video camera:0 --json | python percept_node.py
    python percept_node.py --connect robot.local:5005     # lines that another computer serves

Topics, under the name of the model (`touch` for touch.onnx's name `touch`):

    <model>/state           std_msgs/String              texture, unknown, waiting, stalled, looking
    <model>/texture         std_msgs/String              the likeliest texture; empty if not known
    <model>/probabilities   std_msgs/Float32MultiArray   of each texture; the label names them
    <model>/novelty         std_msgs/Float32             above 1, nothing that was learnt fits
    <model>/percept         std_msgs/String              the whole prediction, JSON

`--print` writes the messages instead of publishing them, and needs no ROS.
"""

import argparse
import json
import socket
import sys
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, TextIO


class Message(NamedTuple):
    """A message: its topic, its type in std_msgs, and what it holds."""

    topic: str
    type: str
    data: Any
    label: str = ""


def messages(lines: Iterable[str]) -> Iterator[Message]:
    """Yield the messages of each percept; lines that are none (a last, broken one) are left out."""
    for line in lines:
        try:
            percept = json.loads(line)
            model = percept["model"].replace("-", "_")
        except (ValueError, KeyError, TypeError):
            continue
        probabilities = percept.get("probabilities") or {}
        yield Message(f"{model}/state", "String", percept["state"])
        yield Message(f"{model}/texture", "String", percept.get("texture") or "")
        if probabilities:
            values = list(probabilities.values())
            label = ",".join(probabilities)
            yield Message(f"{model}/probabilities", "Float32MultiArray", values, label)
        if percept.get("novelty") is not None:
            yield Message(f"{model}/novelty", "Float32", float(percept["novelty"]))
        yield Message(f"{model}/percept", "String", line.strip())


def lines_from(address: str | None) -> TextIO:
    """Return the lines of stdin, or of a socket HOST:PORT."""
    if address is None:
        return sys.stdin
    host, _, port = address.rpartition(":")
    return socket.create_connection((host or "localhost", int(port))).makefile("r")


def publish(found: Iterable[Message]) -> None:
    """Publish messages until there are no more, or ROS is shut down."""
    import rclpy
    from std_msgs import msg

    rclpy.init()
    node = rclpy.create_node("afferents")
    publishers: dict[str, Any] = {}
    try:
        for message in found:
            if not rclpy.ok():
                return
            kind = getattr(msg, message.type)
            if message.topic not in publishers:
                publishers[message.topic] = node.create_publisher(kind, message.topic, 10)
            content = kind(data=message.data)
            if message.label:
                size = len(message.data)
                dimension = msg.MultiArrayDimension(label=message.label, size=size, stride=size)
                content.layout.dim.append(dimension)
            publishers[message.topic].publish(content)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def main() -> None:
    """Read percepts and publish them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--connect", metavar="HOST:PORT", help="read lines from a socket")
    parser.add_argument("--print", action="store_true", help="print messages; needs no ROS")
    options = parser.parse_args()
    with lines_from(options.connect) as lines:
        found = messages(lines)
        if not options.print:
            publish(found)
            return
        for message in found:
            print(json.dumps(message._asdict()), flush=True)  # noqa: T201


if __name__ == "__main__":
    main()

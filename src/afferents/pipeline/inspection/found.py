"""What `inspect` found."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MARKERS, RESPONSES, VIBRATION = "markers.png", "responses.png", "vibration.png"
"""The pictures that it draws."""


@dataclass
class Inspection:
    """Sentences about a source, problems found, pictures drawn, and facts for scripts."""

    source: str
    sentences: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)

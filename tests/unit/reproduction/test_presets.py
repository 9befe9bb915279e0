"""What `reproduce` chooses, and what is asked for otherwise."""

from afferents.reproduction.presets import choose, list_changes


def test_what_is_given_overrules_and_is_named():
    given = {"cut": "all", "preset": "paper", "workers": 3}
    assert choose("published", given) == {
        "method": "published", "rest": "own", "fps_hz": 90.0, "cut": "all", "protocol": "published",
        "models": "all", "preset": "paper", "statistics": "keras", "precision": "float32",
    }  # fmt: skip
    assert list_changes("published", given) == ["--cut all (published: published)"]
    assert list_changes("recommended", given, ["--held-out 50"]) == [
        "--preset paper (recommended: fast)",
        "--held-out 50",
    ]

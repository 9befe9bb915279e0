"""Figures drawn as in the paper: what stands in for what, and what is drawn."""

from afferents.reporting.data import PANELS, choose_rows, choose_substitutes, describe_substitutes


def test_the_papers_own_are_shown_where_they_are_there():
    recorded = [(texture, float(v)) for texture in ("0", "3", "6") for v in range(10, 101, 10)]
    shown = [one for panel in PANELS.values() for one in choose_substitutes(panel, recorded, True)]
    assert [(one.texture, one.speed_mm_s) for one in shown] == [
        ("0", 50), ("3", 50), ("6", 50), ("3", 10), ("3", 50), ("3", 100),
    ]  # fmt: skip
    assert describe_substitutes(shown) == ""


def test_the_nearest_speed_stands_in_and_is_named():
    (shown,) = choose_substitutes([("g", 50.0)], [("3", 10.0), ("3", 40.0), ("0", 50.0)], True)
    assert (shown.texture, shown.speed_mm_s) == ("3", 40.0)
    assert shown.label == "g\n40 mm/s\n(for 50)"
    assert describe_substitutes([shown]).endswith("session lacks: g at 40 mm/s for 50 mm/s.")


def test_other_textures_stand_in_by_their_place():
    recorded = [(name, 20.0) for name in ("cotton", "denim", "silk", "wool", "zinc")]
    shown = choose_substitutes([("a", 50.0), ("g", 50.0), ("m", 50.0)], recorded, True)
    assert [one.texture for one in shown] == ["cotton", "silk", "zinc"]
    assert shown[0].wanted == "a, 50"


def test_the_report_shows_textures_spread_over_what_there_is_and_one_of_them_at_three_speeds():
    recorded = [(name, float(v)) for name in "pqrstu" for v in (20, 40, 60, 80)] + [("v", 90.0)]
    shown = [(panel, one.label) for panel, one in choose_rows(recorded, False, "report")]
    assert shown == [
        ("A", "p\n40 mm/s"), ("A", "r\n40 mm/s"), ("A", "t\n40 mm/s"), ("A", "v\n90 mm/s"),
        ("B", "s\n20 mm/s"), ("B", "s\n60 mm/s"), ("B", "s\n80 mm/s"),
    ]  # fmt: skip

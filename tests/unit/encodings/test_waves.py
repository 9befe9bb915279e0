"""Which waves pins can't show is said, with the textures that it concerns."""

from afferents.encodings.wavenumbers import unseen_waves


def test_textures_finer_than_two_pins_are_named_and_smooth_or_worded_ones_are_not():
    said = unseen_waves(1.2, ["0", "0.5", "2", "2.4", "3", "felt"])
    assert said == (
        "Models of waves cannot resolve waves shorter than twice the distance of the pins, 2.4 mm "
        "(here the bumps of 0.5, 2)."
    )
    assert unseen_waves(1.2, ["3", "felt"]).endswith("2.4 mm.")


def test_where_nobody_knows_the_pitch_no_length_is_named():
    assert unseen_waves(None, ["1"]).endswith("shorter than twice the distance of the pins.")

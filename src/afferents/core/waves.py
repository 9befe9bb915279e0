"""What pins can't show of a texture's waves."""

from collections.abc import Iterable

from afferents.core.recording import spacing_mm


def unseen_waves(pitch_mm: float | None, textures: Iterable[str] = ()) -> str:
    """Say which waves a fingertip can't show: at least two pins must fall on one.

    Shannon, Communication in the presence of noise, Proc. IRE 1949: shorter ones look like longer
    ones, or like none.

    Parameters
    ----------
    pitch_mm
        Distance of its pins, mm; None where the sensor file does not say.
    textures
        Named by the spacing of their bumps; those with bumps closer together are listed.
    """
    if pitch_mm is None:
        return "Models of waves can't see any shorter than two pins."
    finer = [t for t in textures if 0 < (spacing_mm(t) or 0.0) < 2 * pitch_mm]
    named = f" (here the bumps of {', '.join(finer)})" if finer else ""
    return f"Models of waves can't see any shorter than two pins, {2 * pitch_mm:g} mm{named}."

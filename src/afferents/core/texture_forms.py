"""What must stand in the summaries of `--split texture` for them to be read back; see `forms`."""

from itertools import chain
from typing import Literal, Self

from pydantic import Field, model_validator

from afferents.core.forms import AboutSpeeds, Amount, Form, Key, Share, Shares


class Unknown(Form):
    """Shares called unknown, at some held-out speeds."""

    mean: Share
    ci95: Shares


class UnknownBySpeed(Unknown):
    """The same at all of them and, where there are any, at those that lie between others."""

    inside: Unknown | None
    outside: Unknown | None = None
    by_speed: dict[Key, Share] = Field(min_length=1)

    @model_validator(mode="after")
    def _some_lie_between(self) -> Self:
        if self.inside is not None and len(self.by_speed) < 3:
            raise ValueError("inside must be null where by_speed has fewer than 3")
        return self


class Units(Form):
    """Of samples, and of whole recordings."""

    samples: UnknownBySpeed
    recordings: UnknownBySpeed


class Areas(Form):
    """Under the curve of false alarms against finds, of both."""

    samples: Share | None
    recordings: Share | None


class OfTexture(Form):
    """How often one texture is called unknown."""

    found_samples: Share
    false_alarms: Share


class UnknownOutcome(Form):
    """What a model makes of textures never felt."""

    found: Units
    false_alarms: Units
    auroc: Areas
    auroc_inside: Areas
    auroc_outside: Areas | None = None
    by_texture: dict[str, OfTexture]

    @model_validator(mode="after")
    def _areas_go_with_speeds(self) -> Self:
        known = [self.auroc] + [self.auroc_inside] * (self.found.samples.inside is not None)
        if None in chain.from_iterable((one.samples, one.recordings) for one in known):
            raise ValueError("auroc must be a number")
        return self


class UnknownSummary(AboutSpeeds):
    """`unknown.json`."""

    false_alarms_stated: Share
    models: dict[str, UnknownOutcome] = Field(min_length=1)

    @model_validator(mode="after")
    def _knows_all_textures(self) -> Self:
        for name, outcome in self.models.items():
            if missing := set(self.textures) - set(outcome.by_texture):
                raise ValueError(f"models.{name}.by_texture must have {min(missing)}")
        return self


class RoughnessOutcome(Form):
    """How far off a model is in mm."""

    mae_mm: Amount
    mae_mm_inside: Amount | None
    mae_mm_recordings: Amount
    by_speed: dict[Key, Amount] = Field(min_length=1)
    by_spacing: dict[Key, Amount] = Field(min_length=1)
    covered: Share
    half_interval_mm: Amount


class RoughnessSummary(AboutSpeeds):
    """`roughness.json`."""

    coverage_asked: Share
    models: dict[str, dict[Literal["seen", "unseen"], RoughnessOutcome]]

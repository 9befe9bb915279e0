"""Which sensor each recording of a session was made with."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from afferents.errors import InputError
from afferents.markers.sensor import Sensor, load_sensor
from afferents.recordings.layouts import sensor_named
from afferents.recordings.session import Session
from afferents.store.recording import Recording

USUAL = "tip_b"
"""Where nothing names a sensor: the paper's."""


@dataclass(frozen=True)
class Sensors:
    """The sensor of a session, and those of recordings that were made with another.

    Attributes
    ----------
    usual
        Of all recordings that name none of their own.
    own
        By the recording's name.
    """

    usual: Sensor
    own: Mapping[str, Sensor] = field(default_factory=dict)

    def of(self, recording: Recording) -> Sensor:
        """Return a recording's sensor, with the rest frame of this recording."""
        sensor = self.own.get(recording.name, self.usual)
        if recording.rest_frame is None:
            return sensor
        return sensor.model_copy(update={"rest_frame": recording.rest_frame})


def find_sensors(session: Session, given: Sensor | None) -> Sensors:
    """Return the sensors of a session.

    Parameters
    ----------
    given
        By the user, for this command: it goes before the session file's. None for what that says.

    Raises
    ------
    InputError
        If a sensor file is not what it should be, or one is given though recordings name theirs.
    """
    named = {r.name: r.sensor for r in session.recordings if r.sensor is not None}
    if given is not None and named:
        name, sensor = next(iter(named.items()))
        found = f"{sensor} for {name} in {session.declared.file}"
        raise InputError(
            f"--sensor: expected a session whose recordings name no sensor, found {found}; leave it"
        )
    files = {sensor: load_sensor(sensor) for sensor in dict.fromkeys(named.values())}
    own = {name: files[sensor] for name, sensor in named.items()}
    if given is not None:
        return Sensors(given)
    if session.declared.sensor is not None:
        try:
            usual = load_sensor(sensor_named(session.root, session.declared.sensor))
        except InputError as error:
            where = session.root / session.declared.file
            raise InputError(f"{where}, sensor {error}; mend it there, or give --sensor") from None
        return Sensors(usual, own)
    if len(own) == len(session.recordings):
        return Sensors(next(iter(own.values())), own)
    return Sensors(load_sensor(USUAL), own)


def default_sentences(session: Session, given: Sensor | None) -> list[str]:
    """Say that markers are taken to be the paper's, where nothing names the sensor of a video."""
    named = given is not None or session.declared.sensor is not None
    if named or all(r.video is None or r.sensor is not None for r in session.recordings):
        return []
    return [
        f"No sensor is named, so the markers are taken to be those of the paper's, '{USUAL}'; if "
        "yours is another, make its file with 'afferents calibrate' and give it with --sensor."
    ]

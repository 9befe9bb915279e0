"""Sessions whose files are named by a session file: any container, any layout, any label."""

import json
from hashlib import sha256
from pathlib import Path

import av
import numpy as np
import pandas as pd
import pytest
import soundfile
import xarray as xr

import afferents
from afferents.errors import InputError
from afferents.recordings.audio import WavFile
from afferents.recordings.check import check_files, check_recording
from afferents.recordings.described import Described
from afferents.recordings.draft import find_tables
from afferents.recordings.grid import require_rates_that_agree
from afferents.recordings.media import find_media
from afferents.recordings.pattern import Pattern
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.session import match_recordings
from afferents.recordings.session_file import read_session_file
from afferents.recordings.video import VideoFile

ONE = '[[recordings]]\nvideo = "a.avi"\ntexture = "a"\n'
TWO = ONE + ONE.replace('"a"', '"b"').replace("a.avi", "b.avi")
PAIRS = ["felt/20_1.avi", "felt/20_2.avi", "silk/20_1.avi", "silk/20_2.avi", "notes.avi"]


@pytest.fixture
def lab(tmp_path, write_video):
    """Write short videos of these names, and a session.toml; return the folder."""

    def write(names, toml, **video):
        for name in names:
            write_video(tmp_path / name, **video)
        (tmp_path / "session.toml").write_text(toml)
        return tmp_path

    return write


@pytest.fixture
def empty(tmp_path):
    """Write empty files of these names, and a session.toml: nothing is opened."""

    def write(names, toml=""):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
        if toml:
            (tmp_path / "session.toml").write_text(toml)
        return tmp_path

    return write


def list_names(root):
    return [r.name for r in afferents.read_session(root).recordings]


def test_a_pattern_gives_ids_speeds_and_conditions(empty):
    toml = 'pattern = "{texture}/{speed}_{trial}.avi"\nsteady_s = [0.5, 2]\n'
    session = afferents.read_session(empty(PAIRS, toml))
    names = [r.name for r in session.recordings]
    assert names == ["felt/20/1", "felt/20/2", "silk/20/1", "silk/20/2"]
    second = session.recordings[1]
    assert (second.texture, second.speed_mm_s, second.steady_s) == ("felt", 20.0, (0.5, 2.0))
    assert second.conditions == {"trial": "2"}
    assert session.left_out()[0] == (
        "1 file is left out: notes.avi; not of the pattern '{texture}/{speed}_{trial}.avi' in "
        "session.toml."
    )


@pytest.mark.parametrize(
    ("speeds", "mm_s"), [(("20", "-20"), [20.0] * 4), (("12,5_1", "12.5_2"), [12.5] * 4)]
)
def test_a_speed_may_have_a_sign_or_a_decimal_comma(empty, speeds, mm_s):
    names = [f"{texture}_{speed}.avi" for texture in ("felt", "silk") for speed in speeds]
    rule = "{texture}_{speed}_{trial}.avi" if "_" in speeds[0] else "{texture}_{speed}.avi"
    session = afferents.read_session(empty(names, f'pattern = "{rule}"\n'))
    assert [r.speed_mm_s for r in session.recordings] == mm_s
    assert session.left_out() == []


def test_a_pattern_without_speed_and_with_sound(empty):
    root = empty(
        ["v/felt_low.mkv", "v/silk_low.mkv", "s/felt_low.wav", "s/silk_low.wav"],
        'pattern = "v/{texture}_{pressure}.mkv"\naudio_pattern = "s/{texture}_{pressure}.wav"\n',
    )
    session = afferents.read_session(root)
    assert [r.name for r in session.recordings] == ["felt/low", "silk/low"]
    assert session.speeds_mm_s == ()
    assert [r.audio.path.name for r in session.recordings] == ["felt_low.wav", "silk_low.wav"]
    assert session.left_out() == []
    (root / "s/silk_low.wav").unlink()
    with pytest.raises(InputError, match=r"audio in every condition or in none, .* silk/low"):
        afferents.read_session(root)


@pytest.mark.parametrize(
    ("pattern", "sentence"),
    [
        ("{texture}/{speed}.mkv", r"none among felt/20_1\.avi, felt/20_2\.avi"),
        ("{texture}/{speed}_*.avi", "an id each, found felt/20_1.avi and felt/20_2.avi, both"),
        ("{texture}{trial}.avi", "reads in one way, found notes.avi"),
        ("{speed}.avi", "a pattern with {texture}"),
        ("{texture}/{texture}.avi", "with each name once"),
        ("{texture/{speed}.avi", "names in braces"),
        ("../{texture}.avi", "of paths in its folder"),
        ("{texture}/{speed_mm_s}_{trial}.avi", "a pattern with {speed}"),
        (
            '{texture}/{speed}_{trial}.avi"\naudio_pattern = "{texture}.wav',
            "fits, found none",
        ),
    ],
)
def test_patterns_that_fit_nothing_or_twice(empty, pattern, sentence):
    with pytest.raises(InputError, match=sentence):
        afferents.read_session(empty(PAIRS, f'pattern = "{pattern}"\n'))


def test_a_hole_among_files_of_a_pattern_is_named_and_may_be_declared(empty):
    names = ["felt_20.avi", "felt_40.avi", "silk_20.avi"]
    toml = 'pattern = "{texture}_{speed}.avi"\n'
    with pytest.raises(InputError, match=r"none in silk/40; .*session\.toml"):
        list_names(empty(names, toml))
    assert len(list_names(empty(names, toml + 'holes = [["silk", 40]]\n'))) == 3


def test_names_in_a_pattern_take_what_the_rest_leaves():
    found = Pattern("{texture}_{speed}_{trial}.avi").values("soft_felt_2.5_b.avi")
    assert found == {"texture": "soft_felt", "speed": "2.5", "trial": "b"}
    assert Pattern("{texture}_{speed}.avi").values("felt_fast.avi") is None


LIST = {
    "sensor": "mine.toml",
    "rest_frame": 3,
    "conditions": {"robot": "ur5"},
    "recordings": [
        {"video": "a.avi", "texture": 3, "speed_mm_s": 20, "repetition": 1},
        {"video": "b.avi", "texture": "3", "speed_mm_s": 20, "repetition": 2,
         "conditions": {"pressure": 4.5}, "fps_hz": 30, "steady_s": [1, 2], "rest_frame": 0,
         "sensor": "hex127"},
        {"video": "c.avi", "texture": "felt", "id": "others/c"},
    ],
}  # fmt: skip


def test_a_list_says_all_of_each(empty):
    root = empty(["a.avi", "b.avi", "c.avi"])
    (root / "session.json").write_text(json.dumps({**LIST, "program": "mine"}))
    first, second, third = afferents.read_session(root).recordings
    assert (first.name, first.texture, first.speed_mm_s) == ("3/20/1", "3", 20.0)
    assert first.conditions == {"robot": "ur5", "repetition": "1"}
    assert (first.sensor, first.rest_frame, first.steady_s) == (None, 3, None)
    assert second.video == VideoFile(root / "b.avi", 30)
    assert second.conditions["pressure"] == 4.5
    assert (second.sensor, second.rest_frame, second.steady_s) == ("hex127", 0, (1.0, 2.0))
    assert (third.name, third.texture, third.speed_mm_s) == ("others/c", "felt", None)
    assert read_session_file(root).sensor == "mine.toml"


def test_what_people_write_is_what_programs_write(empty):
    root = empty(["a.avi"], '[[recordings]]\nvideo = "a.avi"\ntexture = 3\nsteady_s = [1, 2]\n')
    by_people = read_session_file(root).model_dump()
    (root / "session.toml").unlink()
    one = {"video": "a.avi", "texture": 3, "steady_s": [1, 2]}
    # A program may note a sensor of any form, and whatever else.
    noted = {"recordings": [one], "sensor": {"name": "tip"}, "rig": {"a": 1}}
    (root / "session.json").write_text(json.dumps(noted))
    assert read_session_file(root).model_dump() == by_people
    (root / "session.toml").touch()
    with pytest.raises(InputError, match=r"one session file, found session\.toml and session"):
        read_session_file(root)


@pytest.mark.parametrize(
    ("toml", "sentence"),
    [
        ("stedy_s = [1, 2]\n" + ONE, "unknown key 'stedy_s'"),
        (ONE + "speed = 3\n", "unknown key 'recordings.0.speed'"),
        ('[[recordings]]\nvideo = "a.avi"\n', "key 'recordings.0.texture'"),
        ('[[recordings]]\ntexture = "a"\n', "a video, audio, or both"),
        (ONE + "speed_mm_s = 0\n", "recordings.0.speed_mm_s"),
        (ONE + 'speed_mm_s = "20"\n', "recordings.0.speed_mm_s"),
        (ONE + "steady_s = [2, 1]\n", "0 <= start < stop"),
        (ONE + "steady_s = [0.5, inf]\n", "0 <= start < stop, both finite"),
        (ONE + "conditions = {pressure = inf}\n", "text or finite numbers"),
        (ONE + 'id = "../a"\n', "a label without '/'"),
        (ONE.replace('"a"', '"a/b"'), "a label without '/'"),
        (ONE + ONE, "an id each, found a.avi and a.avi, both a"),
        (ONE + ONE.replace('= "a"', '= "a"\nrepetition = 2'), "none lies in another, found a and"),
        (ONE.replace("a.avi", "z.avi"), r"no such file \(there are a\.avi\)"),
        ('pattern = "{texture}.avi"\n' + ONE, "not both"),
        ('audio_pattern = "{texture}.wav"\n', "goes with a pattern"),
        ("fps_overrules = true\n" + ONE, "needs fps_hz"),
        ("pattern = 5\n", "with pattern: "),
        ('sample_rate_hz = "often"\n' + ONE, "sample_rate_hz"),
        ("holes = [[1]]\n" + ONE, "holes"),
        ('direction = "left"\n' + ONE, "direction"),
        (TWO.replace('"a"', '"3"').replace('"b"', '"3.0"'), r"one name, found 3 and 3\.0"),
    ],
)
def test_a_session_toml_that_makes_no_sense(empty, toml, sentence):
    with pytest.raises(InputError, match=sentence):
        afferents.read_session(empty(["a.avi", *["b.avi"] * ("b.avi" in toml)], toml))


def test_repetitions_other_containers_and_images_in_the_published_layout(empty):
    root = empty(["3/20/1/video.avi", "3/20/2/video.avi", "felt/20/video/f1.png", "felt/20/x.avi"])
    (root / "session.toml").write_text("fps_hz = 30\n")
    session = afferents.read_session(root)
    assert [r.name for r in session.recordings] == ["3/20/1", "3/20/2", "felt/20"]
    assert session.recordings[1].conditions == {"direction": "+x", "repetition": "2"}
    assert session.recordings[2].video == ImageFolder(root / "felt/20/video", 30.0)
    assert "x.avi; not called <texture>/<speed>/video.mp4 or audio.wav" in session.left_out()[0]
    (root / "3/20/1/video.mkv").touch()
    with pytest.raises(InputError, match=r"one video, found video\.avi and video\.mkv"):
        afferents.read_session(root)
    (root / "3/20/1/video.mkv").rename(root / "3/20/video.mkv")
    with pytest.raises(InputError, match="repetitions of it in folders of their own"):
        afferents.read_session(root)


def test_what_is_found_but_is_no_session_is_said(empty):
    root = empty(["concrete.avi", "lego.avi", "a/b.wav"])
    with pytest.raises(InputError, match=r"found a/b\.wav, concrete\.avi, lego\.avi; 'afferents i"):
        afferents.read_session(root)
    (root / "session.toml").write_text('[[recordings]]\nvideo = "lego.avi"\ntexture = "lego"\n')
    said = afferents.recordings.session.PublishedSession(root)
    assert said.describe(said.scan()) == [
        "2 files are left out: a/b.wav, concrete.avi; not listed in session.toml."
    ]


def test_sound_that_is_not_read_is_named_within_videos_and_in_other_formats(tmp_path):
    path = tmp_path / "felt_20.mp4"
    with av.open(str(path), "w") as container:
        video, sound = container.add_stream("mpeg4", rate=30), container.add_stream("aac", 44100)
        video.width = video.height = 32
        video.pix_fmt, sound.layout = "yuv420p", "mono"
        picture = av.VideoFrame.from_ndarray(np.zeros((32, 32), np.uint8), format="gray")
        noise = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), "fltp", "mono")
        noise.sample_rate = 44100
        for stream, frame in ((video, picture), (sound, noise)):
            container.mux([*stream.encode(frame), *stream.encode(None)])
    for ending in ("m4a", "mp3", "aiff"):
        (tmp_path / f"felt_20.{ending}").touch()
    (tmp_path / "session.toml").write_text('pattern = "{texture}_{speed}.mp4"\n')
    beside, within = afferents.read_session(tmp_path).left_out()
    assert beside.startswith("3 files are left out: felt_20.aiff, felt_20.m4a, felt_20.mp3; 'ff")
    assert within == (
        "The video holds sound, which is left out: 'ffmpeg -i felt_20.mp4 -vn felt_20.wav' writes "
        "sound that is read."
    )
    with pytest.raises(InputError, match=r"readable sound file, .*; 'ffmpeg -i felt_20\.mp4"):
        WavFile(path).read()


def test_endings_in_capitals_are_read(tmp_path, write_video):
    for name, ending, form in (("felt", "FLAC", "FLAC"), ("silk", "flac", "FLAC")):
        write_video(tmp_path / f"{name}_20.avi")
        soundfile.write(tmp_path / f"{name}_20.{ending}", np.zeros(800), 8000, format=form)
    toml = 'pattern = "{texture}_{speed}.AVI"\naudio_pattern = "{texture}_{speed}.flac"\n'
    (tmp_path / "session.toml").write_text(toml)
    session = afferents.read_session(tmp_path)
    assert [one.audio.path.name for one in session.recordings] == ["felt_20.FLAC", "silk_20.flac"]
    assert session.left_out() == []
    (tmp_path / "session.toml").write_text('pattern = "{texture}_{speed}.flac"\n')
    assert afferents.read_session(tmp_path).recordings[0].audio.n_samples == 800


CAFE, DECOMPOSED = "caf\xe9 noir", "cafe\N{COMBINING ACUTE ACCENT}\N{NO-BREAK SPACE}noir"


def test_names_of_one_texture_in_two_forms_are_one_texture(empty):
    names = [f"{CAFE}/20.wav", f"{DECOMPOSED} /40.wav"]
    session = afferents.read_session(empty(names, 'pattern = "{texture}/{speed}.wav"\n'))
    assert session.textures == (CAFE,)
    assert [one.name for one in session.recordings] == [f"{CAFE}/20", f"{CAFE}/40"]
    listed = f'audio = "{names[1]}"\ntexture = "{DECOMPOSED}"\n'
    (session.root / "session.toml").write_text(f"[[recordings]]\n{listed}")
    assert afferents.read_session(session.root).textures == (CAFE,)


def test_textures_that_differ_in_capitals_alone_are_asked_about(empty):
    root = empty(["Felt/20.wav", "felt/20.wav"], 'pattern = "{texture}/{speed}.wav"\n')
    sentence = "under one name, found Felt and felt; rename one .* more than capitals differ"
    with pytest.raises(InputError, match=sentence):
        afferents.read_session(root)
    (root / "dataset.toml").write_text('[files]\npattern = "{texture}/{speed}.wav"\n[signal]\n')
    with pytest.raises(InputError, match=sentence):
        Described(root).scan()


def test_folders_linked_to_their_parents_are_entered_once(empty):
    root = empty(["a/clip.avi", "b/other.avi", "b/table.csv"])
    for link, target in (("a/up", root), ("a/across", root / "b"), ("b/across", root / "a")):
        (root / link).symlink_to(target)
    found = {path.relative_to(root).as_posix() for path in find_media(root)}
    assert found == {"a/clip.avi", "b/other.avi", "a/across/other.avi", "b/across/clip.avi"}
    assert len(find_tables(root)) == 2


def test_rates_that_contradict_each_other_are_refused(lab, write_video, write_audio):
    root = lab(["a.avi"], TWO, rate=90)
    write_video(root / "b.avi", rate=30)
    session = afferents.read_session(root)
    with pytest.raises(InputError, match=r"one rate .*, found 90 in a, 30 in b; .*fps_hz"):
        require_rates_that_agree(session, session.declared)
    session = afferents.read_session(lab([], TWO + "fps_hz = 90\n"))
    require_rates_that_agree(session, session.declared)
    session = afferents.read_session(lab([], "fps_hz = 90\n" + TWO + "fps_hz = 30\n"))
    with pytest.raises(InputError, match=r"one rate .*, found 90 in a, 30 in b"):
        require_rates_that_agree(session, session.declared)
    write_audio(root / "a.wav")
    write_audio(root / "b.wav", sample_rate_hz=8000, channels=1)
    session = afferents.read_session(lab([], 'pattern = "{texture}.wav"\n'))
    with pytest.raises(InputError, match="found 44100 in a, 8000 in b"):
        require_rates_that_agree(session, session.declared)
    (problem,) = afferents.inspect(root, root / "pictures", quiet=True).problems
    assert "found 44100 in a, 8000 in b" in problem
    # Of each, the last channel is the sensor's where nothing says so.
    assert [r.audio.read().sizes["channel"] for r in session.recordings] == [1, 1]


def test_pictures_of_two_sizes_are_refused(lab, write_video):
    root = lab(["a.avi"], TWO)
    write_video(root / "b.avi", size=(80, 48))
    session = afferents.read_session(root)
    with pytest.raises(InputError, match="one size, found 64x48 px in a, 80x48 px in b; make"):
        require_rates_that_agree(session, session.declared)


def test_a_folder_of_ones_own_is_where_a_drum_is_logged(empty):
    toml = 'pattern = "{texture}/{speed}{*}/{*}.avi"\n'
    root = empty(["felt/20/v.avi", "felt/40/v.avi", "silk/20x/a.avi", "silk/40x/b.avi"], toml)
    sources = [r.source for r in afferents.read_session(root).recordings]
    assert sources == [root / name for name in ("felt/20", "felt/40", "silk/20x", "silk/40x")]
    toml = 'pattern = "{texture}_{speed}.avi"\n'
    root = empty(["felt_20.avi", "felt_40.avi"], toml)  # a log there may be of either
    sources = [r.source.name for r in afferents.read_session(root).recordings]
    assert sources == ["felt_20.avi", "felt_40.avi"]


@pytest.mark.parametrize(
    ("checksum", "sentence"),
    [
        ('{"sub/a.avi" = "00"}', "checksums of a's a.avi, found sub/a.avi alone; name"),
        ('{"a.avi" = "00"}', "checksum session.toml declares, found another"),
    ],
)
def test_a_checksum_of_another_file_is_refused(lab, checksum, sentence):
    root = lab(["sub/a.avi"], f"{ONE.replace('a.avi', 'sub/a.avi')}[checksums]\na = {checksum}\n")
    session = afferents.read_session(root)
    with pytest.raises(InputError, match=sentence):
        check_files(session.recordings[0], session.declared)


def test_checksums_may_be_in_capitals(lab):
    root = lab(["a.avi"], ONE)
    found = sha256((root / "a.avi").read_bytes()).hexdigest().upper()
    (root / "session.toml").write_text(f'{ONE}[checksums]\na = {{"a.avi" = "{found}"}}\n')
    session = afferents.read_session(root)
    check_files(session.recordings[0], session.declared)


def test_videos_come_back_at_the_rate_at_which_they_were_extracted(lab):
    session = afferents.read_session(lab(["a.avi"], ONE))
    stored = xr.Dataset(attrs={"name": "a", "declared": '{"fps_hz": 45.0}'})
    frames = list(match_recordings(session, [stored])["a"].video.frames())
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(len(frames)) / 45)


def test_sound_may_end_with_the_constant_speed(lab, write_audio):
    toml = ONE + 'audio = "a.wav"\n'
    root = lab(["a.avi"], toml, n_frames=270)  # 3 s
    write_audio(root / "a.wav", duration_s=2.0)
    (recording,) = afferents.read_session(root).recordings
    with pytest.raises(InputError, match=r"audio of at least 2\.25 s, for a video of 3\.00 s"):
        check_recording(recording, read_session_file(root))
    (root / "session.toml").write_text(toml + "steady_s = [0.5, 1.9]\n")
    (recording,) = afferents.read_session(root).recordings
    assert check_recording(recording, read_session_file(root)) == []
    (root / "session.toml").write_text(ONE + "steady_s = [0.5, 6]\n")
    (recording,) = afferents.read_session(root).recordings
    with pytest.raises(InputError, match=r"a\.avi: expected at least 6 s, .* found 3\.00 s"):
        check_recording(recording, read_session_file(root))


TABLE = pd.DataFrame(
    {
        "video": [Path("a.avi"), "b.avi"],
        "texture": ["felt", 3],
        "speed_mm_s": [20, np.nan],
        "rest_frame": [5, np.nan],
        "pressure": [1.5, np.nan],
        "operator": ["kim", "ada"],
    }
)


def test_rows_of_a_table_are_recordings_and_other_columns_conditions(empty):
    root = empty(["a.avi", "b.avi"])
    session = afferents.Session.from_table(TABLE, root, steady_s=(0.5, 2.0), sensor="hex127")
    three, felt = session.recordings
    assert [three.name, felt.name] == ["3", "felt/20"]
    assert felt.conditions == {"pressure": 1.5, "operator": "kim"}
    assert (felt.rest_frame, felt.steady_s) == (5, (0.5, 2.0))
    assert (three.speed_mm_s, three.rest_frame) == (None, None)
    large = afferents.Session.from_table(TABLE.assign(texture=[1234567, 1234568]), root)
    assert large.textures == ("1234567", "1234568")
    assert session.declared.sensor == "hex127"
    more = TABLE.assign(id=[7, 8], washed=[True, False])
    numbered = afferents.Session.from_table(more, root).recordings
    assert {(r.name, r.conditions["washed"]) for r in numbered} == {("7", "True"), ("8", "False")}


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (TABLE.assign(speed_mm_s="fast"), r"row 0 of the table: .*speed_mm_s"),
        (TABLE.iloc[:0], "a row for each recording, found none"),
        (TABLE[["video"]], "a recording with the key 'texture'"),
        (TABLE.assign(speed=20), "which is speed_mm_s"),
        (TABLE.assign(conditions="dry"), r"row 0 of the table: .*conditions"),
    ],
)
def test_a_table_that_makes_no_sense(empty, table, sentence):
    with pytest.raises(InputError, match=sentence):
        afferents.Session.from_table(table, empty(["a.avi", "b.avi"]))

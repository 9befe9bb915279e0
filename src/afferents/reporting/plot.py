"""Plots for a notebook or a script, which `afferents.plot` offers: each draws on one Axes."""

from collections.abc import Sequence
from statistics import fmean

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import pyplot
from matplotlib.axes import Axes
from numpy.typing import NDArray

from afferents import dims, filling
from afferents.encodings.samples import list_textures
from afferents.encodings.spectra import amplitude_spectrum
from afferents.errors import InputError, then
from afferents.evaluation import metrics
from afferents.evaluation.results import Results
from afferents.folds.held_out import SPEED, column_of, group_in, key_of, order
from afferents.markers.places import covered, make_images
from afferents.reporting import labels, style
from afferents.store.recording import Frame, GreyImage, natural_order

COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY)


@style.styled
def tactile_image(
    response: xr.DataArray, *, time_s: float | None = None, ax: Axes | None = None
) -> Axes:
    """Draw one tactile image: the markers' response at their places in rows and columns.

    Parameters
    ----------
    response
        SA-I or RA-I, (time, marker) or (marker), with `row` and `column` of the markers, such as
        ``example().sa1``; or one image (row, column), such as ``samples(...)[0]``.
    time_s
        Of which the nearest frame is drawn, s; None for the one with the strongest response, by
        the median of its markers. Only of (time, marker).
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        The image, y of the camera downwards, grey where there are no markers. On layouts that are
        no square grid, pixels are interpolated between the markers; a lost marker is filled from
        its neighbours, as models see it. The colour bar, from the 1st to the 99th percentile of the
        image, has the unit of the response.

    Raises
    ------
    InputError
        If there is no grid, or there are several images and no time to choose by.
    """
    _require_array(response, "responses.sa1")
    found, title = response, []
    if dims.TIME in response.dims:
        found = _select_frame(response, time_s)
        title.append(f"{float(found[dims.TIME]):.2f} s")
    if dims.TEXTURE in found.coords and not found[dims.TEXTURE].dims:
        texture = str(found[dims.TEXTURE].item())
        by_spacing = bool(response.attrs.get(dims.NAMED_BY_SPACING))
        title.append(f"texture {labels.texture_labels([texture], by_spacing)[texture]}")
    if dims.SPEED in found.coords and not found[dims.SPEED].dims:
        title.append(f"{key_of(found[dims.SPEED].item())} mm/s")
    image = _lay_out(found)
    ax = _make_axes(ax, 4.2, 3.5)
    drawn = style.draw_image(ax, image, style.find_scale(image), ", ".join(title))
    rows, columns = image.shape
    ax.set(xticks=[0, columns - 1], yticks=[0, rows - 1])
    ax.set(xlabel="column (x) →", ylabel="← row (y)")
    style.add_bar(ax.figure, drawn, ax, _name_response(response))
    return ax


@style.styled
def markers(
    tracks: xr.Dataset,
    frame: Frame | GreyImage | None = None,
    *,
    time_s: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw where the markers were found, on a frame of the video where one is given.

    Parameters
    ----------
    tracks
        `position` (time, marker, space), px, and `detected` (time, marker), as `example`, `track`
        and `extract` give them.
    frame
        Of the video, one of ``open_video(path).frames()``, or its grey values (height, width).
    time_s
        Of which the nearest markers are drawn, s; None for the frame's own time, else the middle.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        In px of the camera, x to the right and y down. Crosses: markers that are known at that time
        but were not detected.

    Raises
    ------
    InputError
        If there are no positions, or the frame is no grey image.
    """
    if not isinstance(tracks, xr.Dataset) or dims.POSITION not in tracks:  # type: ignore[redundant-expr]
        raise InputError(
            "tracks: expected a data set with 'position' (time, marker, space), found "
            f"{_describe_kind(tracks)}"
        )
    if isinstance(frame, Frame):
        time_s = frame.time_s if time_s is None else time_s
        frame = frame.image
    if frame is not None and np.ndim(frame) != 2:
        raise InputError(
            f"frame: expected a grey image (height, width), found shape {np.shape(frame)}"
        )
    if time_s is None:
        time_s = float(tracks[dims.TIME][tracks.sizes[dims.TIME] // 2])
    now = _select_frame(tracks[dims.POSITION], time_s).transpose(dims.MARKER, dims.SPACE)
    seen = np.isfinite(now.values).all(axis=1)
    if dims.DETECTED in tracks:
        seen &= tracks[dims.DETECTED].sel({dims.TIME: now[dims.TIME]}).values
    ax = _make_axes(ax, 5.2, 4.3)
    if frame is not None:
        style.draw_cells(ax, frame, "gray", 0, 255)
    width_inch = ax.get_window_extent().width / ax.figure.dpi
    style.draw_markers(ax, now.values, seen, scale=width_inch / 7)
    if not seen.all():
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0, ncols=2)
    time = f"{float(now[dims.TIME]):.2f} s"
    ax.set_title(f"{int(seen.sum())} of {len(seen)} markers, {time}", loc="left")
    ax.set(xlabel="x (px) →", ylabel="← y (px)", aspect="equal")
    if frame is None and not ax.yaxis_inverted():
        ax.invert_yaxis()
    ax.spines[:].set_visible(True)
    return ax


@style.styled
def responses(response: xr.DataArray, *, ax: Axes | None = None) -> Axes:
    """Draw a response over time: SA-I and RA-I as mean over markers with bands, RA-II as a trace.

    Parameters
    ----------
    response
        SA-I or RA-I (time, marker), or RA-II (audio_time, channel), such as ``example().ra1``.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        Time in s; the response in its unit. The bands hold 50 and 90 % of the markers. Several
        channels of RA-II lie one above the other.

    Raises
    ------
    InputError
        If the dimensions are others.
    """
    _require_array(response, "responses.sa1")
    if set(response.dims) == {dims.TIME, dims.MARKER}:
        ax = _make_axes(ax, 7.0, 2.6)
        colour = style.GREEN if str(response.name).startswith(dims.RA1) else style.BLUE
        style.draw_bands(
            ax, response.transpose(dims.TIME, dims.MARKER), _name_response(response), colour
        )
        ax.legend()
    elif set(response.dims) == {dims.AUDIO_TIME, dims.CHANNEL}:
        rate = _read_rate(response)
        ax = _make_axes(ax, 7.0, 2.6)
        values = response.transpose(dims.AUDIO_TIME, dims.CHANNEL).values
        style.draw_traces(ax, values, rate, f" ({response.attrs.get(dims.UNITS, '?')})")
        if values.shape[1] == 1:
            ax.set_ylabel(_name_response(response))
    else:
        expected = "the dimensions (time, marker) or (audio_time, channel)"
        raise InputError(f"response: expected {expected}, found {_describe_kind(response)}")
    ax.set_xlabel("time (s)")
    return ax


@style.styled
def spectrum(data: xr.DataArray, *, ax: Axes | None = None) -> Axes:
    """Draw the spectrum of RA-II up to 400 Hz; of samples of several textures, a line for each.

    Parameters
    ----------
    data
        RA-II (audio_time, channel), such as ``example().ra2``, cut into windows of 1 s; or spectra
        (sample, channel, frequency), such as ``samples(STORE, "ra2", "spectral")``. The mean of all
        that is given is drawn.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        Frequency in Hz; amplitude (`2 |FFT| / N`) in the unit of the vibration.

    Raises
    ------
    InputError
        If there is neither vibration nor a dimension `frequency`.
    """
    _require_array(data, "responses.ra2")
    if dims.AUDIO_TIME in data.dims:
        data = _transform(data)
    if dims.FREQUENCY not in data.dims or dims.FEATURE in data.dims:
        expected = "the dimensions (audio_time, channel), or one 'frequency'"
        raise InputError(f"data: expected {expected}, found {_describe_kind(data)}")
    parts = {"": data}
    if dims.TEXTURE in data.coords and data[dims.TEXTURE].dims:
        by_spacing = bool(data.attrs.get(dims.NAMED_BY_SPACING))
        parts = {
            label: data.isel({dims.SAMPLE: np.flatnonzero(data[dims.TEXTURE] == name)})
            for name, label in labels.texture_labels(list_textures(data), by_spacing).items()
        }
    others = [dim for dim in data.dims if dim != dims.FREQUENCY]
    lines = {label: part.mean(others) for label, part in parts.items()}
    ax = _make_axes(ax, 7.0, 3.0)
    for number, (label, line) in enumerate(lines.items()):
        colour = COLOURS[number % len(COLOURS)]
        ax.plot(line[dims.FREQUENCY], line, color=colour, lw=0.8, label=label)
    highest = min(style.HIGHEST_HZ, float(data[dims.FREQUENCY].max()))
    ax.set(xlim=(0, highest), ylim=(0, style.amplitude_top(list(lines.values()))))
    ax.set(xlabel="frequency (Hz)", ylabel=style.amplitude_label(data.attrs))
    if len(lines) > 1:
        ax.legend(title="texture")
    return ax


_TEXTURES = ["true_texture", "predicted_texture"]
_ACCURACY = ("model", "protocol", "accuracy")


@style.styled
def confusion(
    results: Results | pd.DataFrame,
    *,
    model: str | None = None,
    protocol: str | None = None,
    held_out_mm_s: float | None = None,
    held_out: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a confusion matrix: which texture is recognised as which, in percent.

    Parameters
    ----------
    results
        `Results`, or a table of predictions as theirs.
    model, protocol
        Which of those evaluated; may be left out where there is one.
    held_out_mm_s
        Speed held out, mm/s; None for all of them together.
    held_out
        Group held out, of results of another split; None for all of them together.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        True textures to the right, predicted ones up; every column sums to 100%. The title gives
        the accuracy.

    Raises
    ------
    InputError
        If there are several models or protocols to choose from, or none as named.
    """
    rows = results.predictions if isinstance(results, Results) else results
    _require_columns(rows, _TEXTURES)
    named = rows[_TEXTURES].to_numpy().ravel()
    textures = sorted({str(name) for name in named}, key=natural_order)
    summary = results.found if isinstance(results, Results) else None
    rows, chosen = _choose(rows, "model", model)
    title = [labels.model_title(chosen, summary)] if chosen else []
    rows, chosen = _choose(rows, "protocol", protocol)
    title += [labels.PROTOCOL_TITLES.get(chosen, chosen)] if chosen else []
    if held_out_mm_s is not None:
        rows, _ = _choose(rows, "held_out_speed_mm_s", held_out_mm_s)
        title.append(f"{key_of(held_out_mm_s)} mm/s held out")
    if held_out is not None:
        rows, _ = _choose(rows, "held_out_group", held_out)
        title.append(f"{summary.split.printed(held_out) if summary else held_out} held out")
    counts = metrics.confusion(rows, textures)
    by_group = metrics.accuracy_by_group(rows).values() if column_of(rows) in rows else ()
    accuracy = 100 * (fmean(by_group) if by_group else np.trace(counts) / counts.sum())
    ax = _make_axes(ax, 4.6, 4.0)
    percent = style.normalise(counts)
    title.append(f"{accuracy:.0f}%")
    width_inch = ax.bbox.width / ax.figure.dpi
    image = style.draw_matrix(ax, percent, ", ".join(title), width_inch)
    style.name_textures(
        np.array([[ax]]), textures, summary is not None and summary.named_by_spacing
    )
    style.add_bar(ax.figure, image, ax, style.OF_TRUE)
    return ax


@style.styled
def accuracy_by_speed(
    results: Results | pd.DataFrame,
    *,
    models: Sequence[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how many samples are recognised at each speed held out, a line for each model.

    Of results of another split, in each group held out.

    Parameters
    ----------
    results
        `Results`, or the table `Results.accuracy`.
    models
        Names of those to draw; None for all.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        Held-out speed in mm/s, or the group's name; accuracy in percent. Where
        the published protocol was run, its marks are open. Of `Results`, a dashed line is chance.

    Raises
    ------
    InputError
        If a model was not evaluated, or the table lacks a column.
    """
    table = results.accuracy if isinstance(results, Results) else results
    _require_columns(table, _ACCURACY)
    held_out = column_of(table) if column_of(table) in table else SPEED.column
    _require_columns(table, [held_out])
    summary = results.found if isinstance(results, Results) else None
    there = list(dict.fromkeys(table["model"]))
    for name in models or ():
        if name not in there:
            raise InputError(f"models: expected some of {', '.join(there)}, found '{name}'")
    ax = _make_axes(ax, 6.4, 3.0)
    tested = table.dropna(subset=[held_out, "accuracy"])
    groups = sorted({group_in(value) for value in tested[held_out]}, key=order)
    several = len(set(tested["protocol"])) > 1
    for number, name in enumerate(models or there):
        for protocol, rows in tested[tested["model"] == name].groupby("protocol"):
            found = rows.sort_values(held_out, key=lambda column: column.map(groups.index))
            colour, line = COLOURS[number % len(COLOURS)], "--" if protocol == "published" else "-"
            style.draw_accuracies(
                ax,
                protocol,
                found[held_out],
                found["accuracy"],
                line if held_out == SPEED.column else "",
                colour=colour,
                label=labels.model_title(name, summary) + (f", {protocol}" if several else ""),
            )
    if summary is not None:
        style.draw_chance(ax, summary.chance)
    axis = SPEED.axis if held_out == SPEED.column else summary.split.axis if summary else "group"
    ax.set(xlabel=f"held-out {axis}", ylabel="accuracy (%)", ylim=(0, 103))
    ax.grid(axis="y", color=style.LINE, lw=0.4)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def _make_axes(ax: Axes | None, width: float, height: float) -> Axes:
    """Return the axes given, or those of a new figure of that size in inches.

    A notebook shows the figures that pyplot knows of, so here they are made with it.
    """
    if ax is not None:
        return ax
    new: Axes = pyplot.subplots(figsize=(width, height), layout="constrained")[1]
    return new


def _describe_kind(given: object) -> str:
    """Return what something is, in words: its dimensions where it has some."""
    if isinstance(given, xr.DataArray):
        return f"({', '.join(map(str, given.dims))})"
    if isinstance(given, xr.Dataset):
        return f"a data set of {', '.join(map(str, given.data_vars)) or 'nothing'}"
    return type(given).__name__


def _require_array(given: object, such_as: str) -> None:
    if not isinstance(given, xr.DataArray):
        found = _describe_kind(given)
        raise InputError(
            f"the plot: expected one xarray.DataArray, such as {such_as}, found {found}"
        )


def _name_response(response: xr.DataArray) -> str:
    """Return what a response is called, with its unit."""
    name = "response" if response.name is None else str(response.name)
    name = style.NAMES.get(name, name)
    return f"{name} ({response.attrs[dims.UNITS]})" if dims.UNITS in response.attrs else name


def _select_frame(response: xr.DataArray, time_s: float | None) -> xr.DataArray:
    """Return a response at the frame nearest to a time, or where it is strongest."""
    if dims.TIME not in response.coords:
        raise InputError(
            "the response: expected times of its frames, s (coordinate time), found none"
        )
    if time_s is None:
        seen = response.dropna(dims.TIME, how="all")
        if not seen.sizes[dims.TIME]:
            return response.isel({dims.TIME: 0})
        level = seen.median([d for d in response.dims if d != dims.TIME])
        return seen.isel({dims.TIME: int(np.argmax(level.values))})
    return response.sel({dims.TIME: time_s}, method="nearest")


def _lay_out(image: xr.DataArray) -> NDArray[np.float32]:
    """Return an image (row, column) of what is one, or of markers with their places.

    A pixel is NaN where no markers are around it, and where too few were seen to fill it from.
    """
    if set(image.dims) == {dims.ROW, dims.COLUMN}:
        return np.asarray(image.transpose(dims.ROW, dims.COLUMN).values, np.float32)
    if image.dims != (dims.MARKER,):
        several = [str(d) for d in image.dims if d not in (dims.MARKER, dims.ROW, dims.COLUMN)]
        do = f"choose one, such as .isel({several[0]}=0)" if several else ""
        raise InputError(
            "response: expected the dimensions (row, column) or (marker), found "
            f"{_describe_kind(image)}{then(do)}"
        )
    if dims.ROW not in image.coords or dims.COLUMN not in image.coords:
        raise InputError(
            "response: expected markers in a grid (coordinates row and column), found neither"
        )
    row, column = image[dims.ROW].values, image[dims.COLUMN].values
    values = filling.fill_frames(image.values[None], np.stack([row, column], axis=1))
    lost = np.isnan(values)
    shown = covered(row, column) & (make_images(lost, row, column)[0] == 0)
    return np.where(
        shown, make_images(np.where(lost, 0, values), row, column)[0], np.float32(np.nan)
    )


def _read_rate(response: xr.DataArray) -> float:
    if dims.SAMPLE_RATE not in response.attrs:
        raise InputError(f"the vibration: expected the attribute '{dims.SAMPLE_RATE}', found none")
    return float(response.attrs[dims.SAMPLE_RATE])


def _transform(response: xr.DataArray) -> xr.DataArray:
    """Return amplitudes (window, frequency) of vibration in windows of 1 s, of every channel."""
    rate = _read_rate(response)
    signal = response.transpose(..., dims.AUDIO_TIME).values
    n = min(round(rate), signal.shape[-1])
    whole = signal[..., : signal.shape[-1] // n * n]
    amplitude = amplitude_spectrum(whole.reshape(-1, n))
    coords = {dims.FREQUENCY: np.fft.rfftfreq(n, 1 / rate)}
    return xr.DataArray(amplitude, coords, ("window", dims.FREQUENCY), attrs=response.attrs)


def _require_columns(table: object, names: Sequence[str]) -> None:
    if not isinstance(table, pd.DataFrame):
        raise InputError(
            f"results: expected Results, or a table of theirs, found {type(table).__name__}"
        )
    for name in names:
        if name not in table:
            raise InputError(
                f"results: expected a table with the column '{name}', found none of that name"
            )


def _choose(
    rows: pd.DataFrame, column: str, wanted: str | float | None
) -> tuple[pd.DataFrame, str]:
    """Return the rows of one value of a column, and the value; the only one where none is named.

    Raises
    ------
    InputError
        If there are several to choose from, or none of that name.
    """
    if column not in rows and wanted is None:
        return rows, ""
    _require_columns(rows, [column])
    there = list(dict.fromkeys(rows[column]))
    if wanted is None and len(there) != 1:
        raise InputError(
            f"{column}: expected one of {', '.join(map(str, there))}, found none chosen"
        )
    one = there[0] if wanted is None else wanted
    if one not in there:
        raise InputError(f"{column}: expected one of {', '.join(map(str, there))}, found '{one}'")
    return rows[rows[column] == one], str(one)

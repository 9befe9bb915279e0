"""Reading a response of a recording whole, checked and labelled."""

import xarray as xr

from afferents.core.errors import InputError, reason_of
from afferents.core.responses import Responses, check_values


def read_whole(responses: Responses, variable: str) -> xr.DataArray:
    """Read a response into memory, with its own attributes and the recording's.

    Raises
    ------
    InputError
        If it can't be read, has changed since it was extracted, or holds what can't be.
    """
    try:
        # Not `load`, which would keep what was read in the responses.
        response = check_values(
            responses[variable].compute(), f"{variable} of {responses.attrs['name']}"
        )
    except (OSError, ValueError, RuntimeError, ArithmeticError) as error:
        raise InputError(
            f"{variable} of {responses.attrs['name']}",
            "data that can be read",
            reason_of(error),
            "extract the recording again",
        ) from error
    return labelled(response, responses)


def labelled(response: xr.DataArray, responses: Responses) -> xr.DataArray:
    """Return a response with its own attributes and those of its recording."""
    return response.assign_attrs({**response.attrs, **responses.attrs})

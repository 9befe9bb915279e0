"""Nested numbers, each under its path."""


def flat(content, name=""):
    """Return every number, text and empty place of dicts and lists, by a path to it."""
    if isinstance(content, dict):
        parts = content.items()
    elif isinstance(content, list):
        parts = enumerate(content)
    else:
        return {name: content}
    return {k: v for key, part in parts for k, v in flat(part, f"{name}/{key}").items()}

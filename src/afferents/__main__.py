"""The command `afferents`, also as `python -m afferents`."""

from afferents.stopping import stop_on_signals


def main() -> None:
    """Run the command line; a signal that comes while it is imported ends it without a word."""
    stop_on_signals()
    from afferents.cli import main as run

    run()


if __name__ == "__main__":
    main()

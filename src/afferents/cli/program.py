"""The commands together, and the program that runs them."""

import sys
from typing import Annotated

import typer

from afferents.cli.benchmark import benchmark
from afferents.cli.errors import exit_code_of, exit_code_of_fault
from afferents.cli.evaluation import evaluate, report, status
from afferents.cli.exchange import export_lerobot, export_mcap, view
from afferents.cli.live import live
from afferents.cli.models import explain, export, train
from afferents.cli.neuro import export_nwb, neural
from afferents.cli.options import Commands
from afferents.cli.recorder import devices, import_, record
from afferents.cli.recordings import align, calibrate, extract, fetch, init, inspect, track
from afferents.cli.reproduction import doctor, reproduce
from afferents.cli.rig import drum, simulate
from afferents.progress import flush_streams, prepare_streams, silence_libraries
from afferents.stopping import ignore_signals_briefly, stop_on_signals

app = typer.Typer(
    cls=Commands,
    help="Artificial SA-I, RA-I and RA-II afferents for tactile sensing of texture.",
    add_completion=False,
    pretty_exceptions_enable=False,
    epilog="Add --debug to any command to see the traceback of an error.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from afferents.version import __version__

        print(__version__)  # noqa: T201
        raise typer.Exit


@app.callback()
def _afferents(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turn recordings of a soft tactile fingertip into afferents, and learn texture from them."""


for _command in (
    *(fetch, record, init, inspect, calibrate, track, simulate, drum, extract),
    *(evaluate, report, status),
    *(train, explain, export, align, live, neural, export_nwb, export_mcap, export_lerobot, view),
    *(reproduce, devices, doctor),
):
    app.command()(_command)


app.command("import")(import_)
app.add_typer(benchmark, name="benchmark")


def main() -> None:
    """Run the command line; exit code 2 and one sentence for what the user can mend."""
    stop_on_signals()
    prepare_streams()
    debug = "--debug" in sys.argv
    if not debug:
        silence_libraries()
    arguments = [text for text in sys.argv[1:] if text != "--debug"] or ["--help"]
    code = exit_code_of(lambda: app(arguments, prog_name="afferents"), debug)
    ignore_signals_briefly()
    fault = flush_streams()
    if fault and code == 0:  # the work is done, and nobody is told
        code = exit_code_of_fault(fault, debug)
    sys.exit(code)

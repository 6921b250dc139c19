"""Runs one verb and turns whatever happens into one exit code, the same on all ranks."""

import math
import os
import sys
import traceback
from contextlib import ExitStack

import rom
from rom.cli.described import TOML_SUFFIX
from rom.cli.parser import build_parser, given
from rom.cli.speech import OutputOptions, output_options, present, print_error, say, speaking
from rom.process.interruption import Terminated, terminable
from rom.process.launcher import ranks
from rom.process.memory import free_bytes


class InternalError(rom.RomError):
    """An exception nobody foresaw."""

    exit_code = 1


def main(argv: list[str] | None = None) -> int:
    """Run what stands behind ``rom``, from the system when not given; the exit code."""
    argv = sys.argv[1:] if argv is None else argv
    with terminable():
        return _run(argv, output_options(argv))


def _run(argv: list[str], options: OutputOptions) -> int:
    """The exit code; SIGTERM ends in the same way as Ctrl-C."""
    try:
        return run(argv, options)
    except SystemExit:  # argparse has printed the help
        raise
    except BrokenPipeError:  # the reader, for example head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except BaseException as raised:
        if options.debug:
            traceback.print_exception(raised)
        error, ended = translated(raised), isinstance(raised, Terminated)

        def complain() -> None:  # mpirun ends other ranks because of what one has printed
            rank = ranks()[0]
            if rank == 0 or not ended:
                print_error(error, options, rank)

        if ranks()[1] == 1:
            complain()
        else:  # once, and every rank ends with the same exit code; MPI is loaded under mpirun only
            from rom.fe.parallel import stop_all_ranks

            stop_all_ranks(error.exit_code, complain)
        return error.exit_code


def run(argv: list[str], options: OutputOptions) -> int:
    """Parse, run the verb, write its files, print its answer."""
    args = build_parser().parse_args(argv)
    if str(getattr(args, "file", "")).endswith(TOML_SUFFIX):
        args.given = given(argv)
    args.argv = argv
    if args.version:
        say(f"rom {rom.__version__}")
        return 0
    if args.verb is None:
        raise rom.ConfigError("no verb was given.", hint="rom --help lists the verbs.")
    first = ranks()[0] == 0
    with speaking(options, verbose=first) as remarks, ExitStack() as args.claims:
        answer = args.run(args)
        if first and answer.write is not None:
            answer.write()
    if first:
        present(answer, remarks, options)
    return rom.QualityGateError.exit_code if answer.failed else 0


def translated(error: BaseException) -> rom.RomError:
    """Any exception as an error a user can act on."""
    if isinstance(error, rom.RomError):
        return error
    if isinstance(error, KeyboardInterrupt):
        return rom.InterruptedRun("interrupted.", hint="No file was left half written.")
    if isinstance(error, MemoryError):
        return _out_of_memory(error)
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("rom"):
        return rom.ResourceError(
            f"{error.name} is not installed.", hint="rom doctor says what to type."
        )
    if isinstance(error, OSError) and error.filename is not None:
        return rom.FileFormatError(f"{error.strerror}.", where=str(error.filename))
    last = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{os.path.basename(last.filename)}, line {last.lineno}"
    return InternalError(
        f"{type(error).__name__}: {error} ({place})",
        hint="This is a mistake of ours: please report it with what --debug prints.",
    )


def _out_of_memory(error: MemoryError) -> rom.ResourceError:
    """What was asked for, as far as NumPy tells, and what there is."""
    shape, dtype = getattr(error, "shape", None), getattr(error, "dtype", None)
    asked = ""
    if shape is not None and dtype is not None:
        size = math.prod(shape) * dtype.itemsize / 2**30
        asked = f" for {size:.3g} GiB, {' x '.join(map(str, shape))} numbers"
    return rom.ResourceError(
        f"the memory ran out{asked}; this process may take {free_bytes() / 2**30:.3g} GiB more.",
        hint="Use larger elements or fewer modes.",
    )

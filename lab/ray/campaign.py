#!/usr/bin/env python3
"""A fault campaign on a Ray cluster.

Cuts the campaign into shards, runs each as a Ray task with `agv campaign --shard`, and puts the results together with
`agv campaign`. A shard whose worker is lost is run again elsewhere. The same campaign gives the same table and the same
Parquet file on every cluster, however it is cut.

`agv`, the campaign and the scenario that it names must lie at the same paths on every node, and be the same there.
"""

import argparse
import contextlib
import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLES = """\
Examples:
  python3 lab/ray/campaign.py host-sim/scenarios/faults.toml --agv target/release/agv
  python3 lab/ray/campaign.py host-sim/scenarios/faults.toml --workers 2 --shards 6 -- --only laser --runs 5
  python3 lab/ray/campaign.py /srv/faults.toml --agv /srv/agv --address 10.0.0.1:6379 --output all.parquet
"""

# How often a shard is run again before the campaign fails.
MAX_RETRIES = 5


class Failure(Exception):
    """Why there is no result, in one line."""


def complaint(done: subprocess.CompletedProcess[bytes]) -> str:
    """What a command that failed says about it, in one line."""
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    return lines[0] if lines else f"exit code {done.returncode}"


def run_shard(agv: str, campaign: str, shard: str, extra: list[str]) -> bytes:
    """Runs a shard of a campaign on this node. Returns its results as Apache Parquet.

    Raises ChildProcessError if the command was killed, so that Ray tries again, and RuntimeError if it failed.
    """
    here = f"shard {shard} on {socket.gethostname()}"
    # The file has no name, so that nothing is left of it if this worker is killed.
    with tempfile.TemporaryFile() as output:
        command = [agv, "campaign", campaign, "--shard", shard, "--output", f"/dev/fd/{output.fileno()}", "-q", *extra]
        try:
            done = subprocess.run(
                command,
                pass_fds=[output.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                # Ray gives this task one core.
                env={**os.environ, "RAYON_NUM_THREADS": "1"},
            )
        except OSError as error:
            raise RuntimeError(f"{here}: {agv} cannot be started: {error.strerror}") from None
        if done.returncode < 0:
            raise ChildProcessError(f"{here}: the command was killed by {signal.Signals(-done.returncode).name}")
        if done.returncode > 0:
            raise RuntimeError(f"{here}: {complaint(done)}")
        output.seek(0)
        return output.read()


def assert_listens(address: str) -> None:
    """Ray itself tries for many minutes."""
    host, _, port = address.rpartition(":")
    if not port.isdigit() or "//" in host:
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()
    except OSError as error:
        raise Failure(f"there is no Ray cluster at {address}: {error}") from error


def run_shards(options: argparse.Namespace) -> list[bytes]:
    """Runs all shards on the cluster. Returns the result of each, in order."""
    # What the command leaves behind on a lost worker would go on without it.
    os.environ.setdefault("RAY_process_group_cleanup_enabled", "true")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError as error:
        raise Failure(f"{error}; install what {Path(__file__).with_name('requirements.txt')} names") from error

    if options.address is not None:
        assert_listens(options.address)
    where = options.address or "this machine"
    local = {"num_cpus": options.workers, "include_dashboard": False} if options.address is None else {}
    try:
        ray.init(address=options.address or "local", log_to_driver=False, logging_level=logging.ERROR, **local)
    except (OSError, RuntimeError, ValueError) as error:
        raise Failure(f"there is no Ray cluster at {where}: {str(error).splitlines()[0]}") from error
    try:
        count: int = options.shards or 4 * max(1, int(ray.cluster_resources().get("CPU", 1)))
        task = ray.remote(num_cpus=1, max_retries=MAX_RETRIES, retry_exceptions=[ChildProcessError])(run_shard)
        shards = [
            task.remote(options.agv, options.campaign, f"{number}/{count}", options.extra) for number in range(count)
        ]
        waiting = list(shards)
        while waiting:
            done, waiting = ray.wait(waiting)
            # Fails as soon as one shard does.
            ray.get(done)
            print(f"{count - len(waiting)} of {count} shards", file=sys.stderr, flush=True)
        return ray.get(shards)
    except ray.exceptions.RayTaskError as error:
        raise Failure(str(error.cause)) from error
    except ray.exceptions.RayError as error:
        raise Failure(f"a shard was lost {MAX_RETRIES + 1} times: {str(error).splitlines()[0]}") from error
    finally:
        ray.shutdown()


def merge(options: argparse.Namespace, results: list[bytes]) -> None:
    """Prints the table of all results, and writes them as one file."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, f"{number}.parquet") for number in range(len(results))]
        for file, result in zip(files, results):
            file.write_bytes(result)
        output = [] if options.output is None else ["--output", options.output]
        done = subprocess.run([options.agv, "campaign", *files, *output, *options.extra], stderr=subprocess.PIPE)
        if done.returncode != 0:
            raise Failure(f"the results cannot be put together: {complaint(done)}")


def positive(text: str) -> int:
    """A number from 1."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 1")
    return int(text)


def parse(arguments: list[str]) -> argparse.Namespace:
    """Reads the command line."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    parser = argparse.ArgumentParser(
        usage="%(prog)s [OPTIONS] CAMPAIGN [-- ARGUMENTS OF agv campaign]",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("campaign", metavar="CAMPAIGN", help="the campaign, such as host-sim/scenarios/faults.toml")
    parser.add_argument("--agv", metavar="PATH", default="agv", help="the command; default: agv on the PATH")
    parser.add_argument("--shards", metavar="N", type=positive, help="parts of the campaign; default: four a core")
    parser.add_argument("--output", metavar="FILE", help="write every run, as Apache Parquet")
    parser.add_argument("--address", metavar="HOST:PORT", help="a running cluster; default: one of this machine alone")
    parser.add_argument("--workers", metavar="N", type=positive, help="workers on this machine; default: one a core")
    options = parser.parse_args(arguments[:end])
    options.extra = arguments[end + 1 :]
    if options.address is not None and options.workers is not None:
        parser.error("--workers is for a cluster on this machine, without --address")
    return options


def main() -> int:
    """Runs the command. Returns its exit code."""
    options = parse(sys.argv[1:])
    try:
        found = shutil.which(options.agv)
        if found is None:
            raise Failure(f"{options.agv} is no command")
        # Tasks run in folders of their own.
        options.agv = str(Path(found).resolve())
        options.campaign = str(Path(options.campaign).resolve())
        if options.output is not None and not Path(options.output).resolve().parent.is_dir():
            raise Failure(f"there is no folder for {options.output}")
        # Standard output is for the table; Ray prints there, too.
        with contextlib.redirect_stdout(sys.stderr):
            results = run_shards(options)
        merge(options, results)
    except Failure as failure:
        print(f"campaign.py: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

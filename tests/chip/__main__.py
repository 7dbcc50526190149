"""Checks of the image that is flashed, in the emulated chip. `cargo xtask chip` calls this with everything that it needs.

Each check is one line of JSON; the exit code tells whether all have passed.
"""

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor

from bench import Bench
from checks import CHECKS, checks_of
from emulated_chip.description import Description
from served import serve


def run(options, name):
    start = time.monotonic()
    bench = Bench(options.image, options.description, options.hook, options.long)
    answer = {"check": name}
    try:
        CHECKS[name](bench)
        answer["passed"] = True
    except AssertionError as failure:
        answer["passed"] = False
        answer["why"] = str(failure)
    answer["facts"] = bench.facts
    answer["seconds"] = round(time.monotonic() - start, 1)
    return answer


def main():
    parser = argparse.ArgumentParser(prog="chip", description=__doc__)
    parser.add_argument("--image", required=True, help="the file that is flashed, ELF")
    parser.add_argument("--description", required=True, help="the chip's description, JSON")
    parser.add_argument("--hook", required=True, help="block_hook.c, built as a shared library")
    parser.add_argument("--long", action="store_true", help="full sweeps instead of samples of them")
    parser.add_argument("--list", action="store_true", help="only name the checks")
    parser.add_argument("--serve", action="store_true", help="be a part of a vehicle: see served.py")
    parser.add_argument("checks", nargs="*", help="checks to run; all of them if none is named")
    options = parser.parse_args()
    if options.serve:
        bench = Bench(options.image, options.description, options.hook)
        serve(bench, sys.stdin, lambda line: print(line, flush=True))
        return 0
    all_checks = checks_of(Description(options.description).name)
    if options.list:
        print("\n".join(all_checks))
        return 0
    unknown = [name for name in options.checks if name not in all_checks]
    if unknown:
        parser.error(f"there is no check {unknown[0]}")
    names = options.checks or all_checks
    has_failed = False
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for answer in pool.map(run, [options] * len(names), names):
            has_failed |= not answer["passed"]
            print(json.dumps(answer), flush=True)
    return int(has_failed)


if __name__ == "__main__":
    sys.exit(main())

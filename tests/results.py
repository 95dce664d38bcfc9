#!/usr/bin/env python3
"""Prints what a run of ctest came to: the end of what each failed test printed, then "N passed, N failed".

    tests/results.py JUNIT_FILE

Exit code 1 if a test failed, or if there is no such file.
"""

import sys
import xml.etree.ElementTree as ElementTree

LINES_MAX = 40  # a failed test; ctest has printed all of them where it ran


def end_of(test: ElementTree.Element) -> str:
    lines = (test.findtext("system-out") or "").rstrip().splitlines()
    return "\n".join(f"  {line}" for line in lines[-LINES_MAX:])


def main() -> int:
    try:
        suite = ElementTree.parse(sys.argv[1]).getroot()
    except (OSError, ElementTree.ParseError) as error:
        print(f"no results: {error}", file=sys.stderr)
        return 1
    failed = [test for test in suite.iter("testcase") if test.get("status") == "fail"]
    for test in failed:
        print(f"{test.get('name')} failed:\n{end_of(test)}")
    skipped = int(suite.get("skipped", 0)) + int(suite.get("disabled", 0))
    passed = int(suite.get("tests", 0)) - len(failed) - skipped
    print(f"{passed} passed, {len(failed)} failed" + (f", {skipped} skipped" if skipped else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Runs clang-tidy on the sources of a build that lie in one folder, and ends with 1 if it finds anything.

    tidy_check.py CLANG_TIDY BUILD FOLDER

Tests and generated files are left out. BUILD must have been built: what a translation unit includes is asked of ninja.
What was clean before, and has not changed since, is not looked at again (BUILD/tidy).

Nearly all of the time goes into headers, so the sources are checked as one translation unit, in which local names of
two sources must not clash; those for other processors, of other standards, and programs, are checked apart. A source
that is compiled several times, for several precisions, is checked once.
"""

import hashlib
import json
import pathlib
import re
import shlex
import subprocess
import sys

# The headers of SpiderMonkey refuse this clang.
LEFT_OUT = {"spidermonkey_engine.cc"}
# Warnings are those of the compiler that builds.
ARGUMENTS = ["--quiet", "--warnings-as-errors=*", "--extra-arg=-Wno-everything"]


def sources(entry):
    """The files of a translation unit: of a grouped one, those that it groups."""
    file = pathlib.Path(entry["file"])
    if not file.name.startswith("unity_"):
        return [file]
    return [pathlib.Path(name) for name in re.findall(r'^#include "(.*)"$', file.read_text(), re.MULTILINE)]


def dependencies(build):
    """From object to the files that it is made of, as ninja knows them."""
    listing = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True)
    deps, target = {}, None
    for line in listing.stdout.splitlines():
        if line.startswith("    "):
            deps[target].append(line.strip())
        elif ":" in line and not line.startswith("ninja:"):
            target = line.split(":")[0]
            deps[target] = []
    return deps


def digest(top, entry, files):
    """Changes with the command, the checks, and all files of the project that the translation unit includes."""
    hash = hashlib.sha256(entry["command"].encode())
    hash.update((top / ".clang-tidy").read_bytes())
    hash.update(pathlib.Path(__file__).read_bytes())
    for name in sorted(files):
        file = pathlib.Path(entry["directory"], name)
        if file.is_relative_to(top) and file.exists() and file.suffix in (".h", ".cc", ".cxx"):
            hash.update(file.read_bytes())
    return hash.hexdigest()


def flags(entry):
    """What the meaning of the code depends on: where headers are, macros, the processor."""
    words = shlex.split(entry["command"])
    found = []
    for n, word in enumerate(words):
        if word == "-isystem":
            found.append((word, words[n + 1]))
        elif word.startswith(("-I", "-D", "-std", "-m")):
            found.append((word,))
    return found


def is_clean(tidy, together, units):
    """Checks units, [(flags, file)], as one; prints what is found."""
    together.write_text("".join(f'#include "{file}"\n' for _, file in units))
    words = [word for flag in dict.fromkeys(flag for own, _ in units for flag in own) for word in flag]
    run = subprocess.run([tidy, *ARGUMENTS, together, "--", *words], capture_output=True, text=True)
    if run.returncode != 0:
        print(run.stdout, run.stderr)
    return run.returncode == 0


def main():
    tidy, build, folder = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    top = pathlib.Path(__file__).resolve().parent.parent
    scratch = build / "tidy" / folder
    scratch.mkdir(parents=True, exist_ok=True)
    deps = dependencies(build)
    seen, units, stamps, programs = set(), {}, [], 0
    for entry in json.loads((build / "compile_commands.json").read_text()):
        files = [
            file for file in sources(entry)
            if file.is_relative_to(top / folder) and re.search(r"(?<!_test)\.cc$", file.name) and file not in seen
            and file.name not in LEFT_OUT
        ]
        if not files:
            continue
        seen.update(files)
        object_file = re.search(r" -o (\S+)", entry["command"]).group(1)
        stamp = scratch / digest(top, entry, deps.get(object_file, []))
        if stamp.exists():
            continue
        stamps.append(stamp)
        kind = str([flag for flag in flags(entry) if flag[0].startswith(("-m", "-std"))])
        for file in files:
            # Only one of them can have a main().
            is_program = bool(re.search(r"^int main\(", file.read_text(), re.MULTILINE))
            units.setdefault((kind, programs if is_program else 0), []).append((flags(entry), file))
            programs += is_program

    results = [is_clean(tidy, scratch / "together.cc", group) for group in units.values()]
    if all(results):
        for stamp in stamps:
            stamp.touch()
    print(f"{sum(map(len, units.values()))} of {len(seen)} files, in {len(units)} runs")
    return 0 if all(results) and seen else 1


if __name__ == "__main__":
    sys.exit(main())

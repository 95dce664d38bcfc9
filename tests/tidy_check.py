#!/usr/bin/env python3
"""Runs clang-tidy on the translation units of a build that lie in one folder, and ends with 1 if it finds anything.

    tidy_check.py CLANG_TIDY BUILD FOLDER

Tests and generated files are left out. BUILD must have been built: what a translation unit includes is asked of ninja.
What was clean before, and has not changed since, is not looked at again (BUILD/tidy).
"""

import hashlib
import json
import pathlib
import re
import subprocess
import sys

# The precompiled headers are not clang's. Warnings are those of the compiler that builds.
PRECOMPILED = re.compile(r" -include \S*cmake_pch\.hxx(?= )")
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
    for name in sorted(files):
        file = pathlib.Path(entry["directory"], name)
        if file.is_relative_to(top) and file.exists() and file.suffix in (".h", ".cc", ".cxx"):
            hash.update(file.read_bytes())
    return hash.hexdigest()


def main():
    tidy, build, folder = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    top = pathlib.Path(__file__).resolve().parent.parent
    database = build / "tidy" / folder
    database.mkdir(parents=True, exist_ok=True)
    deps = dependencies(build)
    entries = []
    for entry in json.loads((build / "compile_commands.json").read_text()):
        files = sources(entry)
        if not all(file.is_relative_to(top / folder) and re.search(r"(?<!_test)\.cc$", file.name) for file in files):
            continue
        entry["command"] = PRECOMPILED.sub("", entry["command"])
        entries.append(entry)
    (database / "compile_commands.json").write_text(json.dumps(entries))

    found = False
    for entry in entries:
        object_file = re.search(r" -o (\S+)", entry["command"]).group(1)
        stamp = database / digest(top, entry, deps.get(object_file, []))
        if stamp.exists():
            continue
        run = subprocess.run([tidy, "-p", database, *ARGUMENTS, entry["file"]], capture_output=True, text=True)
        if run.returncode == 0:
            stamp.touch()
        else:
            found = True
            print(run.stdout, run.stderr)
    print(f"{len(entries)} translation units")
    return 1 if found or not entries else 0


if __name__ == "__main__":
    sys.exit(main())

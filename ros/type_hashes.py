#!/usr/bin/env python3
"""Writes the RIHS01 hashes of ROS 2's types (REP 2011) from the IDL files of this folder to type_hashes.inc.

    type_hashes.py           writes the file
    type_hashes.py --check   compares it

A hash is the SHA-256 of a type's description as JSON: names and types of all fields, and those of all types
that it refers to. The IDL files have ROS's names but for underscores, and beginnings that rmw_cyclonedds adds
to requests and replies, which are no part of a type.
"""

import hashlib
import json
import re
import sys
from pathlib import Path
from typing import Any

# type_description_interfaces/msg/FieldType; `octet` is ROS's uint8.
BASIC = {
    "int8": 2,
    "octet": 3,
    "uint16": 5,
    "long": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float": 10,
    "double": 11,
    "boolean": 15,
    "string": 17,
}
NESTED = 1
ARRAY = 48
SEQUENCE = 144

MODULE = re.compile(r"module (\w+) \{ module (\w+) \{ module dds_ \{(.*?)\}; \}; \};", re.DOTALL)
STRUCT = re.compile(r"struct (\w+)_ \{(.*?)\};", re.DOTALL)
FIELD = re.compile(r"(?P<type>[\w:<>]+) (?P<name>\w+)(?:\[(?P<size>\d+)\])?;")

# As JSON; by name, "package/msg/Name".
Description = dict[str, Any]
Types = dict[str, Description]


def ros_name(name: str, folder: str) -> str:
    """Of a DDS name that is used in a folder, "package/msg"."""
    words = name.rstrip("_").split("::")
    return "/".join([words[0], words[1], words[-1]] if len(words) > 1 else [folder, *words])


def field_of(declared: re.Match[str], folder: str) -> Description:
    sequence = re.fullmatch(r"sequence<(.*)>", declared["type"])
    element = sequence[1] if sequence else declared["type"]
    size = int(declared["size"] or 0)
    number = BASIC.get(element, NESTED) + (SEQUENCE if sequence else ARRAY if size else 0)
    return {
        "name": declared["name"],
        "type": {
            "type_id": number,
            "capacity": size,
            "string_capacity": 0,
            "nested_type_name": "" if element in BASIC else ros_name(element, folder),
        },
    }


def types_of(idl: str) -> Types:
    types = {}
    for package, kind, body in MODULE.findall(re.sub(r"//[^\n]*", "", idl)):
        folder = f"{package}/{kind}"
        for struct, text in STRUCT.findall(body):
            fields = [field_of(declared, folder) for declared in FIELD.finditer(text)]
            if [field["name"] for field in fields[:2]] == ["client", "number"]:
                fields = fields[2:]
            types[f"{folder}/{struct}"] = {"type_name": f"{folder}/{struct}", "fields": fields}
    return types


def nested_in(description: Description) -> list[str]:
    return [field["type"]["nested_type_name"] for field in description["fields"] if field["type"]["nested_type_name"]]


def hash_of(name: str, types: Types) -> str:
    found: set[str] = set()
    left = nested_in(types[name])
    while left:
        nested = left.pop()
        if nested not in found:
            found.add(nested)
            left.extend(nested_in(types[nested]))
    whole = {"type_description": types[name], "referenced_type_descriptions": [types[other] for other in sorted(found)]}
    return hashlib.sha256(json.dumps(whole).encode()).hexdigest()


def dds_name(name: str) -> str:
    package, kind, struct = name.split("/")
    return f"{package}::{kind}::dds_::{struct}_"


def table(folder: Path) -> str:
    types: Types = {}
    for file in sorted(folder.glob("*.idl")):
        types.update(types_of(file.read_text(encoding="utf-8")))
    lines = ["// Of all types, by name; written by type_hashes.py."]
    lines += [f'{{"{dds_name(name)}",\n "RIHS01_{hash_of(name, types)}"}},' for name in sorted(types)]
    return "\n".join([*lines, ""])


def main() -> int:
    folder = Path(__file__).parent
    file = folder / "type_hashes.inc"
    if sys.argv[1:] != ["--check"]:
        file.write_text(table(folder), encoding="utf-8")
    elif file.read_text(encoding="utf-8") != table(folder):
        print(f"{file} is not that of the IDL files: run {__file__}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

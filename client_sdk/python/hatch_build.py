"""Generates messages and gRPC stubs from the protocol files while the package is built, and adds its compiled parts.

The files are in `proto/` of the repository, or of the source distribution. `grpcio-tools` generates the
modules if it is installed; otherwise `protoc` and `grpc_python_plugin` do, which building Tessera requires
anyway.

They are built with Tessera, if pybind11 is installed: in `build/release/bin` of the repository, or where
TESSERA_COMPILED says. A package without them is a client of clusters only.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = "tessera/_proto"
NAMES = ("world.proto", "command.proto", "query.proto", "tessera.proto")
DESCRIBED = "foxglove"  # no module: other packages register messages of the same names


def compiler() -> list[str]:
    """The command line that generates, up to its options."""
    if find_spec("grpc_tools"):
        return [sys.executable, "-m", "grpc_tools.protoc"]
    protoc, plugin = shutil.which("protoc"), shutil.which("grpc_python_plugin")
    if protoc and plugin:
        return [protoc, f"--plugin=protoc-gen-grpc_python={plugin}"]
    raise RuntimeError(
        "cannot generate messages: install grpcio-tools, or protoc with grpc_python_plugin"
    )


def generate(sources: Path, output: Path) -> None:
    """Writes the modules of `sources`, in PACKAGE, to `output`.

    The file names include PACKAGE, so that the modules import each other from there, and do not clash with
    `world.proto` of another package.
    """
    folder = output / PACKAGE
    folder.mkdir(parents=True)
    for name in NAMES:
        text = (sources / name).read_text()
        (folder / name).write_text(text.replace('import "', f'import "{PACKAGE}/'))
    subprocess.run(
        [
            *compiler(),
            f"--proto_path={output}",
            f"--python_out={output}",
            f"--pyi_out={output}",
            f"--grpc_python_out={output}",
            *(f"{PACKAGE}/{name}" for name in NAMES),
        ],
        check=True,
    )


def describe(sources: Path, output: Path) -> None:
    """Writes the file DESCRIBED, as a FileDescriptorSet, to `output`."""
    subprocess.run(
        [
            *compiler(),
            f"--proto_path={sources}",
            f"--descriptor_set_out={output / PACKAGE / DESCRIBED}.binpb",
            "--include_imports",
            f"{DESCRIBED}.proto",
        ],
        check=True,
    )


def compiled_parts(root: Path) -> list[Path]:
    """The compiled module of this package, and the engines that it loads; none if it was not built."""
    default = root.parents[1] / "build" / "release" / "bin" if len(root.parents) > 1 else root
    folder = Path(os.environ.get("TESSERA_COMPILED", default))
    modules = sorted(folder.glob("_native.*.so"))
    if not modules:
        return []
    libraries = ("libtessera-engine-f32.so", "libtessera-engine-f64.so", "libtessera-mjcf.so", "libtessera-wasm.so")
    return [*modules, *(folder / name for name in libraries if (folder / name).exists())]


class GenerateMessages(BuildHookInterface):
    """Adds the generated modules, and those that are compiled, to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel":
            return
        root = Path(self.root)
        packed = root / "proto"
        sources = packed if packed.is_dir() else root.parents[1] / "proto"
        self.output = Path(tempfile.mkdtemp(prefix="tessera-proto-"))
        generate(sources, self.output)
        describe(sources, self.output)
        folder = self.output / PACKAGE
        for file in sorted([*folder.glob("*.py*"), *folder.glob("*.binpb")]):
            build_data["force_include"][str(file)] = f"{PACKAGE}/{file.name}"
        parts = compiled_parts(root)
        for file in parts:
            build_data["force_include"][str(file)] = f"tessera/{file.name}"
        if parts:
            build_data["pure_python"] = False
            build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if self.target_name == "wheel":
            shutil.rmtree(self.output)

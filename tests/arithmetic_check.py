"""Checks that nothing that computes the state of a world calls a function of the C library whose last bits depend on the
processor or on the library's version; lpss/base/portable_math.h has those to use instead. Ends with 1 if something does.

    arithmetic_check.py LIBRARY...      static libraries and modules
"""

import re
import subprocess
import sys
from pathlib import Path

# fma, fmod, remainder, rint, sqrt and the like are correctly rounded.
INEXACT = re.compile(
    r"^(a?(sin|cos|tan)h?|sincos|atan2|exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|cbrt|hypot|[lt]gamma|erfc?)[fl]?$"
)


def called(library: str) -> set[str]:
    """The functions that a library takes from others."""
    dynamic = ["--dynamic"] if Path(library).suffix == ".so" else []
    listing = subprocess.run(
        ["nm", "--undefined-only", "--format=posix", *dynamic, library], capture_output=True, text=True, check=True
    )
    words = (line.split() for line in listing.stdout.splitlines())
    return {parts[0].split("@")[0] for parts in words if len(parts) > 1}


def main() -> int:
    libraries = sys.argv[1:]
    wrong = [f"{library} calls {name}" for library in libraries for name in sorted(called(library)) if INEXACT.match(name)]
    for line in wrong:
        print(line)
    print(f"{len(libraries)} libraries, {len(wrong)} calls of inexact functions")
    return 1 if wrong or not libraries else 0


if __name__ == "__main__":
    sys.exit(main())

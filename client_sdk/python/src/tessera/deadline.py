"""Calls that are made again until a deadline."""

from __future__ import annotations

import time

ASK_AGAIN_S = 0.05


def is_worth_another(deadline: float | None) -> bool:
    """Waits a little before a call is made again; false, and at once, where its deadline comes before."""
    if deadline is not None and time.monotonic() + ASK_AGAIN_S >= deadline:
        return False
    time.sleep(ASK_AGAIN_S)
    return True

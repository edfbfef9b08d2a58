"""What our own clouds say of themselves: station, frame, pose, and where their sigmas come from."""

from __future__ import annotations

import json

#: title of the time at which a scan began, as E57 counts it
START = "start [GPS s]"
#: facts that are kept, and characters of each
_MOST, _LENGTH = 50, 20_000


def told_facts(text: str | bytes) -> dict[str, str]:
    """Facts in a JSON record, as strings by name; none if it is not such a record."""
    try:
        told = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    if not isinstance(told, dict):
        return {}
    out: dict[str, str] = {}
    for name, value in list(told.items())[:_MOST]:
        if value is None or name == "name" or isinstance(value, dict):
            continue
        said = " to ".join(map(str, value)) if isinstance(value, list) else str(value)
        out[str(name)[:80]] = said[:_LENGTH]
    return out

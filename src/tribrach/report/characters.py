"""Characters of names in reports: those that do something instead of being seen are made visible.

Names come from files. A name with U+202E turns the rest of its sentence round, so that 12.3 mm is
read as 3.21 mm; one with an escape moves the cursor of a terminal. Neither stays in a report.

Source: Unicode Technical Report 36, "Unicode Security Considerations", section 2.5.
"""

from __future__ import annotations

import re

from tribrach.errors import STEERING


def anchor(text: str) -> str:
    """A text as the end of an anchor in a page: its letters and digits, a dash for the rest."""
    return re.sub(r"\W+", "-", text)


def visible(text: str) -> str:
    """A text whose every character is seen, as long as it was; line ends and tabulators stay.

    Control characters of ASCII become their pictures, everything else that steers U+FFFD.
    """
    return STEERING.sub(_shown, text)


def _shown(found: re.Match[str]) -> str:
    """What stands for a character that steers."""
    character = found.group()
    if character in "\n\t":
        return character
    code = ord(character)
    return chr(0x2400 + code) if code < 0x20 else "\u2421" if code == 0x7F else "\ufffd"

"""Why something was not read, in the reader's language.

The reader of scans says its reasons as English sentences, for programs and people alike. Those known
here are told in other languages; an unknown one is told as it is.
"""

import re

from grader.i18n import N_, Tongue

REASONS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), text)
    for pattern, text in (
        (
            r"no stroke between (?P<start>\S+) and (?P<end>\S+) could be told apart",
            N_("no stroke between %(start)s and %(end)s could be told apart"),
        ),
        (
            r"(?P<nodes>.+), on which it hangs, was not read for certain",
            N_("%(nodes)s, on which it hangs, was not read for certain"),
        ),
        (r"(?P<name>\S+) was not found on the sheets", N_("%(name)s was not found on the sheets")),
        (r"no mechanism sketch was found on the sheets", N_("no mechanism sketch was found on the sheets")),
        (r"no velocity plan was found on the sheets", N_("no velocity plan was found on the sheets")),
        (r"no acceleration plan was found on the sheets", N_("no acceleration plan was found on the sheets")),
        (r"not drawn: (?P<node>\S+) found by similarity", N_("not drawn: %(node)s found by similarity")),
        (r"not drawn: .*normal component.* left out", N_("not drawn: normal component left out")),
        (r"not drawn: .*Coriolis component.* left out", N_("not drawn: Coriolis component left out")),
    )
)


def told_reason(reason: str, speaker: Tongue) -> str:
    """A reason of the reader, in a language."""
    for pattern, text in REASONS:
        found = pattern.fullmatch(reason)
        if found is not None:
            return speaker.gettext(text) % found.groupdict()
    return reason

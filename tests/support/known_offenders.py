"""Violations of the rules for sources that exist today: a ratchet. A new one fails the test, and so does an entry that no longer
occurs, so that the list only becomes shorter."""
import collections
import re

from tests.support.sources import text

LIST = "tests/architecture/known_offenders.txt"


def without_line_number(offender):
    return re.sub(r":\d+:", ":", offender, count=1)


def known(rule):
    """Counter of the listed offenders of `rule`: the lines below its "# RULE" heading."""
    found, current = collections.Counter(), None
    for line in text(LIST).splitlines():
        if line.startswith("# "):
            current = line[2:]
        elif line and current == rule:
            found[line] += 1
    return found


def expect_only_known(test, rule, offenders):
    found = collections.Counter(map(without_line_number, offenders))
    listed = known(rule)
    test.assertFalse(found - listed, f"\nnew offenders of {rule}:\n" + "\n".join(sorted((found - listed).elements())))
    test.assertFalse(listed - found, f"\nremove from {LIST}, under {rule}:\n" + "\n".join(sorted((listed - found).elements())))

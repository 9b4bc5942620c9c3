"""--set PATH=VALUES: which place of a document takes which values."""
import decimal
import json
import re

VALUES_MAX = 100_000  # as many as the queue takes; more is a typing mistake
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
RANGE = re.compile(rf"({NUMBER})\.\.({NUMBER})(?::({NUMBER}))?")


class BadSweep(Exception):
    """A sentence that says what is wrong with one --set."""


def read_path(text):
    """The keys from the document's root: of "a.b.0", or of the JSON pointer "/a/b/0"."""
    if text.startswith("/"):
        keys = [key.replace("~1", "/").replace("~0", "~") for key in text[1:].split("/")]
    else:
        keys = text.split(".")
    return tuple(keys) if all(keys) else None


def number(value):
    """A decimal as JSON writes it: 30, not 30.0, where it is whole."""
    return int(value) if value == value.to_integral_value() and abs(value) < 2**53 else float(value)


def read_range(first, last, step, text):
    # In decimals: 0..1:0.1 has eleven values, and the third is 0.2.
    first, last = decimal.Decimal(first), decimal.Decimal(last)
    step = decimal.Decimal(step) if step else decimal.Decimal(1 if last >= first else -1)
    if step == 0 or (last - first) * step < 0:
        raise BadSweep(f"--set {text}: the step leads away from the end")
    count = int((last - first) / step) + 1
    if count > VALUES_MAX:
        raise BadSweep(f"--set {text}: {count} values; at most {VALUES_MAX} are taken")
    return [number(first + index * step) for index in range(count)]


def read_list(values):
    try:
        return json.loads(f"[{values}]", parse_constant=lambda name: name)
    except ValueError:
        return [as_json(value) for value in values.split(",")]


def as_json(text):
    try:
        return json.loads(text, parse_constant=lambda name: name)
    except ValueError:
        return text  # a word: draft, "#c03020" without its quotes


def read_sweep(text):
    """(path, values)"""
    place, equals, values = text.partition("=")
    path = read_path(place)
    if not equals or not path or not values:
        raise BadSweep(f"--set must be PATH=VALUES as camera.fov=30..60:5 or accuracy.preset=draft,fine, got {text!r}")
    found = RANGE.fullmatch(values)
    return path, read_range(*found.groups(), text) if found else read_list(values)


def with_value(node, path, value):
    """A copy of `node` with `value` at `path`; what is not changed is shared. KeyError names what is not there."""
    key, rest = path[0], path[1:]
    if isinstance(node, list):
        if not key.isdecimal() or int(key) >= len(node):
            raise KeyError(f"{key!r} is no index below {len(node)}")
        changed = list(node)
        changed[int(key)] = with_value(node[int(key)], rest, value) if rest else value
        return changed
    if isinstance(node, dict):
        inner = with_value(node.get(key, {}), rest, value) if rest else value
        return {**node, key: inner}
    raise KeyError(f"{key!r} cannot be set within {json.dumps(node)}")

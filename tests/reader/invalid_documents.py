#!/usr/bin/python3
"""Invalid and doubtful documents, and the issues or warnings that each must give, from the tables in tests/reader/invalid.

A line of a table is a JSON object. `{"base": DOCUMENT, "at": POINTER}` sets a valid document and the default pointer for the lines
below it; with `"request": "batch"` or "measure" it is the body of that request. Each other line is a case:

    name             unique in its table
    patch            a JSON merge patch (RFC 7396) of the base's value at the JSON pointer `at`; a missing value is created, also one at
                     the end of an array (RFC 6901: "-")
    text             instead of `patch`: the document itself; "\\udcXX" is the byte XX
    issues           all issues in document order: [[POINTER, CODE], ...]; [] if it is accepted
    error            instead of `issues`: "not_json LINE:COLUMN" or "too_large"
    warnings         instead of `issues`: all warnings of a document that is accepted: [[POINTER, CODE], ...]
    detail           the sentence of the only issue or of the error
    schema_accepts   true where a JSON Schema cannot find the error: a reference, a limit, degenerate geometry, a duplicate name

An object with one member `$RULE` stands for the value that the rule of this file generates. Numbers keep their spelling.
Run as a program, this file prints all cases for invalid_documents_test.cpp: bases first.
"""
import dataclasses
import json
import math
import pathlib
import sys

TABLES = pathlib.Path(__file__).parent / "invalid"


@dataclasses.dataclass
class Case:
    name: str  # TABLE.NAME
    text: bytes
    outcome: list  # lines as reader_tests::outcome() gives them
    request: str = "scene"
    schema_accepts: bool = False
    detail: str = ""  # not compared if empty

    @property
    def is_read(self):
        """False where the document is not JSON or exceeds a limit of the parser."""
        return not self.outcome[0].startswith(("not_json", "too_large"))


class Number(str):
    """The spelling of a number: 1e999 and 1.5000 survive reading and writing."""


def star(count):
    """A polygon whose even corners are reflex."""
    def corner(i):
        radius = (0.5, 1)[i % 2]
        return [Number(round(radius * f(2 * math.pi * i / count), 4)) for f in (math.cos, math.sin)] + [Number(0)]
    return [corner(i) for i in range(count)]


def chain(count, copies, last):
    """Prototypes p0 to pCOUNT: each is `copies` instances of the next one, the last is `last`."""
    return {f"p{i}": [{"type": "instance", "of": f"p{i + 1}"}] * copies for i in range(count)} | {f"p{count}": last}


RULES = {"$repeat": lambda text, count: text * int(count),
         "$join": lambda *parts: "".join(parts),
         "$range": lambda count: [Number(i) for i in range(int(count))],
         "$labels": lambda count: {f"l{i}": "" for i in range(int(count))},
         "$star": lambda count: star(int(count)),
         "$chain": lambda count, copies, last: chain(int(count), int(copies), last)}


def expand(value):
    if isinstance(value, list):
        return [expand(element) for element in value]
    if not isinstance(value, dict):
        return value
    members = {name: expand(member) for name, member in value.items()}
    rule = RULES.get(next(iter(members), None))
    return rule(*next(iter(members.values()))) if rule else members


def merged(target, patch):
    """RFC 7396."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for name, member in patch.items():
        if member is None:
            result.pop(name, None)
        else:
            result[name] = merged(result.get(name), member)
    return result


def patched(value, pointer, patch):
    if not pointer:
        return merged(value, patch)
    name, _, rest = pointer[1:].partition("/")
    rest = rest and "/" + rest
    if isinstance(value, list):
        index = len(value) if name == "-" else int(name)
        return value[:index] + [patched(value[index] if index < len(value) else None, rest, patch)] + value[index + 1:]
    return {**(value or {}), name: patched((value or {}).get(name), rest, patch)}


def written(value):
    if isinstance(value, Number):
        return str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(name)}: {written(member)}" for name, member in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return json.dumps(value)


def lines(table):
    for line in table.read_text("utf-8").splitlines():
        yield expand(json.loads(line, parse_int=Number, parse_float=Number))


def bases():
    """A case for each base; the reader must accept it."""
    return [Case(f"{table.stem}.base", written(line["base"]).encode(), ["accepted"], line.get("request", "scene"), True)
            for table in sorted(TABLES.glob("*.jsonl")) for line in lines(table) if "base" in line]


def cases_of(table):
    base, base_at, request = None, "", "scene"
    for line in lines(table):
        if "base" in line:
            base, base_at, request = line["base"], line.get("at", ""), line.get("request", "scene")
            continue
        text = line["text"] if "text" in line else written(patched(base, line.get("at", base_at), line["patch"]))
        listed = [f'{pointer or chr(34) * 2} {code}' for pointer, code in line.get("issues") or line.get("warnings", [])]
        outcome = ["warnings", *listed] if "warnings" in line else listed or [line.get("error", "accepted")]
        yield Case(f"{table.stem}.{line['name']}", text.encode("utf-8", "surrogateescape"), outcome, request,
                   line.get("schema_accepts", outcome[0] in ("accepted", "warnings")), line.get("detail", ""))


def cases():
    return [case for table in sorted(TABLES.glob("*.jsonl")) for case in cases_of(table)]


def main():
    for case in bases() + cases():
        sys.stdout.buffer.write(f"{case.name} {case.request} {len(case.text)} {len(case.outcome)}\n".encode())
        sys.stdout.buffer.write("".join(f"{line}\n" for line in (case.detail, *case.outcome)).encode() + case.text + b"\n")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""The seeds of the fuzzers: tests/fuzz/corpus has a file for each fuzzer and a line for each seed.

seeds.py unpack DIRECTORY       writes each seed to a file, DIRECTORY/FUZZER/NAME
seeds.py add FUZZER FILE...     adds files, such as those that soak.py has found

A line is a JSON object with `name` and `text`, or `base64` for bytes that are no UTF-8.
"""
import argparse
import base64
import json
import pathlib
import shutil

CORPUS = pathlib.Path(__file__).parent / "corpus"
FUZZERS = sorted(path.stem for path in CORPUS.glob("*.jsonl"))


def read(fuzzer):
    """{name: bytes}"""
    with (CORPUS / f"{fuzzer}.jsonl").open(encoding="utf-8") as lines:
        seeds = [json.loads(line) for line in lines]
    return {seed["name"]: seed["text"].encode() if "text" in seed else base64.b64decode(seed["base64"]) for seed in seeds}


def unpack(directory):
    for fuzzer in FUZZERS:
        shutil.rmtree(directory / fuzzer, ignore_errors=True)
        (directory / fuzzer).mkdir(parents=True)
        for name, seed in read(fuzzer).items():
            (directory / fuzzer / name).write_bytes(seed)


def encoded(name, seed):
    try:
        return json.dumps({"name": name, "text": seed.decode()}, ensure_ascii=False)
    except UnicodeDecodeError:
        return json.dumps({"name": name, "base64": base64.b64encode(seed).decode()})


def add(fuzzer, paths):
    seeds = read(fuzzer)
    seeds |= {path.name: path.read_bytes() for path in paths}
    (CORPUS / f"{fuzzer}.jsonl").write_text("".join(f"{encoded(*seed)}\n" for seed in sorted(seeds.items())), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("unpack").add_argument("directory", type=pathlib.Path)
    adding = commands.add_parser("add")
    adding.add_argument("fuzzer", choices=FUZZERS)
    adding.add_argument("files", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.command == "unpack":
        unpack(arguments.directory)
    else:
        add(arguments.fuzzer, arguments.files)


if __name__ == "__main__":
    main()

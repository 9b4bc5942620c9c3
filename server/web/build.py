#!/usr/bin/env python3
"""Builds the page of the daemon: server/web/build.py CACHE OUT

Installs the packages of package-lock.json into CACHE (kept and shared by all build trees, so that later builds need no
network), bundles the modules with esbuild into OUT/files, compresses them, and writes OUT/page_files.S and
OUT/page_table.cpp, which embed them in the daemon. Equal sources give equal bytes."""
import fcntl
import gzip
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
TIME_LIMIT_S = 300  # npm waits for ever where it does not trust the registry's certificate
# Each is a program of its own: the page, its workers, and the stylesheet.
ENTRIES = ("main.js", "stream-worker.js", "schema-worker.js", "image-worker.js", "live/live-view.js", "app.css")
TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".html": "text/html; charset=utf-8",
         ".txt": "text/plain; charset=utf-8", ".json": "application/json", ".svg": "image/svg+xml"}
EXAMPLE_BYTES_MAX = 40_000


def run(command, cwd, what):
    try:
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=TIME_LIMIT_S, stdin=subprocess.DEVNULL, check=False)
    except FileNotFoundError:
        sys.exit(f"{what}: there is no {command[0]}; docker/install Web installs Node.js and npm")
    except subprocess.TimeoutExpired:
        sys.exit(f"{what}: no end within {TIME_LIMIT_S} s. Can this machine reach the npm registry, and does npm trust its certificate?")
    if done.returncode != 0:
        sys.exit(f"{what}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def install(cache):
    """Installs the packages, unless CACHE has exactly those of the lock file."""
    names = ("package.json", "package-lock.json", ".npmrc")
    wanted = hashlib.sha256(b"".join((HERE / name).read_bytes() for name in names)).hexdigest()
    stamp = cache / "installed"
    if stamp.exists() and stamp.read_text(encoding="ascii") == wanted:
        return
    for name in names:
        shutil.copyfile(HERE / name, cache / name)
    run(["npm", "ci", "--ignore-scripts", "--fetch-timeout=30000", "--fetch-retries=1"], cache, "npm ci for the page in server/web")
    stamp.write_text(wanted, encoding="ascii")


def licences(modules):
    """The licence texts of the packages that the bundle contains."""
    package = json.loads((HERE / "package.json").read_text(encoding="utf-8"))
    tools = set(package["devDependencies"])
    parts = []
    for path in sorted(modules.glob("**/package.json")):
        name = path.parent.relative_to(modules).as_posix()
        is_package = name.count("/") == (1 if name.startswith("@") else 0)
        if not is_package or name in tools or name.startswith("@esbuild/"):
            continue
        texts = [text.read_text(encoding="utf-8") for text in sorted(path.parent.glob("LICEN[CS]E*"))]
        described = json.loads(path.read_text(encoding="utf-8"))
        parts.append(f"{name} {described['version']}: {described.get('license')}\n\n" + "\n".join(texts))
    return ("\n" + "-" * 80 + "\n\n").join(parts)


def examples():
    """The example scenes that are small enough to edit, by name."""
    found = {path.stem: path.read_text(encoding="utf-8") for path in sorted((HERE / "../../scenes").resolve().glob("*.json"))
             if path.stat().st_size < EXAMPLE_BYTES_MAX}
    return json.dumps(found)


def bundle(cache, files):
    shutil.rmtree(files, ignore_errors=True)
    sources = cache / "sources"  # where the modules find node_modules; the same for every build tree
    shutil.rmtree(sources, ignore_errors=True)
    shutil.copytree(HERE, sources, ignore=shutil.ignore_patterns("*.py", "*.txt", "*.h", "package*", ".npmrc"))
    (sources / "examples.json").write_text(examples(), encoding="utf-8")
    run([cache / "node_modules/.bin/esbuild", *ENTRIES, "examples.json", "--bundle", "--splitting", "--format=esm", "--minify",
         "--target=es2022", "--preserve-symlinks", "--legal-comments=none", "--loader:.json=copy", "--loader:.svg=copy", "--loader:.glsl=text",
         "--entry-names=[name]", "--asset-names=[name]", "--chunk-names=[name]-[hash]", f"--outdir={files}"], sources, "esbuild")
    (files / "licences.txt").write_text(licences(cache / "node_modules"), encoding="utf-8")
    shutil.copyfile(HERE / "icon.svg", files / "icon.svg")


def tree_hash(files):
    """The first 16 hexadecimal digits of the SHA-256 over names and contents: the directory that the page names."""
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def embed(out, paths, tree):
    assembler, table, rows = [], [], []
    for index, path in enumerate(paths):
        packed = out / "packed" / f"{path.name}.gz"
        packed.write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
        for kind, source in (("raw", path), ("gzip", packed)):
            symbol = f"web_{kind}_{index}"
            assembler.append(f'.global {symbol}\n{symbol}:\n.incbin "{source}"\n')
            table.append(f'extern "C" const char {symbol}[];')
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        rows.append(f'    {{"{path.name}", "{TYPES[path.suffix]}", "{sha256}", {{web_raw_{index}, {path.stat().st_size}}}, '
                    f'{{web_gzip_{index}, {packed.stat().st_size}}}}},')
    (out / "page_files.S").write_text('.section .rodata\n' + "".join(assembler) + '.section .note.GNU-stack,"",@progbits\n', encoding="ascii")
    (out / "page_table.cpp").write_text("\n".join(
        ['#include <array>', '#include "server/web/page.h"', *table, "namespace web {", "namespace {",
         f"constexpr std::array<File, {len(rows)}> table{{{{", *rows, "}};", "}",
         f'std::string_view tree() {{ return "{tree}"; }}', "std::span<const File> files() { return table; }", "}", ""]), encoding="ascii")


def main(cache, out):
    cache.mkdir(parents=True, exist_ok=True)
    with open(cache / "lock", "w", encoding="ascii") as lock:  # build trees may be built at the same time
        fcntl.flock(lock, fcntl.LOCK_EX)
        install(cache)
        files = out / "files"
        bundle(cache, files)
    tree = tree_hash(files.iterdir())
    page = files / "index.html"
    page.write_text((HERE / "index.html").read_text(encoding="utf-8").replace("{tree}", tree), encoding="utf-8")
    shutil.rmtree(out / "packed", ignore_errors=True)
    (out / "packed").mkdir()
    embed(out, sorted(files.iterdir()), tree)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())

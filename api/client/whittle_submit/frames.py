"""From the command line to frames: each is one document with its values set and its files named by their hash."""
import dataclasses
import glob
import hashlib
import itertools
import json
import pathlib
import re

from whittle_submit.sweep import with_value

UPLOAD = "sha256:"
PLAIN = re.compile(r"[\w+.-]{1,32}")  # what stands in a file's name as it is


class BadInput(Exception):
    """A sentence that says which file or value cannot be used, and why."""


@dataclasses.dataclass
class Frame:
    name: str       # of the picture, without its ending; unique among all
    batch: str      # the scene's file
    document: dict
    digest: str     # sha256 of the document as it is meant: another digest is another picture
    files: dict     # hash -> path of what it names


def no_duplicates(pairs):
    members = dict(pairs)
    if len(members) != len(pairs):  # which Python would keep the last of, silently
        keys = [key for key, _ in pairs]
        raise ValueError(f"{next(key for key in keys if keys.count(key) > 1)!r} is written twice")
    return members


def no_constants(name):
    raise ValueError(f"{name} is no JSON")


def read_document(path):
    try:
        text = path.read_text(encoding="utf-8-sig")
        document = json.loads(text, object_pairs_hook=no_duplicates, parse_constant=no_constants)
    except (OSError, ValueError, RecursionError) as trouble:
        raise BadInput(f"{path}: {trouble}") from trouble
    if not isinstance(document, dict):
        raise BadInput(f"{path}: must be a scene document, a JSON object")
    return document


class Files:
    """Files that documents name, hashed once each."""

    def __init__(self, leave_missing):
        self.leave_missing = leave_missing
        self.hashes = {}

    def hash_of(self, path, named):
        if path not in self.hashes:
            try:
                digest = hashlib.sha256()
                with open(path, "rb") as file:
                    while piece := file.read(1 << 20):
                        digest.update(piece)
            except FileNotFoundError:
                if self.leave_missing:
                    return None
                raise BadInput(f"{named}: no such file at {path} (--server-files leaves it to the server)") from None
            except OSError as trouble:
                raise BadInput(f"{named}: {trouble}") from trouble
            self.hashes[path] = digest.hexdigest()
        return self.hashes[path]

    def rewritten(self, node, scene, found, pointer=""):
        """`node` with each file that it names, relative to `scene`, named by its hash; `found` gets hash -> path."""
        if isinstance(node, list):
            return [self.rewritten(child, scene, found, f"{pointer}/{i}") for i, child in enumerate(node)]
        if not isinstance(node, dict):
            return node
        changed = {}
        for key, child in node.items():
            at = f"{pointer}/{key}"
            is_file = key == "file" and isinstance(child, str) and not child.startswith(UPLOAD)
            if is_file and (digest := self.hash_of(scene.parent / child, f"{scene}: {at}")):
                found[digest] = scene.parent / child
                changed[key] = UPLOAD + digest
            else:
                # What the job says for itself are names of its owner's.
                changed[key] = child if at == "/job" else self.rewritten(child, scene, found, at)
        return changed


def scene_paths(patterns):
    paths = []
    for pattern in patterns:
        matches = [pattern] if pathlib.Path(pattern).exists() else sorted(glob.glob(pattern, recursive=True))
        if not matches:
            raise BadInput(f"{pattern}: no such file")
        paths += [pathlib.Path(match) for match in matches if pathlib.Path(match) not in paths]
    return paths


def stems(paths):
    """Each file's name for its pictures: the shortest that tells them apart."""
    short = [path.name.removesuffix(".json") for path in paths]
    return [name if short.count(name) == 1 else f"{name}-{i + 1}" for i, name in enumerate(short)]


def value_text(value, index):
    text = value if isinstance(value, str) else json.dumps(value)
    return text if PLAIN.fullmatch(text) else f"{index:04}"


def read_frames(options):
    files = Files(options.server_files)
    paths = scene_paths(options.scenes)
    frames = []
    for path, stem in zip(paths, stems(paths)):
        scene = read_document(path)
        for combination in itertools.product(*(enumerate(values) for _, values in options.sweeps)):
            document, name = scene, stem
            for (place, values), (index, value) in zip(options.sweeps, combination):
                try:
                    document = with_value(document, place, value)
                except KeyError as mistake:
                    raise BadInput(f"{path}: --set {'.'.join(place)}: {mistake.args[0]}") from mistake
                if len(values) > 1:
                    name += f"-{place[-1] if PLAIN.fullmatch(place[-1]) else 'value'}={value_text(value, index)}"
            found = {}
            document = files.rewritten(document, path, found)
            digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
            frames.append(Frame(name, stem, document, digest, found))
    names = set()
    for frame in frames:  # equal last keys (a.x and b.x), or equal values
        base, number = frame.name, 1
        while frame.name in names:
            number += 1
            frame.name = f"{base}-{number}"
        names.add(frame.name)
    if any(len(name.encode()) > 200 for name in names):
        raise BadInput("a picture's name would be longer than 200 bytes: use shorter file names or fewer --set")
    return frames

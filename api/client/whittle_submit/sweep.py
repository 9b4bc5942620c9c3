"""Input: expands scenes and --set options into frames and groups frames into batch requests."""
import dataclasses
import decimal
import glob
import hashlib
import itertools
import json
import pathlib
import re

VALUES_MAX = 100_000  # capacity of the service's queue; a longer range is a typing error
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
RANGE = re.compile(rf"({NUMBER})\.\.({NUMBER})(?::({NUMBER}))?")
SAFE_NAME = re.compile(r"[\w+.-]{1,32}")  # values that appear unchanged in file names
NAME_BYTES_MAX = 200  # file systems allow 255; the rest is for endings
UPLOAD = "sha256:"
MODELS = (".glb", ".gltf", ".obj", ".ply", ".stl")

# Limits of one request. The service's defaults are 10,000 jobs, a body of 64 MiB and documents of 256 MiB, handled in one
# transaction. Smaller requests delay other clients less.
FRAMES_MAX = 1000
BODY_BYTES_MAX = 16 << 20
DOCUMENT_BYTES_MAX = 64 << 20


class InputError(Exception):
    """An invalid argument or file; the message names it and the reason."""


class NoMergePatch(Exception):
    """No merge patch expresses the change: it assigns null, which in a patch removes the member."""


@dataclasses.dataclass
class Frame:
    name: str       # of the image, without its ending; unique in a run
    scene: str      # name of the scene file, without its ending
    document: dict
    digest: str     # SHA-256 of the document: a frame whose digest changes is rendered again
    files: dict     # SHA-256 -> path of each file that the document names


# ---- --set PATH=VALUES


def parse_path(text):
    """Keys from the document root to "a.b.0" or to the JSON pointer "/a/b/0". Returns None if a key is empty."""
    if text.startswith("/"):
        keys = [key.replace("~1", "/").replace("~0", "~") for key in text[1:].split("/")]
    else:
        keys = text.split(".")
    return tuple(keys) if all(keys) else None


def json_number(value):
    """Converts a decimal to the number that JSON writes shortest: 30, not 30.0."""
    return int(value) if value == value.to_integral_value() and abs(value) < 2**53 else float(value)


def expand_range(first, last, step, text):
    # Decimal arithmetic: 0..1:0.1 has eleven values, and the third is 0.2.
    first, last = decimal.Decimal(first), decimal.Decimal(last)
    step = decimal.Decimal(step) if step else decimal.Decimal(1 if last >= first else -1)
    if step == 0 or (last - first) * step < 0:
        raise InputError(f"--set {text}: the step never reaches the end of the range")
    count = int((last - first) / step) + 1
    if count > VALUES_MAX:
        raise InputError(f"--set {text}: {count} values; the maximum is {VALUES_MAX}")
    return [json_number(first + index * step) for index in range(count)]


def parse_json(text, otherwise):
    try:
        return json.loads(text, parse_constant=str)
    except ValueError:
        return otherwise(text)


def parse_list(text):
    """JSON values separated by commas; anything else is a string, such as draft or #c03020."""
    return parse_json(f"[{text}]", lambda _: [parse_json(value, str) for value in text.split(",")])


def parse_sweep(text):
    """Returns (path, values) of one --set option."""
    path, equals, values = text.partition("=")
    keys = parse_path(path)
    if not equals or not keys or not values:
        raise InputError(f"--set must be PATH=VALUES as camera.fov=30..60:5 or accuracy.preset=draft,fine, got {text!r}")
    found = RANGE.fullmatch(values)
    return keys, expand_range(*found.groups(), text) if found else parse_list(values)


def with_value(node, path, value):
    """Returns a copy of `node` with `value` at `path`; unchanged parts are shared. Raises InputError if there is no such path."""
    key, rest = path[0], path[1:]
    if isinstance(node, list):
        if not key.isdecimal() or int(key) >= len(node):
            raise InputError(f"{key!r} is not an index below {len(node)}")
        changed = list(node)
        changed[int(key)] = with_value(node[int(key)], rest, value) if rest else value
        return changed
    if isinstance(node, dict):
        return {**node, key: with_value(node.get(key, {}), rest, value) if rest else value}
    raise InputError(f"{key!r} cannot be set within {json.dumps(node)}")


# ---- Scenes and frames


def json_digest(value):
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def file_digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def unique_members(pairs):
    members = dict(pairs)
    if len(members) != len(pairs):  # Python would keep the last duplicate and report nothing
        keys = [key for key, _ in pairs]
        raise ValueError(f"duplicate member {next(key for key in keys if keys.count(key) > 1)!r}")
    return members


def reject_constant(name):
    raise ValueError(f"{name} is not JSON")


def read_document(path):
    """The scene, or for a model a document that stands for it."""
    if path.suffix.lower() in MODELS:
        return {"version": 1, "model": path.name}
    try:
        text = path.read_text(encoding="utf-8-sig")
        document = json.loads(text, object_pairs_hook=unique_members, parse_constant=reject_constant)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {error}") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: must be a scene document, a JSON object")
    return document


class AssetFiles:
    """Replaces file names in documents by upload names ("sha256:..."). Each file is hashed once."""

    def __init__(self, allow_missing):
        self.allow_missing = allow_missing
        self.digests = {}

    def digest(self, path, reference):
        """Returns None for a missing file if missing files are allowed."""
        if path not in self.digests:
            try:
                self.digests[path] = file_digest(path)
            except FileNotFoundError:
                if self.allow_missing:
                    return None
                raise InputError(f"{reference}: no such file: {path} (--server-files allows files of the server)") from None
            except OSError as error:
                raise InputError(f"{reference}: {error}") from error
        return self.digests[path]

    def replace_names(self, node, scene, found, pointer=""):
        """Returns a copy of `node` with upload names; file names are relative to `scene`. Adds SHA-256 -> path to `found`."""
        if isinstance(node, list):
            return [self.replace_names(child, scene, found, f"{pointer}/{i}") for i, child in enumerate(node)]
        if not isinstance(node, dict):
            return node
        changed = {}
        for key, child in node.items():
            at = f"{pointer}/{key}"
            is_file = (key == "file" or at == "/model") and isinstance(child, str) and not child.startswith(UPLOAD)
            if is_file and (digest := self.digest(scene.parent / child, f"{scene}: {at}")):
                found[digest] = scene.parent / child
                changed[key] = UPLOAD + digest
            else:  # members of "job", such as labels, are the user's own
                changed[key] = child if at == "/job" else self.replace_names(child, scene, found, at)
        return changed


def scene_paths(patterns):
    paths = []
    for pattern in patterns:
        matches = [pattern] if pathlib.Path(pattern).exists() else sorted(glob.glob(pattern, recursive=True))
        if not matches:
            raise InputError(f"{pattern}: no such file")
        paths += [pathlib.Path(match) for match in matches if pathlib.Path(match) not in paths]
    return paths


def scene_names(paths):
    """File names without .json or the ending of a model; equal names get a number."""
    names = [path.stem if path.suffix.lower() in MODELS else path.name.removesuffix(".json") for path in paths]
    return [name if names.count(name) == 1 else f"{name}-{i + 1}" for i, name in enumerate(names)]


def value_suffix(path, value, index):
    text = value if isinstance(value, str) else json.dumps(value)
    key = path[-1] if SAFE_NAME.fullmatch(path[-1]) else "value"
    return f"-{key}={text if SAFE_NAME.fullmatch(text) else f'{index:04}'}"


def make_unique(frames):
    """Numbers equal names, which come from equal last keys (a.x and b.x) or equal values."""
    names = set()
    for frame in frames:
        base, number = frame.name, 1
        while frame.name in names:
            number += 1
            frame.name = f"{base}-{number}"
        names.add(frame.name)
    if any(len(name.encode()) > NAME_BYTES_MAX for name in names):
        raise InputError(f"an image name is longer than {NAME_BYTES_MAX} bytes: use shorter file names or fewer --set")


def read_frames(scenes, sweeps, allow_missing):
    """Returns a frame for each scene file and combination of values."""
    files = AssetFiles(allow_missing)
    paths = scene_paths(scenes)
    frames = []
    for path, scene in zip(paths, scene_names(paths)):
        base = read_document(path)
        for combination in itertools.product(*(enumerate(values) for _, values in sweeps)):
            document, name = base, scene
            for (keys, values), (index, value) in zip(sweeps, combination):
                try:
                    document = with_value(document, keys, value)
                except InputError as error:
                    raise InputError(f"{path}: --set {'.'.join(keys)}: {error}") from error
                if len(values) > 1:
                    name += value_suffix(keys, value, index)
            found = {}
            document = files.replace_names(document, path, found)
            frames.append(Frame(name, scene, document, json_digest(document), found))
    make_unique(frames)
    return frames


# ---- Batches: one scene and a merge patch (RFC 7396) for each frame


def equal(a, b):
    """JSON equality: 1 differs from true and from 1.0."""
    return a is b or json.dumps(a, sort_keys=True) == json.dumps(b, sort_keys=True)


def has_null(node):
    """Arrays are replaced whole, so a null inside one is safe."""
    return any(map(has_null, node.values())) if isinstance(node, dict) else node is None


def merge_patch(base, document):
    """Returns the patch that turns `base` into `document`. Raises NoMergePatch."""
    patch = {key: None for key in base if key not in document}
    for key, value in document.items():
        if key in base and equal(base[key], value):
            continue
        if isinstance(value, dict) and isinstance(base.get(key), dict):
            patch[key] = merge_patch(base[key], value)
        elif has_null(value):
            raise NoMergePatch
        else:
            patch[key] = value
    return patch


def group_frames(frames):
    """Splits `frames` into lists, one for each request: consecutive frames of one scene, within the limits above."""
    groups = []
    body_bytes = document_bytes = 0
    for frame in frames:
        base = groups[-1][0] if groups else None
        patch_bytes, size = None, len(json.dumps(frame.document))
        if base and base.scene == frame.scene and len(groups[-1]) < FRAMES_MAX:
            try:
                patch_bytes = len(json.dumps(merge_patch(base.document, frame.document)))
            except NoMergePatch:
                pass
        if patch_bytes and body_bytes + patch_bytes <= BODY_BYTES_MAX and document_bytes + size <= DOCUMENT_BYTES_MAX:
            groups[-1].append(frame)
            body_bytes += patch_bytes
            document_bytes += size
        else:
            groups.append([frame])
            body_bytes = document_bytes = size
    return groups


def batch_request(name, documents):
    """Returns the request body for the documents of one group."""
    return {"name": name, "scene": documents[0],
            "frames": [merge_patch(documents[0], document) for document in documents]}

"""Which frames are submitted together, and how: those of one scene, as the scene and merge patches of it (RFC 7396)."""
import json

# Of one request. The service takes 10,000 jobs, 64 MiB of body and 256 MiB of documents unless it is told otherwise, and
# keeps all of it in one transaction: a quarter of that leaves others their turn, and is many frames for one reply.
FRAMES_MAX = 1000
BODY_BYTES_MAX = 16 << 20
DOCUMENT_BYTES_MAX = 64 << 20


class NoPatch(Exception):
    """A null in what changes: in a merge patch that means to take the member away."""


def same(a, b):
    """As JSON: 1 is not true."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


def has_null(node):
    """Where a patch would take it for something else: arrays are replaced whole, with what is in them."""
    return any(map(has_null, node.values())) if isinstance(node, dict) else node is None


def merge_patch(base, document):
    """What makes `document` of `base`. Throws NoPatch where nothing does."""
    patch = {key: None for key in base if key not in document}
    for key, value in document.items():
        if key in base and same(base[key], value):
            continue
        if isinstance(value, dict) and isinstance(base.get(key), dict):
            patch[key] = merge_patch(base[key], value)
        elif has_null(value):
            raise NoPatch
        else:
            patch[key] = value
    return patch


def submissions(frames):
    """Lists of frames, in their order: those of one scene that follow each other together."""
    together = []
    body_bytes = document_bytes = 0
    for frame in frames:
        base = together[-1][0] if together else None
        try:
            fits = base is not None and base.batch == frame.batch and len(together[-1]) < FRAMES_MAX
            more = len(json.dumps(merge_patch(base.document, frame.document))) if fits else 0
        except NoPatch:
            fits = False
        whole = len(json.dumps(frame.document))
        if fits and body_bytes + more <= BODY_BYTES_MAX and document_bytes + whole <= DOCUMENT_BYTES_MAX:
            together[-1].append(frame)
            body_bytes += more
            document_bytes += whole
        else:
            together.append([frame])
            body_bytes = document_bytes = whole
    return together


def batch_request(name, documents):
    """The body that submits `documents`, of frames that `submissions` put together."""
    return {"name": name, "scene": documents[0],
            "frames": [merge_patch(documents[0], document) for document in documents]}

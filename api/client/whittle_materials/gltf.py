"""The parts of glTF 2.0 files, JSON or GLB, and the images and textures of their materials. Sections cited are those
of Khronos, "glTF 2.0 specification", 2021."""
import base64
import binascii
import json
import math
import os
import struct
import urllib.parse

from whittle_materials.members import FILE_BYTES_MAX, Invalid, read_texels
from whittle_materials.surface import material_of

JSON_TYPES = {dict: "an object", list: "an array", str: "a string", bool: "true or false"}
WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
NEAREST = 9728
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"


def is_gltf(content):
    return content.startswith(b"glTF") or content.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n").startswith(b"{")


class Value:
    """A value of the file's JSON, with its pointer."""

    def __init__(self, path, value, pointer=""):
        self.path, self.value, self.pointer = path, value, pointer

    @property
    def place(self):
        return f"{self.path}: {self.pointer or 'its JSON'}"

    def fail(self, sentence):
        raise Invalid(f"{self.place}: {sentence}")

    def expect(self, kind):
        if not isinstance(self.value, kind):
            self.fail(f"must be {JSON_TYPES[kind]}")
        return self

    def get(self, name, kind=None):
        """The member, or nothing; an empty object is nothing but a value."""
        self.expect(dict)
        if name not in self.value:
            return None
        escaped = name.replace("~", "~0").replace("/", "~1")
        member = Value(self.path, self.value[name], f"{self.pointer}/{escaped}")
        return member.expect(kind) if kind else member

    def required(self, name, kind=None):
        member = self.get(name, kind)
        return member if member is not None else self.fail(f'must have "{name}"')

    def elements(self, name):
        array = self.get(name, list)
        return [] if array is None else [Value(self.path, value, f"{array.pointer}/{i}")
                                         for i, value in enumerate(array.value)]

    def extension(self, name):
        extensions = self.get("extensions", dict)
        return extensions.get(name, dict) if extensions is not None else None

    def is_number(self):
        return isinstance(self.value, (int, float)) and not isinstance(self.value, bool) and abs(self.value) <= 1e300

    def number(self, low=-math.inf, high=math.inf):
        if not self.is_number() or not low <= self.value <= high:
            self.fail(f"must be a number from {low:g} to {high:g}" if low > -math.inf else "must be a finite number")
        return float(self.value)

    def numbers(self, count, low=-math.inf, high=math.inf):
        if not isinstance(self.value, list) or len(self.value) != count:
            self.fail(f"must be {count} numbers")
        return [Value(self.path, value, f"{self.pointer}/{i}").number(low, high) for i, value in enumerate(self.value)]

    def index(self, count):
        """An integer below `count`."""
        if not isinstance(self.value, int) or isinstance(self.value, bool) or not 0 <= self.value < count:
            self.fail(f"must be an integer from 0 to {count - 1}" if count else "refers to a list without elements")
        return self.value

    def number_or(self, name, fallback, low=-math.inf, high=math.inf):
        member = self.get(name)
        return fallback if member is None else member.number(low, high)

    def numbers_or(self, name, fallback, low=-math.inf, high=math.inf):
        member = self.get(name)
        return fallback if member is None else member.numbers(len(fallback), low, high)

    def index_or(self, name, fallback, count=2**32):
        member = self.get(name)
        return fallback if member is None else member.index(count)


def chunk_at(path, content, offset):
    """Kind, content and end of the chunk (section 4.4.3)."""
    if offset + 8 > len(content):
        raise Invalid(f"{path}: byte {offset}: the file ends within a chunk")
    size, kind = struct.unpack_from("<I4s", content, offset)
    if offset + 8 + size > len(content):
        raise Invalid(f"{path}: byte {offset}: the file ends within a chunk")
    return kind, content[offset + 8:offset + 8 + size], offset + 8 + size


def open_container(path, content):
    """The JSON text, and the binary chunk of a GLB or nothing."""
    if not content.startswith(b"glTF"):
        return content, None
    if len(content) < 12:
        raise Invalid(f"{path}: byte {len(content)}: the file ends within its header")
    version, size = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise Invalid(f"{path}: byte 4: must be version 2 of GLB, got {version}")
    if not 12 <= size <= len(content):
        raise Invalid(f"{path}: byte 8: declares {size} bytes, the file has {len(content)}")
    content = content[:size]
    kind, text, end = chunk_at(path, content, 12)
    if kind != b"JSON":
        raise Invalid(f"{path}: byte 12: the first chunk must be JSON")
    if end == len(content):
        return text, None
    kind, binary, _ = chunk_at(path, content, end)
    return text, binary if kind == b"BIN\0" else None


def parse(path, text):
    def refuse(word):
        raise ValueError(f"{word} is no JSON")

    try:
        root = Value(path, json.loads(text.decode("utf-8-sig"), parse_constant=refuse))
    except (ValueError, RecursionError) as error:
        raise Invalid(f"{path}: its JSON: {error}") from error
    version = root.required("asset", dict).required("version", str)
    if not version.value.startswith("2."):
        version.fail("must be 2.x")
    return root


def decode(uri):
    """The content of a data: URI (RFC 2397)."""
    head, comma, data = uri.value.partition(",")
    if not comma:
        uri.fail("is no data: URI")
    try:
        if head.endswith(";base64"):
            return base64.b64decode(data + "=" * (-len(data) % 4), validate=True)
        return urllib.parse.unquote_to_bytes(data)
    except (binascii.Error, ValueError):
        return uri.fail("is no base64")


def has_alpha(content):
    """True for a PNG with alpha: color type 4 or 6, or a chunk tRNS before the data (ISO/IEC 15948)."""
    return content.startswith(PNG) and (content[25:26] in (b"\4", b"\6") or b"tRNS" in content.partition(b"IDAT")[0])


class GltfFile:
    """One file."""

    def __init__(self, path, content, members):
        self.path, self.members, self.directory = path, members, os.path.dirname(path)
        self.stem = os.path.splitext(os.path.basename(path))[0]
        text, self.binary = open_container(path, content)
        self.root = parse(path, text)
        self.lists = {name: self.root.elements(name) for name in (
            "accessors", "buffers", "bufferViews", "images", "materials", "meshes", "nodes", "samplers", "scenes", "textures")}
        self.buffers, self.contents = {}, {}  # of buffers and images that were read, by pointer

    def omit(self, at, what="this"):
        self.members.omit(at.place, what)

    def add(self):
        """Adds all materials, and the mesh with those that its triangles have."""
        names, seen = [], set()
        for index, at in enumerate(self.lists["materials"]):
            name = at.get("name", str)
            names.append(name.value if name is not None and name.value else f"#{index}")
            if names[-1] in seen:
                self.omit(at, f'a second material "{names[-1]}"')
            else:
                self.members.add_material(self.path, names[-1], material_of(self, at))
            seen.add(names[-1])
        used = {names[index] for index in self.used_materials()}
        self.members.add_mesh(self.path, material_of(self, Value(self.path, {})), used)

    def target(self, at, kind):
        """The element of a list that the value at `at` is the index of."""
        return self.lists[kind][at.index(len(self.lists[kind]))]

    def placed_meshes(self):
        """As the reader of meshes takes them: those of the scene's nodes, else of all nodes, else all."""
        nodes, scenes = self.lists["nodes"], self.lists["scenes"]
        if not nodes:
            return self.lists["meshes"]
        if scenes:
            stack = scenes[self.root.index_or("scene", 0, len(scenes))].elements("nodes")
        else:
            return [self.target(mesh, "meshes") for node in nodes if (mesh := node.get("mesh")) is not None]
        reached, meshes = set(), []
        while stack:
            at = stack.pop()
            node = self.target(at, "nodes")
            if node.pointer in reached:
                at.fail("the node is reached twice: nodes must make a tree, without circles")
            reached.add(node.pointer)
            stack += node.elements("children")
            if (mesh := node.get("mesh")) is not None:
                meshes.append(self.target(mesh, "meshes"))
        return meshes

    def used_materials(self):
        used = set()
        for mesh in {mesh.pointer: mesh for mesh in self.placed_meshes()}.values():
            for primitive in mesh.elements("primitives"):
                corners = primitive.get("indices")
                if corners is None:
                    corners = primitive.required("attributes", dict).required("POSITION")
                count = self.target(corners, "accessors").required("count").index(2**32)
                material = primitive.get("material")
                if material is not None and primitive.index_or("mode", 4, 7) >= 4 and count >= 3:
                    used.add(material.index(len(self.lists["materials"])))
        return used

    def buffer(self, at):
        if at.pointer not in self.buffers:
            self.buffers[at.pointer] = self.read_buffer(at)
        return self.buffers[at.pointer]

    def read_buffer(self, at):
        uri = at.get("uri", str)
        if uri is None:
            content = self.binary if at.pointer == "/buffers/0" else None
        elif uri.value.startswith("data:"):
            content = decode(uri)
        else:
            return uri.fail("names another file, which is not opened: a mesh must be one file")
        if content is None:
            at.fail("has neither a uri nor a GLB's binary chunk")
        size = at.required("byteLength").index(2**32)
        if size > len(content):
            at.fail(f"declares {size} bytes, there are {len(content)}")
        return content[:size]

    def view(self, at):
        content = self.buffer(self.target(at.required("buffer"), "buffers"))
        begin, size = at.index_or("byteOffset", 0), at.required("byteLength").index(2**32)
        if begin + size > len(content):
            at.fail(f"ends at byte {begin + size}, its buffer has {len(content)}")
        return content[begin:begin + size]

    def image(self, at):
        """Path in the document and content of an image; no path if its format is not one that a texture has."""
        if at.pointer in self.contents:
            return self.contents[at.pointer]
        uri = at.get("uri", str)
        if uri is None:
            content = self.view(self.target(at.required("bufferView"), "bufferViews"))
        elif uri.value.startswith("data:"):
            content = decode(uri)
        elif ":" in uri.value:
            self.omit(uri, f"an image at another place ({uri.value[:60]})")
            return None, b""
        else:
            name = urllib.parse.unquote(uri.value)
            self.contents[at.pointer] = name, self.external(uri, os.path.join(self.directory, name))
            return self.contents[at.pointer]
        ending = "png" if content.startswith(PNG) else "jpg" if content.startswith(JPEG) else None
        name = ending and f"{self.stem}.{at.pointer.rsplit('/', 1)[1]}.{ending}"
        if name:
            self.members.add_file(at.place, self.directory, name, content)
        else:
            self.omit(at, "an image that is neither PNG nor JPEG")
        self.contents[at.pointer] = name, content
        return self.contents[at.pointer]

    @staticmethod
    def external(uri, path):
        try:
            with open(path, "rb") as file:
                return file.read(FILE_BYTES_MAX)
        except (OSError, ValueError) as error:
            return uri.fail(f"cannot be read: {getattr(error, 'strerror', None) or error}")

    def texture(self, info, **fields):
        """Name of the texture of a textureInfo, or nothing if it is not carried over."""
        image, placing = self.lookup(info)
        if image is None:
            return None
        file, content = image
        if fields.get("channel") == "alpha" and not has_alpha(content):
            return None
        return self.members.texture({"file": file, **fields, **placing})

    def texels(self, info):
        """Values of a textureInfo as they are coded, and the fields that place them; nothing if they cannot be computed
        with."""
        image, placing = self.lookup(info)
        return (read_texels(image[1]) if image is not None else None), placing

    def computed(self, at, what, image, placing):
        """A color, or the name of a texture with these linear values, whose file is named after its material."""
        name = f"{self.stem}.{at.pointer.rsplit('/', 1)[1]}.{what}.hdr"
        return self.members.computed(at.place, self.directory, name, image, **placing)

    def lookup(self, info):
        """Path and content of the image of a textureInfo, or nothing if it is not carried over, and the fields that
        place it."""
        at = self.target(info.required("index"), "textures")
        transform = info.extension("KHR_texture_transform") or Value(self.path, {}, info.pointer)
        if transform.index_or("texCoord", info.index_or("texCoord", 0)) != 0:
            self.omit(info, "a texture with other coordinates than TEXCOORD_0")
            return None, {}
        source = at.get("source")
        if source is None:
            self.omit(at, "a texture in the format of an extension" if at.get("extensions") else "a texture without image")
            return None, {}
        image = self.image(self.target(source, "images"))
        return (image if image[0] is not None else None), {**self.sampling(at), **self.placing(transform)}

    def sampling(self, at):
        reference = at.get("sampler")
        if reference is None:
            return {}
        sampler = self.target(reference, "samplers")
        wraps = [WRAPS.get(sampler.index_or(name, 10497)) for name in ("wrapS", "wrapT")]
        if None in wraps:
            sampler.fail("wrapS and wrapT must be 10497, 33071 or 33648")
        if wraps[0] != wraps[1]:
            self.omit(sampler, "a wrapT unlike wrapS")
        fields = {"wrap": wraps[0]} if wraps[0] != "repeat" else {}
        return {**fields, "filter": "nearest"} if sampler.index_or("magFilter", 0) == NEAREST else fields

    def placing(self, transform):
        """In glTF v points down: v' = s v + o there is 1 - v' = s (1 - v) + 1 - o - s from below."""
        scale, offset = transform.numbers_or("scale", [1.0, 1.0]), transform.numbers_or("offset", [0.0, 0.0])
        if transform.number_or("rotation", 0.0) != 0:
            self.omit(transform, "the rotation of a texture")
        if (scale, offset) == ([1.0, 1.0], [0.0, 0.0]):
            return {}
        return {"scale": scale, "offset": [offset[0], 1 - offset[1] - scale[1]]}

"""The members of a scene document that are made from files, images that are computed for them, and what the files have
besides. Products of textures, and of textures and factors, need NumPy and Pillow; without them nothing is computed."""
import io
import os
import warnings

try:
    import numpy
    from PIL import Image
except ImportError:
    Image = None

FILE_BYTES_MAX = 256_000_000
TEXELS_MAX = 21_000_000  # of a texture of a document


class Invalid(Exception):
    """A sentence that begins with the file and the place in it."""


def read_file(path, bytes_max):
    try:
        with open(path, "rb") as file:
            content = file.read(bytes_max + 1)
    except (OSError, ValueError) as error:
        raise Invalid(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if len(content) > bytes_max:
        raise Invalid(f"{path}: has more than {bytes_max} bytes")
    return content


def has_content(path, content):
    try:
        with open(path, "rb") as file:
            return file.read(len(content) + 1) == content
    except OSError:
        return False


def factor_and_color(color):
    """A color as its largest channel and the rest, which is at most 1."""
    largest = max(color)
    return (largest, [channel / largest for channel in color]) if largest > 0 else (0.0, [0.0, 0.0, 0.0])


class Members:
    """Textures and materials by name, objects, sentences about what is not carried over, and new files."""

    def __init__(self):
        self.textures = {}
        self.materials = {}
        self.objects = []
        self.omitted = []
        self.files = {}  # directory and content by the name that textures have

    def omit(self, place, what):
        self.omitted.append(f"{place}: {what} is not carried over")

    def texture(self, texture):
        """Name of the texture; one for equal textures."""
        name = next((name for name, other in self.textures.items() if other == texture), None)
        if name is None:
            name = os.path.basename(texture["file"])
            while name in self.textures:
                name += "'"
            self.textures[name] = texture
        return name

    def add_file(self, place, directory, name, content):
        """A file that is written if a material uses it."""
        if sum(len(other) for _, other in self.files.values()) + len(content) > FILE_BYTES_MAX:
            raise Invalid(f"{place}: the images to write have more than {FILE_BYTES_MAX} bytes")
        if self.files.setdefault(name, (directory, content)) != (directory, content):
            raise Invalid(f"{place}: two images would have the name {name}")

    def computed(self, place, directory, name, image, **fields):
        """A color, or the name of a texture with these linear values; its file is `name` in `directory`."""
        if (color := constant(image)) is not None:
            return color * (3 // len(color))
        self.add_file(place, directory, name, write_hdr(image))
        return self.texture({"file": name, **fields})

    def add_material(self, path, name, material):
        if name in self.materials:
            raise Invalid(f'{path}: the material "{name}" is in two files')
        self.materials[name] = material

    def add_mesh(self, path, material, names):
        """The object of a mesh file. Parts without a translated material have `material`."""
        mesh = {"type": "mesh", "file": os.path.basename(path), "material": material}
        if names:
            mesh["materials"] = {name: name for name in sorted(names)}
        self.objects.append(mesh)

    def document(self):
        members = {"textures": self.used_textures(), "materials": self.materials}
        return {**members, "objects": self.objects} if self.objects else members

    def used_textures(self):
        used = {value for material in self.materials.values() for field, value in material.items()
                if field != "model" and isinstance(value, str)}
        return {name: texture for name, texture in self.textures.items() if name in used}

    def write_files(self):
        """Writes each file completely or not at all. One that exists with another content stays as it is."""
        used = {texture["file"] for texture in self.used_textures().values()}
        files = {os.path.join(directory, name): content for name, (directory, content) in self.files.items() if name in used}
        for path, content in files.items():
            if os.path.lexists(path) and not has_content(path, content):
                raise Invalid(f"{path}: exists with another content")
        for path, content in files.items():
            try:
                write_image(path, content)
            except OSError as error:
                raise Invalid(f"{path}: {error.strerror}") from error


def write_image(path, content):
    if os.path.lexists(path):
        return
    unfinished = f"{path}.{os.getpid()}.part"
    with open(unfinished, "xb") as file:
        try:
            file.write(content)
            file.flush()
            os.link(unfinished, path)  # fails if the file has come into being
        finally:
            os.unlink(unfinished)


# ---- images

def read_texels(content):
    """Values in [0, 1] as they are coded, of shape (height, width, 4), or nothing if they cannot be computed with."""
    if Image is None:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(content)) as image:
                if image.width * image.height > TEXELS_MAX or (image.mode.startswith("I") and image.format != "PNG"):
                    return None
                if image.mode.startswith("I"):  # 16 bits of gray, which convert() would clip
                    gray = numpy.asarray(image, numpy.float32)[..., None] / 65535
                    return numpy.concatenate([gray, gray, gray, numpy.ones_like(gray)], axis=2)
                return numpy.asarray(image.convert("RGBA"), numpy.float32) / 255
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        return None


def to_linear(srgb):
    """IEC 61966-2-1."""
    return numpy.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def luminance(linear):
    """ITU-R BT.709."""
    return linear @ numpy.array([[0.2126], [0.7152], [0.0722]])


def of_equal_size(images):
    """The images in the largest width and height among them, by repeating texels."""
    shape = [max(image.shape[axis] for image in images) for axis in (0, 1)]
    for image in images:
        rows, columns = (numpy.arange(size) * old // size for size, old in zip(shape, image.shape))
        yield image[rows][:, columns]


def constant(image):
    """The color that all texels have, or nothing."""
    color = image[0, 0]
    return [float(channel) for channel in color] if (image == color).all() else None


def rescaled_normals(coded, scale):
    """A tangent-space normal map whose slopes are `scale` times as steep."""
    normals = (2 * coded - 1) * numpy.array([scale, scale, 1], numpy.float32)
    lengths = numpy.linalg.norm(normals, axis=2, keepdims=True)
    return normals / numpy.maximum(lengths, 1e-6) / 2 + 0.5


def write_hdr(image):
    """A Radiance HDR file without run lengths (Ward 1991, "Real Pixels"). Values are rounded down: products of
    textures that add up to one must not add up to more."""
    rgb = numpy.ascontiguousarray(numpy.broadcast_to(image, image.shape[:2] + (3,)), numpy.float64)
    _, exponents = numpy.frexp(rgb.max(axis=2))
    dark = rgb.max(axis=2) < 1e-30
    mantissas = numpy.floor(numpy.ldexp(rgb, 8 - exponents[..., None]))
    pixels = numpy.concatenate([mantissas, exponents[..., None] + 128], axis=2)
    pixels[dark] = 0
    height, width = dark.shape
    return (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode()
            + pixels.astype(numpy.uint8).tobytes())

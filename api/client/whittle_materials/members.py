"""The members of a scene document that are made from files, and what the files have besides."""
import os


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


def factor_and_color(color):
    """A color as its largest channel and the rest, which is at most 1."""
    largest = max(color)
    return (largest, [channel / largest for channel in color]) if largest > 0 else (0.0, [0.0, 0.0, 0.0])


class Members:
    """Textures and materials by name, objects, and sentences about what is not carried over."""

    def __init__(self):
        self.textures = {}
        self.materials = {}
        self.objects = []
        self.omitted = []

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
        members = {"textures": self.textures, "materials": self.materials}
        return {**members, "objects": self.objects} if self.objects else members


def write_images(images):
    """Writes the contents by path, each completely or not at all. A file with another content stays as it is."""
    for path, content in images.items():
        if os.path.lexists(path) and read_file(path, len(content)) != content:
            raise Invalid(f"{path}: exists with another content")
    for path, content in images.items():
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

"""The subset of scene documents that other ray tracers support, with names and defaults resolved.

Features that no exporter supports are rejected here, by name; an exporter rejects those that its program lacks. Unknown
fields are rejected, too, so that no feature is dropped silently.
"""
import math
from typing import NamedTuple


class Unsupported(Exception):
    """The other program has no equivalent of a feature of the document; the text names it."""


class Material(NamedTuple):
    """A material with all defaults filled in. Colours are linear RGB; factors and their colours are multiplied."""
    model: str              # lambert, phong or blinn_phong
    color: tuple
    ambient: float
    diffuse: float
    specular: float
    shininess: float
    reflection: tuple       # K_r C_r
    transmission: float     # K_t C_t, grey
    transparency: str       # refract or filtered
    ior: float


class Light(NamedTuple):
    kind: str               # point or directional
    position: tuple         # or, of a directional light, the direction of propagation
    color: tuple            # times intensity
    attenuation: tuple      # c0, c1, c2; (1, 0, 0) is none


class Camera(NamedTuple):
    """Unit vectors; the image plane at distance 1 is 2 tan_x wide and 2 tan_y high."""
    position: tuple
    forward: tuple
    right: tuple
    up: tuple
    tan_x: float
    tan_y: float


class Scene(NamedTuple):
    width: int
    height: int
    camera: Camera
    background: tuple
    ambient: tuple
    lights: list
    materials: dict         # Material by name
    objects: list           # as in the document, with "material" as a name
    max_depth: int
    cutoff: float


SHAPE_FIELDS = ("type material point normal center radius inner_radius from to caps apex base apex_radius min max vertices "
                "positions triangles normals smooth")


def portable_scene(document):
    """The Scene of a document. Raises Unsupported."""
    check_fields(document, "the document", "version name image camera background ambient lights materials objects accuracy output")
    accuracy = document.get("accuracy", {})
    check_fields(accuracy, "accuracy", "samples max_depth cutoff target_error preset seed")
    materials = {name: material(value) for name, value in document.get("materials", {}).items()}
    objects = []
    for shape in document["objects"]:
        if isinstance(shape["material"], dict):
            name = f"own_{len(materials)}"
            materials[name] = material(shape["material"])
            shape = {**shape, "material": name}
        check_fields(shape, f"a {shape['type']}", SHAPE_FIELDS)
        if shape.get("smooth"):
            raise Unsupported("smooth shading of a mesh without normals")
        objects.append(shape)
    image = document.get("image", {})
    check_fields(image, "image", "width height")
    background = document.get("background", {"color": 0})
    check_fields(background, "background", "color")
    width, height = image.get("width", 640), image.get("height", 480)
    return Scene(width, height, camera(document["camera"], width / height), color(background["color"]),
                 color(document.get("ambient", 0)), [light(value) for value in document.get("lights", [])], materials,
                 objects, accuracy.get("max_depth", 64), accuracy.get("cutoff", 1e-3))


def check_fields(section, name, fields):
    for field in section:
        if field not in fields.split():
            raise Unsupported(f"{field} of {name}")


def color(value):
    if isinstance(value, (int, float)):
        return (float(value),) * 3
    if isinstance(value, list):
        return tuple(float(channel) for channel in value)
    if isinstance(value, str) and value.startswith("#"):
        codes = [int(value[i:i + 2], 16) / 255 for i in (1, 3, 5)]
        return tuple(code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4 for code in codes)
    raise Unsupported("a texture, or a colour that is not RGB")


def times(factor, rgb):
    return tuple(factor * channel for channel in rgb)


def grey(rgb, name):
    """The value of a colour whose channels are equal."""
    if rgb[0] == rgb[1] == rgb[2]:
        return rgb[0]
    raise Unsupported(f"coloured {name}")


def material(value):
    check_fields(value, "a material", "model color ambient diffuse specular shininess reflection reflection_color transmission "
                               "transmission_color transparency ior fresnel")
    transmission = grey(times(value.get("transmission", 0), color(value.get("transmission_color", 1))), "transmission")
    transparency = value.get("transparency", "refract") if transmission else "filtered"
    if transparency == "interpolated":
        raise Unsupported("interpolated transparency")
    if value.get("fresnel", transmission > 0 and transparency == "refract"):
        raise Unsupported("fresnel")
    reflection = times(value.get("reflection", 0), color(value.get("reflection_color", 1)))
    return Material(value.get("model", "phong"), color(value.get("color", 0.8)), value.get("ambient", 1),
                    value.get("diffuse", 1), value.get("specular", 0), value.get("shininess", 32), reflection,
                    transmission, transparency, value.get("ior", 1.5))


def light(value):
    check_fields(value, f"a {value['type']} light", "type position direction color intensity attenuation")
    if value["type"] not in ("point", "directional"):
        raise Unsupported(f"a {value['type']} light")
    attenuation = value.get("attenuation", "none")
    if attenuation == "inverse_square":
        raise Unsupported("inverse_square attenuation")
    factors = (1, 0, 0) if attenuation == "none" or value["type"] == "directional" else tuple(attenuation)
    position = value["position"] if value["type"] == "point" else value["direction"]
    return Light(value["type"], tuple(position), times(value.get("intensity", 1), color(value.get("color", 1))), factors)


def camera(value, aspect):
    check_fields(value, "the camera", "type position look_at up fov")
    if value.get("type", "perspective") != "perspective":
        raise Unsupported(f"a camera of type {value['type']}")
    position = tuple(value["position"])
    forward = unit(tuple(b - a for a, b in zip(position, value["look_at"])))
    right = unit(cross(forward, tuple(value.get("up", (0, 1, 0)))))
    tan_y = math.tan(math.radians(value.get("fov", 45)) / 2)
    return Camera(position, forward, right, cross(right, forward), tan_y * aspect, tan_y)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)

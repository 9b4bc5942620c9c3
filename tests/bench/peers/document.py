"""Parts of scene documents that the exporters share."""
import math
from typing import NamedTuple


class Unsupported(Exception):
    """The other program has no equivalent of a feature of the document; the text names it."""


class Camera(NamedTuple):
    """Unit vectors; the image plane at distance 1 is 2 tan_x wide and 2 tan_y high."""
    position: tuple
    forward: tuple
    right: tuple
    up: tuple
    tan_x: float
    tan_y: float


def camera(document):
    value, image = document["camera"], document["image"]
    position = tuple(value["position"])
    forward = unit(tuple(b - a for a, b in zip(position, value["look_at"])))
    right = unit(cross(forward, tuple(value.get("up", (0, 1, 0)))))
    tan_y = math.tan(math.radians(value["fov"]) / 2)
    return Camera(position, forward, right, cross(right, forward), tan_y * image["width"] / image["height"], tan_y)


def color(value):
    return tuple(map(float, value)) if isinstance(value, list) else (float(value),) * 3


def times(factor, rgb):
    return tuple(factor * channel for channel in rgb)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)

"""Parts of scene documents that the exporters share."""
import math
from typing import NamedTuple

import numpy


class Unsupported(Exception):
    """The other program has no equivalent of a feature of the document; the text names it."""


class Camera(NamedTuple):
    """Unit vectors; the image plane at distance 1 is 2 tan_x wide and 2 tan_y high."""
    position: numpy.ndarray
    forward: numpy.ndarray
    right: numpy.ndarray
    up: numpy.ndarray
    tan_x: float
    tan_y: float


def camera(document):
    value, image = document["camera"], document["image"]
    position = numpy.array(value["position"])
    forward = unit(value["look_at"] - position)
    right = unit(numpy.cross(forward, value.get("up", (0, 1, 0))))
    tan_y = math.tan(math.radians(value["fov"]) / 2)
    return Camera(position, forward, right, numpy.cross(right, forward), tan_y * image["width"] / image["height"], tan_y)


def color(value):
    return numpy.broadcast_to(numpy.array(value, float), 3)


def unit(v):
    return v / numpy.linalg.norm(v)

"""Renders a scene of Lambert's triangle meshes and one glowing rectangle with POV-Ray 3.7 and its radiosity.

- POV-Ray's radiosity is a cache of irradiance with interpolation (after Ward et al. 1988). It samples small lamps poorly, so
  the lamp is an area light, as POV-Ray's manual advises, and its surface shines for the camera only.
- An area light is a grid of point lights. `fade_power 2 fade_distance 1` is 2 / (1 + d^2); a `spotlight` of tightness 1 has
  the cosine at the lamp. A point light of the colour L A / 2 pi gives the radiance reflectance / pi L A cos cos / d^2 then.
- The spotlight's cosine is that of the middle of the lamp: POV-Ray has no other.
"""
import math

import numpy

from tests.bench.peers.document import camera, color, unit
from tests.bench.peers.povray import mesh, vector, view

RADIOSITY = ("count COUNT error_bound ERROR_BOUND nearest_count NEAREST recursion_limit RECURSION pretrace_start 0.08 "
             "pretrace_end PRETRACE low_error_factor 0.5 minimum_reuse REUSE")
DECLARED = ("COUNT", "ERROR_BOUND", "NEAREST", "RECURSION", "PRETRACE", "REUSE", "LAMP")
# POV-Ray's defaults (a lamp of 9 x 9 points), then better ones; antialiasing is a part of the setting
SETTINGS = [
    ("-A", 35, 1.8, 5, 3, 0.04, 0.015, 9),
    ("+AM2 +A0.0 +R1 +J1.0", 100, 1.0, 8, 4, 0.02, 0.01, 9),
    ("+AM2 +A0.0 +R2", 200, 0.7, 10, 6, 0.01, 0.01, 17),
    ("+AM2 +A0.0 +R2", 400, 0.5, 10, 8, 0.01, 0.005, 17),
    ("+AM2 +A0.0 +R2", 800, 0.3, 15, 8, 0.01, 0.004, 17),
    ("+AM2 +A0.0 +R3", 1600, 0.25, 20, 10, 0.005, 0.003, 17)]


def options(setting):
    """Those of the command line."""
    antialiasing, *values = setting
    return [*antialiasing.split(), *(f"Declare={name}={value}" for name, value in zip(DECLARED, values))]


def lamp(positions, radiance):
    """The light of a rectangle of four corners that shines along its normal."""
    corners = numpy.array(positions)
    along, across = corners[1] - corners[0], corners[3] - corners[0]
    normal, middle = numpy.cross(along, across), corners.mean(0)
    return (f"light_source {{ {vector(middle)} rgb {vector(numpy.linalg.norm(normal) / (2 * math.pi) * radiance)} fade_power 2 fade_distance 1 "
            f"spotlight radius 89.9 falloff 90 tightness 1 point_at {vector(middle + unit(normal))} "
            f"area_light {vector(along)}, {vector(across)}, LAMP, LAMP adaptive 2 jitter area_illumination on }}")


def write_scene(document, path):
    """The settings are those of SETTINGS, declared on the command line."""
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write("#version 3.7;")
        write(f"global_settings {{ assumed_gamma 1 max_trace_level 20 adc_bailout 0 radiosity {{ {RADIOSITY} }} }}")
        write(view(camera(document), (0, 0, 0)))
        for value in document["objects"]:
            material = document["materials"][value["material"]]
            radiance = color(material.get("emission", 0))
            finish = f"pigment {{ rgb {vector(color(material.get('color', 0)))} }} finish {{ ambient 0 diffuse {material.get('diffuse', 1)} }}"
            tail = ""
            if any(radiance):
                write(lamp(value["positions"], radiance))
                finish = f"pigment {{ rgb {vector(radiance)} }} finish {{ ambient 0 diffuse 0 emission 1 }}"
                tail = " no_radiosity no_shadow"
            mesh(value, f" {finish}{tail} }}", write)

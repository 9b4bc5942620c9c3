"""Exports a scene to Tachyon 0.99.

- Its camera is left-handed and its samples are at the upper right corners of the pixels: the FRUSTUM, the image plane at
  distance 1, is given from right to left and shifted by half a pixel.
- Colours: its PPM48 is linear with 16 bits; ppm.write_png encodes it as sRGB.
- Numbers are read as 32-bit floats.
- Factors are grey: ambient light times K_a, K_r C_r and K_t C_t. SPECULAR is the mirror factor, PHONG the highlight's.
- It has no cutoff.
- Transmitted rays keep their direction: OPACITY 1 - K_t is our `filtered`. Refraction and cones are rejected.
- A scene has one highlight model (-shade_phong, -shade_blinn).
- Lights are visible spheres: their radius is too small for a ray to hit.
- At the maximum depth it returns the background; Whittle and POV-Ray return black. This difference cannot be configured.
"""
from tests.bench.peers.document import Unsupported, grey, times

LIGHT_RADIUS = 1e-7


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


def texture(name, material, ambient):
    if material.transmission and material.transparency == "refract":
        raise Unsupported("refraction")
    highlight = 0 if material.model == "lambert" else material.specular
    return (f"TEXDEF {name} AMBIENT {grey(times(material.ambient, ambient), 'ambient light'):.9g} "
            f"DIFFUSE {material.diffuse:.9g} SPECULAR {grey(material.reflection, 'reflection'):.9g} "
            f"OPACITY {1 - material.transmission:.9g} PHONG PLASTIC {highlight:.9g} "
            f"PHONG_SIZE {material.shininess:.9g} COLOR {numbers(material.color)} TEXFUNC 0")


def light_source(light):
    if light.kind == "directional":
        return f"DIRECTIONAL_LIGHT DIRECTION {numbers(light.position)} COLOR {numbers(light.color)}"
    if light.attenuation != (1, 0, 0):
        raise Unsupported("attenuation (which does not apply to its highlights and is not limited)")
    return f"LIGHT CENTER {numbers(light.position)} RAD {LIGHT_RADIUS:g} COLOR {numbers(light.color)}"


def mesh(value, name, write):
    positions, normals = value["positions"], value.get("normals")
    for face in value["triangles"]:
        corners = " ".join(f"V{i} {numbers(positions[corner])}" for i, corner in enumerate(face))
        if normals:
            write(f"STRI {corners} " + " ".join(f"N{i} {numbers(normals[corner])}" for i, corner in enumerate(face))
                  + f" {name}")
        else:
            write(f"TRI {corners} {name}")


def cylinder(value, name, write):
    start, end = value["from"], value["to"]
    write(f"FCYLINDER BASE {numbers(start)} APEX {numbers(end)} RAD {value['radius']:.9g} {name}")
    if value.get("caps", True):
        axis = [b - a for a, b in zip(start, end)]
        for center, normal in ((start, times(-1, axis)), (end, axis)):
            write(f"RING CENTER {numbers(center)} NORMAL {numbers(normal)} INNER 0 OUTER {value['radius']:.9g} {name}")


def shape(value, write):
    kind, name = value["type"], value["material"]
    if kind == "mesh":
        mesh(value, name, write)
    elif kind == "triangle" and "normals" not in value:
        write("TRI " + " ".join(f"V{i} {numbers(v)}" for i, v in enumerate(value["vertices"])) + f" {name}")
    elif kind == "sphere":
        write(f"SPHERE CENTER {numbers(value['center'])} RAD {value['radius']:.9g} {name}")
    elif kind == "plane":
        write(f"PLANE CENTER {numbers(value['point'])} NORMAL {numbers(value['normal'])} {name}")
    elif kind == "disc":
        write(f"RING CENTER {numbers(value['center'])} NORMAL {numbers(value['normal'])} "
              f"INNER {value.get('inner_radius', 0):.9g} OUTER {value['radius']:.9g} {name}")
    elif kind == "cylinder":
        cylinder(value, name, write)
    elif kind == "box":
        write(f"BOX MIN {numbers(value['min'])} MAX {numbers(value['max'])} {name}")
    else:
        raise Unsupported(f"a {kind}")


def highlights(scene):
    """The option that selects the highlight model of the scene."""
    models = {material.model for material in scene.materials.values() if material.specular and material.model != "lambert"}
    if len(models) > 1:
        raise Unsupported("two highlight models in one scene")
    return "-shade_blinn" if models == {"blinn_phong"} else "-shade_phong"


def write_scene(scene, path):
    """Raises Unsupported; the file is then incomplete."""
    highlights(scene)
    camera = scene.camera
    half_x, half_y = camera.tan_x / scene.width, camera.tan_y / scene.height  # of a pixel
    frame = (camera.tan_x + half_x, -camera.tan_x + half_x, -camera.tan_y - half_y, camera.tan_y - half_y)
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write(f"BEGIN_SCENE\nRESOLUTION {scene.width} {scene.height}")
        write(f"CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH {scene.max_depth + 1} "
              f"CENTER {numbers(camera.position)} VIEWDIR {numbers(camera.forward)} UPDIR {numbers(camera.up)} "
              f"FRUSTUM {numbers(frame)} END_CAMERA")
        write(f"BACKGROUND {numbers(scene.background)}")
        for light in scene.lights:
            write(light_source(light))
        for name, material in scene.materials.items():
            write(texture(name, material, scene.ambient))
        for value in scene.objects:
            shape(value, write)
        write("END_SCENE")

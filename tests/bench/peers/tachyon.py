"""A scene as Tachyon 0.99 reads it.

- Its pictures are mirrored (its camera is left-handed) and its samples lie on the pixels' upper right corners: the
  FRUSTUM, which is the picture's plane at distance 1, is given right to left and half a pixel back.
- Colours: its PPM48 is linear light of 16 bits; ppm.to_png writes it as sRGB.
- Numbers are read as 32-bit floats.
- Factors are grey: ambient light times K_a, K_r C_r and K_t C_t. SPECULAR is the mirror's, PHONG the highlight's factor.
- It has no cutoff.
- Transmitted rays go straight on: OPACITY 1 - K_t is our `filtered`. What refracts is refused, and so are cones.
- One model of highlights a scene (-shade_phong, -shade_blinn).
- Lights are small balls that rays see: of a radius that none hits.
- Where the depth ends it sees the background, and we and POV-Ray nothing: the one thing that cannot be told it.
"""
from tests.bench.peers.document import Inexpressible, grey, times

LIGHT_RADIUS = 1e-7


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


def texture(name, material, ambient):
    if material.transmission and material.transparency == "refract":
        raise Inexpressible("refraction")
    highlight = 0 if material.model == "lambert" else material.specular
    return (f"TEXDEF {name} AMBIENT {grey(times(material.ambient, ambient), 'ambient light'):.9g} "
            f"DIFFUSE {material.diffuse:.9g} SPECULAR {grey(material.reflection, 'reflection'):.9g} "
            f"OPACITY {1 - material.transmission:.9g} PHONG PLASTIC {highlight:.9g} "
            f"PHONG_SIZE {material.shininess:.9g} COLOR {numbers(material.color)} TEXFUNC 0")


def light(one):
    if one.kind == "directional":
        return f"DIRECTIONAL_LIGHT DIRECTION {numbers(one.place)} COLOR {numbers(one.color)}"
    if one.attenuation != (1, 0, 0):
        raise Inexpressible("attenuation (its highlights have none, and it has no maximum)")
    return f"LIGHT CENTER {numbers(one.place)} RAD {LIGHT_RADIUS:g} COLOR {numbers(one.color)}"


def mesh(thing, name, write):
    positions, normals = thing["positions"], thing.get("normals")
    for face in thing["triangles"]:
        corners = " ".join(f"V{i} {numbers(positions[corner])}" for i, corner in enumerate(face))
        if normals:
            write(f"STRI {corners} " + " ".join(f"N{i} {numbers(normals[corner])}" for i, corner in enumerate(face))
                  + f" {name}")
        else:
            write(f"TRI {corners} {name}")


def cylinder(thing, name, write):
    start, end = thing["from"], thing["to"]
    write(f"FCYLINDER BASE {numbers(start)} APEX {numbers(end)} RAD {thing['radius']:.9g} {name}")
    if thing.get("caps", True):
        axis = [b - a for a, b in zip(start, end)]
        for middle, normal in ((start, times(-1, axis)), (end, axis)):
            write(f"RING CENTER {numbers(middle)} NORMAL {numbers(normal)} INNER 0 OUTER {thing['radius']:.9g} {name}")


def shape(thing, write):
    kind, name = thing["type"], thing["material"]
    if kind == "mesh":
        mesh(thing, name, write)
    elif kind == "triangle" and "normals" not in thing:
        write("TRI " + " ".join(f"V{i} {numbers(v)}" for i, v in enumerate(thing["vertices"])) + f" {name}")
    elif kind == "sphere":
        write(f"SPHERE CENTER {numbers(thing['center'])} RAD {thing['radius']:.9g} {name}")
    elif kind == "plane":
        write(f"PLANE CENTER {numbers(thing['point'])} NORMAL {numbers(thing['normal'])} {name}")
    elif kind == "disc":
        write(f"RING CENTER {numbers(thing['center'])} NORMAL {numbers(thing['normal'])} "
              f"INNER {thing.get('inner_radius', 0):.9g} OUTER {thing['radius']:.9g} {name}")
    elif kind == "cylinder":
        cylinder(thing, name, write)
    elif kind == "box":
        write(f"BOX MIN {numbers(thing['min'])} MAX {numbers(thing['max'])} {name}")
    else:
        raise Inexpressible(f"a {kind}")


def highlights(scene):
    """The option that selects the scene's model of highlights."""
    models = {material.model for material in scene.materials.values() if material.specular and material.model != "lambert"}
    if len(models) > 1:
        raise Inexpressible("two models of highlights in one scene")
    return "-shade_blinn" if models == {"blinn_phong"} else "-shade_phong"


def write_scene(scene, path):
    """Throws Inexpressible; then the file is worth nothing."""
    highlights(scene)
    eye = scene.camera
    half_x, half_y = eye.tan_x / scene.width, eye.tan_y / scene.height  # of a pixel
    frame = (eye.tan_x + half_x, -eye.tan_x + half_x, -eye.tan_y - half_y, eye.tan_y - half_y)
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write(f"BEGIN_SCENE\nRESOLUTION {scene.width} {scene.height}")
        write(f"CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH {scene.max_depth + 1} "
              f"CENTER {numbers(eye.position)} VIEWDIR {numbers(eye.forward)} UPDIR {numbers(eye.up)} "
              f"FRUSTUM {numbers(frame)} END_CAMERA")
        write(f"BACKGROUND {numbers(scene.background)}")
        for one in scene.lights:
            write(light(one))
        for name, one in scene.materials.items():
            write(texture(name, one, scene.ambient))
        for thing in scene.objects:
            shape(thing, write)
        write("END_SCENE")

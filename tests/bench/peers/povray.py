"""A scene as POV-Ray 3.7 reads it.

- Handedness: the camera is given by its vectors, so the world stays right-handed.
- Colours: assumed_gamma 1, and sRGB in the file, as Whittle writes it.
- Depth: max_trace_level counts the camera's ray, max_depth does not. adc_bailout is the cutoff.
- Highlights: phong is R.V^n; Blinn's N.H^n is `specular` with roughness 1/n.
- Transmission: `transmit` takes its part away from what is diffuse and ambient, and ours does not: it is given back.
- Attenuation: POV-Ray's 2/(1 + (d/D)^2) is 1/(c0 + c2 d^2) with twice the light over c0 and D = sqrt(c0/c2).
- Fresnel is refused (document.py): its `fresnel on` with conserve_energy agrees with ours on the outside of glass alone.
- A directional light stands far away: where its position is matters to a parallel light's shadows alone.
"""
import math

from tests.bench.peers.document import Inexpressible, times

FAR = 1e6  # scene units: POV-Ray is exact to about 1e-6 of its coordinates, and lights within that cast shadows


def vector(values):
    return "<" + ",".join(f"{value + 0.0:.15g}" for value in values) + ">"


def finish(material):
    """What a texture holds beside its pigment."""
    kept = 1 - material.transmission
    if kept <= 0 and (material.ambient or material.diffuse) and any(material.color):
        raise Inexpressible("a surface of its own colour that transmits everything")
    share = 1 / kept if kept > 0 else 0
    parts = [f"diffuse {material.diffuse * share:.15g}"]
    if material.model == "phong" and material.specular:
        parts.append(f"phong {material.specular:.15g} phong_size {material.shininess:.15g}")
    if material.model == "blinn_phong" and material.specular:
        parts.append(f"specular {material.specular:.15g} roughness {1 / material.shininess:.15g}")
    if any(material.reflection):
        parts.append(f"reflection {{ rgb {vector(material.reflection)} }}")
    return parts, share


def texture(name, material, ambient):
    parts, share = finish(material)
    parts.append(f"ambient rgb {vector(times(material.ambient * share, ambient))}")
    bends = material.transmission and material.transparency == "refract"
    interior = f" interior {{ ior {material.ior:.15g} }}" if bends else ""
    return (f"#declare {name} = material {{ texture {{ pigment {{ rgb {vector(material.color)} "
            f"transmit {material.transmission:.15g} }} finish {{ {' '.join(parts)} }} }}{interior} }}")


def light(one, number):
    c0, c1, c2 = one.attenuation
    color, fade = one.color, ""
    if one.kind == "directional":
        place = times(-FAR / math.dist(one.place, (0, 0, 0)), one.place)
        return f"light_source {{ {vector(place)} rgb {vector(color)} parallel point_at <0,0,0> }}"
    if c1 or c0 < 1:
        raise Inexpressible(f"attenuation of light {number}: only [c0 >= 1, 0, c2]")
    if c2:
        color = times(1 / (2 * c0), color)
        fade = f" fade_power 2 fade_distance {math.sqrt(c0 / c2):.15g}"
    elif c0 != 1:
        color = times(1 / c0, color)
    return f"light_source {{ {vector(one.place)} rgb {vector(color)}{fade} }}"


def mesh(thing, tail, write):
    faces = thing["triangles"]
    write("mesh2 { vertex_vectors {" + str(len(thing["positions"])))
    for position in thing["positions"]:
        write("," + vector(position))
    write("}")
    if "normals" in thing:
        write("normal_vectors {" + str(len(thing["normals"])))
        for normal in thing["normals"]:
            write("," + vector(normal))
        write("}")
    write("face_indices {" + str(len(faces)))
    for face in faces:
        write(f",<{face[0]},{face[1]},{face[2]}>")
    write("}" + tail)


def shape(thing, write):
    kind, tail = thing["type"], f" material {{ m_{thing['material']} }} }}"
    sides = "" if thing.get("caps", True) else " open"
    if kind == "mesh":
        mesh(thing, tail, write)
    elif kind == "triangle" and "normals" not in thing:
        write("triangle { " + ",".join(map(vector, thing["vertices"])) + tail)
    elif kind == "sphere":
        write(f"sphere {{ {vector(thing['center'])},{thing['radius']:.15g}{tail}")
    elif kind == "plane":
        write(f"plane {{ {vector(thing['normal'])},0 translate {vector(thing['point'])}{tail}")
    elif kind == "disc":
        write(f"disc {{ {vector(thing['center'])},{vector(thing['normal'])},{thing['radius']:.15g},"
              f"{thing.get('inner_radius', 0):.15g}{tail}")
    elif kind == "cylinder":
        write(f"cylinder {{ {vector(thing['from'])},{vector(thing['to'])},{thing['radius']:.15g}{sides}{tail}")
    elif kind == "cone":
        write(f"cone {{ {vector(thing['base'])},{thing['radius']:.15g},{vector(thing['apex'])},"
              f"{thing.get('apex_radius', 0):.15g}{sides}{tail}")
    elif kind == "box":
        write(f"box {{ {vector(thing['min'])},{vector(thing['max'])}{tail}")
    else:
        raise Inexpressible(f"a {kind}")


def write_scene(scene, path):
    """Throws Inexpressible; then the file is worth nothing."""
    eye = scene.camera
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write("#version 3.7;")
        write(f"global_settings {{ assumed_gamma 1 max_trace_level {scene.max_depth + 1} adc_bailout {scene.cutoff:.15g} }}")
        write(f"camera {{ perspective location {vector(eye.position)} direction {vector(eye.forward)} "
              f"right {vector(times(2 * eye.tan_x, eye.right))} up {vector(times(2 * eye.tan_y, eye.up))} }}")
        write(f"background {{ rgb {vector(scene.background)} }}")
        for number, one in enumerate(scene.lights):
            write(light(one, number))
        for name, one in scene.materials.items():
            write(texture(f"m_{name}", one, scene.ambient))
        for thing in scene.objects:
            shape(thing, write)

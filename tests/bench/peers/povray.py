"""Exports a scene to POV-Ray 3.7.

- Handedness: the camera is given by its vectors, so the scene stays right-handed.
- Colours: assumed_gamma 1, and sRGB in the file, as Whittle writes it.
- Depth: max_trace_level counts the camera ray, max_depth does not. adc_bailout is the cutoff.
- Highlights: phong is R.V^n; Blinn's N.H^n is `specular` with roughness 1/n.
- Transmission: `transmit` reduces the diffuse and ambient terms, and ours does not: both are divided by 1 - transmit.
- Attenuation: POV-Ray's 2/(1 + (d/D)^2) is 1/(c0 + c2 d^2) with the intensity 1/(2 c0) and D = sqrt(c0/c2).
- Fresnel is rejected (document.py): `fresnel on` with conserve_energy agrees with ours only on the outside of glass.
- A directional light is a parallel light far away: its position only affects shadows.
"""
import math

from tests.bench.peers.document import Unsupported, times

FAR = 1e6  # scene units: POV-Ray's precision is about 1e-6 of its coordinates


def vector(values):
    return "<" + ",".join(f"{value + 0.0:.15g}" for value in values) + ">"


def finish(material):
    """The terms of a texture besides its pigment, and the factor that compensates `transmit`."""
    kept = 1 - material.transmission
    if kept <= 0 and (material.ambient or material.diffuse) and any(material.color):
        raise Unsupported("diffuse or ambient colour with full transmission")
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
    refracts = material.transmission and material.transparency == "refract"
    interior = f" interior {{ ior {material.ior:.15g} }}" if refracts else ""
    return (f"#declare {name} = material {{ texture {{ pigment {{ rgb {vector(material.color)} "
            f"transmit {material.transmission:.15g} }} finish {{ {' '.join(parts)} }} }}{interior} }}")


def light_source(light, number):
    c0, c1, c2 = light.attenuation
    color, fade = light.color, ""
    if light.kind == "directional":
        position = times(-FAR / math.dist(light.position, (0, 0, 0)), light.position)
        return f"light_source {{ {vector(position)} rgb {vector(color)} parallel point_at <0,0,0> }}"
    if c1 or c0 < 1:
        raise Unsupported(f"attenuation of light {number}: only [c0 >= 1, 0, c2]")
    if c2:
        color = times(1 / (2 * c0), color)
        fade = f" fade_power 2 fade_distance {math.sqrt(c0 / c2):.15g}"
    elif c0 != 1:
        color = times(1 / c0, color)
    return f"light_source {{ {vector(light.position)} rgb {vector(color)}{fade} }}"


def mesh(value, tail, write):
    faces = value["triangles"]
    write("mesh2 { vertex_vectors {" + str(len(value["positions"])))
    for position in value["positions"]:
        write("," + vector(position))
    write("}")
    if "normals" in value:
        write("normal_vectors {" + str(len(value["normals"])))
        for normal in value["normals"]:
            write("," + vector(normal))
        write("}")
    write("face_indices {" + str(len(faces)))
    for face in faces:
        write(f",<{face[0]},{face[1]},{face[2]}>")
    write("}" + tail)


def shape(value, write):
    kind, tail = value["type"], f" material {{ m_{value['material']} }} }}"
    sides = "" if value.get("caps", True) else " open"
    if kind == "mesh":
        mesh(value, tail, write)
    elif kind == "triangle" and "normals" not in value:
        write("triangle { " + ",".join(map(vector, value["vertices"])) + tail)
    elif kind == "sphere":
        write(f"sphere {{ {vector(value['center'])},{value['radius']:.15g}{tail}")
    elif kind == "plane":
        write(f"plane {{ {vector(value['normal'])},0 translate {vector(value['point'])}{tail}")
    elif kind == "disc":
        write(f"disc {{ {vector(value['center'])},{vector(value['normal'])},{value['radius']:.15g},"
              f"{value.get('inner_radius', 0):.15g}{tail}")
    elif kind == "cylinder":
        write(f"cylinder {{ {vector(value['from'])},{vector(value['to'])},{value['radius']:.15g}{sides}{tail}")
    elif kind == "cone":
        write(f"cone {{ {vector(value['base'])},{value['radius']:.15g},{vector(value['apex'])},"
              f"{value.get('apex_radius', 0):.15g}{sides}{tail}")
    elif kind == "box":
        write(f"box {{ {vector(value['min'])},{vector(value['max'])}{tail}")
    else:
        raise Unsupported(f"a {kind}")


def view(camera, background):
    return (f"camera {{ perspective location {vector(camera.position)} direction {vector(camera.forward)} "
            f"right {vector(times(2 * camera.tan_x, camera.right))} up {vector(times(2 * camera.tan_y, camera.up))} }}\n"
            f"background {{ rgb {vector(background)} }}")


def write_scene(scene, path):
    """Raises Unsupported; the file is then incomplete."""
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write("#version 3.7;")
        write(f"global_settings {{ assumed_gamma 1 max_trace_level {scene.max_depth + 1} adc_bailout {scene.cutoff:.15g} }}")
        write(view(scene.camera, scene.background))
        for number, light in enumerate(scene.lights):
            write(light_source(light, number))
        for name, material in scene.materials.items():
            write(texture(f"m_{name}", material, scene.ambient))
        for value in scene.objects:
            shape(value, write)

"""Exports a scene of bench_scenes.py to POV-Ray 3.7.

- Handedness: the camera is given by its vectors, so the scene stays right-handed.
- Colours: assumed_gamma 1, and sRGB in the file, as Whittle writes it.
- Depth: max_trace_level counts the camera ray, max_depth does not. adc_bailout is the cutoff.
- Transmission: `transmit` reduces the diffuse and ambient terms, and ours does not: both are divided by 1 - transmit.
"""
from tests.bench.peers.document import camera, color


def vector(values):
    return "<" + ",".join(f"{value + 0.0:.15g}" for value in values) + ">"


def texture(name, material, ambient):
    transmission = material.get("transmission", 0)
    kept = 1 - transmission
    parts = [f"diffuse {material.get('diffuse', 1) / kept:.15g}"]
    if material["model"] == "phong" and material["specular"]:
        parts.append(f"phong {material['specular']:.15g} phong_size {material['shininess']:.15g}")
    if material.get("reflection"):
        parts.append(f"reflection {{ rgb {vector(color(material['reflection']))} }}")
    parts.append(f"ambient rgb {vector(color(material.get('ambient', 1) / kept * ambient))}")
    return (f"#declare {name} = material {{ texture {{ pigment {{ rgb {vector(material['color'])} "
            f"transmit {transmission:.15g} }} finish {{ {' '.join(parts)} }} }} }}")


def mesh(value, tail, write):
    write("mesh2 {")
    for name, rows in (("vertex_vectors", "positions"), ("normal_vectors", "normals"), ("face_indices", "triangles")):
        if rows in value:
            write(f"{name} {{{len(value[rows])}" + "".join(f",\n{vector(row)}" for row in value[rows]) + "}")
    write(tail)


def shape(value, write):
    kind, tail = value["type"], f" material {{ m_{value['material']} }} }}"
    if kind == "mesh":
        mesh(value, tail, write)
    elif kind == "sphere":
        write(f"sphere {{ {vector(value['center'])},{value['radius']:.15g}{tail}")
    elif kind == "plane":
        write(f"plane {{ {vector(value['normal'])},0 translate {vector(value['point'])}{tail}")
    elif kind == "cylinder":
        write(f"cylinder {{ {vector(value['from'])},{vector(value['to'])},{value['radius']:.15g} open{tail}")
    else:
        write(f"cone {{ {vector(value['base'])},{value['radius']:.15g},{vector(value['apex'])},{value['apex_radius']:.15g} open{tail}")


def view(frame, background):
    return (f"camera {{ perspective location {vector(frame.position)} direction {vector(frame.forward)} "
            f"right {vector(2 * frame.tan_x * frame.right)} up {vector(2 * frame.tan_y * frame.up)} }}\n"
            f"background {{ rgb {vector(background)} }}")


def write_scene(scene, path):
    accuracy = scene["accuracy"]
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write("#version 3.7;")
        write(f"global_settings {{ assumed_gamma 1 max_trace_level {accuracy['max_depth'] + 1} "
              f"adc_bailout {accuracy['cutoff']:.15g} }}")
        write(view(camera(scene), scene["background"]["color"]))
        for light in scene["lights"]:
            write(f"light_source {{ {vector(light['position'])} rgb {vector(color(light['intensity']))} }}")
        for name, material in scene["materials"].items():
            write(texture(f"m_{name}", material, scene["ambient"]))
        for value in scene["objects"]:
            shape(value, write)

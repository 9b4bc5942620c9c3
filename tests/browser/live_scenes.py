"""Scenes for tests of the live view: random ones with every feature that it traces, extreme ones, and large ones."""
import math
import random

MATERIALS = (  # each a function of a random generator and a function of colors
    lambda pick, color: {"model": "lambert", "color": color()},
    lambda pick, color: {"color": color(), "specular": 0.6, "shininess": pick.choice([0, 5, 60, 400]), "reflection": pick.uniform(0, 0.6)},
    lambda pick, color: {"model": "blinn_phong", "color": color(), "specular": 0.8, "specular_color": color(), "shininess": 40},
    lambda pick, color: {"color": 0, "diffuse": 0, "transmission": 1, "ior": pick.choice([0.8, 1.2, 1.5, 2.4]), "absorption": pick.choice([0, [0.2, 0.5, 0.1]])},
    lambda pick, color: {"color": color(), "transparency": "interpolated", "transmission": 0.5},
    lambda pick, color: {"color": 0, "transparency": "filtered", "transmission": 1, "transmission_color": color()},
    lambda pick, color: {"color": color(), "opacity": {"checker": [0, 1], "scale": [6, 6]}},
    lambda pick, color: {"color": color(), "bump": {"texture": {"noise": [0, 1], "scale": [8, 8], "octaves": 3}, "scale": 0.02}},
    lambda pick, color: {"color": color(), "normal_map": {"file": "assets/studs.png", "scale": [4, 2]}, "specular": 0.5},
    lambda pick, color: {"color": color(), "diffuse_transmission": 0.6, "specular_transmission": 0.4, "specular": 0.3, "diffuse_transmission_color": color()},
    lambda pick, color: {"color": 0.2, "emission": color(), "fresnel": True, "reflection": 1, "shading": "flat"},
    lambda pick, color: {"color": color(), "ambient": 0.5, "reflection": 0.9, "reflection_color": color()},
)
SHAPES = (  # each of about the size 1 around 0
    lambda pick: {"type": "sphere", "center": [0, 0, 0], "radius": 0.8, "axis": [1, 2, 0]},
    lambda pick: {"type": "disc", "center": [0, 0, 0], "normal": [1, 3, 1], "radius": 0.9, "inner_radius": pick.choice([0, 0.3])},
    lambda pick: {"type": "cylinder", "from": [0, -0.7, 0], "to": [0.1, 0.7, 0], "radius": 0.5, "caps": pick.random() < 0.7},
    lambda pick: {"type": "cone", "base": [0, -0.7, 0], "apex": [0, 0.8, 0], "radius": 0.7, "apex_radius": pick.choice([0, 0.3, 0.9]), "caps": pick.random() < 0.7},
    lambda pick: {"type": "box", "min": [-0.6, -0.5, -0.7], "max": [0.5, 0.6, 0.4]},
    lambda pick: {"type": "torus", "center": [0, 0, 0], "axis": [0, 1, pick.uniform(0, 1)], "major_radius": 0.6, "minor_radius": pick.choice([0.05, 0.2, 0.5])},
    lambda pick: {"type": "triangle", "vertices": [[-0.8, -0.6, 0], [0.8, -0.6, 0], [0, 0.8, 0.2]], "normals": [[-0.3, 0, 1], [0.3, 0, 1], [0, 0.4, 1]]},
    lambda pick: {"type": "mesh", "positions": [[0, 0.9, 0], [0.8, -0.5, 0.4], [-0.7, -0.5, 0.5], [0, -0.5, -0.8]], "smooth": pick.random() < 0.5,
                  "triangles": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]},
    lambda pick: {"type": "mesh", "file": "assets/vase.obj", "smooth": True},
)
LIGHTS = (
    lambda at: {"type": "point", "position": at, "attenuation": [1, 0.02, 0.01]},
    lambda at: {"type": "point", "position": at, "attenuation": "inverse_square", "intensity": 30},
    lambda at: {"type": "directional", "direction": [-part for part in at], "shadows": at[0] > 0},
    lambda at: {"type": "spot", "position": at, "direction": [-part for part in at], "inner_angle": 15, "outer_angle": 40},
    lambda at: {"type": "line", "from": at, "to": [at[0] + 1, at[1], at[2] + 1]},
    lambda at: {"type": "rect", "corner": at, "edge_u": [1, 0, 0], "edge_v": [0, 0.3, 1]},
    lambda at: {"type": "disc", "center": at, "normal": [0, -1, 0], "radius": 0.7},
    lambda at: {"type": "sphere", "center": at, "radius": 0.5, "visible": True},
)


def generated(number, width, height):
    """Scene `number`; the kinds of shapes, materials and lights take turns, so that 40 scenes have each several times."""
    pick = random.Random(number)

    def plain():
        return [round(pick.uniform(0.05, 0.95), 3) for _ in range(3)]

    def texture():
        scale, wrap = [pick.choice([1, 3, 8]), pick.choice([1, 2, -5])], {"wrap": pick.choice(["repeat", "clamp", "mirror"])}
        pattern = pick.choice(({"checker": [plain(), plain()]}, {"gradient": [plain(), plain()], **wrap}, {"noise": [plain(), plain()], "octaves": pick.randint(1, 5)},
                               {"file": "assets/tile.png", **wrap}))
        return {**pattern, "scale": scale, "filter": pick.choice(["nearest", "bilinear", "mipmap", "mipmap"])}

    def color():
        return texture() if pick.random() < 0.4 else plain()

    def at(reach):
        return [round(pick.uniform(-reach, reach), 3) for _ in range(3)]

    materials = {f"m{i}": MATERIALS[(3 * number + i) % len(MATERIALS)](pick, color) for i in range(4)}
    objects = [{"type": "plane", "point": [0, -1.6, 0], "normal": [0.05 * at(1)[0], 1, 0], "material": {"color": color(), "reflection": pick.choice([0, 0.3])}}]
    for i in range(7):
        place = [{"rotate": {"axis": [1, 1, 0.3], "angle": pick.uniform(0, 360)}}, {"scale": pick.choice([1, [1, 0.6, 1.3], [-1, 1, 1]])}, {"translate": at(1.8)}]
        objects.append({**SHAPES[(number + i) % len(SHAPES)](pick), "material": f"m{i % 4}", "transform": place, "shadow": pick.random() < 0.9})
    objects.append({"type": "instance", "of": "pair", "transform": [{"translate": at(1.5)}]})
    background = pick.choice(({"color": plain()}, {"zenith": plain(), "nadir": plain()}, {"environment": {"file": "assets/evening.png"}, "rotation": 40},
                              {"environment": {"noise": [plain(), plain()], "octaves": 3, "scale": [6, 3]}}, {"cube": {side: texture() for side in ("+x", "-x", "+y", "-y", "+z", "-z")}}))
    camera = {"position": [round(part + 0.1, 3) for part in (at(1)[0], at(1)[1], 7)], "look_at": [0, -0.2, 0], "fov": 40}
    camera = pick.choice((camera, camera, {**camera, "type": "orthographic", "height": 5}, {**camera, "type": "panorama", "position": [0.2, 0.3, 2.6]}))
    return {
        "version": 1, "image": {"width": width, "height": height}, "camera": camera, "background": background, "ambient": plain(),
        "lights": [{"color": plain(), **LIGHTS[(number + 3 * i) % len(LIGHTS)]([pick.choice([-3, 3]), 4, pick.uniform(2, 5)])} for i in range(1 + number % 3)],
        "materials": materials, "objects": objects,
        "prototypes": {"pair": [{"type": "sphere", "center": [0, 0, 0], "radius": 0.4, "material": "m0"}, {"type": "box", "min": [0.3, 0, 0], "max": [0.7, 0.4, 0.4], "material": "m1"}]},
        **({"depth_cue": {"front": 4, "back": 12, "back_scale": 0.3, "color": plain()}} if number % 5 == 0 else {}),
        **({"medium": {"absorption": [0.02, 0.05, 0.08]}} if number % 7 == 0 else {}),
        "output": {"exposure": pick.choice([0, 0, 1]), "overflow": pick.choice(["clamp", "reinhard"])},
        "accuracy": {"max_depth": pick.choice([30, 64])},
    }


def principled():
    """Spheres, a triangle and a mesh with interpolated normals: metals, plastics, clear coats, glass and sheets. Below a coat that reflects otherwise, metal is grey:
    the tracer draws one of both layers by chance."""
    kinds = ({"metallic": 1, "roughness": 0}, {"metallic": 1, "roughness": 0.3}, {"metallic": 1, "roughness": 0.9}, {"roughness": 0}, {"roughness": 0.4},
             {"roughness": 0.6, "coat": 1}, {"color": 0.6, "metallic": 0.5, "coat": 0.5, "coat_roughness": 0.3}, {"color": 1, "transmission": 1, "roughness": 0},
             {"transmission": 0.6, "transparency": "filtered", "roughness": 0.2}, {"roughness": 1, "diffuse_transmission": 0.5})
    spheres = [{"type": "sphere", "center": [1.3 * (i % 5) - 2.6, 1.3 * (i // 5) - 0.4, 0], "radius": 0.6, "material": f"m{i}"} for i in range(len(kinds))]
    return {"version": 1, "image": {"width": 192, "height": 120}, "camera": {"position": [0, 1, 9], "look_at": [0, 0.5, 0], "fov": 30}, "ambient": 0.1,
            "background": {"zenith": [0.4, 0.5, 0.6], "nadir": [0.3, 0.2, 0.2]}, "lights": [{**LIGHTS[kind]([3, 4, 5]), "intensity": 1} for kind in (0, 2)],
            "materials": {f"m{i}": {"model": "principled", "color": [0.8, 0.5, 0.3], **kind} for i, kind in enumerate(kinds)},
            "objects": [{"type": "plane", "point": [0, -1, 0], "normal": [0, 1, 0], "material": {"color": 0.5}}, *spheres,
                        {**SHAPES[6](None), "material": "m1", "transform": [{"translate": [1.3, 2.2, 0]}]}, {**SHAPES[8](None), "material": "m5", "transform": [{"translate": [-1.3, 1.6, 0]}]}]}


def scaled(document, factor, offset):
    """A scene of spheres, meshes, boxes and point lights, `factor` as large, and moved."""
    def at(point):
        return [factor * part + offset for part in point]

    def moved(each):
        points = {name: at(each[name]) for name in ("center", "min", "max", "position", "look_at", "point") if name in each}
        sizes = {name: factor * each[name] for name in ("radius",) if name in each}
        return {**each, **points, **sizes, **({"positions": [at(each_point) for each_point in each["positions"]]} if "positions" in each else {})}
    return {**document, "camera": moved(document["camera"]), "lights": [moved(each) for each in document["lights"]], "objects": [moved(each) for each in document["objects"]]}


def extremes():
    """{name: document} with the extremes of tests/stability that 32-bit floats hold."""
    def spheres(places, radius, material):
        return [{"type": "sphere", "center": place, "radius": radius, "material": material} for place in places]

    def wall(z, toward, material):
        return {"type": "plane", "point": [0, 0, z], "normal": [0, 0, toward], "material": material}

    mirror, glass = {"color": 0, "emission": [0.05, 0.1, 0.02], "reflection": 0.99}, {"color": 0.1, "transmission": 1, "reflection": 1, "fresnel": True, "ior": 1.5}
    camera = {"position": [0.4, 1, 6], "look_at": [0, 0, 0], "fov": 40}
    plain = {"version": 1, "image": {"width": 64, "height": 48}, "camera": camera, "background": {"color": [0.2, 0.3, 0.5]}, "ambient": 0.1,
             "lights": [{"type": "point", "position": [3, 5, 4]}], "objects": [
                 {"type": "plane", "point": [0, -1, 0], "normal": [0, 1, 0], "material": {"color": 0.6, "reflection": 0.2}},
                 *spheres([[-1, 0, 0]], 0.9, glass), {"type": "box", "min": [0.4, -1, -0.8], "max": [1.6, 0.6, 0.4], "material": {"color": [0.8, 0.3, 0.1], "specular": 0.4}}]}
    flat = [[-2, -1, 0], [2, -1, 0], [0, 2, 0], [0, -1, 0], [1e-30, 2, 0], [2, -1, 0]]
    degenerate = [[0, 1, 2], [0, 1, 3], [0, 0, 1], [2, 2, 2], [1, 5, 2], [0, 2, 4]]
    corridor = {**plain, "camera": {"position": [0.1, 0.2, 0.25], "look_at": [0.1, 0.3, 1], "fov": 60}, "objects": [wall(0, 1, mirror), wall(1, -1, mirror)]}
    return {
        "huge": scaled(plain, 1e9, 0), "tiny": scaled(plain, 1e-9, 0), "far from the origin": scaled(plain, 1, 1e6), "plain": plain,
        "corridor of mirrors": {**corridor, "accuracy": {"max_depth": 2000}},
        "closed mirrors": {**plain, "camera": {"position": [0.3, 0.4, 0.9], "look_at": [1, 0.1, 0.2], "fov": 110}, "accuracy": {"max_depth": 300}, "objects": [
            {"type": "box", "min": [0, 0, 0], "max": [1, 0.75, 1.5], "material": {**mirror, "reflection": 0.9}}]},
        "degenerate triangles": {**plain, "objects": [plain["objects"][0], {"type": "mesh", "positions": flat, "triangles": degenerate, "material": {"color": [0.3, 0.7, 0.4]}}]},
        "many waiting rays": {**plain, "image": {"width": 24, "height": 18}, "accuracy": {"max_depth": 64, "cutoff": 1e-12},
                              "objects": spheres([[x, y, 0] for x in (-0.9, 0.9) for y in (-0.9, 0.9)], 0.85, glass)},
        "camera on a surface": {**plain, "camera": {"position": [0, 0, 1], "look_at": [1, -0.3, 0.9], "fov": 100}, "objects": [
            plain["objects"][0], *spheres([[0, 0, 0]], 1, {"color": [0.6, 0.2, 0.7], "reflection": 0.3})]},
        "small beside large": {**plain, "objects": [*plain["objects"], *spheres([[0.2 * i, 0.5, 2] for i in range(-4, 5)], 2e-3, {"emission": [1, 1, 0.5]})]},
        "as bright as floats": {**plain, "lights": [{"type": "point", "position": [3, 5, 4], "intensity": 1e30}], "objects": [
            {**each, "material": {"color": 0.6, "specular": 1, "reflection": 0.9}} for each in plain["objects"]]},
    }


def large_scene(kind):
    """A wavy square of 100,352 triangles, or 50,000 spheres."""
    side = 224
    corners = [row * (side + 1) + column for row in range(side) for column in range(side)]
    mesh = {"type": "mesh", "smooth": True, "material": {"color": [0.5, 0.7, 0.4]},
            "positions": [[x / side, round(0.05 * math.sin(20 * x / side) * math.cos(17 * y / side), 6), y / side] for y in range(side + 1) for x in range(side + 1)],
            "triangles": [triangle for at in corners for triangle in ([at, at + side + 1, at + 1], [at + 1, at + side + 1, at + side + 2])]}
    cloud = [{"type": "sphere", "center": [round(i * step % 1, 6) for step in (0.6180339887, 0.7548776662, 0.5698402910)], "radius": 0.005, "material": "ball"} for i in range(50_000)]
    return {"version": 1, "camera": {"position": [0.5, 0.7, 2], "look_at": [0.5, 0.3, 0.5], "fov": 40}, "lights": [{"type": "point", "position": [2, 3, 2]}],
            "materials": {"ball": {"color": [0.8, 0.5, 0.2]}}, "objects": [mesh] if kind == "triangles" else cloud}

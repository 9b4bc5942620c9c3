"""Scenes that show each feature once: shapes, tori, instances, lights, transparency."""
import math


def shapes():
    """Shapes with a checker along their texture coordinates; torus() shows the torus."""
    def checkered(first, second, u, v):
        return {"color": {"checker": [first, second], "scale": [u, v]}, "specular": 0.25, "shininess": 60}

    return {
        "version": 1, "name": "shapes",
        "image": {"width": 720, "height": 405},
        "camera": {"position": [0.3, 3.1, 9.5], "look_at": [0.1, 0.72, 0], "fov": 29},
        "background": {"color": [0.62, 0.74, 0.86]},
        "ambient": 0.22,
        "lights": [{"type": "point", "position": [-5, 8, 6], "intensity": 0.7},
                   {"type": "directional", "direction": [-1, -1.2, -0.4], "color": [1, 0.9, 0.75], "intensity": 0.2}],
        "materials": {
            "floor": {"model": "lambert", "color": {"checker": [0.62, 0.54]}},
            "red": checkered([0.75, 0.12, 0.08], [0.9, 0.82, 0.7], 16, 8),
            "green": checkered([0.1, 0.42, 0.16], [0.85, 0.88, 0.7], 12, 6),
            "blue": checkered([0.08, 0.2, 0.6], [0.8, 0.86, 0.92], 6, 6),
            "gold": checkered([0.85, 0.55, 0.08], [0.3, 0.16, 0.05], 12, 5),
            "violet": checkered([0.36, 0.14, 0.5], [0.85, 0.8, 0.9], 10, 10)},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
            {"type": "sphere", "center": [-3.2, 0.8, 0], "radius": 0.8, "material": "red"},
            {"type": "cylinder", "from": [-1.35, 0, -0.6], "to": [-1.35, 1.7, -0.6], "radius": 0.62,
             "material": "green"},
            {"type": "cone", "apex": [0.45, 2.0, -0.9], "base": [0.45, 0, -0.9], "radius": 0.85, "material": "gold"},
            {"type": "cone", "apex": [2.3, 1.0, 0.1], "base": [2.3, 0, 0.1], "radius": 0.45, "apex_radius": 0.8,
             "caps": False, "material": "violet"},
            {"type": "box", "min": [-0.6, 0, -0.6], "max": [0.6, 1.2, 0.6], "material": "blue",
             "transform": [{"rotate": {"axis": [0, 1, 0], "angle": 32}}, {"translate": [4.0, 0, -1.0]}]},
            {"type": "disc", "center": [-0.75, 0.62, 1.5], "normal": [0.35, 0.5, 1], "radius": 0.6,
             "inner_radius": 0.26, "material": "violet"},
            {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "green",
             "transform": [{"scale": [0.85, 0.32, 0.5]}, {"rotate": {"axis": [0, 0, 1], "angle": 24}},
                           {"translate": [1.0, 0.55, 1.4]}]},
            {"type": "triangle", "vertices": [[2.5, 0.02, 1.8], [3.9, 0.02, 1.3], [3.1, 1.05, 1.2]],
             "uvs": [[0, 0], [1, 0], [0, 1]], "material": "blue"}],
        "accuracy": {"target_error": 1},
    }


def torus():
    """Tori of painted wood, dough, glass and gold: a stacking toy, two doughnuts, a gold ring linked with a glass one."""
    def ring(center, major, minor, material, axis=(0, 1, 0)):
        return {"type": "torus", "center": center, "axis": axis, "major_radius": major, "minor_radius": minor,
                "material": material}

    def toy(x, z, paints):
        """Rings that shrink upwards on a peg, each at rest on the one below, and a ball on top."""
        rings, y = [], 0.16
        for i, paint in enumerate(paints):
            minor = 0.29 - 0.024 * i
            rings.append(ring([x, y + minor, z], 0.74 - 0.082 * i, minor, paint))
            y += 1.9 * minor
        return rings + [
            {"type": "cylinder", "from": [x, 0, z], "to": [x, 0.16, z], "radius": 0.95, "material": "wood"},
            {"type": "cone", "base": [x, 0.16, z], "apex": [x, y + 0.1, z], "radius": 0.3, "apex_radius": 0.12,
             "material": "wood"},
            {"type": "sphere", "center": [x, y + 0.2, z], "radius": 0.26, "material": "wood"}]

    def linked(x, z, turn):
        """A glass ring on its edge, turned about the vertical, and a smaller one that leans through it at 45 degrees
        and rests on the table and on the glass."""
        major, minor, thin, slope = 0.95, 0.29, 0.11, math.sqrt(0.5)
        height = major + minor + 0.002
        gold = (height - slope * (major - minor - thin) - thin) / (2 * slope)
        right = slope * (major - minor - thin + gold)
        across, ahead = math.cos(turn), math.sin(turn)
        return [ring([x, height, z], major, minor, "glass", [ahead, 0, across]),
                ring([x + right * across, slope * gold + thin, z - right * ahead], gold, thin, "gold",
                     [slope * across, slope, -slope * ahead])]

    def doughnut(x, z, glaze, colors):
        """Glazed above, with sprinkles there, spread evenly around and across by two irrational steps."""
        major, minor, half = 0.4, 0.23, 0.055
        sprinkles = []
        for i in range(110 if colors else 0):
            around, across = 2.39996 * i, math.pi * (0.14 + 0.72 * (i * 0.7548777 % 1))
            c, s, cc, ss = math.cos(around), math.sin(around), math.cos(across), math.sin(across)
            at = (x + (major + minor * cc) * c, minor + 0.004 + minor * ss, z + (major + minor * cc) * s)
            along = [half * (math.cos(1.7 * i) * p + math.sin(1.7 * i) * q)
                     for p, q in zip((-s, 0, c), (-ss * c, cc, -ss * s))]
            sprinkles.append({"type": "cylinder", "from": [p - d for p, d in zip(at, along)],
                              "to": [p + d for p, d in zip(at, along)], "radius": 0.019,
                              "material": colors[i % len(colors)]})
        return [ring([x, minor + 0.004, z], major, minor, glaze), *sprinkles]

    def painted(color):
        return {"color": color, "diffuse": 0.85, "specular": 0.35, "shininess": 120, "reflection": 0.05}

    def glazed(texture):
        return {"color": texture, "specular": 0.3, "shininess": 60, "reflection": 0.03}

    return {
        "version": 1, "name": "torus",
        "image": {"width": 720, "height": 405},
        "camera": {"position": [0.2, 2.5, 9.6], "look_at": [0.12, 1.08, 0], "fov": 23},
        "background": {"zenith": [0.85, 0.88, 0.95], "nadir": [0.4, 0.36, 0.32]},
        "ambient": 0.26,
        "lights": [{"type": "rect", "corner": [-5.0, 6.5, 2.5], "edge_u": [1.8, 0, 1.2], "edge_v": [0.7, 1, -1],
                    "color": [1, 0.95, 0.87], "intensity": 0.8},
                   {"type": "point", "position": [7, 6, 5], "color": [0.85, 0.9, 1], "intensity": 0.2}],
        "textures": {
            "planks": {"noise": ["#7c5638", "#a57d57"], "octaves": 4, "scale": [0.3, 5]},
            "pink": {"checker": ["#ef8fb0", "#b9793c"], "scale": [1, 2]},
            "chocolate": {"checker": ["#41200f", "#b9793c"], "scale": [1, 2]}},
        "materials": {
            "table": {"color": "planks", "specular": 0.15, "shininess": 60, "reflection": 0.06},
            "wall": {"model": "lambert", "color": [0.42, 0.56, 0.6]},
            "wood": {"color": [0.72, 0.52, 0.3], "specular": 0.2, "shininess": 60},
            "red": painted([0.75, 0.07, 0.06]), "orange": painted([0.88, 0.38, 0.04]),
            "yellow": painted([0.9, 0.72, 0.08]), "green": painted([0.14, 0.5, 0.12]),
            "blue": painted([0.07, 0.22, 0.62]), "cream": painted([0.92, 0.88, 0.78]),
            "pink": glazed("pink"), "chocolate": glazed("chocolate"),
            "gold": {"color": [0.5, 0.32, 0.07], "ambient": 0.3, "diffuse": 0.4, "specular": 0.9, "shininess": 200,
                     "specular_color": [1, 0.85, 0.5], "reflection": 0.7, "reflection_color": [1, 0.77, 0.34]},
            "glass": {"color": 1, "ambient": 0, "diffuse": 0, "specular": 0.7, "shininess": 500, "transmission": 1,
                      "ior": 1.5, "transmission_color": [0.95, 0.985, 0.975]}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "table"},
            {"type": "plane", "point": [0, 0, -4], "normal": [0, 0, 1], "material": "wall"},
            *toy(-1.85, -0.6, ("red", "orange", "yellow", "green", "blue")),
            *linked(1.3, -0.3, 0.35),
            *doughnut(-0.15, 1.3, "pink", ("cream", "green", "blue", "yellow")),
            *doughnut(1.25, 1.9, "chocolate", ())],
        "accuracy": {"target_error": 1},
    }


def instances(levels=5):
    """A tree of cones: each branch places two of the next level's, turned and scaled, and the whole is planted five
    times with other leaves. 32 balls of leaves a tree, from one ball."""
    def branch(level):
        limb = {"type": "cone", "base": [0, 0, 0], "apex": [0, 1, 0], "radius": 0.09, "apex_radius": 0.06,
                "material": "bark"}
        def fork(turn, lean, scale):
            return {"type": "instance", "of": f"branch {level + 1}" if level < levels else "leaves",
                    "transform": [{"scale": scale}, {"rotate": {"axis": [0, 0, 1], "angle": lean}},
                                  {"rotate": {"axis": [0, 1, 0], "angle": turn}}, {"translate": [0, 0.98, 0]}]}
        return [limb, fork(35, 28, 0.78), fork(205, 33, 0.72)]

    def tree(x, z, turn, scale, of="branch 1"):
        return {"type": "instance", "of": of,
                "transform": [{"rotate": {"axis": [0, 1, 0], "angle": turn}}, {"scale": scale},
                              {"translate": [x, 0, z]}]}

    return {
        "version": 1, "name": "instances",
        "image": {"width": 720, "height": 405},
        "camera": {"position": [0, 2.2, 10.5], "look_at": [0, 1.75, 0], "fov": 30},
        "background": {"color": [0.66, 0.79, 0.9]},
        "ambient": [0.2, 0.22, 0.26],
        "lights": [{"type": "directional", "direction": [0.7, -1, -0.55], "color": [1, 0.93, 0.8], "intensity": 0.95}],
        "materials": {
            "grass": {"model": "lambert", "color": [0.34, 0.42, 0.16]},
            "bark": {"model": "lambert", "color": [0.26, 0.16, 0.09]},
            "leaf": {"model": "lambert", "color": [0.16, 0.38, 0.09]},
            "stone": {"color": 0.62, "specular": 0.2}},
        "prototypes": {
            **{f"branch {level}": branch(level) for level in range(1, levels + 1)},
            "leaves": [{"type": "sphere", "center": [0, 0.35, 0], "radius": 0.8, "material": "leaf",
                        "transform": [{"scale": [1, 0.8, 1]}]}]},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "grass"},
            tree(0.1, 0, 20, 1.0), tree(-2.7, -1.2, 130, 0.86), tree(2.8, -0.8, 250, 0.92),
            {**tree(-1.4, -5.5, 75, 1.05), "material": "stone"}, tree(4.6, -4.5, 10, 1.0)],
        "accuracy": {"target_error": 1},
    }


def lights():
    """The seven lights, each over a post of its own between screens: point, spot and directional with hard shadows;
    line, rect, disc and sphere with soft ones."""
    kinds = [
        {"type": "point", "position": [0, 2.2, 0.3]},
        {"type": "spot", "position": [0, 2.4, 0.6], "target": [0, 0, -0.1], "inner_angle": 14, "outer_angle": 24},
        {"type": "line", "from": [-0.45, 2.2, 0.3], "to": [0.45, 2.2, 0.3]},
        {"type": "rect", "corner": [-0.4, 2.2, 0], "edge_u": [0.8, 0, 0], "edge_v": [0, 0, 0.6]},
        {"type": "disc", "center": [0, 2.2, 0.3], "normal": [0, -1, 0], "radius": 0.35},
        {"type": "sphere", "center": [0, 2.1, 0.3], "radius": 0.3}]

    def moved(light, x):
        by = lambda v: [v[0] + x, v[1], v[2]]
        points = ("position", "target", "from", "to", "corner", "center")
        return {**{key: by(value) if key in points else value for key, value in light.items()},
                "attenuation": [0.4, 0, 0.28], "intensity": 1.0}

    places = [1.5 * i - 3.75 for i in range(len(kinds))]
    screens = [1.5 * i - 4.5 for i in range(len(kinds) + 1)]
    return {
        "version": 1, "name": "lights",
        "image": {"width": 900, "height": 340},
        "camera": {"position": [0, 3.0, 12.5], "look_at": [0, 1.0, 0], "fov": 16.5},
        "ambient": 0.06,
        "lights": [moved(light, x) for light, x in zip(kinds, places)]
                  + [{"type": "directional", "direction": [0.3, -1, -0.8], "color": [0.5, 0.62, 1],
                      "intensity": 0.12}],
        "materials": {
            "wall": {"model": "lambert", "color": [0.78, 0.76, 0.72]},
            "post": {"color": [0.72, 0.3, 0.14], "specular": 0.4, "shininess": 50}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "wall"},
            {"type": "plane", "point": [0, 0, -1], "normal": [0, 0, 1], "material": "wall"}]
            + [{"type": "box", "min": [x - 0.03, 0, -1], "max": [x + 0.03, 2.6, 1], "material": "wall"}
               for x in screens]
            + [part for x in places for part in (
                {"type": "cylinder", "from": [x, 0, 0.1], "to": [x, 0.75, 0.1], "radius": 0.11, "material": "post"},
                {"type": "sphere", "center": [x, 0.95, 0.1], "radius": 0.2, "material": "post"})],
        "accuracy": {"target_error": 1},
    }


def transparency():
    """Kinds of transparency: an interpolated and a filtered pane, solids that absorb by their thickness, and two that
    overlap, where the one of higher priority fills the lens they share."""
    def liquid(absorption, **more):
        return {"color": 1, "diffuse": 0, "ambient": 0, "specular": 0.6, "shininess": 400, "transmission": 1,
                "ior": 1.33, "absorption": absorption, **more}

    def pane(x, material):
        return {"type": "box", "min": [x - 0.75, 0.02, 0.9], "max": [x + 0.75, 1.5, 0.94], "material": material}

    return {
        "version": 1, "name": "transparency",
        "image": {"width": 680, "height": 306},
        "camera": {"position": [0, 2.0, 10.5], "look_at": [-0.1, 0.78, 0], "fov": 21.5},
        "background": {"color": [0.68, 0.78, 0.88]},
        "ambient": 0.2,
        "lights": [{"type": "sphere", "center": [-4, 7, 5], "radius": 0.6, "intensity": 0.8}],
        "materials": {
            "floor": {"model": "lambert", "color": {"checker": [[0.82, 0.8, 0.76], [0.3, 0.34, 0.4]],
                                                    "scale": [2, 2]}},
            "post": {"color": [0.75, 0.3, 0.1], "specular": 0.3},
            "veil": {"color": [0.3, 0.5, 0.85], "transparency": "interpolated", "transmission": 0.55},
            "filter": {"color": 0, "transparency": "filtered", "transmission": 1,
                       "transmission_color": [0.95, 0.55, 0.3], "specular": 0.3},
            "amber": liquid([0.15, 0.7, 2.2]),
            "wine": liquid([0.25, 2.2, 1.7], priority=1),
            "mint": liquid([1.9, 0.25, 0.9])},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
            pane(-3.3, "veil"), pane(-1.5, "filter")]
            + [{"type": "cylinder", "from": [x, 0, 0], "to": [x, 1.25, 0], "radius": 0.2, "material": "post"}
               for x in (-3.3, -1.5)]
            + [{"type": "cone", "base": [0.35, 0.01, 0.4], "apex": [0.35, 1.5, 0.4], "radius": 0.5,
                "apex_radius": 0.12, "material": "amber"},
               {"type": "sphere", "center": [2.0, 0.8, 0.3], "radius": 0.75, "material": "wine"},
               {"type": "sphere", "center": [2.95, 0.8, 0.3], "radius": 0.75, "material": "mint"}],
        "accuracy": {"target_error": 1},
    }

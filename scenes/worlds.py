"""Scenes of environments, cube maps, bump maps and normal maps, and of light between surfaces."""
import math

from terrain import gradient_noise


def evening(x, y, width=512, height=256):
    """An evening all around: a low sun, streaks of cloud, hills, a plain. Equirectangular, row 0 straight up."""
    longitude, latitude = ((x + 0.5) / width - 0.5) * 2 * math.pi, (0.5 - (y + 0.5) / height) * math.pi
    mix = lambda a, b, t: [p + (q - p) * min(1.0, max(0.0, t)) for p, q in zip(a, b)]
    around = (2 * math.cos(longitude), 2 * math.sin(longitude))  # noise on a circle closes at the seam
    hills = 0.06 + 0.05 * gradient_noise(around[0] * 1.5, around[1] * 1.5, 3)
    ground = mix((112, 84, 92), (58, 52, 44), (hills - latitude) * 1.6)
    color = mix((250, 190, 120), (52, 84, 148), (latitude - hills) / 0.9)
    cloud = gradient_noise(around[0] * 1.2, around[1] * 1.2 + 9 * latitude, 1)
    cloud += 0.5 * gradient_noise(around[0] * 3, around[1] * 3 + 20 * latitude, 2)
    color = mix(color, (255, 214, 190), (cloud - 0.05) * 1.6 * math.cos(latitude))
    sun = math.acos(max(-1.0, min(1.0, math.cos(latitude) * math.cos(0.24) * math.cos(longitude - 0.75)
                                  + math.sin(latitude) * math.sin(0.24))))
    sky = mix((255, 250, 225), color, (sun - 0.05) / 0.25)
    return tuple(round(c) for c in mix(sky, ground, (hills - latitude) * height / math.pi + 0.5))


def studs(x, y, side=64):
    """Normals of a round stud on a plate, as n/2 + 1/2 in 8 bits; row 0 is the upper edge."""
    u, v = (x + 0.5) / side * 2 - 1, 1 - (y + 0.5) / side * 2
    distance, radius = math.hypot(u, v), 0.72
    lean = min(1.0, distance / radius) * 0.85 if distance < radius else 0.0
    n = (u / distance * lean, v / distance * lean, math.sqrt(1 - lean * lean)) if lean else (0.0, 0.0, 1.0)
    return tuple(round(255 * (c / 2 + 0.5)) for c in n)


def tile(x, y, side=64):
    """A glazed tile: a star of eight points in a ring, white joints."""
    u, v = (x + 0.5) / side * 2 - 1, (y + 0.5) / side * 2 - 1
    star = min(max(abs(u), abs(v)), (abs(u) + abs(v)) / math.sqrt(2))
    if max(abs(u), abs(v)) > 0.94:
        return (226, 221, 208)
    if star < 0.3:
        return (214, 160, 52)
    if star < 0.48:
        return (240, 236, 226)
    return (26, 110, 118) if math.hypot(u, v) < 0.84 else (18, 56, 92)


def environment():
    """An evening around two mirror balls, one of them glass, and a rough one."""
    return {
        "version": 1, "name": "environment",
        "image": {"width": 800, "height": 450},
        "camera": {"position": [0, 1.15, 6], "look_at": [0, 1.05, 0], "fov": 42},
        "background": {"environment": "evening", "rotation": 20},
        "ambient": [0.35, 0.3, 0.32],
        "lights": [{"type": "directional", "direction": [-0.4, -0.33, 0.85], "color": [1, 0.8, 0.55], "intensity": 0.8},
                   {"type": "point", "position": [-4, 5, 7], "color": [0.9, 0.85, 1], "intensity": 0.5}],
        "textures": {"evening": {"file": "assets/evening.png"}},
        "materials": {
            "chrome": {"color": 0.02, "specular": 0.8, "shininess": 400, "reflection": 0.95},
            "glass": {"diffuse": 0, "ambient": 0, "specular": 0.6, "shininess": 300, "transmission": 1},
            "clay": {"model": "lambert", "color": "#b8805a"},
            "table": {"color": "#4a3a34", "specular": 0.3, "shininess": 40, "reflection": 0.18}},
        "objects": [
            {"type": "cylinder", "from": [0, -0.25, 0], "to": [0, 0, 0], "radius": 3.1, "material": "table"},
            {"type": "sphere", "center": [-1.55, 1, -0.5], "radius": 1, "material": "chrome"},
            {"type": "sphere", "center": [1.5, 0.85, 0], "radius": 0.85, "material": "glass"},
            {"type": "sphere", "center": [0, 0.5, 1.1], "radius": 0.5, "material": "clay"}],
        "accuracy": {"target_error": 1},
    }


def cube():
    """A cube map: a ball and mirrors in front of six patterns, each in its own colour."""
    wall = lambda low, high: {"gradient": [low, high]}
    tiled = lambda dark, light, n: {"checker": [dark, light], "scale": [n, n]}
    return {
        "version": 1, "name": "cube",
        "image": {"width": 640, "height": 400},
        "camera": {"position": [3.4, 0.7, 3.3], "look_at": [0.35, 0.1, 0], "fov": 84},
        "background": {"cube": {"+x": wall("#3a1410", "#e88a70"), "-x": wall("#10203a", "#7aa8e8"),
                                "+y": tiled("#fff4d8", "#e8cf98", 6), "-y": tiled("#2c2c30", "#8c8c92", 10),
                                "+z": tiled("#4a2a5a", "#b88ad0", 8), "-z": wall("#123a20", "#8ad09a")}},
        "ambient": 0.3,
        "lights": [{"type": "directional", "direction": [-0.3, -1, -0.4], "intensity": 0.7}],
        "materials": {
            "mirror": {"color": 0.02, "specular": 0.7, "shininess": 300, "reflection": 0.92},
            "pearl": {"color": 0.7, "specular": 0.5, "shininess": 120, "reflection": 0.25}},
        "objects": [
            {"type": "sphere", "center": [-0.5, 0, 0], "radius": 1.35, "material": "mirror"},
            {"type": "box", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5], "material": "mirror",
             "transform": [{"rotate": {"axis": [1, 2, 0.5], "angle": 40}}, {"translate": [2.1, -0.55, 0.6]}]},
            {"type": "sphere", "center": [1.2, 1.15, 0.2], "radius": 0.42, "material": "pearl"}],
        "accuracy": {"target_error": 1},
    }


def relief():
    """Bump maps of noise, a gradient and an image, and a normal map, each on a smooth shape."""
    return {
        "version": 1, "name": "relief",
        "image": {"width": 672, "height": 378},
        "camera": {"position": [0, 2.1, 7.5], "look_at": [0, 0.85, 0], "fov": 34},
        "background": {"zenith": [0.3, 0.42, 0.6], "nadir": [0.75, 0.76, 0.75]},
        "ambient": 0.2,
        "lights": [{"type": "point", "position": [-6, 6, 5], "color": [1, 0.95, 0.88], "intensity": 0.9}],
        "textures": {
            "dents": {"noise": [0, 1], "octaves": 4, "scale": [14, 9]},
            "waves": {"noise": [0, 1], "octaves": 2, "scale": [1.6, 3.2]},
            "grooves": {"gradient": [0, 1], "wrap": "mirror", "scale": [1, 24]},
            "tiles": {"file": "assets/tile.png", "scale": [8, 4]},
            "studs": {"file": "assets/studs.png", "scale": [10, 5]}},
        "materials": {
            "water": {"color": [0.04, 0.1, 0.13], "specular": 0.5, "shininess": 200, "reflection": 0.5,
                      "bump": {"texture": "waves", "scale": 0.037}},
            "orange": {"color": "#e07a1a", "specular": 0.5, "shininess": 40,
                       "bump": {"texture": "dents", "scale": 0.074}},
            "lathed": {"color": "#b08d57", "specular": 0.6, "shininess": 60, "reflection": 0.15,
                       "bump": {"texture": "grooves", "scale": 0.03}},
            "glazed": {"color": "tiles", "specular": 0.6, "shininess": 150, "reflection": 0.06,
                       "bump": {"texture": "tiles", "scale": -0.06}},
            "studded": {"color": 0.62, "specular": 0.6, "shininess": 80, "reflection": 0.12, "normal_map": "studs"}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "water"},
            {"type": "sphere", "center": [-2.7, 1, 0], "radius": 1, "material": "orange"},
            {"type": "cylinder", "from": [-0.85, 0.05, 0.4], "to": [-0.85, 1.75, 0.4], "radius": 0.6,
             "material": "lathed"},
            {"type": "sphere", "center": [1.0, 0.95, 0], "radius": 0.95, "material": "glazed"},
            {"type": "sphere", "center": [2.95, 0.85, 0.2], "radius": 0.85, "material": "studded"}],
        "accuracy": {"target_error": 1},
    }


def cornell_box():
    """The Cornell box with its measured geometry (Cornell University Program of Computer Graphics, 1998), in millimetres,
    under the rendering equation: its lamp is the only light. Reflectances and the lamp's radiance in linear RGB are those
    of Mitsuba's scene cbox-rgb, with white blocks."""
    def face(material, *corners):
        return {"type": "mesh", "positions": corners, "triangles": [[0, 1, 2], [0, 2, 3]], "material": material}

    def block(corners, height):
        """The sides and the top of a block on four corners of the floor."""
        at = lambda corner, y: [corner[0], y, corner[1]]
        sides = [face("white", at(a, 0), at(b, 0), at(b, height), at(a, height))
                 for a, b in zip(corners, corners[1:] + corners[:1])]
        return [*sides, face("white", *(at(corner, height) for corner in corners))]

    lamp = 548.79   # just below the ceiling
    return {
        "version": 1, "name": "Cornell box",
        "image": {"width": 256, "height": 256},
        "camera": {"position": [278, 273, -800], "look_at": [278, 273, 0], "fov": 39.3077},
        "materials": {
            "white": {"model": "lambert", "color": [0.885809, 0.698859, 0.666422]},
            "red": {"model": "lambert", "color": [0.570068, 0.0430135, 0.0443706]},
            "green": {"model": "lambert", "color": [0.105421, 0.37798, 0.076425]},
            "lamp": {"model": "lambert", "diffuse": 0, "emission": [18.387, 10.9873, 2.75357]}},
        "objects": [
            face("lamp", [343, lamp, 227], [343, lamp, 332], [213, lamp, 332], [213, lamp, 227]),
            face("white", [552.8, 0, 0], [0, 0, 0], [0, 0, 559.2], [549.6, 0, 559.2]),
            face("white", [556, 548.8, 0], [556, 548.8, 559.2], [0, 548.8, 559.2], [0, 548.8, 0]),
            face("white", [549.6, 0, 559.2], [0, 0, 559.2], [0, 548.8, 559.2], [556, 548.8, 559.2]),
            face("green", [0, 0, 559.2], [0, 0, 0], [0, 548.8, 0], [0, 548.8, 559.2]),
            face("red", [552.8, 0, 0], [549.6, 0, 559.2], [556, 548.8, 559.2], [556, 548.8, 0]),
            *block([(130, 65), (82, 225), (240, 272), (290, 114)], 165),
            *block([(423, 247), (265, 296), (314, 456), (472, 406)], 330)],
        "accuracy": {"model": "global", "target_error": 2},
    }

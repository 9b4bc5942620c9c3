"""Scenes of light between surfaces, under the rendering equation."""
from meshes import box, quad


def color_bleeding():
    """A white corner between a red wall and a blue block: what is white takes their color, a ball on both sides. The
    gallery shows this scene under each model of light."""
    return {
        "version": 1, "name": "color bleeding",
        "image": {"width": 256, "height": 192},
        "camera": {"position": [1.75, 1.75, 5.2], "look_at": [1.2, 0.78, 0.9], "fov": 36},
        "lights": [{"type": "rect", "corner": [1.1, 3.9, 1.5], "edge_u": [0.8, 0, 0], "edge_v": [0, 0, 0.8],
                    "color": [1, 0.96, 0.88], "intensity": 0.65}],
        "materials": {
            "white": {"model": "lambert", "color": 0.86},
            "red": {"model": "lambert", "color": [0.85, 0.07, 0.04]},
            "blue": {"model": "lambert", "color": [0.06, 0.22, 0.85]}},
        "objects": [
            {**quad((0, 0, 4), (4, 0, 0), (0, 0, -4)), "material": "white"},
            {**quad((0, 0, 0), (4, 0, 0), (0, 3.2, 0)), "material": "white"},
            {**quad((0, 0, 4), (0, 0, -4), (0, 3.2, 0)), "material": "red"},
            {**box((1.85, 0, 0.35), (2.75, 1.75, 1.25), 15.0), "material": "blue"},
            {"type": "sphere", "center": [1.12, 0.5, 1.15], "radius": 0.5, "material": "white"},
            {"type": "cone", "base": [0.42, 0, 0.5], "apex": [0.42, 1.35, 0.5], "radius": 0.34, "material": "white"}],
        "accuracy": {"model": "global", "target_error": 2},
    }


def integrating_sphere():
    """An integrating sphere, seen from its inside: a lamp behind a baffle, and a red sample. White paint sends the light
    on so often that the wall is evenly bright, also where no light of the lamp arrives."""
    return {
        "version": 1, "name": "integrating sphere",
        "image": {"width": 256, "height": 192},
        "camera": {"position": [0.35, 0.15, 1.25], "look_at": [-0.1, -0.1, -1], "fov": 96},
        "lights": [{"type": "sphere", "center": [-0.75, 0.35, -0.45], "radius": 0.1, "intensity": 0.055,
                    "attenuation": "inverse_square"}],
        "output": {"exposure": 0.5},
        "materials": {
            "paint": {"model": "lambert", "color": [0.92, 0.92, 0.9]},
            "baffle": {"model": "lambert", "color": 0.9},
            "sample": {"model": "lambert", "color": [0.7, 0.06, 0.04]},
            "port": {"model": "lambert", "color": 0}},
        "objects": [
            {"type": "sphere", "center": [0, 0, 0], "radius": 1.5, "material": "paint"},
            {"type": "disc", "center": [-0.45, 0.25, -0.4], "normal": [0.96, -0.2, 0.2], "radius": 0.34, "material": "baffle"},
            {"type": "disc", "center": [1.1, -0.35, -0.85], "normal": [-0.767, 0.244, 0.593], "radius": 0.3,
             "material": "sample"},
            {"type": "disc", "center": [-0.1, -0.95, -1.1], "normal": [0.069, 0.652, 0.755], "radius": 0.22,
             "material": "port"}],
        "accuracy": {"model": "global", "approximate": {"interreflection": "radiosity"}, "target_error": 2},
    }


def daylight():
    """A room by day: the sky and the sun come through the window, and all other light is theirs, sent on by the floor and
    the walls."""
    wide, high, deep = 4.0, 2.6, 5.0
    left, right, sill, head = 0.9, 3.9, 0.6, 2.3     # of the window, in the wall at x = 0, along z

    def window_wall(z0, z1, y0, y1):
        return {**box((-0.25, y0, z0), (0, y1, z1)), "material": "white"}

    def leg(x, z):
        return {"type": "cylinder", "from": [x, 0, z], "to": [x, 0.7, z], "radius": 0.035, "material": "wood"}

    return {
        "version": 1, "name": "daylight",
        "image": {"width": 256, "height": 192},
        "camera": {"position": [3.3, 1.5, 4.75], "look_at": [1.35, 1.08, 1.6], "fov": 62},
        "output": {"exposure": 0.3},
        "background": {"zenith": [0.45, 0.75, 1.6], "nadir": [0.35, 0.3, 0.22]},
        "lights": [{"type": "directional", "direction": [0.72, -0.62, -0.3], "color": [1, 0.9, 0.72], "intensity": 5}],
        "materials": {
            "white": {"model": "lambert", "color": [0.82, 0.8, 0.76]},
            "floor": {"model": "lambert", "color": {"noise": ["#6b452b", "#a87c50"], "octaves": 4, "scale": [2, 24]}},
            "green": {"model": "lambert", "color": [0.3, 0.42, 0.2]},
            "wood": {"color": [0.45, 0.28, 0.15], "specular": 0.2, "shininess": 60},
            "clay": {"model": "lambert", "color": "#b8643c"}},
        "objects": [
            {**quad((0, 0, deep), (wide, 0, 0), (0, 0, -deep)), "material": "floor"},
            {**quad((0, high, 0), (wide, 0, 0), (0, 0, deep)), "material": "white"},
            {**quad((0, 0, 0), (wide, 0, 0), (0, high, 0)), "material": "green"},
            {**quad((wide, 0, deep), (-wide, 0, 0), (0, high, 0)), "material": "white"},
            {**quad((wide, 0, 0), (0, 0, deep), (0, high, 0)), "material": "white"},
            window_wall(0, left, 0, high), window_wall(right, deep, 0, high),
            window_wall(left, right, 0, sill), window_wall(left, right, head, high),
            {**box((0.6, 0.7, 0.5), (1.9, 0.76, 1.5)), "material": "wood"},
            *(leg(x, z) for x in (0.68, 1.82) for z in (0.58, 1.42)),
            {"type": "sphere", "center": [1.0, 0.96, 1.0], "radius": 0.2, "material": "clay"},
            {"type": "cone", "base": [1.55, 0.76, 0.9], "apex": [1.55, 1.2, 0.9], "radius": 0.13, "apex_radius": 0.07,
             "material": "white"}],
        "accuracy": {"model": "global", "approximate": {"interreflection": "radiosity"}, "target_error": 2},
    }

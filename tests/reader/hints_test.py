"""Every hint of the reader's messages ("write ...", "did you mean ...?"), applied to the document that caused it, leaves no issue.

Each field of each kind of object is misspelled, and each word of foreign_words.txt is written into each kind of object. The reader's
answer depends on the word and the kind alone, so that one document gets many hints.
"""
import copy
import json
import re

from tests.support.whittle import SOURCE, DirectoryTest, whittle

WORDS = sorted({word for line in (SOURCE / "api/src/reader/foreign_words.txt").read_text("utf-8").splitlines() if " > " in line
                for word in line.split(" > ")[0].split()})
TRIANGLE = {"positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}
SPOT = {"type": "spot", "position": [0, 1, 0], "inner_angle": 10, "outer_angle": 20}
LIGHTS = [{"type": "point", "position": [0, 1, 0], "attenuation": "none", "color": 1, "intensity": 1, "shadows": True},
          {"type": "directional", "direction": [0, -1, 0]}, {**SPOT, "direction": [0, -1, 0]}, {**SPOT, "target": [0, 0, 0]},
          {"type": "line", "from": [0, 1, 0], "to": [1, 1, 0]},
          {"type": "rect", "corner": [0, 1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1], "visible": False},
          {"type": "disc", "center": [0, 1, 0], "normal": [0, 1, 0], "radius": 1, "visible": True},
          {"type": "sphere", "center": [0, 1, 0], "radius": 1, "visible": False}]
OBJECTS = [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "axis": [0, 1, 0], "meridian": [1, 0, 0], "shadow": True},
           {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "u_axis": [1, 0, 0]},
           {"type": "triangle", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "normals": [[0, 0, 1]] * 3, "uvs": [[0, 0]] * 3},
           {"type": "mesh", **TRIANGLE, "normals": [[0, 0, 1]] * 3, "uvs": [[0, 0]] * 3, "smooth": True},
           {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2, 3]]},
           {"type": "mesh", "file": "a.obj", "materials": {}}, {"type": "instance", "of": "p"},
           {"type": "disc", "center": [0, 0, 0], "normal": [0, 1, 0], "radius": 1, "inner_radius": 0.5, "u_axis": [1, 0, 0]},
           {"type": "cylinder", "from": [0, 0, 0], "to": [0, 1, 0], "radius": 1, "caps": True, "u_axis": [1, 0, 0]},
           {"type": "cylinder", "base": [0, 0, 0], "height": 1, "radius": 1}, {"type": "cone", "base": [0, 0, 0], "height": 1, "radius": 1},
           {"type": "cone", "apex": [0, 1, 0], "base": [0, 0, 0], "radius": 1, "apex_radius": 0.5, "caps": True, "u_axis": [1, 0, 0]},
           {"type": "box", "min": [0, 0, 0], "max": [1, 1, 1]}, {"type": "box", "center": [0, 0, 0], "size": [1, 1, 1]},
           {"type": "torus", "center": [0, 0, 0], "axis": [0, 1, 0], "major_radius": 1, "minor_radius": 0.5, "u_axis": [1, 0, 0]}]
TEXTURES = [{"checker": [0, 1], "scale": [2, 4], "offset": [0, 0], "wrap": "clamp", "filter": "nearest"}, {"gradient": [0, 1]},
            {"noise": [0, 1], "octaves": 2}, {"file": "a.png", "channel": "color", "color_space": "srgb"}]
MATERIAL = {"model": "phong", "color": 1, "ambient": 0.5, "diffuse": 0.5, "specular": 0.5, "shininess": 8, "specular_color": 1,
            "diffuse_transmission": 0.25, "diffuse_transmission_color": 1, "specular_transmission": 1, "emission": 0, "reflection": 0.25,
            "reflection_color": 1, "transmission": 0.25, "transmission_color": 1, "transparency": "filtered", "opacity": 1, "ior": 1.5,
            "fresnel": False, "priority": 1, "absorption": 0, "shading": "smooth", "normal_map": "t", "bump": {"texture": "t", "scale": 1}}
LOCAL = ("model", "diffuse", "shininess", "specular_transmission", "fresnel", "reflection", "reflection_color")
PRINCIPLED = {**{name: value for name, value in MATERIAL.items() if name not in LOCAL}, "model": "principled", "metallic": 0, "roughness": 0.25,
              "normal_scale": 2, "opacity_cutoff": 0}
BACKGROUNDS = [{"color": 1}, {"zenith": 1, "nadir": 0}, {"environment": "t", "rotation": 10, "up": [0, 1, 0]},
               {"cube": {face: "t" for face in ("+x", "-x", "+y", "-y", "+z", "-z")}}]
DOCUMENT = {"version": 1, "name": "n", "image": {"width": 8, "height": 8, "crop": [0, 0, 4, 4]},
            "camera": {"type": "perspective", "position": [0, 1, 6], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 40, "height": 2,
                       "aperture": 0.1, "focus_distance": 6},
            "background": {"color": 1}, "ambient": 1, "medium": {"absorption": 0}, "depth_cue": {
                "front": 1, "back": 2, "front_scale": 1, "back_scale": 0, "color": 0}, "lights": [], "textures": {"t": {"checker": [0, 1]}},
            "materials": {"m": {}}, "prototypes": {"p": [{**OBJECTS[0], "material": "m"}]}, "objects": [],
            "output": {"formats": ["png"], "exposure": 0, "overflow": "clamp", "palette": 16, "quality": 90, "half": False, "layers": [],
                       "alpha": False},
            "accuracy": {"model": "whitted", "preset": "fine", "target_error": 1, "tile_error": 2, "samples": [1, 2],
                         "time_budget_ms": 9, "max_depth": 4, "cutoff": 0, "seed": 1, "approximate": {
                             "shadows": "map", "reflections": "none", "shading": "flat", "lights": "nearest-8"}},
            "job": {"name": "n"}}
# Values of fields that a hint names.
EXAMPLES = {"accuracy": {"preset": "fine"}, "output": {"formats": ["png"]}, "background": {"zenith": 1, "nadir": 0}, "ambient": 1,
            "position": [0, 0, 0], "rotate": [0, 0, 90], "scale": 2, "transform": [{"scale": 2}], "material": {"color": 1},
            "shadow": False, "file": "a.obj", "size": [1, 1, 1], "center": [0, 0, 0], "from": [0, 0, 0], "to": [0, 1, 0],
            "apex": [0, 1, 0], "environment": {"file": "a.png"}, "zenith": 1, "nadir": 0, "target": [0, 0, 0], "triangles": [[0, 1, 2]],
            "uvs": [[0, 0]] * 4, "direction": [0, -1, 0], "attenuation": "none", "intensity": 2, "shadows": False, "color": 1,
            "apex_radius": 0.5, "samples": 4, **MATERIAL, **PRINCIPLED, "color": 1}
# Fields of all objects.
PLACEMENT = {("objects",): {"position", "rotate", "scale", "transform", "shadow", "material"}, ("lights",): {
    "color", "intensity", "shadows", "attenuation"}}
# Fields in place of which another one is written.
REPLACED = {"file": ("positions", "triangles", "faces", "normals", "uvs", "checker", "gradient", "noise", "octaves"), "triangles": ("faces",),
            "target": ("direction",), "direction": ("target",), "size": ("min", "max"), "from": ("base", "height"), "to": ("base", "height"),
            "apex": ("height",), "zenith": ("color", "environment", "rotation", "cube"),
            "environment": ("color", "zenith", "nadir", "cube"), "metallic": LOCAL, "roughness": LOCAL, **{name: ("model", "metallic", "roughness") for name in LOCAL[1:]}, "checker": ("gradient", "noise", "octaves", "file", "channel", "color_space")}


class Place:
    """An object of a document by its path."""

    def __init__(self, name, document, *path):
        self.name, self.document, self.path, self.kind = name, document, path, name.split(" ")[0]

    def object(self, document):
        for step in self.path:
            document = document[step]
        return document

    def written(self, value):
        """The document with another object here."""
        document = copy.deepcopy(self.document)
        if not self.path:
            return value
        Place("", document, *self.path[:-1]).object(document)[self.path[-1]] = value
        return document

    def pointer(self, key=None):
        return "".join(f"/{step}" for step in (*self.path, *([key] if key is not None else [])))


def places():
    yield Place("document", DOCUMENT)
    for section in ("image", "camera", "depth_cue", "medium", "output", "accuracy", "job"):
        yield Place(section, DOCUMENT, section)
    yield Place("approximate", DOCUMENT, "accuracy", "approximate")
    for background in BACKGROUNDS:
        yield Place(f"background {list(background)}", {**DOCUMENT, "background": background}, "background")
    for light in LIGHTS:
        yield Place(f"{light['type']}_light {list(light)}", {**DOCUMENT, "lights": [light]}, "lights", 0)
    for shape in OBJECTS:
        with_material = shape if shape["type"] == "instance" else {**shape, "material": "m"}
        yield Place(f"{shape['type']} {list(shape)}", {**DOCUMENT, "objects": [with_material]}, "objects", 0)
    for texture in TEXTURES:
        yield Place(f"texture {list(texture)}", {**DOCUMENT, "materials": {"m": {"color": texture}}}, "materials", "m", "color")
    yield Place("material", {**DOCUMENT, "materials": {"m": MATERIAL}}, "materials", "m")
    yield Place("material principled", {**DOCUMENT, "materials": {"m": PRINCIPLED}}, "materials", "m")
    yield Place("bump", {**DOCUMENT, "materials": {"m": MATERIAL}}, "materials", "m", "bump")
    yield Place("color", {**DOCUMENT, "ambient": {"hsb": [0, 1, 1]}}, "ambient")


def misspelled(name):
    """Likely errors: letters swapped, omitted, doubled or replaced, capitals, and other ways to join words."""
    swaps = {name[:i] + name[i + 1] + name[i] + name[i + 2:] for i in range(len(name) - 1)}
    changes = {name[:i] + middle + name[i + 1:] for i in range(len(name)) for middle in ("", name[i] * 2, "x")}
    words = name.split("_")
    joined = {name.upper(), name.capitalize(), "-".join(words), "".join(words), words[0] + "".join(map(str.capitalize, words[1:]))}
    return (swaps | changes | joined | {name + "s"}) - {name, ""}


def without_brackets(form):
    while (shorter := re.sub(r"\{[^{}]*\}|\[[^\[\]]*\]", "", form)) != form:
        form = shorter
    return form


class Hints(DirectoryTest):
    def setUp(self):
        super().setUp()
        (self.directory / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
        (self.directory / "a.png").write_bytes((SOURCE / "api/docs/images/shape_box.png").read_bytes())

    def issues(self, document):
        """Details by pointer."""
        (self.directory / "a.json").write_text(json.dumps(document), encoding="utf-8")
        done = whittle("check", "--json", self.directory / "a.json")
        return {issue["pointer"][1:].replace("%2B", "+"): issue["detail"] for issue in json.loads(done.stdout)["errors"]}

    def hints(self, place, words):
        """Hints for words that are no fields."""
        issues = self.issues(place.written({**place.object(place.document), **dict.fromkeys(words, 1)}))
        found = {word: re.search(r"; (write|did you mean) (.*?)\??$", issues.get(place.pointer(word), "")) for word in words}
        return {word: hint.groups() for word, hint in found.items() if hint}

    def followed(self, place, form):
        """The document after the hint was followed, or a sentence. Of several forms the first one is taken."""
        fields, own = place.object(place.document), self.fields_of(place)
        first = re.split(r",? or ", form)[0]
        if re.match("nothing|only|the file's name", form):
            return place.document
        if form[0] in "{[":
            return place.written({"hsb": [0, 1, 1]} if "hsb" in first else {"checker": [0, 1]} if "checker" in first else [1, 0, 0])
        names = re.findall(r'"(\w+)"', re.sub(r':\s*"[^"]*"', "", without_brackets(first)))
        if names[0] not in own:
            known = names[0] in DOCUMENT and place.path
            return {**place.document, names[0]: EXAMPLES.get(names[0], DOCUMENT.get(names[0]))} if known else f'"{names[0]}" is no field'
        replaced = {other for name in own.intersection(names) for other in REPLACED.get(name, ())}
        fields = {key: value for key, value in fields.items() if key not in replaced}
        for name in own.intersection(names):
            fields.setdefault(name, "a.png" if place.kind == "texture" and name == "file" else EXAMPLES.get(name))
        return place.written(fields)

    def fields_of(self, place):
        """The fields of the object's kind in all its forms."""
        return set().union(*(other.object(other.document) for other in places() if other.kind == place.kind), PLACEMENT.get(place.path[:1], ()))

    def test_for_words_of_other_programs_are_right(self):
        total = 0
        for place in places():
            self.assertEqual(self.issues(place.document), {}, place.name)
            forms = {}
            for word, (verb, form) in self.hints(place, [word for word in WORDS if word not in self.fields_of(place)]).items():
                if verb == "write":
                    forms.setdefault(form, []).append(word)
            for form, words in forms.items():
                with self.subTest(place.name, words=words, form=form):
                    document = self.followed(place, form)
                    self.assertEqual(document if isinstance(document, str) else self.issues(document), {})
                    total += len(words)
        self.assertGreater(total, 400)

    def test_for_misspelled_fields_are_right(self):
        total = 0
        for place in places():
            fields = place.object(place.document)
            words = {word: name for name in fields for word in misspelled(name) if word not in self.fields_of(place)}
            meant = {(words[word], hint[1].strip('"')): word for word, hint in self.hints(place, words).items() if hint[0] == "did you mean"}
            total += len(meant)
            for (name, hint), word in meant.items():
                if name == hint:
                    continue
                # In place of the field that was meant, since a missing field is proposed first.
                rest = {key: value for key, value in fields.items() if key != name}
                before = self.issues(place.written({word: fields[name], **rest}))
                hint = re.search(r'did you mean "(.*?)"', before[place.pointer(word)])[1]
                with self.subTest(place.name, word=word, hint=hint):
                    after = self.issues(place.written({hint: fields[name], **rest}))
                    self.assertLess(len(after), len(before), after)
        self.assertGreater(total, 150)

    def test_for_misspelled_values_are_right(self):
        total = 0
        for place in places():
            fields = place.object(place.document)
            wrong = {name: f"{value[0]}{value}" for name, value in fields.items() if isinstance(value, str) and name not in ("name", "file")}
            issues = self.issues(place.written({**fields, **wrong}))
            for name in wrong:
                if "; did you mean" in issues.get(place.pointer(name), ""):
                    total += 1
                    self.assertIn(f'did you mean "{fields[name]}"?', issues[place.pointer(name)], place.name)
        self.assertGreater(total, 25)

    def test_for_types_of_other_programs_are_right(self):
        total = 0
        for section, document in (("lights", {}), ("objects", {"material": "m"}), ("camera", DOCUMENT["camera"])):
            for words in [[word] for word in WORDS] if section == "camera" else [WORDS]:
                value = [{**document, "type": word} for word in words]
                issues = self.issues({**DOCUMENT, section: value[0] if section == "camera" else value})
                for i, word in enumerate(words):
                    detail = issues.get(f"/{section}/type" if section == "camera" else f"/{section}/{i}/type", "")
                    if hint := re.search("; write (.*)", detail):
                        total += 1
                        name = re.match('"(\\w+)"', hint[1])[1]
                        self.assertIn(name, DOCUMENT if hint[1].endswith("in the document") else re.findall(r'"(\w+)"', detail.split(", got ")[0]),
                                      f"{section} {word}")
        self.assertGreater(total, 40)

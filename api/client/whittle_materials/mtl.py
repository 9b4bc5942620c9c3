"""The statements of Wavefront MTL files as materials of the local model, and the libraries that OBJ files name."""
import math
import os

from whittle_materials.members import Invalid, factor_and_color, luminance, read_file, read_texels, to_linear

FILE_BYTES_MAX = 16_000_000
COLORS = {"Kd", "Ka", "Ks", "Ke", "Tf"}
NUMBERS = {"Ns", "Ni", "d", "Tr", "illum"}
MAPS = {"map_Kd": "color", "map_Ks": "specular_color", "map_Ke": "emission", "map_d": "opacity", "norm": "normal_map"}
# Numbers of values of the options of maps.
OPTIONS = {"-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2, "-texres": 1,
           "-type": 1}
VECTORS = {"-s", "-o", "-t"}  # one to three numbers
WHITE = [1.0, 1.0, 1.0]
GLASS, MIRRORS, FRESNEL = {4, 6, 7, 9}, {3, 5, 8}, {5, 7}


class MtlFile:
    """The statements of one file as materials by name."""

    def __init__(self, path):
        self.path = path
        self.materials = {}
        self.omitted = []
        self.line = 0

    def read(self):
        content = read_file(self.path, FILE_BYTES_MAX)
        statements = None
        lines = content.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ").splitlines()
        for self.line, line in enumerate(lines, 1):
            words = line.split("#", 1)[0].split()
            if not words:
                continue
            if words[0] == "newmtl":
                statements = self.begin(" ".join(words[1:]))
            elif statements is None:
                self.fail(f"{words[0]} stands before the first newmtl")
            else:
                self.add(statements, words[0], words[1:])

    def begin(self, name):
        if not name:
            self.fail("newmtl has no name")
        if name in self.materials:
            self.fail(f'the material "{name}" is defined twice')
        return self.materials.setdefault(name, {"line": self.line})

    def add(self, statements, keyword, words):
        if keyword in COLORS:
            if words and words[0] in ("spectral", "xyz"):
                self.omit(f"{keyword} {words[0]}")
            else:
                statements[keyword] = self.color(keyword, words)
        elif keyword in NUMBERS:
            if keyword == "d" and words[:1] == ["-halo"]:
                self.omit("d -halo")
                words = words[1:]
            statements[keyword] = self.numbers(keyword, words, 1, 1)[0]
        elif keyword in MAPS:
            statements[keyword] = self.texture(keyword, words)
        else:
            self.omit(keyword)

    def texture(self, keyword, words):
        texture = {}
        while words and words[0].startswith("-"):
            option, words = words[0], words[1:]
            count = OPTIONS.get(option, 0)
            if option in VECTORS:
                while count < 3 and count < len(words) and is_number(words[count]):
                    count += 1
            elif option not in OPTIONS:
                self.fail(f"{keyword} has the unknown option {option}")
            if count == 0 or len(words) < count:
                self.fail(f"{option} of {keyword} has no value")
            self.apply(texture, keyword, option, words[:count])
            words = words[count:]
        if not words:
            self.fail(f"{keyword} names no file")
        return {"file": " ".join(words).replace("\\", "/"), **texture}

    def apply(self, texture, keyword, option, values):
        if option == "-s":
            texture["scale"] = (self.numbers(option, values, 1, 3) + [1.0])[:2]
        elif option == "-o":
            texture["offset"] = (self.numbers(option, values, 1, 3) + [0.0])[:2]
        elif option == "-clamp" and values == ["on"]:
            texture["wrap"] = "clamp"
        elif option == "-imfchan" and keyword == "map_d" and values == ["m"]:
            texture["channel"] = "alpha"
        elif (option, values) not in (("-clamp", ["off"]), ("-blendu", ["on"]), ("-blendv", ["on"])):
            self.omit(f"{keyword} {option}")

    def color(self, keyword, words):
        values = self.numbers(keyword, words, 1, 3)
        if len(values) == 2:
            self.fail(f"{keyword} must have one or three numbers")
        if min(values) < 0:
            self.fail(f"{keyword} must be >= 0")
        return values * 3 if len(values) == 1 else values

    def numbers(self, keyword, words, least, most):
        if not least <= len(words) <= most or not all(map(is_number, words)):
            self.fail(f"{keyword} must have {least if least == most else f'{least} to {most}'} finite numbers")
        return [float(word) for word in words]

    def omit(self, what):
        self.omitted.append(f"{self.path}:{self.line}: {what} is not carried over")

    def fail(self, sentence):
        raise Invalid(f"{self.path}:{self.line}: {sentence}")


def is_number(word):
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def is_cut_out(statements):
    """True if parts of the surface are missing; such a surface has no Fresnel reflection in the local model."""
    return illum_of(statements) not in GLASS and ("map_d" in statements or presence(statements) < 1)


def illum_of(statements):
    return int(statements.get("illum", 2))


def presence(statements):
    return min(max(statements.get("d", 1.0 - statements.get("Tr", 0.0)), 0.0), 1.0)


def unused(statements):
    """Statements that have no place beside others."""
    if illum_of(statements) in FRESNEL and is_cut_out(statements):
        yield "the Fresnel reflection of a cut-out"
    if "map_d" in statements and illum_of(statements) in GLASS:
        yield "map_d of glass"
    if "Tf" in statements and illum_of(statements) not in GLASS and presence(statements) < 1:
        yield "Tf of a surface that is no glass"
    if illum_of(statements) not in range(10):
        yield f"illum {illum_of(statements)}"
    if "map_Ks" in statements and not max(statements.get("Ks", [0.0])) > 0:
        yield "map_Ks without Ks"


def translate(statements):
    """The material of one newmtl."""
    illumination = illum_of(statements)
    if illumination == 0:  # the color itself
        constant = {"model": "lambert", "color": 0, "ambient": 0, "diffuse": 0, "emission": statements.get("Kd", [0.8] * 3)}
        return {**constant, "opacity": presence(statements)} if presence(statements) < 1 else constant
    diffuse, color = factor_and_color(statements.get("Kd", [0.8, 0.8, 0.8]))
    specular, specular_color = factor_and_color(statements.get("Ks", [0.0, 0.0, 0.0]))
    material = {"model": "lambert" if illumination < 2 else "phong", "color": color, "diffuse": diffuse,
                "ambient": max(statements.get("Ka", [diffuse]))}
    if specular > 0 and illumination >= 2:
        material.update(specular=specular, specular_color=specular_color, shininess=max(0.0, statements.get("Ns", 10.0)))
    if max(statements.get("Ke", [0.0])) > 0:
        material["emission"] = statements["Ke"]
    if illumination in MIRRORS and specular > 0:
        material.update(reflection=min(specular, 1.0), reflection_color=specular_color, fresnel=illumination in FRESNEL and not is_cut_out(statements))
    if illumination in MIRRORS | GLASS and "Ni" in statements:
        material["ior"] = statements["Ni"]
    present = presence(statements)
    if illumination in GLASS:
        material.update(transmission=1.0, diffuse=diffuse * present, ambient=material["ambient"] * present)
        if "Tf" in statements:
            material["transmission_color"] = statements["Tf"]
    elif present < 1:
        material["opacity"] = present
    return material


def factor_of(keyword, statements):
    """The color that a map is multiplied by. An emission of 0 beside a map is that of a program that has no other."""
    if keyword == "map_d":
        return [presence(statements)] * 3
    color = statements.get({"map_Kd": "Kd", "map_Ks": "Ks", "map_Ke": "Ke"}.get(keyword), WHITE)
    if keyword == "map_Ke":
        return color if max(color) > 0 else WHITE
    return factor_and_color(color)[1] if max(color) > 0 else WHITE


class Maps:
    """Puts textures in place of the colors of one material; one texture for equal maps."""

    def __init__(self, file, name, members, directory):
        self.place, self.members, self.directory = f"{file.path}:{file.materials[name]['line']}", members, directory
        self.name, self.root = name, os.path.dirname(file.path)[:-len(directory) or None]
        self.prefix = f"{os.path.splitext(os.path.basename(file.path))[0]}.{list(file.materials).index(name)}"

    def texture(self, keyword, texture, factor):
        """The texture, times the factor if that can be computed."""
        file = os.path.join(self.directory, texture["file"])
        texels = self.texels(file) if factor != WHITE or keyword == "map_d" else None
        if keyword == "map_d" and texels is not None:
            texture, values, is_file = self.scalar(texture, texels)
        elif texels is not None:
            values, is_file = to_linear(texels[..., :3]), False
        if texels is not None and not (is_file and factor == WHITE):
            path = os.path.join(self.directory, f"{self.prefix}.{keyword.removeprefix('map_')}.hdr")
            placing = {key: value for key, value in texture.items() if key not in ("file", "channel")}
            return self.members.computed(self.place, self.root, path, values * factor, **placing)
        if keyword == "map_d" and texture.get("channel") != "alpha" and texels is None:
            self.members.omit(self.place, f"map_d as one number instead of three, because its image cannot be read, in {self.name},")
        if factor != WHITE:
            what = "d" if keyword == "map_d" else "the hue of " + keyword.removeprefix("map_")
            self.members.omit(self.place, f"{what} beside {keyword}, in {self.name},")
        return self.members.texture({**texture, "file": file, **({"color_space": "linear"} if keyword == "norm" else {})})

    def scalar(self, texture, texels):
        """MTL's d is one number: alpha, or luminance where an image has none or only 1. The texture, its values, and
        whether the values are those of the file."""
        is_gray = (texels[..., :1] == texels[..., 1:3]).all()
        if texture.get("channel") == "alpha":
            return texture, texels[..., 3:], True
        if texels[..., 3].min() < 1:
            if texels[..., :3].min() < 1:
                self.members.omit(self.place, f"map_d is the alpha of its image: the rest of it, in {self.name},")
            return {**texture, "channel": "alpha"}, texels[..., 3:], True
        if not is_gray:
            self.members.omit(self.place, f"map_d is the luminance of its image: the hue, in {self.name},")
        return texture, luminance(to_linear(texels[..., :3])), is_gray

    def texels(self, file):
        try:
            with open(os.path.join(self.root, file), "rb") as image:
                return read_texels(image.read())
        except (OSError, ValueError):
            return None  # the document is made without its images, too

    def add(self, material, statements):
        for keyword, field in MAPS.items():
            if keyword not in statements or (field == "opacity" and "transmission" in material):
                continue
            if field == "color" and statements.get("illum") == 0:
                field = "emission"
            if field == "specular_color" and "specular" not in material:
                continue
            material[field] = self.texture(keyword, statements[keyword], factor_of(keyword, statements))
            if field == "specular_color" and "reflection_color" in material:
                material["reflection_color"] = material[field]


def add_mtl(path, members, directory=""):
    """Adds the materials of an MTL file, whose images are in `directory` of the document; returns their names."""
    file = MtlFile(path)
    file.read()
    members.omitted += file.omitted
    for name, statements in file.materials.items():
        material = translate(statements)
        Maps(file, name, members, directory).add(material, statements)
        members.add_material(path, name, material)
        for what in unused(statements):
            members.omit(f"{path}:{statements['line']}", f"{what}, in {name},")
    return set(file.materials)


def libraries_of(path, words):
    """The files of an mtllib: one whose name has blanks, if it exists, else all of them."""
    whole = " ".join(words)
    return [whole] if os.path.exists(os.path.join(os.path.dirname(path), whole)) else words


def add_obj(path, content, members):
    """Adds the materials of an OBJ's libraries, and the mesh with those that its faces use."""
    libraries, used, current = [], {}, ""
    lines = content.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ").split("\n")
    for line, text in enumerate(lines, 1):
        words = text.split("#", 1)[0].split() if text.lstrip()[:1] in ("u", "f", "m") else []
        if words[:1] == ["usemtl"]:
            current = " ".join(words[1:])
        elif words[:1] == ["f"]:
            used.setdefault(current, line)
        elif words[:1] == ["mtllib"]:
            libraries += [name for name in libraries_of(path, words[1:]) if name not in libraries]
    if not used:
        raise Invalid(f"{path}: is neither a glTF file nor an OBJ with faces")
    names = set()
    for library in libraries:
        library = library.replace("\\", "/")
        names |= add_mtl(os.path.join(os.path.dirname(path), library), members, os.path.dirname(library))
    for name, line in used.items():
        if name and name not in names:
            members.omitted.append(f'{path}:{line}: the material "{name}" is in none of its MTL files')
    members.add_mesh(path, {}, names & set(used))

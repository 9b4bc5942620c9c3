"""The JSON schema of scene documents: schemas/scene.template.schema.json with the fields of the tables `fields()` in HEADERS,
and their meanings in docs/scene.md. In the template, {"$fields": [STRUCT, ...]} stands for an object with the fields of these structs, or of
a part in "$parts"; members beside it are added, or replace those of the same name. A field has its meaning from the table on the page that
is below `<!-- fields of STRUCT -->`, or in the template. The headers have the layout of clang-format; a row or a type that is not understood
is an error."""
import json
import pathlib
import re

TOP = pathlib.Path(__file__).parent.parent
HEADERS = [*(TOP / f"tracer/include/tracer/{name}.h" for name in ("accuracy", "format", "lights", "materials", "scene", "shapes")),
           TOP / "api/include/api/document.h", TOP / "api/src/reader/accuracy_section.cpp"]
STRUCT = re.compile(r"^struct (\w+) \{\n(.*?)^\};", re.MULTILINE | re.DOTALL)
MEMBERS = re.compile(r"^  (\w+(?:::\w+)*(?:<.*>)?) (\w+(?:(?: =|\{|,)[^;]*)?);", re.MULTILINE)
MEMBER = re.compile(r"(\w+)(?: = ([^,{]+(?:\{[^}]*\})?)|\{([^}]*)\})?(?:, |$)")
FIELD = re.compile(r'(optional_field\(|Field\{)"(\w+)", &\w+::(\w+)(?:, FieldRange::(\w+)(?:\(([-\d]+), ([-\d]+)\)|\(\))?)?(?:, FieldPresence::(\w+))?[)}]')
WORDS = re.compile(r"words_of\(([\w:]+)(?: first)?\) \{\s+return (?:tracer::)?in_order\(([\w:]+), \{([^}]*)\}")
RANGES = {"": {}, "any": {}, "position": {}, "direction": {}, "texture_point": {}, "length": {"exclusiveMinimum": 0},
          "length_or_0": {"minimum": 0}, "factor": {"minimum": 0}, "exponent": {"minimum": 0}, "ratio": {"exclusiveMinimum": 0},
          "fraction": {"minimum": 0, "maximum": 1}, "count": {"minimum": 1}, "time": {"$ref": "#/$defs/time"}}
SIMPLE = {"bool": {"type": "boolean"}, "double": {"type": "number"}, "int": {"type": "integer", "minimum": -2**31, "maximum": 2**31 - 1},
          "std::uint32_t": {"type": "integer", "minimum": 0, "maximum": 2**32 - 1}, "std::int64_t": {"type": "integer"},
          "std::uint64_t": {"type": "integer", "minimum": 0, "maximum": 2**53 - 1}, "std::string": {"$ref": "#/$defs/name"}}
IN_TEMPLATE = ("PixelWindow", "SampleRange", "Webhook", "std::map<std::string, std::string>")
DEFINITIONS = {"AssetId": "asset", "Attenuation": "attenuation", "Color": "color", "ColorOrTexture": "color_or_texture",
               "TextureId": "texture_or_name", "Vec2": "vec2", "Vec3": "vec3"}
TABLE = re.compile(r"^<!-- fields of (\w+) -->\n\n\|.*\n\| --- .*\n((?:\|.*\n)+)", re.MULTILINE)
TYPE = ("type", "$ref", "anyOf", "enum")

SOURCE = "".join(path.read_text("utf-8") for path in HEADERS)
STRUCTS = {name: body for name, body in STRUCT.findall(SOURCE) if " fields() {" in body}
ENUMS = {name: re.findall(r'"(\w+)"', words) for name, _, words in WORDS.findall(SOURCE)}
ENUMS["Format"] = re.findall(r'\{"(\w+)", "[\w.]+", "[\w./-]+", ImageFormat::', SOURCE)


def number(text):
    return int(float(text)) if float(text).is_integer() else float(text)


def default_of(kind, text):
    """The value of an initialiser."""
    if kind == "bool":
        return text == "true"
    numbers = [number(each) for each in re.findall(r"(?<!\w)-?\d[\d.]*", text)]
    if kind in ("Color", "ColorOrTexture"):
        return numbers if len(set(numbers)) > 1 else (numbers or [0])[0]
    return numbers if kind in ("Vec2", "Vec3") else numbers[0]


def schema_of(kind, text, limits, struct):
    """The schema of the values of a C++ type; `text` is the default's initialiser, or None."""
    if outer := re.fullmatch(r"std::(optional|array|vector)<(.*?)(?:, (\d))?>", kind):
        form, inner, size = outer.groups()
        items = schema_of(inner, None, limits, struct)
        if form == "optional":
            return items
        if form == "array":
            return {"type": "array", "minItems": int(size), "maxItems": int(size), "items": items}
        return {"type": "array", "uniqueItems": True, "items": items, "default": re.findall(r"::(\w+)", text)}
    if kind in STRUCTS:
        return fields_of(kind)
    if kind in IN_TEMPLATE or "$ref" in limits:
        return {**limits}
    if words := ENUMS.get(kind) or ENUMS.get(f"{struct}::{kind}"):
        return {"enum": words, **({"default": text.rsplit("::", 1)[1]} if text else {})}
    schema = {**SIMPLE[kind], **limits} if kind in SIMPLE else {"$ref": f"#/$defs/{DEFINITIONS[kind]}"}
    return schema if text is None or kind in ("AssetId", "Attenuation", "TextureId", "std::string") else {**schema, "default": default_of(kind, text)}


def fields_of(struct):
    """The schema of an object with the fields of a struct."""
    body, kind = STRUCTS[struct], re.search(r' type = "(\w+)"', STRUCTS[struct])
    members = {name: (type_, equal or braces) for type_, names in MEMBERS.findall(body) for name, equal, braces in MEMBER.findall(names)}
    properties, required = {}, []
    if kind:
        properties["type"] = {"const": kind[1]}
        required.append("type")
    rows = FIELD.findall(body)
    if len(rows) != len(re.findall(r"[Ff]ield[({]\"", body)):
        raise ValueError(f"a row of {struct}::fields() has an unknown form")
    for form, name, member, limit, least, most, presence in rows:
        limits = {"minimum": int(least), "maximum": int(most)} if least else RANGES[limit]
        type_, text = members[member]
        is_default = form.startswith("optional")
        properties[name] = schema_of(type_, text if is_default else None, limits, struct)
        if not is_default and not presence and not type_.startswith("std::optional"):
            required.append(name)
    return {"type": "object", "additionalProperties": False, **({"required": required} if required else {}), "properties": properties}


def color_names():
    lines = re.findall(r'^    "(.*)"', (TOP / "api/src/reader/color_names.cpp").read_text("utf-8"), re.MULTILINE)
    return re.findall(r"([a-z]+) [0-9a-f]{6} ", "".join(lines))


def tables(page):
    """{struct: {field: the cells of its row after the name}}; the field of a field is FIELD.FIELD."""
    rows = {struct: [[cell.strip() for cell in line[1:-1].split("|")] for line in lines.splitlines()] for struct, lines in TABLE.findall(page)}
    return {struct: {name.strip("`"): cells for name, *cells in lines} for struct, lines in rows.items()}


def plain(markdown):
    return re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", markdown).replace("`", "")


def merged(schema, own):
    """The schema with members of `own` added or replaced. A type replaces a type."""
    if "properties" not in schema and any(key in own for key in TYPE):
        schema = {key: value for key, value in schema.items() if key not in TYPE}
    return {**schema, **{key: merged(schema[key], value) if isinstance(value, dict) and key in schema else value for key, value in own.items()}}


def described(schema, table, prefix=""):
    """The schema of an object with the meanings of its fields; `type` is the first."""
    properties = {}
    for name, field in sorted(schema["properties"].items(), key=lambda member: member[0] != "type"):
        if "properties" in field:
            field = described(field, table, f"{prefix}{name}.")
        meaning = plain(table.get(prefix + name, [""])[-1])
        properties[name] = {"description": meaning, **field} if meaning else field
    return {**schema, "properties": properties}


def load():
    template = json.loads((TOP / "api/schemas/scene.template.schema.json").read_text("utf-8"))
    rows = tables((TOP / "api/docs/scene.md").read_text("utf-8"))
    template["$defs"]["color_name"]["enum"] = color_names()
    parts = {**{struct: fields_of(struct) for struct in STRUCTS}, **template.pop("$parts")}

    def expanded(node):
        if isinstance(node, list):
            return [expanded(element) for element in node]
        if not isinstance(node, dict):
            return node
        own = {key: expanded(value) for key, value in node.items() if key != "$fields"}
        structs = node.get("$fields")
        if structs is None:
            return own
        whole = {"type": "object", "additionalProperties": False, "required": [], "properties": {}}
        for part in (parts[struct] for struct in structs if struct in parts or not rows[struct]):
            whole = {**merged(whole, part), "required": whole["required"] + part.get("required", [])}
        whole = merged(whole, own)
        if not whole["required"]:
            del whole["required"]
        return described(whole, {name: cells for struct in structs for name, cells in rows.get(struct, {}).items()})

    return expanded(template)

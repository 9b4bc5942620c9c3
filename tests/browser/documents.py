"""Documents for the editor: positions of the cursor with what must be offered there, and the lines of values."""
import copy
import json
import urllib.parse

ROOT, OBJECT, MATERIAL, ACCURACY, OUTPUT, JOB = ('{{"version": 1, ', '{{"version": 1, "objects": [{{', '{{"version": 1, "materials": {{"a": {{', '{{"version": 1, "accuracy": {{',
                                                 '{{"version": 1, "output": {{', '{{"version": 1, "job": {{')
SHAPES_AND_FIELDS = {"sphere": {"center", "radius"}, "plane": {"point", "normal"}, "disc": {"center", "inner_radius"}, "cylinder": {"from", "to", "caps"},
                     "cone": {"apex", "apex_radius"}, "box": {"min", "max"}, "torus": {"major_radius", "minor_radius"}, "triangle": {"vertices", "uvs"},
                     "mesh": {"positions", "file"}, "instance": {"of"}}
# Texts before the cursor, and labels that must be offered there.
CURSORS = [
    ("{{", {"version"}), (ROOT + '"', {"camera", "objects", "lights", "materials", "accuracy", "output", "job"}), (ROOT + '"ca', {"camera"}), (ROOT + '"image": {{"', {"width", "height", "crop"}),
    (ROOT + '"image": {{"width": 8, "', {"height"}), (ROOT + '"camera": {{"', {"position", "look_at", "fov", "aperture"}), (ROOT + '"camera": {{"type": "', {"orthographic", "panorama"}),
    (ROOT + '"camera": {{"position": [0, 0, 1], "', {"look_at", "up"}), (ROOT + '"background": {{"', {"color"}), (ROOT + '"background": {{"zenith": 1, "', {"nadir"}), (ROOT + '"depth_cue": {{"', {"front", "back"}),
    (ROOT + '"lights": [{{"', {"type"}), (ROOT + '"lights": [{{"type": "', {"point", "directional", "spot"}), (ROOT + '"lights": [{{"type": "point", "', {"position", "intensity", "color"}),
    (ROOT + '"lights": [{{"type": "directional", "', {"direction"}), (ROOT + '"textures": {{"a": {{"', {"checker", "gradient", "noise", "file"}), (ROOT + '"textures": {{"a": {{"file": "a.png", "wrap": "', {"repeat", "clamp", "mirror"}),
    (ROOT + '"textures": {{"a": {{"file": "a.png", "filter": "', {"nearest", "bilinear", "mipmap"}), (ROOT + '"textures": {{"a": {{"file": "a.png", "color_space": "', {"srgb", "linear"}),
    (MATERIAL + '"', {"color", "diffuse", "specular", "reflection", "transmission", "ior", "emission"}), (MATERIAL + '"model": "', {"lambert", "phong", "blinn_phong"}),
    (MATERIAL + '"transparency": "', {"refract", "interpolated", "filtered"}), (MATERIAL + '"shading": "', {"smooth", "flat", "gouraud", "flat_polygon"}), (MATERIAL + '"re', {"reflection", "reflection_color"}), (MATERIAL + '"fresnel": ', {"true", "false"}),
    (MATERIAL + '"color": {{"', {"checker", "noise"}), (MATERIAL + '"color": 1, "', {"shininess", "absorption", "normal_map", "bump"}),
    (OBJECT + '"', {"type"}), (OBJECT + '"type": "', set(SHAPES_AND_FIELDS)), (OBJECT + '"type": "s', {"sphere"}), (OBJECT + '"type": "t', {"torus", "triangle"}),
    *((OBJECT + f'"type": "{shape}", "', fields) for shape, fields in SHAPES_AND_FIELDS.items()),
    (OBJECT + '"type": "sphere", "material": {{"', {"color", "ior"}), (OBJECT + '"type": "sphere", "material": {{"model": "', {"phong"}), (OBJECT + '"type": "sphere", "transform": [{{"', {"translate", "rotate", "scale"}),
    (OBJECT + '"type": "sphere", "radius": 1, "', {"center", "material", "shadow"}), (OBJECT + '"type": "mesh", "smooth": ', {"true", "false"}), (OBJECT + '"type": "cylinder", "caps": ', {"true", "false"}),
    (ACCURACY + '"', {"preset", "target_error", "time_budget_ms", "samples", "max_depth", "cutoff", "approximate"}), (ACCURACY + '"preset": "', {"draft", "standard", "fine", "reference"}),
    (ACCURACY + '"approximate": {{"', {"shadows", "reflections"}), (ACCURACY + '"approximate": {{"shadows": "', {"none"}), (ACCURACY + '"approximate": {{"reflections": "', {"environment"}), (ACCURACY + '"target_error": 1, "', {"max_depth", "seed"}),
    (OUTPUT + '"', {"formats", "exposure", "layers", "quality", "alpha"}), (OUTPUT + '"formats": ["', {"png", "exr", "jpg", "webp"}), (OUTPUT + '"formats": ["png", "', {"exr"}), (OUTPUT + '"layers": ["', {"depth", "normal", "albedo", "error", "samples"}),
    (OUTPUT + '"alpha": ', {"true", "false"}), (OUTPUT + '"half": ', {"true", "false"}),
    (JOB + '"', {"name", "labels", "priority", "run_after", "deadline", "webhook"}), (JOB + '"cache": "', {"off"}), (JOB + '"keep": ', {"true", "false"}), (JOB + '"webhook": {{"', {"url"}), (JOB + '"priority": 1, "', {"max_attempts"}),
]


def is_plain(text):
    """True for an object whose values Python writes again as they are."""
    try:
        value = json.loads(text)
        return isinstance(value, dict) and json.loads(json.dumps(value, allow_nan=False)) == value
    except ValueError:
        return False


def line_at(document, pointer):
    """The line of the value at a pointer, or of the nearest part around it, as set_document() writes the document."""
    parts = [part.replace("~1", "/").replace("~0", "~") for part in urllib.parse.unquote(pointer.removeprefix("#")).split("/")[1:]]
    marked, inner = copy.deepcopy(document), None
    for part in parts:
        value = marked if inner is None else inner[0][inner[1]]
        name = int(part) if isinstance(value, list) and part.isdigit() else part
        if not (isinstance(value, list) and isinstance(name, int) and name < len(value)) and not (isinstance(value, dict) and name in value):
            break
        inner = (value, name)
    if inner is None:
        return 1
    inner[0][inner[1]] = "the marked value"
    return next(number for number, line in enumerate(json.dumps(marked, indent=1).splitlines(), 1) if "the marked value" in line)

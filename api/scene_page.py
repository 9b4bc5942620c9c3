"""The page of the scene format, made from scene.schema.json: a section for each object of the format, an entry for each field with
its type, range, default and meaning. A section has its path in the document or its name in $defs as anchor, a field SECTION.FIELD."""
import html
import json

SCALARS = ("name", "positive_integer", "index", "fraction", "not_negative", "positive")
STYLE = """dl{display:grid;grid-template-columns:minmax(9rem,max-content) 1fr;margin:0}
dt,dd{border-top:1px solid var(--line);padding:.35rem .75rem .35rem 0;margin:0;overflow-wrap:anywhere}dt a{color:inherit;text-decoration:none}h3{font-size:1rem;margin:1.5rem 0 .5rem}
dd p{margin:0}dd p:first-child{color:var(--dim)}@media(max-width:40rem){dl{display:block}dd{border:0;padding:0 0 .5rem}dt{padding-bottom:0}}"""


def code(value):
    return f"<code>{html.escape(value if isinstance(value, str) else json.dumps(value), quote=False)}</code>"


def range_of(field):
    parts = [f"{sign} {field[key]}" for key, sign in (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
             if key in field]
    return ", ".join(parts)


def count_of(field):
    least, most = field.get("minItems"), field.get("maxItems")
    if least is not None and least == most:
        return f"{least} × "
    return f"at least {least} × " if least else ""


class ScenePage:
    def __init__(self, schema):
        self.schema = schema
        self.sections = []  # (anchor, HTML)
        self.objects("document", {**schema, "description": ""})
        for name, part in schema["$defs"].items():
            if name not in SCALARS:
                self.objects(name, part)

    def resolved(self, field):
        """The field with the members of what it refers to, its own ones first."""
        if "$ref" not in field:
            return field
        return {**self.resolved(self.schema["$defs"][field["$ref"].rsplit("/", 1)[1]]), **{key: field[key] for key in field if key != "$ref"}}

    def type_of(self, field, anchor):
        if "$ref" in field:
            name = field["$ref"].rsplit("/", 1)[1]
            return self.type_of(self.schema["$defs"][name], name) if name in SCALARS else f'<a href="#{name}">{name}</a>'
        if "const" in field:
            return f"always {code(field['const'])}"
        if "enum" in field:
            return "one of " + " ".join(code(value) for value in field["enum"])
        for kind in ("oneOf", "anyOf"):
            if kind in field and field.get("type") != "object":
                return " or ".join(dict.fromkeys(self.type_of(part, anchor) for part in field[kind]))
        if field["type"] == "array":
            return self.array_type(field, anchor)
        if field["type"] == "object":
            return self.object_type(field, anchor)
        return " ".join(part for part in (field["type"], html.escape(range_of(field)), self.length_of(field)) if part)

    @staticmethod
    def length_of(field):
        return f"of at most {field['maxLength']} bytes" if "maxLength" in field else ""

    def array_type(self, field, anchor):
        if "prefixItems" in field:
            return f"array of {', '.join(self.type_of(part, anchor) for part in field['prefixItems'])}"
        each = ", each once" if field.get("uniqueItems") else ""
        return f"array of {count_of(field)}{self.type_of(field['items'], anchor)}{each}"

    def object_type(self, field, anchor):
        if "properties" in field:
            return f'<a href="#{anchor}">object</a>'
        return f"object of {self.type_of(field['additionalProperties'], anchor)} by name"

    def objects(self, anchor, field):
        """Adds the section of a definition or a field, then those of the objects in it."""
        forms = [part for kind in ("oneOf", "anyOf") for part in field.get(kind, []) if "properties" in part]
        parts = [f'<h2 id="{anchor}">{code(anchor)}</h2>']
        if "description" in field:
            parts.append(f"<p>{html.escape(field['description'], quote=False)}</p>")
        if "properties" not in field:
            parts.append(f"<p>{self.forms_type(field, anchor)}</p>")
        if "default" in field:
            parts.append(f"<p>default {code(field['default'])}</p>")
        place = len(self.sections)
        if "properties" in field:
            parts.append(self.fields(anchor, field))
        for form in forms:
            name = f"{anchor}-{form['properties'].get('type', {}).get('const') or form.get('required', list(form['properties']))[0]}"
            about = html.escape(form.get("description", ""), quote=False)
            parts.append(f'<h3 id="{name}">{code(name)}</h3><p>{about}</p>{self.fields(name, form)}')
        self.sections.insert(place, (anchor, "".join(parts)))

    def forms_type(self, field, anchor):
        """The type of a definition: its forms with fields are links to their tables."""
        shown = dict(field)
        for kind in ("oneOf", "anyOf"):
            if kind in field:
                shown[kind] = [part if "properties" not in part else {"type": "object", "properties": {}} for part in field[kind]]
        return self.type_of(shown, anchor)

    def fields(self, anchor, field):
        rows = []
        for name, part in field["properties"].items():
            path = name if anchor == "document" else f"{anchor}.{name}"
            resolved = self.resolved(part)
            facts = [self.type_of(part, path)]
            if name in field.get("required", []):
                facts.append("required")
            elif "default" in resolved:
                facts.append(f"default {code(json.dumps(resolved['default']))}")
            rows.append(f'<dt id="{path}-field"><a href="#{path}-field">{code(name)}</a></dt><dd><p>{"; ".join(facts)}</p>'
                        f"<p>{html.escape(part.get('description', ''), quote=False)}</p></dd>")
            if "properties" in part or any("properties" in form for form in part.get("oneOf", [])):
                self.objects(path, part)
        return f"{self.rules(field)}<dl>{''.join(rows)}</dl>"

    @staticmethod
    def rules(field):
        """The combinations of fields that are allowed."""
        found = []
        for kind, words in (("oneOf", "Exactly one of"), ("anyOf", "At least one of")):
            groups = [part["required"] for part in field.get(kind, []) if "required" in part and "properties" not in part]
            if groups:
                found.append(f"{words}: {'; '.join(' and '.join(map(code, group)) for group in groups)}.")
        found += [f"{code(name)} needs {' and '.join(map(code, needed))}." for name, needed in field.get("dependentRequired", {}).items()]
        return f"<p>{' '.join(found)}</p>" if found else ""

    def body(self):
        return (f"<h1>Scene documents</h1><p>{html.escape(self.schema['description'], quote=False)}</p><p>For programs: "
                f'<a href="/schemas/scene.schema.json">scene.schema.json</a>. The routes that accept them: <a href="/docs">/docs</a>.</p>\n'
                + "\n".join(text for _, text in self.sections))

"""Pages for people: every operation with its parameters, examples and replies, and all problems; the fields of scene documents. No
script, no link elsewhere."""
import html
import re

import docs_examples
import scene_page

STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222;background:#fff}
pre{overflow-x:auto}h2{margin-top:2.5rem;font-size:1.1rem}code{background:#f0f0f0;padding:0 .25em}table{border-collapse:collapse;width:100%}
td{border-top:1px solid #ddd;padding:.25rem .75rem .25rem 0;vertical-align:top}td:first-child{white-space:nowrap}details{margin:0 0 1rem}
@media(prefers-color-scheme:dark){body{color:#ddd;background:#181818}code{background:#303030}td{border-color:#444}}"""


def resolved(node, document):
    while "$ref" in node:
        target = document
        for key in node["$ref"][2:].split("/"):
            target = target[key]
        node = {**target, **{name: value for name, value in node.items() if name != "$ref"}}
    return node


def table(rows):
    cells = "".join(f"<tr><td><code>{html.escape(name)}</code></td><td>{html.escape(text)}</td></tr>" for name, text in rows)
    return f"<table>{cells}</table>" if rows else ""


def operation_html(method, path, item, operation, document):
    parameters = [resolved(parameter, document) for parameter in item.get("parameters", []) + operation.get("parameters", [])]
    named = [(f"{parameter['name']} ({parameter['in']})", parameter.get("description", ""))
             for parameter in parameters if parameter["in"] != "path"]
    body = resolved(operation.get("requestBody", {}), document)
    if body:
        named.append((f"body: {', '.join(body['content'])}", body.get("description", "")))
    replies = [(status, resolved(reply, document)["description"]) for status, reply in sorted(operation["responses"].items())]
    example = docs_examples.example_of(method, path, item, operation, document)
    examples = (f"<pre>{html.escape(docs_examples.curl_of(example), quote=False)}</pre>"
                f"<details><summary>Python</summary><pre>{html.escape(docs_examples.python_of(example), quote=False)}</pre></details>")
    title = f"<h2 id=\"{operation['operationId']}\"><code>{method.upper()} {html.escape(path)}</code></h2>"
    text = " ".join(html.escape(operation[part]) for part in ("summary", "description") if part in operation)
    return f"{title}<p>{text}</p>{table(named)}{examples}<p>Replies:</p>{table(replies)}"


def problems_html(contract):
    """The table of problems in api/docs/http.md."""
    rows = re.findall(r"^\| (\d{3}) \| ([^|]+) \| ([^|]+) \|[^|]*\|$", contract, re.MULTILINE)
    plain = [(f"{status} {code}", re.sub(r"\[([^]]*)\]\([^)]*\)|`", r"\1", cause)) for status, codes, cause in rows
             for code in re.findall(r"`(\w+)`", codes)]
    return f"<h2 id=\"problems\">Problems</h2>{table(plain)}"


ABOUT_EXAMPLES = """<p>Each operation has an example for curl and one for Python 3, which needs no package. Start with
<a href="#render">an image from a scene document</a>, <a href="#submitJob">a job and its end within a minute</a> or
<a href="#validateJob">all errors of a document</a>. Words in capitals stand for values of earlier replies, such as JOB for the
<code>id</code> of a job. A service with keys needs the header <code>Authorization: Bearer KEY</code> in each request.</p>"""


def framed(title, style, body):
    return (f"<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>"
            f"<meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}{style}</style></head><body>{body}</body></html>\n")


def page(document, contract):
    operations = "\n".join(operation_html(method, path, item, item[method], document)
                           for path, item in document["paths"].items()
                           for method in ("get", "post", "put", "patch", "delete") if method in item)
    about = html.escape(document["info"]["description"])
    return framed("Whittle: the HTTP interface", "",
                  f"<h1>Whittle over HTTP</h1><p>{about}</p><p>For machines: <a href=\"/openapi.json\">openapi.json</a>, with all "
                  f"schemas. All fields of scene documents: <a href=\"/docs/scene\">/docs/scene</a>.</p>\n"
                  f"<h2 id=\"examples\">Examples</h2>{ABOUT_EXAMPLES}{operations}\n{problems_html(contract)}")


def scene(schema):
    return framed("Whittle: scene documents", scene_page.STYLE, scene_page.ScenePage(schema).body())

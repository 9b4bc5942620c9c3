"""Pages for people: every operation with its parameters, examples and replies, and all problems; the fields of scene documents. No
script, no link elsewhere."""
import html
import re

import docs_examples
import scene_page

# The colours and the header are those of the page in server/web.
STYLE = """:root{color-scheme:light dark;--page:#f5f5f3;--panel:#fff;--raised:#f0f0ec;--line:#dcdcd6;--text:#1b1d22;--dim:#5a5f6a;--link:#1552b8;--brand:#9a5b00}
@media(prefers-color-scheme:dark){:root{--page:#0e0f12;--panel:#16181d;--raised:#1f2229;--line:#2c3038;--text:#e8e9ed;--dim:#a0a5b1;--link:#8fbcff;--brand:#f0b84f}}
*{box-sizing:border-box}html{scroll-padding-top:4rem}body{margin:0;font:15px/1.55 system-ui,sans-serif;color:var(--text);background:var(--page)}
a{color:var(--link)}:focus-visible{outline:2px solid var(--link);outline-offset:2px}
header{position:sticky;top:0;z-index:1;display:flex;flex-wrap:wrap;gap:.25rem 1.25rem;align-items:center;padding:.6rem 1rem;background:var(--panel);border-bottom:1px solid var(--line)}
header a{color:var(--dim);text-decoration:none;padding:.2rem 0}header a:hover{color:var(--text)}header strong{margin-right:.5rem}header a[aria-current]{color:var(--text);box-shadow:0 2px var(--brand)}
.docs{display:grid;grid-template-columns:17rem minmax(0,1fr);max-width:88rem}
.contents{position:sticky;top:3rem;align-self:start;max-height:calc(100vh - 3rem);overflow:auto;padding:1rem;font-size:13px;border-right:1px solid var(--line)}
.contents a{display:block;padding:.15rem 0;color:var(--dim);text-decoration:none;overflow-wrap:anywhere}.contents a:hover{color:var(--text)}.contents b{display:inline-block;min-width:3.4em;font-size:11px;color:var(--brand)}
main{padding:1rem 2rem 4rem;min-width:0}main>*{max-width:60rem}h1{font-size:1.5rem;margin:.5rem 0}h2{margin:2.5rem 0 .5rem;font-size:1.05rem;overflow-wrap:anywhere}
pre{overflow-x:auto;background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:.75rem}code,pre{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:.9em}
p code,td code,dd code,li code{background:var(--raised);padding:0 .25em;border-radius:3px;overflow-wrap:anywhere}table{border-collapse:collapse;width:100%}
td{border-top:1px solid var(--line);padding:.25rem .75rem .25rem 0;vertical-align:top;overflow-wrap:anywhere}td:first-child{white-space:nowrap}details{margin:0 0 1rem}summary{cursor:pointer}
@media(max-width:60rem){.docs{display:block}.contents{position:static;max-height:40vh;border:0;border-bottom:1px solid var(--line)}main{padding:1rem}td:first-child{white-space:normal;min-width:6rem}}"""


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


HEADER = (("/", "Queue"), ("/#/new", "Playground"), ("/#/batches", "Batches"), ("/#/system", "System"), ("/docs", "API"), ("/docs/scene", "Scene documents"))


def framed(title, path, style, contents, body):
    """A page with the header of all pages and a list of `contents`: (anchor, HTML of its name)."""
    current = " aria-current='page'"
    links = "".join(f"<a href='{to}'{current if to == path else ''}>{name}</a>" for to, name in HEADER).replace("'", '"')
    listed = "".join(f"<a href=\"#{anchor}\">{name}</a>" for anchor, name in contents)
    return (f"<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>"
            f"<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><style>{STYLE}{style}</style></head><body>"
            f"<header><strong>Whittle</strong>{links}</header><div class=\"docs\"><nav class=\"contents\" aria-label=\"Contents\">{listed}</nav>"
            f"<main>{body}</main></div></body></html>\n")


def page(document, contract):
    listed = [(method, path, item) for path, item in document["paths"].items() for method in ("get", "post", "put", "patch", "delete") if method in item]
    operations = "\n".join(operation_html(method, path, item, item[method], document) for method, path, item in listed)
    contents = [("examples", "Examples"), *((item[method]["operationId"], f"<b>{method.upper()}</b> {html.escape(path)}") for method, path, item in listed),
                ("problems", "Problems")]
    about = html.escape(document["info"]["description"])
    return framed("Whittle: the HTTP interface", "/docs", "", contents,
                  f"<h1>Whittle over HTTP</h1><p>{about}</p><p>For machines: <a href=\"/openapi.json\">openapi.json</a>, with all "
                  f"schemas. All fields of scene documents: <a href=\"/docs/scene\">/docs/scene</a>.</p>\n"
                  f"<h2 id=\"examples\">Examples</h2>{ABOUT_EXAMPLES}{operations}\n{problems_html(contract)}")


def scene(schema):
    page_of_scenes = scene_page.ScenePage(schema)
    return framed("Whittle: scene documents", "/docs/scene", scene_page.STYLE, [(anchor, anchor) for anchor, _ in page_of_scenes.sections], page_of_scenes.body())

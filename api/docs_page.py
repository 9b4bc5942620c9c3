"""openapi.yaml as a page for people: every operation with its parameters and replies. No script, no link elsewhere."""
import html

STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222;background:#fff}
h2{margin-top:2.5rem;font-size:1.1rem}code{background:#f0f0f0;padding:0 .25em}table{border-collapse:collapse;width:100%}
td{border-top:1px solid #ddd;padding:.25rem .75rem .25rem 0;vertical-align:top}td:first-child{white-space:nowrap}
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
    replies = [(status, resolved(reply, document)["description"]) for status, reply in operation["responses"].items()]
    title = f"<h2 id=\"{operation['operationId']}\"><code>{method.upper()} {html.escape(path)}</code></h2>"
    text = " ".join(html.escape(operation[part]) for part in ("summary", "description") if part in operation)
    return f"{title}<p>{text}</p>{table(named)}<p>Replies:</p>{table(replies)}"


def page(document):
    operations = "\n".join(operation_html(method, path, item, item[method], document)
                           for path, item in document["paths"].items()
                           for method in ("get", "post", "put", "patch", "delete") if method in item)
    about = html.escape(document["info"]["description"])
    return (f"<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Whittle: the HTTP interface</title>"
            f"<meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style></head><body>"
            f"<h1>Whittle over HTTP</h1><p>{about}</p><p>For machines: <a href=\"/openapi.json\">openapi.json</a>, with all "
            f"schemas.</p>\n{operations}\n</body></html>\n")

"""Examples of the operations of openapi.yaml: of each a curl command and a Python program with nothing but its standard library. Both
come from `x-example` of the operation: query, headers, body (the name of a file, or JSON) and output (the file that the reply is written
to). An operation without it needs only its path. Words in capitals stand for values of earlier replies."""
import json

IDS = {"/v1/jobs/{id}": "JOB", "/v1/batches/{id}": "BATCH", "/v1/webhooks/test/{id}": "TEST"}


def url_of(path, item, query, document):
    base = item.get("servers", document["servers"])[0]["url"]
    for start, word in IDS.items():
        if path.startswith(start):
            path = path.replace("{id}", word, 1)
    path = "".join(part.upper() if index % 2 else part for index, part in enumerate(path.replace("}", "{").split("{")))
    return base + path + (f"?{query}" if query else "")


def example_of(method, path, item, operation, document):
    """The example of an operation, completed with its method, its URL and the kind of its reply. Without an output the reply is shown."""
    row = {"query": "", "headers": {}, "body": None, "output": None, **operation.get("x-example", {})}
    name = path.rsplit("/", 1)[1]
    return {**row, "method": method.upper(), "url": url_of(path, item, row["query"], document),
            "output": row["output"] or (name if "." in name else None), "redirects": "303" in operation["responses"],
            "stream": "text/event-stream" in json.dumps(operation["responses"])}


def is_json(example):
    return example["method"] != "PUT"


def curl_of(example):
    parts = ["curl -s --fail" + (" -L" if example["redirects"] else "") + (" -N" if example["stream"] else "")]
    posts = example["body"] is not None and is_json(example)
    if example["method"] not in ("GET", "POST" if posts else "GET", "PUT"):
        parts.append(f"-X {example['method']}")
    parts += [f"-H '{name}: {value}'" for name, value in example["headers"].items()]
    if isinstance(example["body"], str):
        parts.append(f"--json @{example['body']}" if is_json(example) else f"-T {example['body']}")
    elif posts:
        parts.append(f"--json '{json.dumps(example['body'])}'")
    if example["output"]:
        parts.append(f"-o {example['output']}")
    url = example["url"]
    return " ".join([*parts, f'"{url}"' if "?" in url else url])


def python_of(example):
    headers = dict(example["headers"])
    arguments = [json.dumps(example["url"])]
    imports = ["import urllib.request"]
    if isinstance(example["body"], str):
        imports.insert(0, "import pathlib")
        arguments.append(f'data=pathlib.Path("{example["body"]}").read_bytes()')
    elif example["body"] is not None:
        imports.insert(0, "import json")
        arguments.append(f"data=json.dumps({example['body']!r}).encode()".replace("'", '"'))
    if example["body"] is not None:
        headers["Content-Type"] = "application/json" if is_json(example) else "application/octet-stream"
    if headers:
        arguments.append(f"headers={json.dumps(headers)}")
    if example["method"] != "GET":
        arguments.append(f'method="{example["method"]}"')
    if example["output"]:
        imports = sorted({*imports, "import pathlib"})
        use = [f'pathlib.Path("{example["output"]}").write_bytes(reply.read())']
    elif example["stream"]:
        use = ["for line in reply:", '    print(line.decode(), end="", flush=True)']
    else:
        use = ["print(reply.read().decode())"]
    opened, made = arguments[0], []
    if len(arguments) > 1:
        opened, made = "request", ["request = urllib.request.Request(\n    " + ",\n    ".join(arguments) + ")"]
    return "\n".join([*imports, "", *made, f"with urllib.request.urlopen({opened}) as reply:", *("    " + line for line in use)])

"""Writes the contract, the schema of scenes and pages of both: openapi.json, schemas/scene.schema.json, and C++ source that holds all:
embed_openapi.py DIRECTORY"""

import json
import pathlib
import sys

import docs_page
import scene_schema
import yaml


def function(name, text):
    # An array of numbers, because string literals have a length limit.
    rows = [", ".join(str(byte) for byte in text[at:at + 24]) for at in range(0, len(text), 24)]
    numbers = ",\n".join(rows)
    return (f"namespace {{\nconstexpr char {name}_text[] = {{\n{numbers}}};\n}}  // namespace\n\n"
            f"std::string_view {name}() {{ return {{{name}_text, sizeof {name}_text}}; }}\n\n")


def main():
    directory = pathlib.Path(sys.argv[1])
    document = yaml.safe_load(pathlib.Path("openapi.yaml").read_text("utf-8"))
    schema = scene_schema.load()
    page = docs_page.page(document, pathlib.Path("docs/http.md").read_text("utf-8"))
    for item in document["paths"].values():
        for operation in item.values():
            if isinstance(operation, dict):
                operation.pop("x-example", None)  # for the page alone
    # Aliases in the YAML become copies: JSON has none.
    document_json = json.dumps(document, ensure_ascii=True, separators=(",", ":"))
    schema_json = json.dumps(schema, ensure_ascii=True, indent=1)
    (directory / "schemas").mkdir(exist_ok=True)
    (directory / "openapi.json").write_text(document_json)
    (directory / "schemas/scene.schema.json").write_text(schema_json)
    with open(directory / "openapi.cpp", "w", encoding="utf-8") as file:
        file.write('#include "api/openapi.h"\n\nnamespace api {\n')
        file.write(function("openapi_json", document_json.encode()))
        file.write(function("scene_schema_json", schema_json.encode()))
        # As references: bytes beyond ASCII are no char everywhere.
        file.write(function("docs_html", page.encode("ascii", "xmlcharrefreplace")))
        file.write(function("scene_docs_html", docs_page.scene(schema).encode("ascii", "xmlcharrefreplace")))
        file.write("}  // namespace api\n")


if __name__ == "__main__":
    main()

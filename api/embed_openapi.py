"""Turns openapi.yaml, the schema of scenes and the table of problems into C++ source that holds them as JSON and as pages:
embed_openapi.py openapi.yaml scene.schema.json CONTRACT openapi.cpp"""

import json
import sys

import docs_page
import yaml


def function(name, text):
    # An array of numbers, because string literals have a length limit.
    rows = [", ".join(str(byte) for byte in text[at:at + 24]) for at in range(0, len(text), 24)]
    numbers = ",\n".join(rows)
    return (f"namespace {{\nconstexpr char {name}_text[] = {{\n{numbers}}};\n}}  // namespace\n\n"
            f"std::string_view {name}() {{ return {{{name}_text, sizeof {name}_text}}; }}\n\n")


def main():
    yaml_path, schema_path, contract_path, cpp_path = sys.argv[1:]
    with open(yaml_path, encoding="utf-8") as file:
        document = yaml.safe_load(file)
    with open(schema_path, encoding="utf-8") as file:
        schema = json.load(file)
    with open(contract_path, encoding="utf-8") as file:
        contract = file.read()
    # Aliases in the YAML become copies: JSON has none.
    text = json.dumps(document, ensure_ascii=True, separators=(",", ":"))
    with open(cpp_path, "w", encoding="utf-8") as file:
        file.write('#include "api/openapi.h"\n\nnamespace api {\n')
        file.write(function("openapi_json", text.encode()))
        file.write(function("scene_schema_json", json.dumps(schema, ensure_ascii=True, indent=1).encode()))
        # As references: bytes beyond ASCII are no char everywhere.
        file.write(function("docs_html", docs_page.page(document, contract).encode("ascii", "xmlcharrefreplace")))
        file.write(function("scene_docs_html", docs_page.scene(schema).encode("ascii", "xmlcharrefreplace")))
        file.write("}  // namespace api\n")


if __name__ == "__main__":
    main()

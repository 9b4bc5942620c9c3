"""Turns openapi.yaml into C++ source that holds it as JSON: embed_openapi.py openapi.yaml openapi.cpp"""

import json
import sys

import yaml


def main():
    yaml_path, cpp_path = sys.argv[1:]
    with open(yaml_path, encoding="utf-8") as file:
        document = yaml.safe_load(file)
    # Aliases in the YAML become copies: JSON has none.
    text = json.dumps(document, ensure_ascii=True, separators=(",", ":"))
    # An array of numbers, because string literals have a length limit.
    rows = [", ".join(str(byte) for byte in text[at:at + 24].encode()) for at in range(0, len(text), 24)]
    with open(cpp_path, "w", encoding="utf-8") as file:
        file.write('#include "api/openapi.h"\n\nnamespace api {\nnamespace {\nconstexpr char text[] = {\n')
        file.write(",\n".join(rows))
        file.write("};\n}  // namespace\n\nstd::string_view openapi_json() { return {text, sizeof text}; }\n\n}  // namespace api\n")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""The gallery of one scene under each model of light: renders its images and writes their errors into README.md.

    scenes/models.py

`whittle measure --parameters model` compares the models with the rendering equation, some minutes long; an interrupted
run is resumed. WHITTLE_BIN is the directory of whittle, by default that of the release build.
"""
import json
import os
import pathlib
import subprocess

SCENES = pathlib.Path(__file__).resolve().parent
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN") or SCENES.parent / "build/release/bin")
MEASUREMENT = SCENES.parent / "build/models/color_bleeding"
SIZE = {"width": 160, "height": 120}
START, END = "<!-- models: scenes/models.py -->", "<!-- end of models -->"
SAMPLES = 256


def measured():
    """The complete measurement of the scene."""
    MEASUREMENT.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run([BIN / "whittle", "measure", SCENES / "color_bleeding.json", "--parameters", "model", "--size",
                    f"{SIZE['width']}x{SIZE['height']}", "--reference-samples", "1024", "-o", MEASUREMENT], check=True)
    return json.loads(MEASUREMENT.with_suffix(".json").read_text(encoding="utf-8"))


def scene_under(model, measurement):
    """The scene with the accuracy, and the ambient light, of a model."""
    scene = json.loads((SCENES / "color_bleeding.json").read_text(encoding="utf-8"))
    is_whitted = model in ("whitted", "fitted ambient")
    scene["accuracy"] = {"model": "whitted" if is_whitted else "global", "samples": SAMPLES}
    if model in ("radiosity", "gather"):
        scene["accuracy"]["approximate"] = {"interreflection": model}
    if model == "fitted ambient":
        scene["ambient"] = measurement["model_error"]["fitted_ambient"]
    return {**scene, "image": SIZE}


def error_of(model, measurement):
    """The model error in levels, of the image with the samples of the baseline, as a text."""
    if model == "path":
        return "0, the rendering equation"
    point = next(point for point in measurement["points"] if point["model"] == model and "samples" in point["value"])
    least = measurement["model_error"]["standard_error"]
    error = point["model_error"]
    return f"{error:.1f} levels" if error > least else f"at most {least:.1f} levels"


def main():
    measurement = measured()
    models = list(dict.fromkeys(point["model"] for point in measurement["points"]))
    directory = SCENES / "images/models"
    directory.mkdir(parents=True, exist_ok=True)
    names = {model: model.replace(" ", "_") for model in models}
    for model in models:
        subprocess.run([BIN / "whittle", "render", "-", "-o", directory / f"{names[model]}.png"], check=True,
                       input=json.dumps(scene_under(model, measurement)).encode())
    row = lambda cells: "| " + " | ".join(cells) + " |"
    table = "\n".join([row(models), row("---" for _ in models),
                       row(f"![{model}](images/models/{names[model]}.png)" for model in models),
                       row(error_of(model, measurement) for model in models)])
    readme = SCENES / "README.md"
    before, rest = readme.read_text(encoding="utf-8").split(START)
    readme.write_text(f"{before}{START}\n\n{table}\n\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()

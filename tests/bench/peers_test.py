"""Exports of documents to other ray tracers: complete, or rejected with the name of the feature. No other program is run."""
import copy
import pathlib
import tempfile
import unittest
from unittest import mock

from tests.bench import agreement
from tests.bench.peers import bench_scenes, document, povray, povray_radiosity, ppm, programs, tachyon, tessellate
from tests.support.whittle import scene, whittle

EQUAL_WORK = {"samples": [1, 1], "max_depth": 5, "cutoff": 0}


def plain():
    """A document with every feature of materials and lights that both programs support."""
    surface = {"model": "phong", "color": "#808080", "diffuse": 0.5, "specular": 0.25, "shininess": 12, "reflection": 0.125}
    return {"version": 1, "image": {"width": 4, "height": 2}, "ambient": 0.5,
            "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0], "fov": 90},
            "background": {"color": [0.25, 0.5, 0.75]},
            "lights": [{"type": "point", "position": [1, 2, 3], "color": [1, 0.5, 0.25], "intensity": 2}],
            "materials": {"a": surface}, "accuracy": EQUAL_WORK,
            "objects": [{"type": "sphere", "center": [1, 2, 3], "radius": 4, "material": "a"}]}


def export(program, source):
    with tempfile.TemporaryDirectory() as directory:
        path = pathlib.Path(directory) / "scene"
        program.write_scene(document.portable_scene(source), path)
        return path.read_text()


class UnsupportedFeatures(unittest.TestCase):
    def assert_rejected(self, program, reason, change):
        source = copy.deepcopy(plain())
        change(source)
        with self.assertRaises(document.Unsupported) as caught:
            export(program, source)
        self.assertIn(reason, str(caught.exception))

    def test_are_rejected_by_name_for_both_programs(self):
        surface = lambda **fields: lambda source: source["materials"]["a"].update(fields)
        light = lambda **fields: lambda source: source["lights"][0].update(fields)
        shape = lambda **fields: lambda source: source["objects"][0].update(fields)
        whole = lambda **fields: lambda source: source.update(fields)
        for reason, change in (
                ("emission", surface(emission=1)), ("texture", surface(color={"checker": [0, 1]})),
                ("texture", surface(color="wood")), ("shading", surface(shading="flat")), ("bump", surface(bump={})),
                ("absorption", surface(transmission=0.5, absorption=1)), ("priority", surface(priority=1)),
                ("fresnel", surface(transmission=0.5)),
                ("interpolated", surface(transmission=0.5, transparency="interpolated")),
                ("coloured transmission", surface(transmission=0.5, fresnel=False, transmission_color=[1, 0, 0])),
                ("specular_color", surface(specular_color=[1, 0, 0])),
                ("shadows", light(shadows=False)), ("inverse_square", light(attenuation="inverse_square")),
                ("rect", light(type="rect")), ("spot", light(type="spot")),
                ("transform", shape(transform=[{"scale": 2}])), ("instance", shape(type="instance", of="b")),
                ("file", shape(type="mesh", file="a.ply")), ("smooth", shape(smooth=True)),
                ("axis", shape(axis=[1, 0, 0])), ("depth_cue", whole(depth_cue={})), ("prototypes", whole(prototypes={})),
                ("environment", whole(background={"environment": "sky"})),
                ("crop", lambda source: source["image"].update(crop=[])),
                ("orthographic", lambda source: source["camera"].update(type="orthographic")),
                ("aperture", lambda source: source["camera"].update(aperture=1)),
                ("approximate", lambda source: source["accuracy"].update(approximate={}))):
            for program in (povray, tachyon):
                with self.subTest(reason=reason, program=program.__name__):
                    self.assert_rejected(program, reason, change)

    def test_are_rejected_by_name_for_one_program(self):
        for program, reason, change in (
                (povray, "attenuation", lambda source: source["lights"][0].update(attenuation=[1, 1, 0])),
                (povray, "full transmission",
                 lambda source: source["materials"]["a"].update(transmission=1, transparency="filtered")),
                (tachyon, "attenuation", lambda source: source["lights"][0].update(attenuation=[1, 0, 1])),
                (tachyon, "refraction", lambda source: source["materials"]["a"].update(transmission=0.5, fresnel=False)),
                (tachyon, "coloured reflection",
                 lambda source: source["materials"]["a"].update(reflection_color=[1, 0, 0])),
                (tachyon, "coloured ambient light", lambda source: source.update(ambient=[1, 0, 0])),
                (tachyon, "a cone", lambda source: source["objects"][0].update(type="cone")),
                (tachyon, "two highlight models", lambda source: source["materials"].update(
                    b={**source["materials"]["a"], "model": "blinn_phong"}))):
            with self.subTest(reason=reason, program=program.__name__):
                self.assert_rejected(program, reason, change)

    def test_occur_in_most_example_scenes_but_not_in_the_sphereflake(self):
        self.assertIn("sphere {", export(povray, scene("sphereflake")))
        for name in ("glass", "textures", "lights", "instances", "haze", "panorama"):
            with self.assertRaises(document.Unsupported):
                document.portable_scene(scene(name))


class ExportedScene(unittest.TestCase):
    def test_has_the_camera_light_and_material_for_pov_ray(self):
        text = export(povray, plain())
        for part in ("location <0,0,5> direction <0,0,-1> right <4,0,0> up <0,2,0>", "rgb <2,1,0.5>",
                     "max_trace_level 6 adc_bailout 0 ", "ambient rgb <0.5,0.5,0.5>", "phong 0.25 phong_size 12",
                     "reflection { rgb <0.125,0.125,0.125> }", "sphere { <1,2,3>,4"):
            self.assertIn(part, text)

    def test_has_the_camera_light_and_material_for_tachyon(self):
        text = export(tachyon, plain())
        for part in ("RESOLUTION 4 2", "RAYDEPTH 6 ", "FRUSTUM 2.5 -1.5 -1.5 0.5 ", "LIGHT CENTER 1 2 3 ", "COLOR 2 1 0.5",
                     "AMBIENT 0.5 DIFFUSE 0.5 SPECULAR 0.125 OPACITY 1 PHONG PLASTIC 0.25 PHONG_SIZE 12",
                     "SPHERE CENTER 1 2 3 RAD 4 a"):
            self.assertIn(part, text)

    def test_compensates_the_terms_that_pov_ray_reduces_by_the_transmission(self):
        source = plain()
        source["materials"]["a"].update(transmission=0.75, transparency="filtered")
        self.assertIn("transmit 0.75 } finish { diffuse 2 ", export(povray, source))

    def test_converts_attenuation_to_the_fade_distance_of_half_the_intensity(self):
        source = plain()
        source["lights"][0]["attenuation"] = [4, 0, 1]  # 1/(4 + d^2) = 2/(1 + (d/2)^2) / 8
        self.assertIn("rgb <0.25,0.125,0.0625> fade_power 2 fade_distance 2 ", export(povray, source))


class BenchScenes(unittest.TestCase):
    def test_are_valid_and_deterministic_documents(self):
        for name in bench_scenes.SCENES:
            with self.subTest(name):
                content = bench_scenes.document(name, EQUAL_WORK, SMALL.get(name, 2), 8, 8)
                self.assertEqual(content, bench_scenes.document(name, EQUAL_WORK, SMALL.get(name, 2), 8, 8))
                self.assertEqual(whittle("check", "-", document=content).returncode, 0)
                self.assertEqual(len(document.portable_scene(content).objects), len(content["objects"]))


SMALL = {"mountain": 6, "pot": 12, "molecule": 40, "waves": 40}


class Radiosity(unittest.TestCase):
    """POV-Ray gets an area light for a glowing rectangle."""

    def export(self, source):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "scene"
            povray_radiosity.write_scene(source, path)
            return path.read_text()

    def test_has_the_radiance_of_the_lamp_over_its_area(self):
        # 130 x 105: L A / 2 pi = 18.387 * 13650 / 2 pi = 39945
        text = self.export(scene("cornell_box"))
        self.assertIn("light_source { <278,548.79,279.5> rgb <39945.", text)
        self.assertIn("point_at <278,547.79,279.5> area_light <0,0,105>, <-130,0,0>", text)
        self.assertEqual(text.count("no_radiosity no_shadow"), 1)
        self.assertEqual(text.count("mesh2"), len(scene("cornell_box")["objects"]))

    def test_rejects_other_shapes_materials_and_lamps(self):
        for reason, change in (("a sphere", lambda source: source["objects"][1].update(type="sphere")),
                               ("reflection", lambda source: source["materials"]["white"].update(reflection=0.5)),
                               ("rectangle", lambda source: source["objects"][0]["positions"].pop()),
                               ("lights", lambda source: source.update(lights=[]))):
            with self.subTest(reason=reason), self.assertRaisesRegex(document.Unsupported, reason):
                source = copy.deepcopy(scene("cornell_box"))
                change(source)
                self.export(source)


class SceneOfMeshes(unittest.TestCase):
    @mock.patch.multiple(tessellate, AROUND=128, ALONG=64)
    def test_has_the_image_of_the_exact_shapes(self):
        for name, of in agreement.SCENES.items():
            exact = {"version": 1, **of(), "image": {"width": 96, "height": 96}, "ambient": 0.5, "accuracy": {"samples": 16}}
            with self.subTest(name), tempfile.TemporaryDirectory() as directory:
                images = []
                for source in (exact, tessellate.scene_of_meshes(exact)):
                    images.append(pathlib.Path(directory, f"{len(images)}.png"))
                    done = whittle("render", "-", "-o", images[-1], document=source)
                    self.assertEqual(done.returncode, 0, done.stderr)
                self.assertLess(programs.difference(*images)["rmse"], 2)


class Ppm(unittest.TestCase):
    def test_is_read_with_comments(self):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "a.ppm"
            path.write_bytes(b"P6\n# by\n# someone\n2 1\n65535\n" + bytes.fromhex("ffff00000a0a" * 2))
            image = ppm.read(path)
        self.assertEqual(image.tolist(), [[[1, 0, 0x0a0a / 65535]] * 2])


if __name__ == "__main__":
    unittest.main()

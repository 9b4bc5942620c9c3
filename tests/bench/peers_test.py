"""What other ray tracers are told of a document is all of it, or it is refused by name; nothing here runs them."""
import copy
import pathlib
import tempfile
import unittest

from tests.bench.peers import bench_scenes, document, povray, ppm, tachyon
from tests.support.whittle import scene, whittle

EQUAL_WORK = {"samples": [1, 1], "max_depth": 5, "cutoff": 0}


def plain():
    """All that both can have of materials, lights and shapes."""
    surface = {"model": "phong", "color": "#808080", "diffuse": 0.5, "specular": 0.25, "shininess": 12, "reflection": 0.125}
    return {"version": 1, "image": {"width": 4, "height": 2}, "ambient": 0.5,
            "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0], "fov": 90},
            "background": {"color": [0.25, 0.5, 0.75]},
            "lights": [{"type": "point", "position": [1, 2, 3], "color": [1, 0.5, 0.25], "intensity": 2}],
            "materials": {"a": surface}, "accuracy": EQUAL_WORK,
            "objects": [{"type": "sphere", "center": [1, 2, 3], "radius": 4, "material": "a"}]}


def told(program, asked):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene"
        program.write_scene(document.of(asked), path)
        return path.read_text()


class WhatAnotherProgramCannotBeTold(unittest.TestCase):
    def refused(self, program, reason, change):
        asked = copy.deepcopy(plain())
        change(asked)
        with self.assertRaises(document.Inexpressible) as caught:
            told(program, asked)
        self.assertIn(reason, str(caught.exception))

    def test_is_refused_by_name_for_both(self):
        surface = lambda **fields: lambda asked: asked["materials"]["a"].update(fields)
        light = lambda **fields: lambda asked: asked["lights"][0].update(fields)
        thing = lambda **fields: lambda asked: asked["objects"][0].update(fields)
        whole = lambda **fields: lambda asked: asked.update(fields)
        for reason, change in (
                ("emission", surface(emission=1)), ("texture", surface(color={"checker": [0, 1]})),
                ("texture", surface(color="wood")), ("shading", surface(shading="flat")), ("bump", surface(bump={})),
                ("absorption", surface(transmission=0.5, absorption=1)), ("priority", surface(priority=1)),
                ("fresnel", surface(transmission=0.5)),
                ("interpolated", surface(transmission=0.5, transparency="interpolated")),
                ("transmission that is coloured", surface(transmission=0.5, fresnel=False, transmission_color=[1, 0, 0])),
                ("specular_color", surface(specular_color=[1, 0, 0])),
                ("shadows", light(shadows=False)), ("inverse_square", light(attenuation="inverse_square")),
                ("rect", light(type="rect")), ("spot", light(type="spot")),
                ("transform", thing(transform=[{"scale": 2}])), ("instance", thing(type="instance", of="b")),
                ("file", thing(type="mesh", file="a.ply")), ("smooth", thing(smooth=True)),
                ("axis", thing(axis=[1, 0, 0])), ("depth_cue", whole(depth_cue={})), ("prototypes", whole(prototypes={})),
                ("environment", whole(background={"environment": "sky"})),
                ("crop", lambda asked: asked["image"].update(crop=[])),
                ("orthographic", lambda asked: asked["camera"].update(type="orthographic")),
                ("aperture", lambda asked: asked["camera"].update(aperture=1)),
                ("approximate", lambda asked: asked["accuracy"].update(approximate={}))):
            for program in (povray, tachyon):
                with self.subTest(reason=reason, program=program.__name__):
                    self.refused(program, reason, change)

    def test_is_refused_by_name_for_one(self):
        for program, reason, change in (
                (povray, "attenuation", lambda asked: asked["lights"][0].update(attenuation=[1, 1, 0])),
                (povray, "transmits everything",
                 lambda asked: asked["materials"]["a"].update(transmission=1, transparency="filtered")),
                (tachyon, "attenuation", lambda asked: asked["lights"][0].update(attenuation=[1, 0, 1])),
                (tachyon, "refraction", lambda asked: asked["materials"]["a"].update(transmission=0.5, fresnel=False)),
                (tachyon, "reflection that is coloured",
                 lambda asked: asked["materials"]["a"].update(reflection_color=[1, 0, 0])),
                (tachyon, "ambient light that is coloured", lambda asked: asked.update(ambient=[1, 0, 0])),
                (tachyon, "a cone", lambda asked: asked["objects"][0].update(type="cone")),
                (tachyon, "two models of highlights", lambda asked: asked["materials"].update(
                    b={**asked["materials"]["a"], "model": "blinn_phong"}))):
            with self.subTest(reason=reason, program=program.__name__):
                self.refused(program, reason, change)

    def test_is_in_most_example_scenes_but_not_in_the_sphereflake(self):
        self.assertIn("sphere {", told(povray, scene("sphereflake")))
        for name in ("glass", "textures", "lights", "instances", "haze", "panorama"):
            with self.assertRaises(document.Inexpressible):
                document.of(scene(name))


class WhatAnotherProgramIsTold(unittest.TestCase):
    def test_is_the_same_camera_light_and_surface_for_pov_ray(self):
        text = told(povray, plain())
        for part in ("location <0,0,5> direction <0,0,-1> right <4,0,0> up <0,2,0>", "rgb <2,1,0.5>",
                     "max_trace_level 6 adc_bailout 0 ", "ambient rgb <0.5,0.5,0.5>", "phong 0.25 phong_size 12",
                     "reflection { rgb <0.125,0.125,0.125> }", "sphere { <1,2,3>,4"):
            self.assertIn(part, text)

    def test_is_the_same_camera_light_and_surface_for_tachyon(self):
        text = told(tachyon, plain())
        for part in ("RESOLUTION 4 2", "RAYDEPTH 6 ", "FRUSTUM 2.5 -1.5 -1.5 0.5 ", "LIGHT CENTER 1 2 3 ", "COLOR 2 1 0.5",
                     "AMBIENT 0.5 DIFFUSE 0.5 SPECULAR 0.125 OPACITY 1 PHONG PLASTIC 0.25 PHONG_SIZE 12",
                     "SPHERE CENTER 1 2 3 RAD 4 a"):
            self.assertIn(part, text)

    def test_is_less_transparent_than_pov_ray_takes_away_from_what_is_its_own(self):
        asked = plain()
        asked["materials"]["a"].update(transmission=0.75, transparency="filtered")
        self.assertIn("transmit 0.75 } finish { diffuse 2 ", told(povray, asked))

    def test_is_attenuation_with_twice_the_light_at_the_distance_of_half(self):
        asked = plain()
        asked["lights"][0]["attenuation"] = [4, 0, 1]  # 1/(4 + d^2) = 2/(1 + (d/2)^2) / 8
        self.assertIn("rgb <0.25,0.125,0.0625> fade_power 2 fade_distance 2 ", told(povray, asked))


class TheScenesOfComparisons(unittest.TestCase):
    def test_are_valid_documents_and_the_same_every_time(self):
        for name in bench_scenes.SCENES:
            with self.subTest(name):
                made = bench_scenes.made(name, EQUAL_WORK, SMALL.get(name, 2), 8, 8)
                self.assertEqual(made, bench_scenes.made(name, EQUAL_WORK, SMALL.get(name, 2), 8, 8))
                self.assertEqual(whittle("check", "-", document=made).returncode, 0)
                self.assertEqual(len(document.of(made).objects), len(made["objects"]))


SMALL = {"mountain": 6, "pot": 12, "molecule": 40, "waves": 40}


class APpm(unittest.TestCase):
    def test_is_read_with_comments_and_shrunk_to_means(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.ppm"
            path.write_bytes(b"P6\n# by\n# someone\n2 2\n65535\n" + bytes.fromhex("ffff00000a0a" * 2 + "000000000a0a" * 2))
            picture = ppm.read(path)
        self.assertEqual((picture.width, picture.height, picture.samples[0]), (2, 2, 1))
        self.assertEqual(ppm.shrunk(picture, 2).samples, [0.5, 0, 0x0a0a / 65535])


if __name__ == "__main__":
    unittest.main()

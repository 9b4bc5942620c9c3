"""No picture takes more instructions or more rays than the file beside this one says; a change that has a reason to
changes the file too (tests/bench/instructions.py --write). No clock: the counts are the same on a busy machine."""
import json
import pathlib
import unittest

from tests.bench.instructions import KEPT, PICTURES, measured

ALLOWED = 1.02  # of what is kept: less is not told apart from another layout of the same code


@unittest.skipUnless("avx2" in pathlib.Path("/proc/cpuinfo").read_text(), "the counts are those of AVX2")
class TracingAPicture(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.kept, cls.found = json.loads(KEPT.read_text()), measured()

    def test_is_kept_for_each_picture_and_no_other(self):
        self.assertEqual(list(self.kept), list(PICTURES))

    def test_takes_no_more_than_2_percent_more_instructions_a_ray_than_kept(self):
        for name, kept in self.kept.items():
            self.within(name, kept, "instructions_per_ray")

    def test_takes_no_more_than_2_percent_more_rays_than_kept(self):
        for name, kept in self.kept.items():
            self.within(name, kept, "rays")

    def within(self, name, kept, what):
        with self.subTest(name):
            self.assertLessEqual(self.found[name][what], ALLOWED * kept[what],
                                 f"{what} of {name}: kept {kept[what]}; if that is worth it, write "
                                 f"tests/bench/instructions.json anew and say why")


if __name__ == "__main__":
    unittest.main()

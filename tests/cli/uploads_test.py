"""Scenes that name their files by hash, on the command line: found in the folder that --assets gives, or said so."""
import hashlib
import pathlib
import shutil
import tempfile
import unittest

from tests.support.whittle import SCENES, whittle

TILE = SCENES / "assets/tile.png"
HASH = hashlib.sha256(TILE.read_bytes()).hexdigest()


def document(name):
    return {"version": 1, "image": {"width": 16, "height": 12}, "camera": {"position": [0, 2, 6], "look_at": [0, 0, 0]},
            "ambient": 1, "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0],
                                       "material": {"color": {"file": name}}}]}


class Uploads(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def render(self, name, *options):
        out = self.folder / "out.png"
        done = whittle("render", "-", "-o", out, *options, document=document(name))
        return done, out.read_bytes() if done.returncode == 0 else None

    def test_lie_under_their_hash_or_as_a_daemon_keeps_them(self):
        _, expected = self.render(str(TILE))
        for place in (self.folder / "plain" / HASH, self.folder / "daemon" / HASH[:2] / HASH):
            place.parent.mkdir(parents=True)
            shutil.copy(TILE, place)
            done, picture = self.render(f"sha256:{HASH}", "--assets", self.folder / place.relative_to(self.folder).parts[0])
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(picture, expected)

    def test_without_the_option_or_the_file_are_told_where_the_document_names_them(self):
        for options, sentence in (((), b"--assets FOLDER"), (("--assets", self.folder), b"no such file at")):
            for command in (("render", "-", "-o", self.folder / "a.png"), ("check", "-"),
                            ("measure", "-", "-o", self.folder / "m")):
                done = whittle(*command, *options, document=document(f"sha256:{HASH}"))
                self.assertEqual(done.returncode, 1, done.stderr)
                said = done.stdout + done.stderr
                self.assertIn(b"/objects/0/material/color/file", said)
                self.assertIn(sentence, said)

    def test_option_needs_a_folder(self):
        for command in ("render", "check", "measure"):
            done = whittle(command, "-", "--assets")
            self.assertEqual(done.returncode, 2)
            self.assertIn(b"--assets needs", done.stderr)


if __name__ == "__main__":
    unittest.main()

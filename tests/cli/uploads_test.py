"""Command line: scenes that refer to files by hash, which are in the directory of --assets."""
import hashlib
import shutil

from tests.support.whittle import SCENES, DirectoryTest, whittle

TILE = SCENES / "assets/tile.png"
HASH = hashlib.sha256(TILE.read_bytes()).hexdigest()


def document(name):
    return {"version": 1, "image": {"width": 16, "height": 12}, "camera": {"position": [0, 2, 6], "look_at": [0, 0, 0]},
            "ambient": 1, "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0],
                                       "material": {"color": {"file": name}}}]}


class Uploads(DirectoryTest):
    def render(self, name, *options):
        out = self.directory / "out.png"
        done = whittle("render", "-", "-o", out, *options, document=document(name))
        return done, out.read_bytes() if done.returncode == 0 else None

    def test_are_named_by_hash_or_stored_as_the_daemon_does(self):
        _, expected = self.render(str(TILE))
        for path in (self.directory / "plain" / HASH, self.directory / "daemon" / HASH[:2] / HASH):
            path.parent.mkdir(parents=True)
            shutil.copy(TILE, path)
            done, image = self.render(f"sha256:{HASH}", "--assets", self.directory / path.relative_to(self.directory).parts[0])
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(image, expected)

    def test_without_the_option_or_the_file_are_reported_with_the_pointer_of_their_use(self):
        for options, sentence in (((), b"--assets DIRECTORY"), (("--assets", self.directory), b"no such file at")):
            for command in (("render", "-", "-o", self.directory / "a.png"), ("check", "-"),
                            ("measure", "-", "-o", self.directory / "m")):
                done = whittle(*command, *options, document=document(f"sha256:{HASH}"))
                self.assertEqual(done.returncode, 1, done.stderr)
                output = done.stdout + done.stderr
                self.assertIn(b"/objects/0/material/color/file", output)
                self.assertIn(sentence, output)

    def test_option_requires_a_directory(self):
        for command in ("render", "check", "measure"):
            done = whittle(command, "-", "--assets")
            self.assertEqual(done.returncode, 2)
            self.assertIn(b"--assets: 1 required DIRECTORY missing", done.stderr)

"""GET /v1/batches/{id}/animation.apng: the images of a batch as an animation."""
import contextlib
import sqlite3
import struct

import numpy

from tests.http.daemon import NOBODY, OneDaemon, json_of, scene
from tests.support.images import png_chunks, read_png, write_png


def frames(apng):
    """The control chunk and the PNG of each frame."""
    head, found, sequence = [], [], []
    for name, data in png_chunks(apng):
        if name == b"acTL":
            count, plays = struct.unpack(">II", data)
        elif name == b"fcTL":
            sequence.append(struct.unpack(">I", data[:4])[0])
            found.append([data, b""])
        elif name == b"IDAT":
            found[-1][1] += data
        elif name == b"fdAT":
            sequence.append(struct.unpack(">I", data[:4])[0])
            found[-1][1] += data[4:]
        elif name != b"IEND":
            head.append((name, data))
    assert (count, plays, sequence) == (len(found), 0, list(range(len(sequence))))
    return [(control, write_png([*head, (b"IDAT", data), (b"IEND", b"")])) for control, data in found]


class Animations(OneDaemon):
    def animation(self, batch, query=""):
        return self.daemon.get(f"{batch['links']['self']}/animation.apng{query}")

    def jobs(self, batch):
        return json_of(self.daemon.get(batch["links"]["jobs"] + "&limit=200"))["items"][::-1]

    def images(self, batch):
        return [self.daemon.get(job["links"]["image"]).body for job in self.jobs(batch) if job["links"]["image"]]

    def test_have_the_pixels_of_every_image(self):
        for size in (16, 200):  # a row of the database, and a file with several chunks of data
            batch = self.daemon.finished_batch(scene=scene(size, size, samples=4), sweep={"/camera/fov": [30 + i for i in range(24)]})
            reply = self.animation(batch, "?fps=10")
            self.assertEqual((reply.status, reply.headers["Content-Type"], len(reply.body)),
                             (200, "image/apng", int(reply.headers["Content-Length"])))
            found, images = frames(reply.body), self.images(batch)
            self.assertEqual(len(found), 24)
            for (control, frame), image in zip(found, images):
                self.assertEqual(struct.unpack(">IIIIHHBB", control[4:]), (size, size, 0, 0, 1, 10, 0, 0))
                numpy.testing.assert_array_equal(read_png(frame), read_png(image))
            self.assertEqual(struct.unpack(">H", frames(self.animation(batch).body)[0][0][22:24]), (24,))

    def test_have_reduced_images(self):
        batch = self.daemon.finished_batch(scene=scene(60, 40), sweep={"/camera/fov": [30, 40, 50]})
        found = frames(self.animation(batch, "?max=30&fps=60").body)
        self.assertEqual(len(found), 3)
        for (control, frame), job in zip(found, self.jobs(batch)):
            self.assertEqual(struct.unpack(">IIIIHHBB", control[4:]), (30, 20, 0, 0, 1, 60, 0, 0))
            numpy.testing.assert_array_equal(read_png(frame), read_png(self.daemon.get(job["links"]["preview"] + "?max=30").body))
        self.assertEqual(self.animation(batch, "?max=30&fps=60").body, self.animation(batch, "?fps=60&max=30").body)
        whole = frames(self.animation(batch, "?max=1024").body)
        numpy.testing.assert_array_equal(read_png(whole[0][1]), read_png(self.images(batch)[0]))
        other = self.daemon.finished_batch(scene=scene(), sweep={"/image/width": [30, 40]})
        self.assert_problem(self.animation(other, "?max=20"), 409, "images_differ")
        kinds = self.daemon.finished_batch(scene=scene(), sweep={"/output": [{}, {"palette": 4}]})
        self.assertEqual(len(frames(self.animation(kinds, "?max=16").body)), 2, "reduced images have one kind")

    def test_find_damaged_artifacts(self):
        batch = self.daemon.finished_batch(scene=scene(), sweep={"/camera/fov": [31, 41]})
        with contextlib.closing(sqlite3.connect(self.daemon.data / "whittle.db")) as database, database:
            changed = 0
            for job in self.jobs(batch):
                changed += database.execute("UPDATE small_artifacts SET bytes = X'89' WHERE sha256 = ?", (job["artifacts"][0]["sha256"],)).rowcount
            self.assertEqual(changed, 2)
        self.assert_problem(self.animation(batch), 500, "internal")
        self.assert_problem(self.animation(batch, "?max=16"), 500, "image_damaged")

    def test_have_the_images_that_exist(self):
        patches = [{}, {"job": {"deadline": "2001-01-01T00:00:00Z"}}, {"camera": {"fov": 50}}]
        batch = self.daemon.finished_batch(scene=scene(), frames=patches)
        self.assertEqual(len(frames(self.animation(batch).body)), 2)
        alone = self.daemon.finished_batch(scene=scene(), frames=[{}])
        self.assertEqual(len(frames(self.animation(alone).body)), 1)

    def test_need_images_of_one_size_and_kind(self):
        for sweep in ({"/image/width": [8, 9]}, {"/output": [{}, {"alpha": True}]}, {"/output": [{"palette": 2}, {"palette": 3}]}):
            self.assert_problem(self.animation(self.daemon.finished_batch(scene=scene(), sweep=sweep)), 409, "images_differ")
        linear = self.daemon.finished_batch(scene=scene(output={"formats": ["exr"]}), frames=[{}])
        self.assert_problem(self.animation(linear), 404, "image_not_found")

    def test_refuse_other_speeds_and_batches(self):
        batch = self.daemon.finished_batch(scene=scene(), frames=[{}])
        for query in ("?fps=0", "?fps=61", "?fps=", "?fps=1.5", "?fps=-1", "?fps=9&fps=9", "?max=15", "?max=1025", "?max=", "?max=64&max=64", "?size=9"):
            self.assert_problem(self.animation(batch, query), 400, "invalid_query")
        self.assert_problem(self.daemon.get(f"/v1/batches/{NOBODY}/animation.apng"), 404, "batch_not_found")

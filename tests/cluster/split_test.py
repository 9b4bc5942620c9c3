"""One image on two nodes with one thread each has the bytes of one node."""
import unittest

from tests.cluster.nodes import Cluster
from tests.http.daemon import Daemon, scene, sha256, wait_until


def mirrors(width=320, height=240, samples=None, **changes):
    """Spheres that mirror each other: some seconds on one thread."""
    plane = {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"color": 0.4}}
    spheres = [{"type": "sphere", "center": [x, 0.5, z], "radius": 0.5,
                "material": {"color": [0.3 + 0.2 * x, 0.5, 0.4], "reflection": 0.5}} for x in (-1, 0, 1) for z in (-1, 0, 1)]
    lights = [{"type": "sphere", "center": [4, 6, 5], "radius": 1}, {"type": "point", "position": [-5, 4, 3]}]
    if samples:
        changes["accuracy"] = {"samples": samples}
    return scene(width, height, objects=[plane, *spheres], lights=lights, output={"formats": ["png", "exr"]}, **changes)


FIXED = mirrors(samples=[324, 324])
TARGET = mirrors(accuracy={"target_error": 0.06})
CROP = mirrors(640, 480, samples=[256, 256])
CROP["image"]["crop"] = [101, 37, 450, 300]


def hashes(node, job):
    return [sha256(node.get(f"/v1/jobs/{job}/image.{name}").body) for name in ("png", "exr")]


def alone(document):
    """(hashes, report) of a node without a cluster."""
    with Daemon("--threads", "1") as daemon:
        job = daemon.submit(document)
        report = daemon.wait_for_end(job)["report"]
        return hashes(daemon, job), report


# The node of a job gets a task only when the other node has got five, however busy the machine is.
AFTER_THE_OTHER = """
    CREATE FUNCTION after_the_other() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
      IF (SELECT count(*) FROM tasks WHERE job_id = new.job_id AND node NOT IN ('', coordinator)) < 5 THEN RETURN NULL; END IF;
      RETURN new;
    END $$;
    CREATE TRIGGER after_the_other BEFORE UPDATE ON tasks FOR EACH ROW
      WHEN (new.node = new.coordinator AND new.attempt > old.attempt) EXECUTE FUNCTION after_the_other()"""
# Leases of tasks and offers of help last for an hour.
LASTING = """
    CREATE FUNCTION last_for_an_hour() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
      IF TG_TABLE_NAME = 'tasks' THEN new.lease_until := new.lease_until + 3600000; ELSE new.seen_at := new.seen_at + 3600000; END IF;
      RETURN new;
    END $$;
    CREATE TRIGGER last_for_an_hour BEFORE UPDATE ON tasks FOR EACH ROW
      WHEN (new.state = 'claimed') EXECUTE FUNCTION last_for_an_hour();
    CREATE TRIGGER last_for_an_hour BEFORE INSERT OR UPDATE ON task_helpers FOR EACH ROW EXECUTE FUNCTION last_for_an_hour()"""


class TwoNodes(unittest.TestCase):
    def setUp(self):
        self.cluster = self.enterContext(Cluster(("fsync=off",)))

    def start_two(self, *options):
        """Two nodes that have nothing to do, with AFTER_THE_OTHER."""
        nodes = [self.cluster.node("all", "--threads", "1", *options) for _ in range(2)]
        self.cluster.sql(AFTER_THE_OTHER)
        wait_until(lambda: self.cluster.sql("SELECT count(*) FROM task_helpers") == "2", "both nodes to offer help")
        return nodes

    def expect_alike(self, image, report, document):
        image_alone, report_alone = alone(document)
        self.assertEqual(image, image_alone)
        self.assertEqual((report_alone["workers"], report_alone["tasks"]), (1, 0))
        self.assertGreater(report["tasks"], 10)
        for name in ("error", "rays", "samples", "holdout_samples", "artifacts"):
            self.assertEqual(report[name], report_alone[name], name)
        self.assertEqual(self.cluster.sql("SELECT count(*) FROM tasks"), "0")


class SplitTest(TwoNodes):
    def test_fixed_samples_a_target_error_and_a_crop_have_the_bytes_of_one_node(self):
        one, _ = self.start_two()
        self.cluster.sql(LASTING)
        for document in (FIXED, TARGET, CROP):
            with self.subTest(accuracy=document["accuracy"]):
                job = one.submit(document)
                report = one.wait_for_end(job)["report"]
                self.assertEqual(report["workers"], 2)
                self.assertEqual(report["repeated_tasks"], 0)
                self.expect_alike(hashes(one, job), report, document)

    def test_small_jobs_are_not_divided(self):
        one, _ = self.start_two()
        report = one.wait_for_end(one.submit(scene(64, 48)))["report"]
        self.assertEqual((report["workers"], report["tasks"]), (1, 0))

"""The stores in a bucket of Ceph's gateway, which checks signatures and hashes independently: the conformance suites, and a node."""
import os
import re
import subprocess
import unittest

from tests.http.daemon import Daemon, put, scene, sha256
from tests.http.uploads_test import TILE, textured
from tests.support.ceph import CephServer
from tests.support.postgres import PostgresServer
from tests.support.s3 import ACCESS_KEY, SECRET_KEY
from tests.support.whittle import BIN, succeeded

# Cases of the client that demand no failures of the server.
CLIENT = ("ReturnsTheBytesThatWerePut", "ReadsRanges", "ReplacesTheBytesOfAKey", "ReadsCredentialsFromAFileAtEachRequest",
          "ListsKeysInOrderAndInPages", "SignsUrlsForOthers", "ServesManyThreads")


class RadosgwTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ceph = CephServer()
        cls.addClassCleanup(cls.ceph.close)

    def test_passes_the_conformance_suites(self):
        cases = ":".join(["*Conformance*/S3", *(f"S3ClientTest.{name}" for name in CLIENT), "BucketObjects.ListsItsObjectsAndNothingElse"])
        result = succeeded(subprocess.run([BIN / "conformance_tests", f"--gtest_filter={cases}"], check=False, capture_output=True, text=True,
                                          env={**os.environ, "WHITTLE_S3_ENDPOINT": self.ceph.endpoint}))
        for name in (*CLIENT, "ListsItsObjectsAndNothingElse", "Conformance"):  # a name that no case has would select nothing
            self.assertRegex(result.stdout, rf"\[       OK \] .*{name}")
        print(re.search(r"\[  PASSED  \] .*", result.stdout)[0], "against radosgw")

    def test_a_node_stores_images_and_uploads(self):
        database = PostgresServer()
        self.addCleanup(database.close)
        options = ("--database", database.uri(database.new_database()), "--artifacts", "s3://whittle/node", "--s3-endpoint", self.ceph.endpoint,
                   "--s3-path-style", "on")
        with Daemon(*options, environment={"AWS_ACCESS_KEY_ID": ACCESS_KEY, "AWS_SECRET_ACCESS_KEY": SECRET_KEY}) as node:
            put(node, TILE)
            jobs = [node.submit(document) for document in (textured(TILE), scene(4800, 3300, output={"formats": ["exr"]}))]
            for job in jobs:
                (artifact,) = node.wait_for_success(job)["artifacts"]
                image = node.get(artifact["url"]).body
                self.assertEqual(sha256(image), artifact["sha256"])
            self.assertGreater(len(image), 16 << 20, "sent in parts")

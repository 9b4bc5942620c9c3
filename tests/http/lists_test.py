"""GET /v1/jobs: order, filters and pages."""
import datetime
import time
import unittest

from tests.http.daemon import Daemon, json_of, scene, wait_until


def moment_ms(text):
    return datetime.datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp() * 1000


class Listing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.__exit__)
        cls.ids = []
        for index in range(7):
            labels = {"parity": "even" if index % 2 == 0 else "odd", "index": f"{index}"}
            cls.ids.append(cls.daemon.submit(scene(job={"name": f"job {index}", "labels": labels})))
        for job_id in cls.ids:
            cls.daemon.wait_for_end(job_id)

    def names(self, query):
        reply = self.daemon.get(f"/v1/jobs{query}")
        self.assertEqual(reply.status, 200, reply.body)
        return [job["name"] for job in json_of(reply)["items"]]

    def test_is_newest_first(self):
        self.assertEqual(self.names(""), [f"job {index}" for index in range(6, -1, -1)])

    def test_filters_by_labels_state_and_part_of_the_name(self):
        self.assertEqual(self.names("?label=parity:odd"), ["job 5", "job 3", "job 1"])
        self.assertEqual(self.names("?label=parity:odd&label=index:3"), ["job 3"])
        self.assertEqual(self.names("?label=parity:none"), [])
        self.assertEqual(self.names("?q=b%203"), ["job 3"])
        self.assertEqual(self.names("?q=%25"), [])
        self.assertEqual(len(self.names("?state=succeeded")), 7)
        self.assertEqual(self.names("?state=failed"), [])

    def test_filters_by_kind_owner_time_and_name_without_case(self):
        with Daemon() as daemon:
            def names(query):
                reply = daemon.get(f"/v1/jobs?{query}")
                self.assertEqual(reply.status, 200, reply.body)
                return [job["name"] for job in json_of(reply)["items"]]
            first = daemon.job(daemon.submit(scene(name="Ærø 100%_A")))
            wait_until(lambda: time.time() * 1000 > moment_ms(first["created_at"]) + 1, "another millisecond")
            second = daemon.job(daemon.submit(scene(name="second")))
            daemon.request("POST", "/v1/measure", {"scene": scene(name="third", job={"run_after": "2099-01-01T00:00:00Z"})})
            self.assertEqual(names("kind=render"), ["second", first["name"]])
            self.assertEqual(names("kind=measure&state=queued"), ["third"])
            self.assertEqual(names("owner=") + names("owner=ann"), ["third", "second", first["name"]])
            self.assertEqual(names(f"created_before={second['created_at']}"), [first["name"]])
            self.assertEqual(names(f"created_after={second['created_at']}"), ["third", "second"])
            self.assertEqual(names(f"created_after={first['created_at']}&created_before={first['created_at']}"), [])
            self.assertEqual(names("created_after=2020-01-01T02:00:00%2B02:00&kind=render&limit=1"), ["second"])
            for query, found in (("q=SECOND", ["second"]), ("q=00%25_a", [first["name"]]), ("q=%C3%86R", [first["name"]]),
                                 ("q=%25", [first["name"]]), ("q=_b", []), ("q=%FF", []), ("q='%20OR%201=1", [])):
                self.assertEqual(names(query), found, query)

    def test_refuses_unknown_and_invalid_parameters(self):
        for query in ("?page=2", "?state=done", "?label=odd", "?label=:x", "?limit=0", "?limit=201", "?limit=x",
                      "?limit=1&limit=2", "?cursor=5", "?batch=1", "?State=queued", "?label=a:1&label=a:2", "?kind=draw", "?kind=", "?kind=render&kind=render",
                      "?created_after=yesterday", "?created_before=2020-02-30T00:00:00Z", "?created_after=", "?owner=a&owner=b"):
            reply = self.daemon.get(f"/v1/jobs{query}")
            self.assertEqual(reply.status, 400, query)
            self.assertEqual(json_of(reply)["type"], "urn:whittle:problem:invalid_query", query)
        for query, detail in (("?page=1&page=2", 'unknown: "page", "page"; known: '), ("?limit=1&limit=2", "limit is given twice")):
            self.assertIn(detail, json_of(self.daemon.get(f"/v1/jobs{query}"))["detail"])


if __name__ == "__main__":
    unittest.main()

"""GET /v1/jobs: order, filters and pages."""
import datetime
import time

from tests.http.daemon import FAR, OneDaemon, json_of, scene, wait_until


class Listing(OneDaemon):
    def names(self, query):
        return [job["name"] for job in json_of(self.daemon.get(f"/v1/jobs?{query}"), 200)["items"]]

    def test_is_newest_first_and_filtered_by_each_field(self):
        first = self.finished(name="Ærø 100%_A", job={"labels": {"parity": "odd", "index": "1"}})
        wait_until(lambda: time.time() > datetime.datetime.fromisoformat(first["created_at"]).timestamp() + 0.001, "another millisecond")
        second = self.finished(name="second", job={"labels": {"parity": "odd", "index": "2"}})
        self.daemon.request("POST", "/v1/measure", {"scene": scene(name="third", job={"run_after": FAR})})
        one, at, then = first["name"], first["created_at"], second["created_at"]
        for query, found in (
                ("", ["third", "second", one]), ("label=parity:odd", ["second", one]), ("label=parity:odd&label=index:1", [one]),
                ("label=parity:none", []), ("state=succeeded", ["second", one]), ("state=failed", []), ("kind=render", ["second", one]),
                ("kind=measure&state=queued", ["third"]), ("owner=", ["third", "second", one]), ("owner=ann", []),
                (f"created_before={then}", [one]), (f"created_after={then}", ["third", "second"]),
                (f"created_after={at}&created_before={at}", []),
                ("created_after=2020-01-01T02:00:00%2B02:00&kind=render&limit=1", ["second"]),
                ("q=SECOND", ["second"]), ("q=00%25_a", [one]), ("q=%C3%86R", [one]), ("q=%25", [one]), ("q=_b", []), ("q=%FF", []),
                ("q='%20OR%201=1", [])):
            self.assertEqual(self.names(query), found, query)
        self.daemon.request("POST", "/v1/batches", {"scene": scene(job={"run_after": FAR}), "frames": [{}]})
        self.assertEqual([len(self.names(query)) for query in ("", "batch=none", "batch=none&state=succeeded")], [4, 3, 2])

    def test_refuses_unknown_and_invalid_parameters(self):
        for query in ("?page=2", "?state=done", "?label=odd", "?label=:x", "?limit=0", "?limit=201", "?limit=x",
                      "?limit=1&limit=2", "?cursor=5", "?batch=1", "?State=queued", "?label=a:1&label=a:2", "?kind=draw", "?kind=", "?kind=render&kind=render",
                      "?created_after=yesterday", "?created_before=2020-02-30T00:00:00Z", "?created_after=", "?owner=a&owner=b"):
            self.assert_problem(self.daemon.get(f"/v1/jobs{query}"), 400, "invalid_query")
        for query, detail in (("?page=1&page=2", 'unknown: "page", "page"; known: '), ("?limit=1&limit=2", "limit is given twice")):
            self.assertIn(detail, json_of(self.daemon.get(f"/v1/jobs{query}"))["detail"])

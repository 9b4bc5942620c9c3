"""POST /v1/jobs/bulk: one action on many jobs."""
import unittest

from tests.http.daemon import FAR, NOBODY, Daemon, OneDaemon, json_of, scene, wait_until


class Bulk(OneDaemon):
    options = ("--jobs", "1")

    def waiting(self, count, **job):
        """Ids of jobs that wait."""
        return [self.daemon.submit(scene(job={"run_after": FAR, **job})) for _ in range(count)]

    def change(self, **body):
        return json_of(self.daemon.request("POST", "/v1/jobs/bulk", body), 200)

    def states(self, ids):
        return [self.daemon.job(job_id)["state"] for job_id in ids]

    def test_cancels_the_jobs_of_a_filter_after_a_dry_run(self):
        ids = self.waiting(5, labels={"shot": "7"}) + self.waiting(1, labels={"shot": "8"})
        self.daemon.request("POST", f"/v1/jobs/{ids[0]}/cancel")
        selected = {"label": "shot:7"}
        expected = {"matched": 5, "done": 0, "refused": [{"id": ids[0], "code": "job_ended"}]}
        self.assertEqual(self.change(action="cancel", filter=selected, dry_run=True), expected)
        self.assertEqual(self.states(ids), ["cancelled"] + ["queued"] * 5)
        self.assertEqual(self.change(action="cancel", filter=selected), {**expected, "done": 4})
        self.assertEqual(self.states(ids), ["cancelled"] * 5 + ["queued"])
        self.assertEqual(self.change(action="cancel", filter={**selected, "state": "queued"}), {"matched": 0, "done": 0, "refused": []})

    def test_acts_on_ids_and_names_those_it_refuses(self):
        ids = self.waiting(2)
        running = self.daemon.start_job()
        done = self.change(action="remove", ids=[ids[0], running, NOBODY, "../x", ids[0]])
        self.assertEqual(done, {"matched": 4, "done": 1, "refused": [
            {"id": running, "code": "job_running"}, {"id": NOBODY, "code": "job_not_found"},
            {"id": "../x", "code": "job_not_found"}]})
        self.assertEqual(self.daemon.get(f"/v1/jobs/{ids[0]}").status, 404)
        self.assertEqual(self.change(action="cancel", ids=[running])["done"], 1)
        self.assertEqual(self.daemon.wait_for_end(running)["state"], "cancelled")

    def test_changes_priorities_and_retries(self):
        ids = self.waiting(3, labels={"set": "a"})
        self.assertEqual(self.change(action="priority", value=90, filter={"label": ["set:a"]})["done"], 3)
        self.assertEqual({self.daemon.job(job_id)["priority"] for job_id in ids}, {90})
        self.assertEqual(self.change(action="cancel", ids=ids[:2])["done"], 2)
        self.assertEqual(self.change(action="priority", value=1, ids=ids)["refused"],
                         [{"id": job_id, "code": "job_ended"} for job_id in ids[:2]])
        succeeded = self.finished()["id"]
        self.assertEqual(self.change(action="retry", ids=ids + [succeeded]),
                         {"matched": 4, "done": 2, "refused": [{"id": job_id, "code": "job_not_failed"}
                                                               for job_id in (ids[2], succeeded)]})
        self.assertEqual(self.states(ids), ["queued"] * 3)

    def test_refuses_hostile_and_incomplete_requests(self):
        self.waiting(1)
        for body in ({}, {"action": "cancel"}, {"action": "cancel", "filter": {}}, {"action": "cancel", "ids": []},
                     {"action": "stop", "ids": [NOBODY]}, {"action": "cancel", "ids": [NOBODY], "filter": {"q": "a"}},
                     {"action": "cancel", "ids": NOBODY}, {"action": "cancel", "ids": [1]}, {"action": "cancel", "filter": {"q": 1}},
                     {"action": "cancel", "filter": {"q": ""}}, {"action": "cancel", "filter": {"limit": "1"}},
                     {"action": "cancel", "filter": {"states": "queued"}}, {"action": "cancel", "filter": {"state": "done"}},
                     {"action": "cancel", "filter": {"state": ["queued", "failed"]}},
                     {"action": "cancel", "filter": {"state": ["failed", "queued"]}}, {"action": "cancel", "filter": {"label": []}},
                     {"action": "priority", "ids": [NOBODY]}, {"action": "priority", "value": 101, "ids": [NOBODY]},
                     {"action": "cancel", "value": 1, "ids": [NOBODY]}, {"action": "cancel", "ids": [NOBODY], "dry_run": 1},
                     {"action": "cancel", "ids": [f"{i}" for i in range(10_001)]}):
            self.assert_problem(self.daemon.request("POST", "/v1/jobs/bulk", body), 422, "invalid_request")
        self.assertEqual(json_of(self.daemon.get("/v1/queue"))["jobs"]["cancelled"], 0)

    def tearDown(self):
        for action in ("cancel", "remove"):
            wait_until(lambda action=action: not self.change(action=action, filter={"created_after": "2000-01-01T00:00:00Z"})
                       ["done"], action)


class ManyJobs(unittest.TestCase):
    def test_that_match_are_cancelled_in_one_request_and_stay_so(self):
        with Daemon() as daemon:
            for _ in range(3):
                batch = {"scene": scene(job={"run_after": FAR}), "sweep": {"/accuracy/seed": list(range(1, 501))}}
                batch_id = json_of(daemon.request("POST", "/v1/batches", batch))["id"]
            ended = [job["id"] for job in json_of(daemon.get(f"/v1/jobs?batch={batch_id}&limit=3"))["items"]]
            for job_id in ended:
                daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
            body = {"action": "cancel", "filter": {"batch": batch_id}}
            dry = json_of(daemon.request("POST", "/v1/jobs/bulk", {**body, "dry_run": True}))
            reply = json_of(daemon.request("POST", "/v1/jobs/bulk", body))
            daemon.kill()
            self.assertEqual((reply["matched"], reply["done"], reply["refused"]), (500, 497, dry["refused"]))
            self.assertEqual(sorted(item["id"] for item in reply["refused"]), sorted(ended))
            daemon.start()
            jobs = json_of(daemon.get("/v1/queue"))["jobs"]
            self.assertEqual((jobs["cancelled"], jobs["queued"]), (500, 1000))

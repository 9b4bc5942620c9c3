"""kill -9 of one of two nodes that trace one image: the image is the same, and little is traced twice."""
from tests.cluster.split_test import TwoNodes, hashes, mirrors
from tests.http.daemon import wait_until

LONG = mirrors(640, 480, samples=[196, 196])


class SplitKillTest(TwoNodes):
    def done_tasks(self):
        """Tasks with a result, by node."""
        rows = self.cluster.sql("SELECT node, count(*) FROM tasks WHERE state = 'done' GROUP BY node").split()
        return {node: int(count) for node, count in (row.split("|") for row in rows)}

    def survive(self, victim, survivor, job):
        """Kills one node when both have traced tasks; the job when the other one has ended it."""
        wait_until(lambda: len(done := self.done_tasks()) == 2 and min(done.values()) >= 5, "both nodes to trace tasks")
        victim.kill()
        ended = survivor.wait_for_end(job)
        report = ended["report"]
        self.expect_alike(hashes(survivor, job), report, LONG)
        share = report["repeated_tasks"] / report["tasks"]
        print(f"repeated {report['repeated_tasks']} of {report['tasks']} tasks: {100 * share:.1f} %")
        self.assertLessEqual(share, 0.15)
        return ended

    def test_survives_kill_9_of_the_helper(self):
        one, other = self.start_two()
        self.survive(other, one, one.submit(LONG))

    def test_survives_kill_9_of_the_coordinator(self):
        one, other = self.start_two("--lease-s", "5")
        ended = self.survive(one, other, one.submit(LONG))
        self.assertEqual(ended["attempt"], 1, "the end of a lease counts as no attempt")

"""kill -9 of one of two nodes that trace one image: the image is the same, and little is traced twice."""
from tests.cluster.split_test import TwoNodes, hashes, mirrors
from tests.http.daemon import wait_until

LONG = mirrors(640, 480, samples=[196, 196])


class SplitKillTest(TwoNodes):
    def done_tasks(self):
        """Tasks with a result, by node."""
        rows = self.cluster.sql("SELECT node, count(*) FROM tasks WHERE state = 'done' GROUP BY node").split()
        return {node: int(count) for node, count in (row.split("|") for row in rows)}

    def wait_for_work_of_both(self):
        wait_until(lambda: len(done := self.done_tasks()) == 2 and min(done.values()) >= 5, "both nodes to trace tasks")

    def expect_little_repeated(self, report):
        share = report["repeated_tasks"] / report["tasks"]
        print(f"repeated {report['repeated_tasks']} of {report['tasks']} tasks: {100 * share:.1f} %")
        self.assertLessEqual(share, 0.15)

    def test_survives_kill_9_of_the_helper(self):
        one, other = self.start_two()
        job = one.submit(LONG)
        self.wait_for_work_of_both()
        other.kill()
        report = one.wait_for_end(job)["report"]
        self.expect_alike(hashes(one, job), report, LONG)
        self.expect_little_repeated(report)

    def test_survives_kill_9_of_the_coordinator(self):
        one, other = self.start_two("--lease-s", "5")
        job = one.submit(LONG)
        self.wait_for_work_of_both()
        one.kill()
        ended = other.wait_for_end(job)
        self.assertEqual(ended["attempt"], 1, "the end of a lease counts as no attempt")
        report = ended["report"]
        self.expect_alike(hashes(other, job), report, LONG)
        self.expect_little_repeated(report)

"""The memory of a page that stays open."""
import os
import time
import unittest

from tests.browser.browser import BrowserTest
from tests.http.daemon import scene


class Memory(BrowserTest):
    def test_stays_flat(self):
        """Acceptance test 47, in ten minutes."""
        minutes = float(os.environ.get("WHITTLE_SOAK_MINUTES", "10"))
        self.open("#/")
        self.browser.one(".page")

        def heap():
            self.browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
            metrics = self.browser.execute_cdp_cmd("Runtime.getHeapUsage", {})
            return metrics["usedSize"] / 1e6
        ids = [self.daemon.submit(scene()) for _ in range(20)]
        time.sleep(5)
        before, end = heap(), time.monotonic() + minutes * 60
        while time.monotonic() < end:
            self.daemon.wait_for_end(self.daemon.submit(scene(name="one more")))
            if ids:
                self.daemon.request("DELETE", f"/v1/jobs/{ids.pop(0)}")
            time.sleep(1)
        print(f"heap {before:.1f} to {heap():.1f} MB")
        self.assertLessEqual(heap() - before, 5)


if __name__ == "__main__":
    unittest.main()

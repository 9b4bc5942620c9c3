"""Drafts of a long session: nothing of them stays."""
import contextlib
import sqlite3
import unittest

from tests.browser.browser import BrowserTest
from tests.http.daemon import json_of, wait_until


class ManyEdits(BrowserTest):
    def test_leave_no_rows(self):
        """Acceptance test 31: after 1,000 edits the list has no job, and 5 s later the store has no row."""
        self.open("#/new")
        self.browser.until(lambda: self.browser.all(".canvas img"), "the first draft")
        self.browser.set_script_timeout(600)
        self.editor("""window.edits = 0;
          const timer = setInterval(() => {
            const at = view.state.doc.toString().indexOf('"version"');
            view.dispatch({changes: edits % 2 ? {from: at - 1, to: at} : {from: at, insert: ' '}});
            if (++edits === 1000) clearInterval(timer);
          }, 170);""")
        self.browser.until(lambda: self.browser.execute_script("return edits") == 1000, "1,000 edits", seconds=500)
        print(f"{self.daemon.log().count('/v1/render')} drafts were rendered")
        self.assertEqual(json_of(self.daemon.get("/v1/jobs"))["items"], [])
        self.browser.get("about:blank")

        def rows():
            with contextlib.closing(sqlite3.connect(f"file:{self.daemon.data / 'whittle.db'}?mode=ro", uri=True)) as store:
                return store.execute("SELECT count(*) FROM jobs").fetchone()[0]
        wait_until(lambda: rows() == 0, "a store without drafts")


if __name__ == "__main__":
    unittest.main()

"""How far each batch is: bars on a terminal, else a line for each frame that ended."""
import os
import shutil
import sys
import time

REDRAW_S = 0.2
BAR_WIDTH = 30


class Progress:
    """`batches`: name -> number of frames."""

    def __init__(self, batches, stream=None):
        self.stream = stream or sys.stderr
        self.terminal = self.stream.isatty() and os.environ.get("TERM") != "dumb"
        self.total = batches
        self.done = dict.fromkeys(batches, 0)
        self.failed = dict.fromkeys(batches, 0)
        self.partial = {}  # batch -> {frame: fraction}
        self.drawn = 0     # lines of bars on the screen
        self.drawn_at = 0.0

    def say(self, sentence):
        self.erase()
        print(sentence, file=self.stream, flush=True)
        self.draw(True)

    def running(self, frame, fraction):
        self.partial.setdefault(frame.batch, {})[frame.name] = fraction
        self.draw(False)

    def ended(self, frame, sentence, failed):
        self.partial.get(frame.batch, {}).pop(frame.name, None)
        self.done[frame.batch] += 1
        self.failed[frame.batch] += failed
        if failed or not self.terminal:
            count = f"[{sum(self.done.values())}/{sum(self.total.values())}]"
            self.say(f"{count} {frame.name}: {sentence}")
        self.draw(True)

    def lines(self):
        columns, rows = shutil.get_terminal_size()
        unfinished = [name for name in self.total if self.done[name] < self.total[name]]
        shown = unfinished[:max(rows - 3, 1)]
        for name in shown:
            fraction = (self.done[name] + sum(self.partial.get(name, {}).values())) / self.total[name]
            filled = int(BAR_WIDTH * fraction)
            text = f"{'#' * filled}{'-' * (BAR_WIDTH - filled)} {self.done[name]}/{self.total[name]} {name}"
            if self.failed[name]:
                text += f", {self.failed[name]} failed"
            yield text[:columns - 1]
        if len(unfinished) > len(shown):
            yield f"and {len(unfinished) - len(shown)} more"

    def draw(self, at_once):
        now = time.monotonic()
        if not self.terminal or (not at_once and now - self.drawn_at < REDRAW_S):
            return
        self.erase()
        lines = list(self.lines())
        for line in lines:
            print(line, file=self.stream)
        self.stream.flush()
        self.drawn, self.drawn_at = len(lines), now

    def erase(self):
        if self.drawn:
            print(f"\x1b[{self.drawn}F\x1b[J", end="", file=self.stream)
        self.drawn = 0

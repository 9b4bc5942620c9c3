"""What was done, as lines of JSON in the folder of the pictures: written before and after each step that must not
happen twice, so that a killed script knows what it may have done."""
import fcntl
import json
import os
import uuid

FILE_NAME = "whittle-submit.state"


class StateTrouble(Exception):
    """A sentence that says why the state cannot be used."""


class State:
    """The journal of one folder. Entries: {"run"}, then of frames by name {"frame", "digest", "attempt"} (about to be
    submitted; with "batch": [a name, how many] where that is together with others), {"frame", "job"},
    {"frame", "refused"}, {"frame", "ended", "pictures"}, {"frame", "forgotten"}."""

    def __init__(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / FILE_NAME
        self.file = open(self.path, "a+b")  # pylint: disable=consider-using-with
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as trouble:
            raise StateTrouble(f"{self.path} is in use by another whittle-submit") from trouble
        self.run = None
        self.frames = {}  # name -> the members of its entries, the last of each
        self.load()
        self.is_new = self.run is None
        if self.is_new:
            self.write({"run": str(uuid.uuid4())})
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            os.fsync(descriptor)
            os.close(descriptor)

    def load(self):
        self.file.seek(0)
        whole = 0
        for line in self.file:
            if not line.endswith(b"\n"):
                break  # the script was killed in the middle of it
            try:
                self.take(json.loads(line))
            except (ValueError, KeyError, TypeError, AttributeError) as trouble:
                raise StateTrouble(f"{self.path} was not written by this program; move it away") from trouble
            whole += len(line)
        self.file.truncate(whole)

    def take(self, entry):
        if "run" in entry:
            self.run = entry["run"]
        elif "digest" in entry:  # begins anew
            self.frames[entry["frame"]] = dict(entry)
        elif "forgotten" in entry:
            self.frames[entry["frame"]] = {"attempt": self.frames[entry["frame"]]["attempt"]}
        else:
            self.frames[entry["frame"]].update(entry)

    def write(self, *entries):
        """On the disk when it returns, in this order."""
        for entry in entries:
            self.file.write(json.dumps(entry).encode() + b"\n")
        self.file.flush()
        os.fsync(self.file.fileno())
        for entry in entries:
            self.take(entry)

    def of(self, frame):
        """What is known of the frame as it is now; {} when that is nothing, or of another document."""
        known = self.frames.get(frame.name, {})
        return known if known.get("digest") == frame.digest else {}

    def begin(self, *frames):
        """A new attempt at each of the frames, which are submitted together where there are several."""
        entries = [{"frame": frame.name, "digest": frame.digest, "attempt": self.next_attempt(frame)} for frame in frames]
        if len(frames) > 1:
            batch = str(uuid.uuid4())
            for entry in entries:
                entry["batch"] = [batch, len(frames)]
        self.write(*entries)

    def forget(self, frame):
        """What is known of it, but for how often it was begun."""
        self.write({"frame": frame.name, "forgotten": True})

    def next_attempt(self, frame):
        return self.frames.get(frame.name, {}).get("attempt", 0) + 1

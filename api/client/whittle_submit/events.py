"""What happens to jobs at the service, as it happens: one stream of server-sent events for all of them."""
import http.client
import json

SILENCE_S = 40  # the service says something every 15 s


class StreamEnded(Exception):
    """The stream broke, or was cut because we were slow."""


class NoStream(Exception):
    """The service gives none at the moment."""


class Events:
    """Resumes after the last event that was seen. `connect()` gives a new connection to the service."""

    def __init__(self, connect, path, headers):
        self.connect, self.path, self.headers = connect, path, headers
        self.connection = self.response = None
        self.last_id = None

    def open(self):
        """Whether it goes on after the last event that was seen. Throws NoStream, StreamEnded."""
        self.close()
        headers = {**self.headers, "Accept": "text/event-stream"}
        if self.last_id is not None:
            headers["Last-Event-ID"] = self.last_id
        try:
            self.connection = self.connect(SILENCE_S)
            self.connection.request("GET", self.path, headers=headers)
            self.response = self.connection.getresponse()
            kind = self.response.headers.get("Content-Type", "")
            if self.response.status != 200 or not kind.startswith("text/event-stream"):
                self.response.read(1 << 16)
                raise NoStream(f"status {self.response.status}, {kind}")
        except (OSError, http.client.HTTPException) as trouble:
            raise StreamEnded(str(trouble)) from trouble
        return self.last_id is not None

    def close(self):
        if self.connection:
            self.connection.close()
        self.connection = self.response = None

    def next(self):
        """(kind, data) of the next event: "state", "progress", "done", or "reset" where events were missed. Throws
        StreamEnded."""
        fields = {}
        try:
            while line := self.response.readline(1 << 16).decode():
                if line != "\n":
                    name, _, value = line.rstrip("\n").partition(": ")
                    fields[name] = value
                elif "event" in fields:
                    self.last_id = fields.get("id", self.last_id)
                    return fields["event"], json.loads(fields["data"])
                else:
                    fields = {}  # a sign of life
        except (OSError, http.client.HTTPException, ValueError, KeyError) as trouble:
            raise StreamEnded(str(trouble)) from trouble
        raise StreamEnded("it ended")

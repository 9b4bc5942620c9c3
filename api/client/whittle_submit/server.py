"""HTTP client of the service: requests that are repeated until the server responds, and the stream of job events."""
import http.client
import json
import os
import shutil
import ssl
import time
import urllib.parse

from whittle_submit.sweep import file_digest

TIMEOUT_S = 90         # of one response; the service responds to these requests in seconds
STREAM_TIMEOUT_S = 40  # the service sends a keep-alive every 15 s
FIRST_PAUSE_S = 0.2    # between attempts, doubled after each
LONGEST_PAUSE_S = 10
HASHES_MAX = 10_000    # limit of the service for one request
PAGE_SIZE = 200        # jobs in one response
CHUNK_BYTES = 1 << 20
QUEUE_FULL = "urn:whittle:problem:queue_full"


class ServerError(Exception):
    """The server does not respond or does not do what is requested; the message gives the reason."""


class Rejected(ServerError):
    """The server rejected a request with `status`; the message is its problem document as text."""

    def __init__(self, status, problem):
        self.status = status
        errors = [f"{error['pointer']} {error['code']}: {error['detail']}" for error in problem.get("errors", [])]
        super().__init__("; ".join(errors) or problem.get("detail") or f"status {status}")

    def is_gone(self):
        return self.status in (404, 410)


class ResponseLost(Exception):
    """The connection broke: it is unknown if the server processed the request."""


class StreamClosed(Exception):
    """The stream broke, or the server closed it because it was read too slowly."""


class StreamUnavailable(Exception):
    """The server does not provide a stream at present."""


def parse_problem(body):
    try:
        problem = json.loads(body)
        return problem if isinstance(problem, dict) else {}
    except ValueError:
        return {}


def tls_advice(error):
    """Returns the end of a sentence about an error that a repetition does not cure; None for others."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"has a certificate that is not trusted: {error.verify_message}"
    if isinstance(error, ssl.SSLError) and error.reason in ("WRONG_VERSION_NUMBER", "HTTP_REQUEST"):
        return "does not use TLS: use http:// in place of https://"
    if isinstance(error, http.client.BadStatusLine) and error.line.startswith("\x15\x03"):  # an alert record (RFC 8446, 5.1)
        return "uses TLS: use https:// in place of http://"
    return None


class Server:
    """`report(message)` informs the user. A server that does not respond is tried again for `patience_s` seconds."""

    def __init__(self, url, key, patience_s, report):
        self.url, self.base = url, url.path.rstrip("/")
        self.headers = {"Authorization": f"Bearer {key}"} if key else {}
        self.patience_s, self.report = patience_s, report
        self.connection = None

    def connect(self, timeout_s=TIMEOUT_S):
        scheme = http.client.HTTPSConnection if self.url.scheme == "https" else http.client.HTTPConnection
        return scheme(self.url.hostname, self.url.port, timeout=timeout_s)

    def close(self):
        if self.connection:
            self.connection.close()
        self.connection = None

    def request(self, method, path, body=None, headers=None, sink=None, repeat=True, wait_for_queue=True):
        """Returns the response body, or writes it to the file `sink`. `body` is bytes, or a function that opens the file to
        send. Without `repeat`, a broken connection raises ResponseLost; without `wait_for_queue`, a full queue raises
        Rejected."""
        deadline, pause = None, FIRST_PAUSE_S
        while True:
            retry_after, is_reused = "", self.connection is not None
            try:
                response = self.send(method, path, body, headers)
                if response.status == 307:
                    response.read()
                    response = self.follow(response.headers["Location"])
                if response.status in (200, 201, 202):
                    return self.receive(response, sink) if sink else response.read()
                problem = parse_problem(response.read())
                is_full = response.status == 429 or problem.get("type") == QUEUE_FULL
                if response.status not in (408, 429, 502, 503, 504) or (is_full and not wait_for_queue):
                    raise Rejected(response.status, problem)
                reason = problem.get("detail") or f"status {response.status}"
                retry_after = response.headers.get("Retry-After", "")
            except (OSError, http.client.HTTPException) as error:
                self.close()
                if advice := tls_advice(error):
                    raise ServerError(f"{self.url.geturl()} {advice}") from error
                reason = str(error) or type(error).__name__
                if not repeat:
                    raise ResponseLost(reason) from error
                if is_reused:
                    continue  # the server closed an idle connection, or was restarted
            now = time.monotonic()
            if deadline is None:
                deadline = now + self.patience_s
                self.report(f"waiting for {self.url.geturl()}: {reason}")
            if now >= deadline:
                raise ServerError(f"{self.url.geturl()} does not respond: {reason}")
            time.sleep(min(max(pause, float(retry_after) if retry_after.isdecimal() else 0), LONGEST_PAUSE_S))
            pause = min(pause * 2, LONGEST_PAUSE_S)

    def send(self, method, path, body, headers):
        self.connection = self.connection or self.connect()
        file = body() if callable(body) else None
        try:
            length = {"Content-Length": str(os.fstat(file.fileno()).st_size)} if file else {}
            self.connection.request(method, self.base + path, body=file or body,
                                    headers={**self.headers, **(headers or {}), **length})
            return self.connection.getresponse()
        finally:
            if file:
                file.close()

    @staticmethod
    def follow(location):
        """Returns the response of another server, which must not receive the key."""
        url = urllib.parse.urlsplit(location)
        scheme = http.client.HTTPSConnection if url.scheme == "https" else http.client.HTTPConnection
        connection = scheme(url.hostname, url.port, timeout=TIMEOUT_S)
        connection.request("GET", f"{url.path}?{url.query}")
        return connection.getresponse()

    @staticmethod
    def receive(response, sink):
        sink.seek(0)  # an earlier attempt may have written a part
        sink.truncate()
        shutil.copyfileobj(response, sink, CHUNK_BYTES)
        if response.length:  # http.client does not report a body that ends early
            raise http.client.IncompleteRead(b"", response.length)

    def request_json(self, method, path, body=None, headers=None, **options):
        if body is not None:
            headers = {"Content-Type": "application/json", **(headers or {})}
            body = json.dumps(body).encode()
        content = self.request(method, path, body, headers, **options)
        try:
            return json.loads(content)
        except ValueError as error:
            raise ServerError(f"{self.url.geturl()}{path}: the response is not JSON: is this a Whittle service?") from error

    def upload(self, files):
        """Uploads those of `files` (SHA-256 -> path) that the server does not have."""
        digests = list(files)
        for begin in range(0, len(digests), HASHES_MAX):
            reply = self.request_json("POST", "/v1/assets/missing", {"sha256": digests[begin:begin + HASHES_MAX]})
            for digest in reply["missing"]:
                self.report(f"uploading {files[digest]}")
                try:
                    self.request("PUT", f"/v1/assets/{digest}", lambda d=digest: open(files[d], "rb"),
                                 {"Content-Type": "application/octet-stream"})
                except Rejected as rejection:
                    raise ServerError(f"{files[digest]}: {rejection}") from rejection

    def submit(self, path, body, key, find, wait_for_queue=True):
        """Returns the new job or batch. If the response is lost, `find()` searches for it before the request is repeated, so
        that nothing is submitted twice even if the server ignores Idempotency-Key."""
        deadline = time.monotonic() + self.patience_s
        while True:
            try:
                return self.request_json("POST", path, body, {"Idempotency-Key": key}, repeat=False,
                                         wait_for_queue=wait_for_queue)
            except ResponseLost as lost:
                if found := find():  # waits until the server responds
                    return found
                if time.monotonic() > deadline:
                    raise ServerError(f"{self.url.geturl()} does not accept jobs: {lost}") from lost

    def job(self, job_id):
        """Returns None if the job no longer exists."""
        try:
            return self.request_json("GET", f"/v1/jobs/{job_id}")
        except Rejected as rejection:
            if rejection.is_gone():
                return None
            raise

    def jobs(self, labels=None, batch=None, page_size=PAGE_SIZE):
        """Yields the jobs of a batch or with all of `labels`, newest first."""
        query = [("batch", batch)] if batch else [("label", f"{name}:{value}") for name, value in labels.items()]
        cursor = []
        while cursor is not None:
            fields = urllib.parse.urlencode([*query, ("limit", page_size), *cursor], quote_via=urllib.parse.quote)
            page = self.request_json("GET", f"/v1/jobs?{fields}")
            yield from page["items"]
            cursor = [("cursor", page["next_cursor"])] if page["next_cursor"] else None

    def newest_job(self, labels):
        return next(self.jobs(labels, page_size=1), None)

    def download(self, artifact, path):
        """Writes the artifact to `path`, atomically and durably. Returns False if it no longer exists."""
        part = path.with_name(f".{path.name}.part")
        try:
            with open(part, "wb") as file:
                self.request("GET", artifact["url"], sink=file)
                file.flush()
                os.fsync(file.fileno())
            if file_digest(part) != artifact["sha256"]:
                raise ServerError(f"{artifact['url']}: the content does not match the SHA-256 of the job")
            os.replace(part, path)
            return True
        except Rejected as rejection:
            if rejection.is_gone():
                return False
            raise
        finally:
            part.unlink(missing_ok=True)


class EventStream:
    """Server-sent events of all jobs. A stream that is opened again resumes after the last event received."""

    def __init__(self, server):
        self.server = server
        self.connection = self.response = self.last_id = None

    def open(self):
        """Returns True if the stream resumes. Raises StreamUnavailable, StreamClosed."""
        self.close()
        headers = {**self.server.headers, "Accept": "text/event-stream"}
        if self.last_id is not None:
            headers["Last-Event-ID"] = self.last_id
        try:
            self.connection = self.server.connect(STREAM_TIMEOUT_S)
            self.connection.request("GET", self.server.base + "/v1/events", headers=headers)
            self.response = self.connection.getresponse()
            media_type = self.response.headers.get("Content-Type", "")
            if self.response.status != 200 or not media_type.startswith("text/event-stream"):
                self.response.read(1 << 16)  # closing with unread data would reset the connection
                raise StreamUnavailable(f"status {self.response.status}, {media_type}")
        except (OSError, http.client.HTTPException) as error:
            raise StreamClosed(str(error)) from error
        return self.last_id is not None

    def close(self):
        if self.connection:
            self.connection.close()
        self.connection = self.response = None

    def next(self):
        """Returns (type, data) of the next event: "state", "progress", "done", or "reset" if events were missed. Raises
        StreamClosed."""
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
                    fields = {}  # keep-alive
        except (OSError, http.client.HTTPException, ValueError, KeyError) as error:
            raise StreamClosed(str(error)) from error
        raise StreamClosed("end of stream")

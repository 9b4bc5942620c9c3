"""The service over HTTP. A server that does not answer is waited for; what it refuses is told."""
import hashlib
import http.client
import json
import os
import time
import urllib.parse

TIMEOUT_S = 90        # of one reply; the service answers any of ours in seconds
FIRST_PAUSE_S = 0.2
LONGEST_PAUSE_S = 10
HASHES_MAX = 10_000   # of one question
PAGE = 200            # jobs of one answer
QUEUE_FULL = "urn:whittle:problem:queue_full"


class ServerTrouble(Exception):
    """A sentence that says why the server does not do what it is asked, now or ever."""


class LostReply(Exception):
    """The connection broke: the server may have done what it was asked, or not."""


class Refused(ServerTrouble):
    """The server understood, and will not: `status`, and its problem as sentences."""

    def __init__(self, status, problem):
        self.status = status
        errors = [f"{error['pointer']} {error['code']}: {error['detail']}" for error in problem.get("errors", [])]
        super().__init__("; ".join(errors) or problem.get("detail") or f"status {status}")


def labels_query(labels):
    return [("label", f"{name}:{value}") for name, value in labels.items()]


def problem_of(body):
    try:
        problem = json.loads(body)
        return problem if isinstance(problem, dict) else {}
    except ValueError:
        return {}


class Server:
    def __init__(self, url, key, patience_s, say):
        self.url = url
        self.base = url.path.rstrip("/")
        self.headers = {"Authorization": f"Bearer {key}"} if key else {}
        self.patience_s = patience_s
        self.say = say  # a sentence for the user
        self.connection = None

    # ---- one request, with patience

    def connect(self, timeout_s=TIMEOUT_S):
        kind = http.client.HTTPSConnection if self.url.scheme == "https" else http.client.HTTPConnection
        return kind(self.url.hostname, self.url.port, timeout=timeout_s)

    def close(self):
        if self.connection:
            self.connection.close()
        self.connection = None

    def request(self, method, path, body=None, headers=None, into=None, once=False, now_or_never=False):
        """The reply's bytes or, with `into`, none: it takes them piece by piece, after a call with None. `body` is
        bytes, or a function that opens a file to be sent. Repeated until the server has answered, unless `once`; with
        `now_or_never` it is refused where there is no room for it now."""
        start = pause = None
        while True:
            wait = None
            is_fresh = self.connection is None
            try:
                response = self.send(method, path, body, headers)
                accepted = response.status in (200, 201, 202)
                if into and accepted:
                    self.receive(response, into)
                    return b""
                content = response.read()
                if accepted:
                    return content
                problem = problem_of(content)
                no_room = response.status == 429 or problem.get("type") == QUEUE_FULL
                if response.status not in (408, 429, 502, 503, 504) or (now_or_never and no_room):
                    raise Refused(response.status, problem)
                why = problem.get("detail") or f"status {response.status}"
                wait = response.headers.get("Retry-After", "")
            except (OSError, http.client.HTTPException) as trouble:
                self.close()
                why = str(trouble) or type(trouble).__name__
                if once:
                    raise LostReply(why) from trouble
                if not is_fresh:
                    continue  # it had been idle, or the server was started anew
            now = time.monotonic()
            if start is None:
                start, pause = now, FIRST_PAUSE_S
                self.say(f"waiting for {self.url.geturl()}: {why}")
            if now - start >= self.patience_s:
                raise ServerTrouble(f"{self.url.geturl()} does not answer: {why}")
            time.sleep(min(max(pause, float(wait) if wait and wait.isdecimal() else 0), LONGEST_PAUSE_S))
            pause = min(pause * 2, LONGEST_PAUSE_S)

    def send(self, method, path, body, headers):
        if self.connection is None:
            self.connection = self.connect()
        opened = body() if callable(body) else None
        try:
            length = {"Content-Length": str(os.fstat(opened.fileno()).st_size)} if opened else {}
            self.connection.request(method, self.base + path, body=opened or body,
                                    headers={**self.headers, **(headers or {}), **length})
            return self.connection.getresponse()
        finally:
            if opened:
                opened.close()

    @staticmethod
    def receive(response, into):
        into(None)
        expected = response.length
        received = 0
        while piece := response.read(1 << 20):
            into(piece)
            received += len(piece)
        if expected is not None and received != expected:
            raise http.client.IncompleteRead(b"", expected - received)

    def ask_json(self, method, path, body=None, headers=None, **how):
        if body is not None:
            headers = {"Content-Type": "application/json", **(headers or {})}
            body = json.dumps(body).encode()
        content = self.request(method, path, body, headers, **how)
        try:
            return json.loads(content)
        except ValueError as trouble:
            raise ServerTrouble(f"{self.url.geturl()}{path} answered no JSON: is this a Whittle service?") from trouble

    # ---- what is asked of it

    def upload(self, files, told):
        """Brings those of `files` (hash -> path) that are missing; `told(path)` before each."""
        hashes = list(files)
        for begin in range(0, len(hashes), HASHES_MAX):
            reply = self.ask_json("POST", "/v1/assets/missing", {"sha256": hashes[begin:begin + HASHES_MAX]})
            for digest in reply["missing"]:
                told(files[digest])
                try:
                    self.request("PUT", f"/v1/assets/{digest}", lambda d=digest: open(files[d], "rb"),
                                 {"Content-Type": "application/octet-stream"})
                except Refused as refusal:
                    raise ServerTrouble(f"{files[digest]}: {refusal}") from refusal

    def submit(self, path, body, key, find, now_or_never=False):
        """The reply: a job or a batch. Where it is lost `find()` looks for what it told before it is asked for again,
        so that there are no two even if the service knows no Idempotency-Key."""
        start = time.monotonic()
        while True:
            try:
                return self.ask_json("POST", path, body, {"Idempotency-Key": key}, once=True,
                                     now_or_never=now_or_never)
            except LostReply as lost:
                if found := find():  # waits until the server answers
                    return found
                if time.monotonic() - start > self.patience_s:
                    raise ServerTrouble(f"{self.url.geturl()} takes no jobs: {lost}") from lost

    def job(self, job_id):
        """None when there is no such job any more."""
        try:
            return self.ask_json("GET", f"/v1/jobs/{job_id}")
        except Refused as refusal:
            if refusal.status in (404, 410):
                return None
            raise

    def labelled(self, labels):
        """The newest job with all these labels, or None."""
        return next(self.jobs_where(labels_query(labels), 1), None)

    def all_labelled(self, labels):
        return self.jobs_where(labels_query(labels))

    def jobs_of_batch(self, batch_id):
        return self.jobs_where([("batch", batch_id)])

    def jobs_where(self, query, limit=PAGE):
        """Jobs, the newest first, page by page."""
        cursor = []
        while cursor is not None:
            fields = urllib.parse.urlencode([*query, ("limit", limit), *cursor], quote_via=urllib.parse.quote)
            page = self.ask_json("GET", f"/v1/jobs?{fields}")
            yield from page["items"]
            cursor = [("cursor", page["next_cursor"])] if page["next_cursor"] else None

    def download(self, artifact, path):
        """To `path`, whole and on the disk or not at all. False when the server has it no more."""
        part = path.with_name(f".{path.name}.part")
        with open(part, "wb") as file:
            digest = None

            def take(piece):
                nonlocal digest
                if piece is None:  # from the start, after whatever broke off
                    file.seek(0)
                    file.truncate()
                    digest = hashlib.sha256()
                else:
                    file.write(piece)
                    digest.update(piece)
            try:
                self.request("GET", artifact["url"], into=take)
                if digest.hexdigest() != artifact["sha256"]:
                    raise ServerTrouble(f"{artifact['url']}: the bytes are not those that the job names")
                file.flush()
                os.fsync(file.fileno())
            except Refused as refusal:
                part.unlink()
                if refusal.status in (404, 410):
                    return False
                raise
            except BaseException:
                part.unlink(missing_ok=True)
                raise
        os.replace(part, path)
        return True

"""A private S3-compatible server for tests: objects in memory, signatures and hashes checked with botocore.

As a program it prints its endpoint and then answers lines of standard input, each with one line, until that is closed.
    status CODE COUNT   answers the next COUNT requests with a status; drop COUNT: closes their connections unread
    lose COUNT          does what the next COUNT requests demand, and closes their connections without an answer
    broken COUNT        ends the next COUNT multipart uploads with an error in the body of status 200
    down, up            closes the port and all connections, opens it again
    fetch URL           status and sha256 of what a client without credentials reads
    corrupt KEY         changes the bytes of an object
    requests, uploads   number of requests so far, of multipart uploads that were not ended
    age                 makes these uploads two days old
    begin KEY           begins one; its id
"""
import collections
import contextlib
import datetime
import hashlib
import http.server
import re
import socket
import sys
import threading
import urllib.error
import urllib.parse
import urllib.request
import uuid
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from botocore.auth import S3SigV4Auth, S3SigV4QueryAuth
from botocore.awsrequest import AWSRequest
from botocore.credentials import Credentials

BUCKET, ACCESS_KEY, SECRET_KEY, REGION = "whittle", "whittle-key", "whittle/secret+", "us-east-1"
PART_BYTES_MIN = 5 << 20  # as S3; not of the last part
LISTED_MAX = 1000


class Refused(Exception):
    def __init__(self, status, code, message=""):
        super().__init__(code)
        self.status, self.code, self.message = status, code, message


def signature_of(auth, request, time):
    request.context["timestamp"] = time
    auth._modify_request_before_signing(request)  # pylint: disable=protected-access
    text = auth.string_to_sign(request, auth.canonical_request(request))
    return auth.signature(text, request)


class Objects:
    """A bucket. Thread-safe."""

    def __init__(self):
        self.lock = threading.Lock()
        self.objects, self.uploads, self.faults = {}, {}, collections.Counter()
        self.status, self.requests, self.skip_faults = 0, 0, 0

    def takes(self, fault):
        """True for a request that is to fail so; after `skip_faults` others."""
        with self.lock:
            if self.faults[fault] > 0 and self.skip_faults > 0:
                self.skip_faults -= 1
                return False
            taken = self.faults[fault] > 0
            self.faults[fault] -= taken
            return taken

    def put(self, key, body):
        with self.lock:
            self.objects[key] = body

    def get(self, key):
        with self.lock:
            if key not in self.objects:
                raise Refused(404, "NoSuchKey")
            return self.objects[key]

    def begin(self, key):
        with self.lock:
            upload = uuid.uuid4().hex + "+/="  # must be encoded in queries
            self.uploads[upload] = (key, {}, datetime.datetime.utcnow())
            return upload

    def upload(self, name, key):
        with self.lock:
            if self.uploads.get(name, ("",))[0] != key:
                raise Refused(404, "NoSuchUpload")
            return self.uploads[name][1]

    def end(self, name, key, parts):
        stored = self.upload(name, key)
        pieces = []
        for number, tag in parts:
            if number not in stored or f'"{hashlib.md5(stored[number]).hexdigest()}"' != tag:
                raise Refused(400, "InvalidPart")
            pieces.append(stored[number])
        if any(len(piece) < PART_BYTES_MIN for piece in pieces[:-1]):
            raise Refused(400, "EntityTooSmall")
        with self.lock:
            self.objects[key] = b"".join(pieces)
            del self.uploads[name]


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    objects = None

    def log_message(self, *_):  # pylint: disable=arguments-differ
        pass

    def handle_any(self):
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        self.objects.requests += 1
        if self.objects.takes("drop"):
            self.close_connection = True
            return
        try:
            if self.objects.takes("status"):
                raise Refused(self.objects.status, "Fault")
            url = urllib.parse.urlsplit(self.path)
            query = dict(urllib.parse.parse_qsl(url.query, keep_blank_values=True))
            self.check_signature(url, query, body)
            bucket, _, key = urllib.parse.unquote(url.path)[1:].partition("/")
            if bucket != BUCKET:
                raise Refused(404, "NoSuchBucket", "The specified bucket does not exist")
            answer = self.answer(key, query, body)
        except Refused as refused:
            text = f"<Error><Code>{refused.code}</Code><Message>{escape(refused.message)}</Message></Error>"
            answer = (refused.status, text.encode(), {"Content-Type": "application/xml"})
        if self.objects.takes("lose"):
            self.close_connection = True
            return
        self.send(*answer)

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = handle_any

    def send(self, status, body=b"", headers=None, length=None):
        self.send_response(status)
        for name, value in (headers or {}).items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def check_signature(self, url, query, body):
        credentials = Credentials(ACCESS_KEY, SECRET_KEY, self.headers.get("x-amz-security-token") or query.get("X-Amz-Security-Token"))
        host = self.headers["Host"]
        if "X-Amz-Signature" in query:
            plain = [pair for pair in url.query.split("&") if not re.match("X-Amz-(Signature|Algorithm|Credential|Date|Expires|SignedHeaders|Security-Token)=", pair)]
            request = AWSRequest(self.command, f"http://{host}{url.path}" + ("?" + "&".join(plain) if plain else ""), headers={})
            time, expires = query["X-Amz-Date"], int(query["X-Amz-Expires"])
            begin = datetime.datetime.strptime(time, "%Y%m%dT%H%M%SZ")
            if datetime.datetime.utcnow() > begin + datetime.timedelta(seconds=expires):
                raise Refused(403, "AccessDenied", "Request has expired")
            expected = signature_of(S3SigV4QueryAuth(credentials, "s3", REGION, expires), request, time)
            if expected != query["X-Amz-Signature"]:
                raise Refused(403, "SignatureDoesNotMatch")
            return
        found = re.fullmatch(r"AWS4-HMAC-SHA256 Credential=([^/]+)/\d{8}/([^/]+)/s3/aws4_request, ?SignedHeaders=([^,]+), ?Signature=(\w+)", self.headers.get("Authorization", ""))
        if not found:
            raise Refused(403, "AccessDenied", "The request is not signed")
        key, region, signed, signature = found.groups()
        if key != ACCESS_KEY:
            raise Refused(403, "InvalidAccessKeyId")
        if region != REGION:
            raise Refused(400, "AuthorizationHeaderMalformed", f"the region '{region}' is wrong; expecting '{REGION}'")
        content = self.headers.get("x-amz-content-sha256")
        if content != hashlib.sha256(body).hexdigest():
            raise Refused(400, "XAmzContentSHA256Mismatch")
        names = signed.split(";")
        if "host" not in names or "x-amz-content-sha256" not in names or "x-amz-date" not in names:
            raise Refused(403, "AccessDenied", "There were headers present in the request which were not signed")
        headers = {name: self.headers[name] for name in names}
        request = AWSRequest(self.command, f"http://{host}{self.path}", headers=headers, data=body)
        auth = S3SigV4Auth(credentials, "s3", REGION)
        request.context["timestamp"] = self.headers["x-amz-date"]
        if auth.signature(auth.string_to_sign(request, auth.canonical_request(request)), request) != signature:
            raise Refused(403, "SignatureDoesNotMatch", "The request signature we calculated does not match")

    def answer(self, key, query, body):
        if not key:
            return self.listing(query)
        if self.command == "POST":
            return self.multipart(key, query, body)
        if self.command == "PUT":
            tag = {"ETag": f'"{hashlib.md5(body).hexdigest()}"'}
            if "uploadId" in query:
                self.objects.upload(query["uploadId"], key)[int(query["partNumber"])] = body
            else:
                self.objects.put(key, body)
            return 200, b"", tag
        if self.command == "DELETE":
            if "uploadId" in query:
                self.objects.upload(query["uploadId"], key)
                self.objects.uploads.pop(query["uploadId"], None)
            self.objects.objects.pop(key, None)
            return 204, b""
        return self.content(self.objects.get(key), query)

    def content(self, content, query):
        headers = {name.removeprefix("response-"): value for name, value in query.items() if name.startswith("response-")}
        if self.command == "HEAD":
            return 200, b"", headers, len(content)
        found = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        if not found:
            return 200, content, headers
        begin, end = int(found[1]), min(int(found[2]) + 1, len(content))
        if begin >= len(content):
            raise Refused(416, "InvalidRange")
        return 206, content[begin:end], {**headers, "Content-Range": f"bytes {begin}-{end - 1}/{len(content)}"}

    def multipart(self, key, query, body):
        if query.get("uploads") == "":
            return 200, f"<InitiateMultipartUploadResult><UploadId>{self.objects.begin(key)}</UploadId></InitiateMultipartUploadResult>".encode()
        if self.objects.takes("broken"):
            return 200, b"<Error><Code>InternalError</Code><Message>parts</Message></Error>"
        parts = [(int(part.find("PartNumber").text), part.find("ETag").text) for part in ElementTree.fromstring(body)]
        self.objects.end(query["uploadId"], key, parts)
        return 200, b"<CompleteMultipartUploadResult><ETag>x</ETag></CompleteMultipartUploadResult>"

    def listing(self, query):
        if query.get("uploads") == "" and self.command == "GET":
            return 200, self.listed_uploads(query.get("prefix", "")).encode()
        if query.get("list-type") != "2" or self.command != "GET":
            raise Refused(405, "MethodNotAllowed")
        with self.objects.lock:
            keys = sorted(key for key in self.objects.objects if key.startswith(query.get("prefix", "")) and key > query.get("start-after", ""))[:LISTED_MAX]
            entries = "".join(f"<Contents><Key>{escape(key)}</Key><Size>{len(self.objects.objects[key])}</Size></Contents>" for key in keys)
        return 200, f'<ListBucketResult xmlns="http://s3.amazonaws.com/doc/2006-03-01/">{entries}</ListBucketResult>'.encode()

    def listed_uploads(self, prefix):
        with self.objects.lock:
            found = sorted((key, name, begun) for name, (key, _, begun) in self.objects.uploads.items() if key.startswith(prefix))
        entries = "".join(f"<Upload><Key>{escape(key)}</Key><UploadId>{escape(name)}</UploadId><Initiated>{begun.isoformat()[:19]}.000Z</Initiated></Upload>"
                          for key, name, begun in found[:LISTED_MAX])
        return f"<ListMultipartUploadsResult>{entries}</ListMultipartUploadsResult>"


class S3Server(http.server.ThreadingHTTPServer):
    """Runs from the construction to `down`."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, port=0, objects=None):
        self.objects = objects or Objects()
        self.clients = []
        super().__init__(("127.0.0.1", port), type("Bound", (Handler,), {"objects": self.objects}))
        threading.Thread(target=self.serve_forever, args=(0.02,), daemon=True).start()

    def get_request(self):
        client, address = super().get_request()
        self.clients.append(client)
        return client, address

    def handle_error(self, *_):  # pylint: disable=arguments-differ
        pass  # a client that went away

    @property
    def endpoint(self):
        return f"http://127.0.0.1:{self.server_address[1]}"

    def down(self):
        self.shutdown()
        self.server_close()
        for client in self.clients:
            with contextlib.suppress(OSError):  # of a client that has ended
                client.shutdown(socket.SHUT_RDWR)

    def up(self):
        """The same objects at the same port."""
        return S3Server(self.server_address[1], self.objects)


def fetch(url):
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(url) as answer:
            return f"{answer.status} {hashlib.sha256(answer.read()).hexdigest()} {answer.headers['Content-Type']}"
    except urllib.error.HTTPError as error:
        return f"{error.code} {ElementTree.fromstring(error.read()).find('Code').text}"


def main():
    server = S3Server()
    print(server.endpoint, flush=True)
    for line in sys.stdin:
        command, *words = line.split()
        answer, objects = "done", server.objects
        questions = {"fetch": fetch, "begin": objects.begin, "requests": lambda: objects.requests, "uploads": lambda: len(objects.uploads)}
        if command == "status":
            objects.status = int(words[0])
            objects.faults["status"] = int(words[1])
        elif command in ("drop", "lose", "broken"):
            objects.faults[command] = int(words[0])
        elif command == "down":
            server.down()
        elif command == "up":
            server = server.up()
        elif command == "corrupt":
            objects.objects[words[0]] = b"x" + objects.objects[words[0]][1:]
        elif command == "age":
            for name, (key, parts, begun) in list(objects.uploads.items()):
                objects.uploads[name] = (key, parts, begun - datetime.timedelta(days=2))
        elif command in questions:
            answer = questions[command](*words)
        print(answer, flush=True)


if __name__ == "__main__":
    main()

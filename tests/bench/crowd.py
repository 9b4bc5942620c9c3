"""Many connections to one daemon, held by a process of their own: idle ones, slow request heads, event streams."""
import multiprocessing
import selectors
import socket
import time

HEAD = b"GET /v1/version HTTP/1.1\r\nHost: localhost\r\nX-Padding: " + b"x" * 4000


def connect(port):
    connection = socket.create_connection(("127.0.0.1", port), timeout=60)
    connection.setblocking(False)
    return connection


class Crowd(multiprocessing.Process):
    """Holds `sizes.idle`, `sizes.slow` and `sizes.streams` connections while the context is active.

    A slow head sends one byte per second. When the daemon closes it, another one takes its place.
    """

    def __init__(self, port, sizes):
        super().__init__(daemon=True)
        self.port, self.sizes = port, sizes
        self.parent, self.child = multiprocessing.Pipe()
        self.selector = None
        self.slow, self.events, self.expired_heads, self.closed = {}, 0, 0, 0

    def __enter__(self):
        self.start()
        self.parent.recv()  # all connections are open
        return self

    def __exit__(self, *_):
        self.terminate()
        self.join()

    def summary(self):
        """Counts of all events received, expired heads and other closed connections so far."""
        self.parent.send("summary")
        return self.parent.recv()

    def add(self, kind, text=b""):
        connection = connect(self.port)
        connection.sendall(text)
        self.selector.register(connection, selectors.EVENT_READ, kind)
        if kind == "slow":
            self.slow[connection] = 0

    def run(self):
        self.selector = selectors.DefaultSelector()
        for _ in range(self.sizes.idle):
            self.add("idle")
        for _ in range(self.sizes.streams):
            self.add("stream", b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
        for _ in range(self.sizes.slow):
            self.add("slow")
        self.child.send("open")
        next_byte = time.monotonic()
        while True:
            if time.monotonic() >= next_byte:
                next_byte += 1
                self.send_bytes()
            for key, _ in self.selector.select(max(0, next_byte - time.monotonic())):
                self.read(key)
            if self.child.poll():
                self.child.recv()
                self.child.send(f"{self.events} events in {self.sizes.streams} streams, {self.expired_heads} slow heads "
                                f"expired, {self.closed} other connections closed")

    def send_bytes(self):
        for connection, sent in list(self.slow.items()):
            try:
                self.slow[connection] += connection.send(HEAD[sent:sent + 1])
            except OSError:
                pass  # closed by the daemon: read() replaces it

    def read(self, key):
        try:
            text = key.fileobj.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            text = b""
        if key.data == "stream":
            self.events += text.count(b"\nevent: ")
        if text and key.data != "slow":
            return
        self.selector.unregister(key.fileobj)
        key.fileobj.close()
        if key.data == "slow":
            del self.slow[key.fileobj]
            self.expired_heads += 1
            self.add("slow")
        else:
            self.closed += 1

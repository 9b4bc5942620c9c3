"""A port that stays while daemons behind it come and go, and that loses replies and connections when it is told to."""
import contextlib
import socket
import threading

from tests.http.daemon import PATIENCE_S


class Relay:
    """Passes connections on to the port that `target()` gives. Use as a context manager."""

    def __init__(self, target):
        self.target = target
        self.replies_to_lose = 0   # of submissions: the request arrives, its answer does not
        self.cuts = 0              # connections that were open and are not any more
        self.streams = []          # of events
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        threading.Thread(target=self.accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()

    def cut(self):
        """All event streams there are."""
        streams, self.streams = self.streams, []
        for client in streams:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)
                self.cuts += 1

    def accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self.serve, args=(client,), daemon=True).start()

    def serve(self, client):
        with client, contextlib.suppress(OSError):
            server = socket.create_connection(("127.0.0.1", self.target()), timeout=PATIENCE_S)
            with server:
                lost = threading.Event()
                back = threading.Thread(target=self.pass_back, args=(server, client, lost), daemon=True)
                back.start()
                while piece := client.recv(65536):
                    if piece.startswith((b"POST /v1/jobs ", b"POST /v1/batches ")) and self.replies_to_lose > 0:
                        self.replies_to_lose -= 1
                        lost.set()
                    if piece.startswith(b"GET /v1/events "):
                        self.streams.append(client)
                    server.sendall(piece)
                server.shutdown(socket.SHUT_WR)
                back.join()

    @staticmethod
    def pass_back(server, client, lost):
        with contextlib.suppress(OSError):
            while piece := server.recv(65536):
                if lost.is_set():
                    break
                client.sendall(piece)
        for end in (client, server):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

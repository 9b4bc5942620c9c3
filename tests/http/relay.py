"""TCP relay on a fixed port in front of daemons that are restarted; it can drop responses and cut connections."""
import contextlib
import socket
import threading

from tests.http.daemon import PATIENCE_S


class Relay(contextlib.AbstractContextManager):
    """Forwards connections to the port that `target()` returns. Use as a context manager."""

    def __init__(self, target):
        self.target = target
        self.responses_to_lose = 0  # to submissions: the request arrives, its response is dropped
        self.cuts = 0               # event streams cut while they were open
        self.streams = []           # open event streams
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        threading.Thread(target=self.accept, daemon=True).start()

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()

    def cut_streams(self):
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
            threading.Thread(target=self.forward, args=(client,), daemon=True).start()

    def forward(self, client):
        with client, contextlib.suppress(OSError):
            server = socket.create_connection(("127.0.0.1", self.target()), timeout=PATIENCE_S)
            with server:
                lost = threading.Event()
                back = threading.Thread(target=self.forward_responses, args=(server, client, lost), daemon=True)
                back.start()
                while chunk := client.recv(65536):
                    if chunk.startswith((b"POST /v1/jobs ", b"POST /v1/batches ")) and self.responses_to_lose > 0:
                        self.responses_to_lose -= 1
                        lost.set()
                    if chunk.startswith(b"GET /v1/events "):
                        self.streams.append(client)
                    server.sendall(chunk)
                server.shutdown(socket.SHUT_WR)
                back.join()

    @staticmethod
    def forward_responses(server, client, lost):
        with contextlib.suppress(OSError):
            while chunk := server.recv(65536):
                if lost.is_set():
                    break
                client.sendall(chunk)
        for end in (client, server):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

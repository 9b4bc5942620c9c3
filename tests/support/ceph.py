"""A private S3-compatible server of Ceph for tests: one monitor, one object store in memory, one gateway, on loopback."""
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import uuid

import botocore.session
from botocore.config import Config

from tests.support.descendants import END_WITH_PARENT
from tests.support.s3 import ACCESS_KEY, BUCKET, REGION, SECRET_KEY

PATIENCE_S = 600
CONFIGURATION = """[global]
fsid = {fsid}
mon host = v1:127.0.0.1:{port}
auth cluster required = none
auth service required = none
auth client required = none
public addr = 127.0.0.1
ms bind msgr2 = false
mon data = {directory}/mon
osd data = {directory}/osd
osd objectstore = memstore
memstore device bytes = 2147483648
osd crush chooseleaf type = 0
osd pool default size = 1
osd pool default min size = 1
osd pool default pg num = 1
osd pool default pg autoscale mode = off
mon allow pool size one = true
mon max pg per osd = 1000
run dir = {directory}
admin socket = {directory}/$name.asok
log file = {directory}/$name.log
pid file =
keyring = /dev/null
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class CephServer:
    """Runs from the construction to `close`. `endpoint` has the bucket of tests.support.s3, with the same keys."""

    def __init__(self):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="ceph"))
        self.processes = []
        try:
            self.start()
        except BaseException:
            self.close()
            raise

    def start(self):
        port, fsid = free_port(), str(uuid.uuid4())
        (self.directory / "osd").mkdir()
        self.configuration = self.directory / "ceph.conf"
        self.configuration.write_text(CONFIGURATION.format(fsid=fsid, port=port, directory=self.directory), encoding="ascii")
        self.run("monmaptool", "--create", "--fsid", fsid, "--addv", "a", f"[v1:127.0.0.1:{port}]", self.directory / "monmap")
        self.run("ceph-mon", "--mkfs", "-i", "a", "--monmap", self.directory / "monmap")
        self.spawn("ceph-mon", "-f", "-i", "a")
        identity = str(uuid.uuid4())
        self.run("ceph", "--connect-timeout", PATIENCE_S, "osd", "new", identity)
        self.run("ceph-osd", "--mkfs", "-i", "0", "--osd-uuid", identity)
        self.spawn("ceph-osd", "-f", "-i", "0")
        self.run("radosgw-admin", "user", "create", "--uid=whittle", "--display-name=whittle", f"--access-key={ACCESS_KEY}", f"--secret={SECRET_KEY}")
        gateway = free_port()
        self.endpoint = f"http://127.0.0.1:{gateway}"
        self.spawn("radosgw", "-f", "-n", "client.rgw", f"--rgw-frontends=beast endpoint=127.0.0.1:{gateway}")
        self.create_bucket()

    def run(self, program, *words):
        subprocess.run([program, "-c", self.configuration, *map(str, words)] if program != "monmaptool" else [program, *map(str, words)],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=PATIENCE_S, cwd=self.directory)

    def spawn(self, program, *words):
        with open(self.directory / f"{program}.out", "wb") as output:
            # pylint: disable-next=consider-using-with
            self.processes.append(subprocess.Popen([*END_WITH_PARENT, program, "-c", self.configuration, *words], cwd=self.directory, stdout=output,
                                                   stderr=output))

    def create_bucket(self):
        client = botocore.session.get_session().create_client(
            "s3", region_name=REGION, endpoint_url=self.endpoint, aws_access_key_id=ACCESS_KEY, aws_secret_access_key=SECRET_KEY,
            config=Config(s3={"addressing_style": "path"}, retries={"max_attempts": 0}, proxies={}))
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                client.create_bucket(Bucket=BUCKET)
                return
            except (OSError, botocore.exceptions.BotoCoreError, botocore.exceptions.ClientError):
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)

    def close(self):
        for process in reversed(self.processes):
            process.kill()
            process.wait(PATIENCE_S)
        shutil.rmtree(self.directory)


if __name__ == "__main__":
    begin = time.monotonic()
    server = CephServer()
    print(f"{server.endpoint} after {time.monotonic() - begin:.1f} s, process {os.getpid()}")
    server.close()

"""Podman over a store of its own, below the build directory or in $WHITTLE_CONTAINERS: nothing of the machine's own
containers is seen or changed, and a second run finds the layers of the first.

Without systemd: health checks are run by hand, control groups are made directly.
"""
import functools
import os
import pathlib
import subprocess

from tests.support.sources import SOURCE

STORE = pathlib.Path(os.environ.get("WHITTLE_CONTAINERS") or SOURCE / "build" / "containers").resolve()
PATIENCE_S = 3600  # of one command: a whole build in the image, on a machine with better things to do

# runc: crun wants one kind of control groups or the other, and machines have both at once. A machine without
# CAP_SYS_RESOURCE cannot raise limits, so these are low. Locks are files: two stores must not share the ones in memory.
CONTAINERS_CONF = f"""
[containers]
default_ulimits = ["nofile=16384:16384", "nproc=16384:16384"]
log_driver = "k8s-file"
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
lock_type = "file"
tmp_dir = "{STORE}/state"
compat_api_enforce_docker_hub = false
[network]
network_backend = "netavark"
network_config_dir = "{STORE}/networks"
"""


def environment(driver):
    """Environment of podman and of the programs that start it."""
    STORE.mkdir(parents=True, exist_ok=True)
    (STORE / "containers.conf").write_text(CONTAINERS_CONF, encoding="ascii")
    storage = f'[storage]\ndriver = "{driver}"\ngraphroot = "{STORE}/{driver}"\nrunroot = "{STORE}/run"\n'
    (STORE / "storage.conf").write_text(storage, encoding="ascii")
    return {**os.environ, "CONTAINERS_CONF": str(STORE / "containers.conf"), "DISABLE_HC_SYSTEMD": "true",
            "CONTAINERS_STORAGE_CONF": str(STORE / "storage.conf")}


@functools.cache
def podman_environment():
    """With overlays where the store's file system bears them, else with copies, which start ten times slower."""
    for driver in ("overlay", "vfs"):
        found = environment(driver)
        info = subprocess.run(["podman", "info"], env=found, check=False, capture_output=True, text=True, timeout=PATIENCE_S)
        if info.returncode == 0:
            return found
    raise AssertionError(f"podman info: {info.stderr}")


def attempt(*arguments, **options):
    """`podman ARGUMENTS`, whatever becomes of it. In the store: of a container without memory podman leaves a file named
    oom where it was started."""
    return subprocess.run(["podman", *map(str, arguments)], env=podman_environment(), cwd=STORE, check=False,
                          capture_output=True, text=True, timeout=PATIENCE_S, **options)


def podman(*arguments, **options):
    """`podman ARGUMENTS`; what it printed."""
    done = attempt(*arguments, **options)
    if done.returncode != 0:
        raise AssertionError(f"podman {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def has_image(name):
    return attempt("image", "exists", name).returncode == 0

"""Abilities of containers on this machine. Each function returns "" for one that is there, else a sentence with the reason.

The kernel and Debian's own tools are queried, never the container engine: what the machine forbids is skipped with its
reason, and what the engine then gets wrong is a failure.
"""
import functools
import os
import pathlib
import shutil
import subprocess
import tempfile
import urllib.parse

CGROUPS = pathlib.Path("/sys/fs/cgroup")


def answer_of(*command):
    """Exit code, and the last line of the output."""
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=600)
    except (OSError, subprocess.TimeoutExpired) as failure:
        return 1, str(failure)
    return done.returncode, (done.stderr.strip() or done.stdout.strip()).rpartition("\n")[2]


def why_no(*tools):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    return f"not installed: {', '.join(missing)}" if missing else ""


def why_no_limits():
    """Limits of memory and of processes are the control groups', without which runc starts nothing."""
    if (CGROUPS / "cgroup.controllers").exists():
        offered = (CGROUPS / "cgroup.controllers").read_text(encoding="ascii").split()
        parents = {"memory": CGROUPS, "pids": CGROUPS}
    else:
        parents = {name: CGROUPS / name for name in ("memory", "pids")}
        offered = [name for name, parent in parents.items() if parent.is_dir()]
    for name, parent in parents.items():
        if name not in offered:
            return f"the kernel offers no control group for {name} here"
        try:
            os.rmdir(tempfile.mkdtemp(prefix="whittle-", dir=parent))
        except OSError as failure:
            return f"no control group can be made here: {failure}"
    return ""


@functools.cache
def why_no_containers():
    if os.geteuid() != 0:
        return "the store of images and the base image are made by root, and this is another user"
    if reason := why_no("podman", "runc", "debootstrap", "unshare", "ip"):
        return reason
    code, output = answer_of("unshare", "--mount", "--pid", "--net", "--ipc", "--uts", "--fork",
                             "mount", "-t", "tmpfs", "tmpfs", "/mnt")
    if code:
        return f"namespaces or mounts are forbidden here: {output}"
    return why_no_limits()


@functools.cache
def why_no_networks():
    """A network of several containers: a bridge, pairs of interfaces, rules of the packet filter."""
    if reason := why_no("ip", "iptables"):
        return reason
    for command in (["ip", "link", "add", "whittle0", "type", "bridge"],
                    ["ip", "link", "add", "whittle1", "type", "veth", "peer", "name", "whittle2"],
                    ["iptables", "--table", "nat", "--list"]):
        code, output = answer_of("unshare", "--net", *command)
        if code:
            return f"\"{' '.join(command)}\" is impossible here: {output}"
    return ""


@functools.cache
def debian_mirror():
    """Address of the server from which this machine installs Debian 12."""
    _, output = answer_of("apt-get", "indextargets", "--format", "$(SITE)", "Codename: bookworm", "Component: main",
                          "Created-By: Packages")
    return output


@functools.cache
def why_no_packages():
    """apt's own downloader, so that its proxies and keys hold."""
    mirror = debian_mirror()
    if urllib.parse.urlsplit(mirror).scheme not in ("http", "https"):
        return "apt has no list of Debian 12's packages from a server; apt-get update?"
    with tempfile.TemporaryDirectory() as directory:
        code, output = answer_of("/usr/lib/apt/apt-helper", "download-file", f"{mirror}/dists/bookworm/InRelease", f"{directory}/x")
    return f"Debian's packages cannot be fetched here: {output}" if code else ""

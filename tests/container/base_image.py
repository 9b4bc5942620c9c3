"""debian:bookworm-slim, which the Dockerfiles start from: pulled, or else made here from this machine's own Debian mirror."""
import pathlib
import shutil
import subprocess
import unittest

from tests.container import machine
from tests.container.engine import PATIENCE_S, STORE, attempt, has_image, podman

NAME = "docker.io/library/debian:bookworm-slim"

# As in the published image: no documents, no caches, and no syncs, since a build that a power cut ends starts anew.
DPKG_SETTINGS = """path-exclude /usr/share/doc/*
path-include /usr/share/doc/*/copyright
path-exclude /usr/share/man/*
path-exclude /usr/share/info/*
path-exclude /usr/share/locale/*
path-exclude /usr/share/lintian/*
force-unsafe-io
"""
APT_SETTINGS = 'Acquire::Languages "none";\nDir::Cache::pkgcache "";\nDir::Cache::srcpkgcache "";\nAPT::Keep-Downloaded-Packages "false";\n'
NOT_NEEDED = ("usr/share/man", "usr/share/info", "usr/share/locale", "usr/share/lintian", "var/cache/apt", "var/lib/apt/lists")


def of_this_machine(root):
    """Settings of the packages' sources: the mirror, its keys, a proxy."""
    apt = pathlib.Path("/etc/apt")
    for path in (apt / "sources.list", apt / "sources.list.d" / "debian.sources"):
        (root / path.relative_to("/")).unlink(missing_ok=True)
        if path.exists():
            shutil.copy(path, root / path.relative_to("/"))
    settings = subprocess.run(["apt-config", "dump"], check=True, capture_output=True, text=True).stdout.splitlines()
    ours = [line for line in settings if line.startswith(("Acquire::http", "Acquire::Check-", "Acquire::Retries"))]
    return "\n".join(ours) + "\n"


def make(root):
    shutil.rmtree(root, ignore_errors=True)
    made = subprocess.run(["debootstrap", "--variant=minbase", "bookworm", root, machine.debian_mirror()], check=False,
                          capture_output=True, text=True, timeout=PATIENCE_S)
    if made.returncode != 0:
        raise AssertionError(f"debootstrap: exit code {made.returncode}\n{made.stdout[-2000:]}{made.stderr}")
    for path in NOT_NEEDED:
        shutil.rmtree(root / path, ignore_errors=True)
    (root / "etc/dpkg/dpkg.cfg.d/image").write_text(DPKG_SETTINGS, encoding="ascii")
    (root / "etc/apt/apt.conf.d/image").write_text(APT_SETTINGS + of_this_machine(root), encoding="ascii")
    policy = root / "usr/sbin/policy-rc.d"
    policy.write_text("#!/bin/sh\nexit 101\n", encoding="ascii")  # services of packages are not started
    policy.chmod(0o755)


def by_digest():
    """The image, named so that no other can take its place."""
    return podman("image", "inspect", "--format", "{{index .RepoDigests 0}}", NAME)


def ensure():
    """Skips the test where there is no way to the image."""
    if has_image(NAME):
        return
    if attempt("pull", "--quiet", NAME).returncode == 0:
        return
    if reason := machine.why_no_packages():
        raise unittest.SkipTest(f"{NAME} can neither be pulled nor made: {reason}")
    root = STORE / "base"
    make(root)
    packed = STORE / "base.tar"
    subprocess.run(["tar", "--create", "--file", packed, "--directory", root, "."], check=True, timeout=PATIENCE_S)
    podman("import", "--quiet", "--change", "ENV PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", packed, NAME)
    packed.unlink()
    shutil.rmtree(root)

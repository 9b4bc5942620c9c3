"""The images, from the unchanged Dockerfiles: made once in a process, and of what is new only in a store that has them."""
import functools
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from tests.container import base_image, machine
from tests.container.engine import attempt, has_image, podman
from tests.http.daemon import BIN
from tests.support.sources import SOURCE

# The whole build in the image, in place of the one outside: --compile of tests/container/run.
COMPILE = bool(os.environ.get("WHITTLE_CONTAINER_COMPILE"))
PROGRAMS = ("whittle", "whittled", "whittled-worker")


# Made before, by main: the tests need no network then.
MADE = bool(os.environ.get("WHITTLE_IMAGES_MADE"))


def build(name, context, *options, file="Dockerfile"):
    """`chroot`: the steps of a build run as this machine's root does, in containers of it too. Docker's format has the
    health check, which OCI's has no place for."""
    podman("build", "--isolation", "chroot", "--network", "host", "--layers", "--format", "docker", "--tag", name,
           "--build-arg", f"BASE={base_image.by_digest()}", "--file", pathlib.Path(context) / file, *options, context)


def npm_options(directory):
    """Options of a build that give npm this machine's registry and certificates. Only the stage that compiles has them."""
    registry = subprocess.run(["npm", "config", "get", "registry"], check=True, capture_output=True, text=True).stdout.strip()
    settings, options = [f"registry={registry}"], []
    if certificates := os.environ.get("NODE_EXTRA_CA_CERTS"):
        settings.append("cafile=/etc/npm-certificates.pem")
        options += ["--volume", f"{certificates}:/etc/npm-certificates.pem:ro"]
    npmrc = pathlib.Path(directory, "npmrc")
    npmrc.write_text("\n".join(settings) + "\n", encoding="utf-8")
    return [*options, "--volume", f"{npmrc}:/root/.npmrc:ro"]


@functools.cache
def whittle():
    """The name of the daemon's image. Skips the test on a machine that bears none."""
    if reason := machine.why_no_containers():
        raise unittest.SkipTest(reason)
    if MADE:
        return made("localhost/whittle")
    base_image.ensure()
    remove_leftovers()
    options = ["--build-arg", "VERSION=0.1.0", "--build-arg", "REVISION=test"]
    if COMPILE:
        build("whittle-libraries", SOURCE, "--target", "libraries", file="docker/Dockerfile")
        with tempfile.TemporaryDirectory() as directory:
            build("whittle", SOURCE, *options, *npm_options(directory), "--build-arg", "PROGRAMS=compile", file="docker/Dockerfile")
    else:
        with tempfile.TemporaryDirectory() as context:
            ready_programs(pathlib.Path(context))
            build("whittle-libraries", context, "--target", "libraries", file="docker/Dockerfile")
            build("whittle", context, *options, "--build-arg", "PROGRAMS=ready", file="docker/Dockerfile")
    return made("localhost/whittle")


def remove_leftovers():
    """Removes what a killed run left. The store is the tests' own."""
    podman("pod", "rm", "--all", "--force")
    podman("rm", "--all", "--force", "--volumes")
    podman("volume", "prune", "--force")
    podman("secret", "rm", "--all")


def ready_programs(context):
    """A checkout as the Dockerfile's PROGRAMS=ready wants it, with the programs that the other tests try."""
    shutil.copytree(SOURCE / "docker", context / "docker", ignore=shutil.ignore_patterns("secrets"))
    shutil.copy(SOURCE / ".dockerignore", context)
    release = context / "build" / "release"
    (release / "bin").mkdir(parents=True)
    for program in PROGRAMS:
        shutil.copy2(BIN / program, release / "bin")
    shutil.copytree(BIN.parent / "lib" / "whittle", release / "lib" / "whittle")


@functools.cache
def proxy():
    """The name of the TLS proxy's image."""
    whittle()
    if not MADE:
        build("whittle-proxy", SOURCE / "docker" / "proxy")
    return made("localhost/whittle-proxy")


DATABASE = "docker.io/library/postgres:15-bookworm"


@functools.cache
def database():
    """The name of PostgreSQL's image: the official one, or else one of Debian's packages."""
    whittle()
    if not MADE and not has_image(DATABASE) and attempt("pull", "--quiet", DATABASE).returncode != 0:
        build(DATABASE, SOURCE / "tests" / "container" / "database")
    return made(DATABASE)


def made(name):
    """`name`, if there is such an image: where there is none, main printed the reason."""
    if not has_image(name):
        raise unittest.SkipTest(machine.why_no_packages() or f"there is no image {name}")
    return name


if __name__ == "__main__":
    try:
        whittle()
        proxy()
        database()
        # Stages without a name: what the last programs were copied through, a gigabyte each time. The libraries have one.
        podman("image", "prune", "--force")
    except unittest.SkipTest as reason:
        print(f"no images: {reason}")

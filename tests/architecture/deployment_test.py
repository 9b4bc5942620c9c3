"""The Dockerfiles, Compose and Kubernetes files are valid and confine the service."""
import json
import pathlib
import re
import shlex
import tempfile
import unittest

import yaml

from tests.support.sources import SOURCE, run, text, tracked
from tests.support.kubernetes import check_document

DOCKERFILES = [path for path in tracked() if path.name == "Dockerfile"]
YAML = [path for path in tracked(".yaml", ".yml")]
YAML_RULES = """{extends: default, rules: {document-start: disable, line-length: disable, comments-indentation: disable,
                 braces: {max-spaces-inside: 0}, truthy: {check-keys: true}}}"""


def documents(pattern):
    return [(path, document) for path in sorted((SOURCE / "docker" / "k8s").glob(pattern))
            for document in yaml.safe_load_all(path.read_text(encoding="utf-8"))]


def instructions(path):
    """[(keyword, rest)] of a Dockerfile, with continued lines joined and without comments."""
    lines = [line for line in text(path).splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n", " ", "\n".join(lines))
    return [tuple(line.split(maxsplit=1)) for line in joined.splitlines() if line.strip()]


class BillOfMaterials(unittest.TestCase):
    def test_names_packages_and_versions_of_the_libraries(self):
        with tempfile.TemporaryDirectory() as root:
            library = next(pathlib.Path("/lib").glob("*-linux-gnu/libz.so.1"))
            lib = pathlib.Path(root, "usr/lib")
            lib.mkdir(parents=True)
            (lib / library.resolve().name).write_bytes(library.read_bytes())
            (lib / "of_no_package.so").write_bytes(b"")
            made = run(SOURCE / "docker/sbom", root)
        document = json.loads(made.stdout)
        self.assertEqual((document["spdxVersion"], made.stderr), ("SPDX-2.3", ""))
        version = run("dpkg-query", "--show", "--showformat=${Version}", "zlib1g").stdout
        found = {package["name"]: package["versionInfo"] for package in document["packages"]}
        self.assertEqual(found["zlib1g"], version)


class Dockerfiles(unittest.TestCase):
    def test_are_all_checked(self):
        self.assertEqual([str(path) for path in DOCKERFILES], ["docker/Dockerfile", "docker/proxy/Dockerfile",
                                                                   "tests/container/database/Dockerfile"])

    def test_use_no_outdated_instruction(self):
        known = {"ARG", "COPY", "ENTRYPOINT", "ENV", "EXPOSE", "FROM", "HEALTHCHECK", "LABEL", "RUN", "STOPSIGNAL", "USER",
                 "VOLUME", "WORKDIR"}  # not ADD, which fetches and unpacks; not MAINTAINER, ONBUILD, SHELL, CMD
        for path in DOCKERFILES:
            self.assertEqual({keyword for keyword, _ in instructions(path)} - known, set(), path)
            self.assertNotIn("# syntax=", text(path), f"{path}: the parser would be fetched")

    def test_start_from_a_named_release_of_debian_or_a_stage(self):
        for path in DOCKERFILES:
            stages = {"scratch", "${PROGRAMS}", "${BASE}"}
            self.assertIn(("ARG", "BASE=debian:bookworm-slim"), instructions(path), path)
            for keyword, rest in instructions(path):
                if keyword == "FROM":
                    image, *alias = rest.split(" AS ")
                    self.assertIn(image, stages, path)
                    stages |= set(alias)
                if keyword == "COPY" and (source := re.search(r"--from=(\S+)", rest)):
                    self.assertIn(source.group(1), stages, path)

    def test_install_only_named_packages_and_delete_package_lists(self):
        for path in DOCKERFILES:
            for keyword, rest in instructions(path):
                self.assertNotRegex(rest, r"apt-get (upgrade|dist-upgrade)|\bsudo\b|\|\s*(ba)?sh\b", path)
                if keyword == "RUN" and "apt-get" in rest:
                    self.assertIn("apt-get update", rest)
                    self.assertTrue(rest.rstrip().endswith("rm -rf /var/lib/apt/lists/*"), f"{path}: {rest}")
                    if "apt-get install" in rest:
                        self.assertRegex(rest, r"apt-get install (\S+ )*-y --no-install-recommends")

    def test_run_commands_that_pass_shellcheck(self):
        for path in DOCKERFILES:
            script = "\n".join(rest for keyword, rest in instructions(path) if keyword == "RUN")
            done = run("shellcheck", "--shell=sh", "--enable=all", "--exclude=SC2250,SC2312", "-", input=script)
            self.assertEqual(done.returncode, 0, f"{path}\n{done.stdout}")

    def test_run_as_unprivileged_user_with_stop_signal(self):
        for path in DOCKERFILES:
            steps = instructions(path)
            last = steps[max(i for i, step in enumerate(steps) if step[0] == "FROM"):]
            found = dict(last)
            self.assertNotIn(found["USER"].split(":")[0], ("root", "0"), path)
            self.assertIsInstance(json.loads(found["ENTRYPOINT"]), list, path)
            self.assertIn(found["STOPSIGNAL"], ("SIGTERM", "SIGQUIT"), path)
            for keyword, rest in last:
                if keyword in ("ENV", "ARG", "LABEL"):
                    self.assertNotRegex(rest, r"(?i)passw|secret|token|\bkey", path)

    def test_install_packages_of_the_package_list(self):
        listed = set(run(SOURCE / "docker/install", "--list").stdout.split())
        for _, rest in instructions("docker/proxy/Dockerfile"):
            for command in rest.split("&&"):
                words = shlex.split(command)
                if words[:2] == ["apt-get", "install"]:
                    self.assertLessEqual({word for word in words[2:] if not word.startswith("-")}, listed | {"nginx-light"})


class Yaml(unittest.TestCase):
    def test_passes_yamllint(self):
        self.assertGreaterEqual(len(YAML), 8)
        done = run("yamllint", "--strict", "--config-data", YAML_RULES, *map(str, YAML), cwd=SOURCE)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Compose(unittest.TestCase):
    def test_is_valid(self):
        done = run("docker-compose", "--file", "docker/compose.yaml", "--profile", "tls", "--profile", "cluster", "config", "--quiet",
                   cwd=SOURCE)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_confines_every_service(self):
        services = yaml.safe_load(text("docker/compose.yaml"))["services"]
        for name, service in services.items():
            self.assertTrue(service["read_only"], name)
            self.assertEqual(service["cap_drop"], ["ALL"], name)
            self.assertEqual(service["security_opt"], ["no-new-privileges:true"], name)
            self.assertEqual(service["restart"], "unless-stopped", name)
            self.assertTrue(service["mem_limit"] and service["pids_limit"], name)
            self.assertEqual(set(service) & {"privileged", "cap_add", "network_mode", "pid", "userns_mode", "devices"}, set())
        (published,) = services["whittle"]["ports"]
        self.assertTrue(published.startswith("127.0.0.1:"), "remote clients use the proxy, which has TLS")

    def test_limits_jobs_to_the_memory_of_the_daemon(self):
        service = yaml.safe_load(text("docker/compose.yaml"))["services"]["whittle"]
        (limit,) = [int(word.partition("=")[2]) for word in service["command"] if word.startswith("--job-memory-bytes=")]
        self.assertEqual(service["mem_limit"], "4g")
        self.assertEqual(limit * 4, 3 * 4 * 2**30)


class Kubernetes(unittest.TestCase):
    def setUp(self):
        self.one = {document["kind"]: document for _, document in documents("*.yaml")}
        self.pod = self.one["Deployment"]["spec"]["template"]["spec"]
        (self.container,) = self.pod["containers"]

    def test_has_only_fields_of_its_kind(self):
        for path, document in documents("**/*.yaml"):
            self.assertEqual(check_document(document), [], path.name)

    def test_lists_every_file_but_that_of_keda(self):
        for pattern in ("*.yaml", "overlays/cluster/*.yaml"):
            files = {path.name: document for path, document in documents(pattern)}
            self.assertEqual(set(files["kustomization.yaml"]["resources"]), set(files) - {"kustomization.yaml", "keda.yaml"})

    def test_satisfies_the_restricted_pod_security_standard(self):
        """Kubernetes, "Pod Security Standards", profile Restricted (and so Baseline)."""
        pod, container = self.pod["securityContext"], self.container["securityContext"]
        self.assertIs(pod["runAsNonRoot"], True)
        self.assertGreater(pod["runAsUser"], 0)
        self.assertEqual(pod["seccompProfile"], {"type": "RuntimeDefault"})
        self.assertIs(container["allowPrivilegeEscalation"], False)
        self.assertEqual(container["capabilities"], {"drop": ["ALL"]})
        self.assertEqual(set(self.pod) & {"hostNetwork", "hostPID", "hostIPC"}, set())
        kinds = {kind for volume in self.pod["volumes"] for kind in volume if kind != "name"}
        self.assertLessEqual(kinds, {"configMap", "csi", "downwardAPI", "emptyDir", "ephemeral", "persistentVolumeClaim",
                                     "projected", "secret"})
        self.assertNotIn("hostPort", str(self.container["ports"]))

    def test_has_no_unused_privileges(self):
        self.assertIs(self.container["securityContext"]["readOnlyRootFilesystem"], True)
        self.assertIs(self.pod["automountServiceAccountToken"], False)
        mounted = {mount["name"] for mount in self.container["volumeMounts"]}
        self.assertEqual(mounted, {volume["name"] for volume in self.pod["volumes"]})

    def test_runs_as_the_user_of_the_image(self):
        user = dict(instructions("docker/Dockerfile"))["USER"]
        context = self.pod["securityContext"]
        self.assertEqual(user, f"{context['runAsUser']}:{context['runAsGroup']}")
        self.assertEqual(context["fsGroup"], context["runAsGroup"])

    def test_limits_jobs_to_the_memory_of_the_daemon(self):
        resources = self.container["resources"]
        self.assertEqual(resources["requests"]["memory"], resources["limits"]["memory"])
        settings = self.one["ConfigMap"]["data"]["whittle.conf"]
        limit = int(re.search(r"^job_memory_bytes = (\d+)$", settings, re.MULTILINE).group(1))
        self.assertEqual(resources["limits"]["memory"], "4Gi")
        self.assertEqual(limit * 4, 3 * 4 * 2**30)

    def test_has_consistent_names(self):
        labels = self.one["Deployment"]["spec"]["template"]["metadata"]["labels"]
        self.assertEqual(self.one["Deployment"]["spec"]["selector"]["matchLabels"], labels)
        self.assertEqual(self.one["Service"]["spec"]["selector"], labels)
        self.assertEqual(self.one["NetworkPolicy"]["spec"]["podSelector"]["matchLabels"], labels)
        ports = {port["name"]: port["containerPort"] for port in self.container["ports"]}
        self.assertIn(self.one["Service"]["spec"]["ports"][0]["targetPort"], ports)
        allowed = {port["port"] for port in self.one["NetworkPolicy"]["spec"]["ingress"][0]["ports"]}
        self.assertEqual(allowed, set(ports.values()))
        volumes = {volume["name"]: volume for volume in self.pod["volumes"]}
        self.assertEqual(volumes["data"]["persistentVolumeClaim"]["claimName"], self.one["PersistentVolumeClaim"]["metadata"]["name"])
        self.assertEqual(volumes["config"]["configMap"]["name"], self.one["ConfigMap"]["metadata"]["name"])


class KubernetesCluster(unittest.TestCase):
    """The overlay of nodes that share a database and a bucket."""

    def setUp(self):
        self.named = {(document["kind"], document.get("metadata", {}).get("name")): document
                      for _, document in documents("overlays/cluster/*.yaml")}
        self.deployments = {role: self.named["Deployment", f"whittle-{role}"]["spec"] for role in ("api", "worker")}

    def test_pods_are_those_of_the_single_service(self):
        single = next(document for _, document in documents("deployment.yaml"))["spec"]["template"]["spec"]
        for role, deployment in self.deployments.items():
            pod = deployment["template"]["spec"]
            for name in ("automountServiceAccountToken", "enableServiceLinks", "securityContext"):
                self.assertEqual(pod[name], single[name], role)
            for name in ("image", "securityContext", "resources", "livenessProbe", "readinessProbe", "startupProbe", "volumeMounts"):
                self.assertEqual(pod["containers"][0][name], single["containers"][0][name], (role, name))

    def test_nodes_drain_before_they_are_killed(self):
        for role, deployment in self.deployments.items():
            (container,) = deployment["template"]["spec"]["containers"]
            arguments = dict(zip(container["args"][::2], container["args"][1::2]))
            self.assertEqual(arguments["--role"], role)
            self.assertGreaterEqual(deployment["template"]["spec"]["terminationGracePeriodSeconds"], int(arguments["--drain-s"]) + 15)
            self.assertEqual(deployment["strategy"]["type"], "RollingUpdate")

    def test_has_consistent_names(self):
        for role, deployment in self.deployments.items():
            labels = deployment["template"]["metadata"]["labels"]
            self.assertEqual(deployment["selector"]["matchLabels"], labels)
            self.assertEqual(self.named["PodDisruptionBudget", f"whittle-{role}"]["spec"]["selector"]["matchLabels"], labels)
        self.assertEqual(self.named["Service", "whittle-cluster"]["spec"]["selector"],
                         self.deployments["api"]["template"]["metadata"]["labels"])
        for kind in ("HorizontalPodAutoscaler", "ScaledObject"):
            self.assertEqual(self.named[kind, "whittle-worker"]["spec"]["scaleTargetRef"]["name"], "whittle-worker")
        pairs = self.named["Kustomization", None]["labels"][0]["pairs"]
        self.assertEqual(self.named["NetworkPolicy", "whittle-cluster"]["spec"]["podSelector"]["matchLabels"], pairs)

    def test_scales_by_a_metric_that_the_service_has(self):
        comment = (SOURCE / "docker/k8s/overlays/cluster/autoscaler.yaml").read_text(encoding="utf-8")
        metric = self.named["HorizontalPodAutoscaler", "whittle-worker"]["spec"]["metrics"][0]["external"]["metric"]["name"]
        self.assertIn(f"name: {{as: {metric}}}", comment)
        source = text("server/telemetry/service_metrics.cpp")
        for name in re.findall(r"whittle_\w+(?=\{)", comment):
            self.assertIn(f'"{name}"', source)

"""Schemas of the Kubernetes documents (API reference, 1.27) that docker/k8s uses; they reject unknown fields.

A cluster ignores a field whose name is misspelt, so that a probe or a limit would silently be missing.
"""
import jsonschema

TEXT = {"type": "string", "minLength": 1}
NAME = {"type": "string", "pattern": r"^[a-z0-9]([a-z0-9.-]{0,61}[a-z0-9])?$"}
COUNT = {"type": "integer", "minimum": 0}
FLAG = {"type": "boolean"}
PORT = {"oneOf": [{"type": "integer", "minimum": 1, "maximum": 65535}, NAME]}
QUANTITY = {"type": "string", "pattern": r"^\d+(\.\d+)?(m|k|M|G|T|Ki|Mi|Gi|Ti)?$"}
STRINGS = {"type": "object", "additionalProperties": {"type": "string"}}


def array_of(item):
    return {"type": "array", "items": item, "minItems": 1}


def one_of(*values):
    return {"enum": list(values)}


def fields(required=(), **known):
    return {"type": "object", "properties": known, "required": list(required), "additionalProperties": False}


METADATA = fields(["name"], name=NAME, labels=STRINGS, annotations=STRINGS, namespace=NAME)
SELECTOR = fields(["matchLabels"], matchLabels=STRINGS)
PROBE = fields(["httpGet"], httpGet=fields(["path", "port"], path=TEXT, port=PORT, scheme=one_of("HTTP", "HTTPS")),
               periodSeconds=COUNT, timeoutSeconds=COUNT, failureThreshold=COUNT, initialDelaySeconds=COUNT)
RESOURCES = fields(requests=fields(cpu=QUANTITY, memory=QUANTITY, storage=QUANTITY),
                   limits=fields(cpu=QUANTITY, memory=QUANTITY, storage=QUANTITY))
CONTAINER = fields(
    ["name", "image", "resources", "securityContext", "startupProbe", "livenessProbe", "readinessProbe"],
    name=NAME, image=TEXT, imagePullPolicy=one_of("IfNotPresent", "Always", "Never"), args=array_of(TEXT),
    envFrom=array_of(fields(["secretRef"], secretRef=fields(["name"], name=NAME, optional=FLAG))),
    ports=array_of(fields(["containerPort"], name=NAME, containerPort=PORT, protocol=one_of("TCP", "UDP"))),
    securityContext=fields(allowPrivilegeEscalation=FLAG, readOnlyRootFilesystem=FLAG,
                           capabilities=fields(["drop"], drop=array_of(TEXT))),
    resources=RESOURCES, startupProbe=PROBE, livenessProbe=PROBE, readinessProbe=PROBE,
    volumeMounts=array_of(fields(["name", "mountPath"], name=NAME, mountPath=TEXT, readOnly=FLAG, subPath=TEXT)))
VOLUME = fields(["name"], name=NAME, emptyDir=fields(sizeLimit=QUANTITY, medium=TEXT), configMap=fields(["name"], name=NAME),
                secret=fields(["secretName"], secretName=NAME, optional=FLAG, defaultMode=COUNT),
                persistentVolumeClaim=fields(["claimName"], claimName=NAME))
POD = fields(
    ["containers"], automountServiceAccountToken=FLAG, enableServiceLinks=FLAG, terminationGracePeriodSeconds=COUNT,
    securityContext=fields(runAsNonRoot=FLAG, runAsUser=COUNT, runAsGroup=COUNT, fsGroup=COUNT,
                           fsGroupChangePolicy=one_of("Always", "OnRootMismatch"),
                           seccompProfile=fields(["type"], type=one_of("RuntimeDefault", "Localhost"))),
    containers=array_of(CONTAINER), volumes=array_of(VOLUME))
TARGET = fields(["name"], apiVersion=TEXT, kind=TEXT, name=NAME)
POLICY_PORTS = array_of(fields(["port"], port=PORT, protocol=one_of("TCP", "UDP")))
KINDS = {
    ("v1", "ConfigMap"): {"data": STRINGS},
    ("v1", "PersistentVolumeClaim"): {"spec": fields(
        ["accessModes", "resources"], accessModes=array_of(one_of("ReadWriteOnce", "ReadWriteOncePod", "ReadWriteMany")),
        resources=RESOURCES, storageClassName=NAME)},
    ("v1", "Service"): {"spec": fields(
        ["selector", "ports"], selector=STRINGS, type=one_of("ClusterIP", "NodePort", "LoadBalancer"),
        ports=array_of(fields(["port"], name=NAME, port=PORT, targetPort=PORT, protocol=one_of("TCP", "UDP"))))},
    ("apps/v1", "Deployment"): {"spec": fields(
        ["selector", "template"], replicas=COUNT, strategy=fields(["type"], type=one_of("Recreate", "RollingUpdate")),
        selector=SELECTOR,
        template=fields(["metadata", "spec"], metadata=fields(["labels"], labels=STRINGS, annotations=STRINGS), spec=POD))},
    ("networking.k8s.io/v1", "NetworkPolicy"): {"spec": fields(
        ["podSelector", "policyTypes"], podSelector=SELECTOR, policyTypes=array_of(one_of("Ingress", "Egress")),
        ingress=array_of(fields(ports=POLICY_PORTS)), egress=array_of(fields(ports=POLICY_PORTS)))},
    ("policy/v1", "PodDisruptionBudget"): {"spec": fields(["selector"], selector=SELECTOR, minAvailable=COUNT, maxUnavailable=COUNT)},
    ("autoscaling/v2", "HorizontalPodAutoscaler"): {"spec": fields(
        ["scaleTargetRef", "maxReplicas", "metrics"], scaleTargetRef=TARGET, minReplicas=COUNT, maxReplicas=COUNT,
        behavior=fields(scaleDown=fields(stabilizationWindowSeconds=COUNT), scaleUp=fields(stabilizationWindowSeconds=COUNT)),
        metrics=array_of(fields(["type", "external"], type=one_of("External"), external=fields(
            ["metric", "target"], metric=fields(["name"], name=TEXT),
            target=fields(["type", "averageValue"], type=one_of("AverageValue"), averageValue=QUANTITY)))))},
    # KEDA 2: "Scaling Deployments", "Prometheus scaler".
    ("keda.sh/v1alpha1", "ScaledObject"): {"spec": fields(
        ["scaleTargetRef", "triggers"], scaleTargetRef=TARGET, minReplicaCount=COUNT, maxReplicaCount=COUNT,
        cooldownPeriod=COUNT, pollingInterval=COUNT,
        triggers=array_of(fields(["type", "metadata"], type=one_of("prometheus"), metadata=fields(
            ["serverAddress", "query", "threshold"], serverAddress=TEXT, query=TEXT, threshold=TEXT))))},
    ("kustomize.config.k8s.io/v1beta1", "Kustomization"): {
        "resources": array_of(TEXT), "labels": array_of(fields(["pairs"], pairs=STRINGS, includeSelectors=FLAG))},
}


def check_document(document):
    """Returns the errors, each with its JSON pointer."""
    kind = (document.get("apiVersion"), document.get("kind"))
    if kind not in KINDS:
        return [f"/: {kind} is unknown"]
    metadata = {} if kind[1] == "Kustomization" else {"metadata": METADATA}
    schema = fields(["apiVersion", "kind", *metadata, *KINDS[kind]], apiVersion=TEXT, kind=TEXT, **metadata, **KINDS[kind])
    errors = jsonschema.Draft202012Validator(schema).iter_errors(document)
    return [f"/{'/'.join(map(str, error.absolute_path))}: {error.message}" for error in errors]

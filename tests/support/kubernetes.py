"""The fields of Kubernetes' documents (API reference, 1.27) as far as docker/k8s uses their kinds; unknown ones are told.

A field that is mistyped is ignored by the cluster, and a probe or a limit is then not there.
"""
import jsonschema

TEXT = {"type": "string", "minLength": 1}
NAME = {"type": "string", "pattern": r"^[a-z0-9]([a-z0-9.-]{0,61}[a-z0-9])?$"}
COUNT = {"type": "integer", "minimum": 0}
FLAG = {"type": "boolean"}
PORT = {"oneOf": [{"type": "integer", "minimum": 1, "maximum": 65535}, NAME]}
QUANTITY = {"type": "string", "pattern": r"^\d+(\.\d+)?(m|k|M|G|T|Ki|Mi|Gi|Ti)?$"}
WORDS = {"type": "object", "additionalProperties": {"type": "string"}}


def some(item):
    return {"type": "array", "items": item, "minItems": 1}


def one_of(*values):
    return {"enum": list(values)}


def fields(required=(), **known):
    return {"type": "object", "properties": known, "required": list(required), "additionalProperties": False}


METADATA = fields(["name"], name=NAME, labels=WORDS, annotations=WORDS, namespace=NAME)
SELECTOR = fields(["matchLabels"], matchLabels=WORDS)
PROBE = fields(["httpGet"], httpGet=fields(["path", "port"], path=TEXT, port=PORT, scheme=one_of("HTTP", "HTTPS")),
               periodSeconds=COUNT, timeoutSeconds=COUNT, failureThreshold=COUNT, initialDelaySeconds=COUNT)
RESOURCES = fields(requests=fields(cpu=QUANTITY, memory=QUANTITY, storage=QUANTITY),
                   limits=fields(cpu=QUANTITY, memory=QUANTITY, storage=QUANTITY))
CONTAINER = fields(
    ["name", "image", "resources", "securityContext", "startupProbe", "livenessProbe", "readinessProbe"],
    name=NAME, image=TEXT, imagePullPolicy=one_of("IfNotPresent", "Always", "Never"), args=some(TEXT),
    ports=some(fields(["containerPort"], name=NAME, containerPort=PORT, protocol=one_of("TCP", "UDP"))),
    securityContext=fields(allowPrivilegeEscalation=FLAG, readOnlyRootFilesystem=FLAG,
                           capabilities=fields(["drop"], drop=some(TEXT))),
    resources=RESOURCES, startupProbe=PROBE, livenessProbe=PROBE, readinessProbe=PROBE,
    volumeMounts=some(fields(["name", "mountPath"], name=NAME, mountPath=TEXT, readOnly=FLAG, subPath=TEXT)))
VOLUME = fields(["name"], name=NAME, emptyDir=fields(sizeLimit=QUANTITY, medium=TEXT), configMap=fields(["name"], name=NAME),
                secret=fields(["secretName"], secretName=NAME, optional=FLAG, defaultMode=COUNT),
                persistentVolumeClaim=fields(["claimName"], claimName=NAME))
POD = fields(
    ["containers"], automountServiceAccountToken=FLAG, enableServiceLinks=FLAG, terminationGracePeriodSeconds=COUNT,
    securityContext=fields(runAsNonRoot=FLAG, runAsUser=COUNT, runAsGroup=COUNT, fsGroup=COUNT,
                           fsGroupChangePolicy=one_of("Always", "OnRootMismatch"),
                           seccompProfile=fields(["type"], type=one_of("RuntimeDefault", "Localhost"))),
    containers=some(CONTAINER), volumes=some(VOLUME))
POLICY_PORTS = some(fields(["port"], port=PORT, protocol=one_of("TCP", "UDP")))
KINDS = {
    ("v1", "ConfigMap"): {"data": WORDS},
    ("v1", "PersistentVolumeClaim"): {"spec": fields(
        ["accessModes", "resources"], accessModes=some(one_of("ReadWriteOnce", "ReadWriteOncePod", "ReadWriteMany")),
        resources=RESOURCES, storageClassName=NAME)},
    ("v1", "Service"): {"spec": fields(
        ["selector", "ports"], selector=WORDS, type=one_of("ClusterIP", "NodePort", "LoadBalancer"),
        ports=some(fields(["port"], name=NAME, port=PORT, targetPort=PORT, protocol=one_of("TCP", "UDP"))))},
    ("apps/v1", "Deployment"): {"spec": fields(
        ["selector", "template"], replicas=COUNT, strategy=fields(["type"], type=one_of("Recreate", "RollingUpdate")),
        selector=SELECTOR, template=fields(["metadata", "spec"], metadata=fields(["labels"], labels=WORDS, annotations=WORDS), spec=POD))},
    ("networking.k8s.io/v1", "NetworkPolicy"): {"spec": fields(
        ["podSelector", "policyTypes"], podSelector=SELECTOR, policyTypes=some(one_of("Ingress", "Egress")),
        ingress=some(fields(ports=POLICY_PORTS)), egress=some(fields(ports=POLICY_PORTS)))},
    ("kustomize.config.k8s.io/v1beta1", "Kustomization"): {
        "resources": some(TEXT), "labels": some(fields(["pairs"], pairs=WORDS, includeSelectors=FLAG))},
}


def check_document(document):
    """What is wrong with it, each with where."""
    kind = (document.get("apiVersion"), document.get("kind"))
    if kind not in KINDS:
        return [f"/: {kind} is not known here"]
    metadata = {} if kind[1] == "Kustomization" else {"metadata": METADATA}
    schema = fields(["apiVersion", "kind", *metadata, *KINDS[kind]], apiVersion=TEXT, kind=TEXT, **metadata, **KINDS[kind])
    errors = jsonschema.Draft202012Validator(schema).iter_errors(document)
    return [f"/{'/'.join(map(str, error.absolute_path))}: {error.message}" for error in errors]

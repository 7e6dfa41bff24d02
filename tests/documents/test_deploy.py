"""The files in deploy/ match the service: its settings, its paths, its metrics, its image."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from api.base.byte_budget import Traffic
from api.base.settings import Settings
from api.pool.messages import PlanFigures
from api.telemetry.metrics import Metrics
from tests.api.made_up_service import WorkersInTheProcess
from tests.api.operations import OPERATIONS
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

DEPLOY = ROOT / "deploy"
COMPOSE = yaml.safe_load((DEPLOY / "compose.yaml").read_text(encoding="utf-8"))
MANIFESTS = {
    document["kind"]: document
    for file in sorted((DEPLOY / "kubernetes").glob("*.yaml"))
    for document in yaml.safe_load_all(file.read_text(encoding="utf-8"))
}
POD = MANIFESTS["Deployment"]["spec"]["template"]["spec"]
CONTAINER = POD["containers"][0]


def texts(value: Any) -> Iterator[str]:
    """Yield all keys and texts in a document."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield str(name)
            yield from texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from texts(inner)
    else:
        yield str(value)


def test_the_base_for_kustomize_has_every_manifest_and_the_image_of_the_readme() -> None:
    files = {file.name for file in (DEPLOY / "kubernetes").glob("*.yaml")}
    assert {*MANIFESTS["Kustomization"]["resources"], "kustomization.yaml"} == files
    assert f"docker build -t {CONTAINER['image']} ." in (ROOT / "README.md").read_text(encoding="utf-8")


def test_settings_are_those_of_the_service() -> None:
    """But for the variables of Compose itself, which have the same names."""
    known = {f"PLANNER_{name.upper()}" for name in Settings.model_fields}
    named = {name for text in texts([COMPOSE, *MANIFESTS.values()]) for name in re.findall(r"PLANNER_[A-Z_]+", text)}
    assert len(named) >= 4 and named <= known


def test_replicas_and_machines_share_what_they_must() -> None:
    services = COMPOSE["services"]
    address = services["planner"]["environment"]["PLANNER_SCHEDULER"]
    assert services["worker"]["command"] == ["planner", "worker", address]
    assert address == f"tcp://scheduler:{services['scheduler']['command'][5]}"
    assert services["worker"]["deploy"]["replicas"] == 2
    assert "postgresql,cluster" in services["planner"]["build"]["args"]["EXTRAS"]
    assert "ARG EXTRAS" in (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert all(services[name]["read_only"] and services[name]["cap_drop"] == ["ALL"] for name in ("planner", "worker"))
    assert COMPOSE["networks"]["back"]["internal"]
    mounted = [volume.split(":")[0] for service in services.values() for volume in service.get("volumes", ())]
    assert all((DEPLOY / path).is_file() for path in mounted if path.startswith("./"))


def test_nobody_gets_in_without_a_key_or_a_password() -> None:
    """Both were open to all who reached their ports: who published these let everybody in."""
    services = COMPOSE["services"]
    assert services["planner"]["environment"]["PLANNER_ACCESS"] == "keys"
    grafana = services["grafana"]["environment"]
    assert not any(name.startswith("GF_AUTH") for name in grafana)
    for password in (grafana["GF_SECURITY_ADMIN_PASSWORD"], services["database"]["environment"]["POSTGRES_PASSWORD"]):
        assert re.fullmatch(r"\$\{\w+:\?[^}]+\}", password), "Compose does not start without it"
    published = [port for service in services.values() for port in service.get("ports", ())]
    assert len(published) == 2 and all(port.startswith("127.0.0.1:") for port in published)
    scraped = yaml.safe_load((DEPLOY / "prometheus.yaml").read_text(encoding="utf-8"))["scrape_configs"][0]
    folder = scraped["authorization"]["credentials_file"].rpartition("/")[0]
    assert f"metrics:{folder}" in services["prometheus"]["volumes"], "the key outlives the container"


def test_probes_ask_what_needs_no_key() -> None:
    open_to_all = {operation.path for operation in OPERATIONS if operation.scope is None}
    probes = [CONTAINER[f"{kind}Probe"]["httpGet"] for kind in ("startup", "readiness", "liveness")]
    assert {probe["path"] for probe in probes} <= open_to_all
    (port,) = CONTAINER["ports"]
    assert {probe["port"] for probe in probes} == {port["name"]}
    assert port["containerPort"] == Settings.model_fields["port"].default
    assert MANIFESTS["Service"]["spec"]["ports"][0]["targetPort"] == port["name"]


def test_a_pod_may_write_nothing_and_reach_nobody_but_its_database() -> None:
    assert CONTAINER["securityContext"]["readOnlyRootFilesystem"] and POD["securityContext"]["runAsNonRoot"]
    assert f"useradd --uid {POD['securityContext']['runAsUser']} " in (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert not POD["automountServiceAccountToken"]
    policy = MANIFESTS["NetworkPolicy"]["spec"]
    assert set(policy["policyTypes"]) == {"Ingress", "Egress"}
    assert {port["port"] for rule in policy["egress"] for port in rule["ports"]} == {53, 5432}
    assert all(rule["to"] for rule in policy["egress"])
    labels = MANIFESTS["Deployment"]["spec"]["template"]["metadata"]["labels"]
    for kind, path in (("NetworkPolicy", "podSelector"), ("PodDisruptionBudget", "selector")):
        assert MANIFESTS[kind]["spec"][path]["matchLabels"] == labels
    assert MANIFESTS["Service"]["spec"]["selector"] == labels
    longest = Settings.model_fields["max_deadline"].default
    assert POD["terminationGracePeriodSeconds"] > longest
    assert int(COMPOSE["services"]["planner"]["stop_grace_period"].removesuffix("s")) > longest


@pytest.fixture(scope="module")
def samples() -> dict[str, set[str]]:
    """The metrics of a service in which everything has happened once, and their labels."""
    metrics = Metrics()
    metrics.watch(WorkersInTheProcess(Settings()), Traffic(0))  # type: ignore[arg-type]
    metrics.count_request("plan_trajectory", 422, 0.1, "unreachable_waypoint")
    metrics.count_plan(PlanFigures("cubic", {"velocity": 0.5}), {"plan": 0.1})
    metrics.count_item("planned")
    families = text_string_to_metric_families(metrics.as_text().decode())
    return {sample.name: set(sample.labels) for family in families for sample in family.samples}


def test_the_dashboard_and_the_autoscaler_ask_for_metrics_that_there_are(samples: dict[str, set[str]]) -> None:
    dashboard = json.loads((DEPLOY / "grafana/planner.json").read_text(encoding="utf-8"))
    asked = [target for panel in dashboard["panels"] for target in panel["targets"]]
    shown: set[str] = set()
    for target in asked:
        names = set(re.findall(r"planner_\w+", target["expr"]))
        assert names and names <= samples.keys(), target["expr"]
        labels = set.union(*(samples[name] for name in names))
        grouped = re.search(r"by \(([^)]*)\)", target["expr"])
        used = set(grouped[1].replace(" ", "").split(",")) if grouped else set()
        assert used <= labels, target["expr"]
        assert set(re.findall(r"{{(\w+)}}", target["legendFormat"])) <= used
        shown |= {re.sub("_(bucket|sum|count|total|created)$", "", name) for name in names}
    assert shown == {re.sub("_(bucket|sum|count|total|created)$", "", name) for name in samples}  # and all of them
    (metric,) = MANIFESTS["HorizontalPodAutoscaler"]["spec"]["metrics"]
    assert metric["pods"]["metric"]["name"] in samples
    assert set(metric["pods"]["metric"]["selector"]["matchLabels"]) <= samples[metric["pods"]["metric"]["name"]]


def test_prometheus_and_grafana_find_each_other() -> None:
    scraped = yaml.safe_load((DEPLOY / "prometheus.yaml").read_text(encoding="utf-8"))["scrape_configs"][0]
    assert scraped["static_configs"][0]["targets"] == ["planner:8000"]
    (source,) = yaml.safe_load((DEPLOY / "grafana/datasource.yaml").read_text(encoding="utf-8"))["datasources"]
    dashboard = json.loads((DEPLOY / "grafana/planner.json").read_text(encoding="utf-8"))
    assert {panel["datasource"]["uid"] for panel in dashboard["panels"]} == {source["uid"]}
    (provider,) = yaml.safe_load((DEPLOY / "grafana/dashboards.yaml").read_text(encoding="utf-8"))["providers"]
    folder = provider["options"]["path"]
    assert f"./grafana/planner.json:{folder}/planner.json:ro" in COMPOSE["services"]["grafana"]["volumes"]

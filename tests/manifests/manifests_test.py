#!/usr/bin/env python3
"""Tests of deploy/kubernetes: every object keeps to schemas.yaml, and the objects fit each other and the server."""
import copy
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "deploy/kubernetes"
SCHEMAS = yaml.safe_load((pathlib.Path(__file__).parent / "schemas.yaml").read_text())


class UniqueKeys(yaml.SafeLoader):
    """YAML whose later keys do not silently replace earlier ones."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.YAMLError(f"{node.start_mark}: '{key}' is there twice")
        return super().construct_mapping(node, deep)


def load(path):
    return [one for one in yaml.load_all(path.read_text(), UniqueKeys) if one is not None]


def is_whole(value, least=0, most=2**31):
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def matches(pattern):
    return lambda value: isinstance(value, str) and re.fullmatch(pattern, value) is not None


SCALARS = {
    "text": lambda value: isinstance(value, str),
    # Kubernetes bounds a name of a label to 63 characters, and the name of a port to 15.
    "name": matches(r"[a-z0-9]([-.a-z0-9]{0,61}[a-z0-9])?"),
    "path": matches(r"/\S*"),
    "bool": lambda value: isinstance(value, bool),
    "whole": is_whole,
    "positive": lambda value: is_whole(value, 1),
    "port": lambda value: is_whole(value, 1, 65535),
    "portOrName": lambda value: is_whole(value, 1, 65535) or matches(r"[a-z0-9]([-a-z0-9]{0,13}[a-z0-9])?")(value),
    "share": lambda value: is_whole(value) or matches(r"\d+%")(value),
    "quantity": lambda value: is_whole(value) or matches(r"\d+(\.\d+)?(m|k|M|G|T|Ki|Mi|Gi|Ti)?")(value),
}


def errors(value, schema, where):
    """One line for each place where the value does not keep to the schema."""
    if isinstance(schema, str) and schema in SCHEMAS["definitions"]:
        return errors(value, SCHEMAS["definitions"][schema], where)
    if isinstance(schema, str):
        fits = SCALARS[schema](value) if schema in SCALARS else value in schema.split("|")
        return [] if fits else [f"{where}: {value!r} is not {schema}"]
    if isinstance(schema, list):
        if not isinstance(value, list) or not value:
            return [f"{where}: a list is expected"]
        return [error for i, one in enumerate(value) for error in errors(one, schema[0], f"{where}[{i}]")]
    if not isinstance(value, dict):
        return [f"{where}: an object is expected"]
    if "*" in schema:
        return [error for key, one in value.items() for error in errors(one, schema["*"], f"{where}.{key}")]
    known = {key.rstrip("!"): one for key, one in schema.items()}
    found = [f"{where}: {key[:-1]} is missing" for key in schema if key.endswith("!") and key[:-1] not in value]
    for key, one in value.items():
        found += errors(one, known[key], f"{where}.{key}") if key in known else [f"{where}: unknown key {key}"]
    return found


def object_errors(value, where):
    kind = f"{value.get('apiVersion')} {value.get('kind')}" if isinstance(value, dict) else "?"
    if kind not in SCHEMAS["objects"]:
        return [f"{where}: {kind} is no kind that schemas.yaml knows"]
    rest = {key: one for key, one in value.items() if key not in ("apiVersion", "kind")}
    return errors(rest, SCHEMAS["objects"][kind], f"{where} {value['kind']}")


def files():
    return sorted(FOLDER.rglob("*.yaml"))


def overlay(name):
    """The objects that this overlay applies, by kind and name."""
    objects = {}
    folders = [FOLDER / name]
    for folder in folders:
        for entry in load(folder / "kustomization.yaml")[0]["resources"]:
            if (folder / entry).is_dir():
                folders.append((folder / entry).resolve())
                continue
            for one in load(folder / entry):
                objects[one["kind"], one["metadata"]["name"]] = one
    return objects


def pod_of(server):
    template = server["spec"]["template"]
    return template["spec"]["template"] if server["kind"] == "Fleet" else template


OVERLAYS = {"agones": ("Fleet", "hairnet"), "plain": ("StatefulSet", "hairnet")}


class Manifests(unittest.TestCase):
    def test_every_object_keeps_to_its_schema(self):
        # A folder that has moved would have no objects, and nothing would be checked.
        self.assertGreater(len(files()), 8)
        for path in files():
            for one in load(path):
                self.assertEqual(object_errors(one, path.name), [])

    def test_an_error_anywhere_in_an_object_is_found(self):
        """Every key of every object, with another name and with a value of another type."""
        count = 0
        for path in files():
            for whole in load(path):
                for keys in paths_of(whole):
                    for corrupt in (rename, retype):
                        corrupted = copy.deepcopy(whole)
                        if corrupt(corrupted, keys):
                            self.assertNotEqual(object_errors(corrupted, path.name), [], (path.name, corrupt.__name__, keys))
                            count += 1
        # The manifests have more keys than that. A walk that finds none would pass, too.
        self.assertGreater(count, 500)

    def test_every_file_is_part_of_an_overlay(self):
        used = {path.resolve() for path in files() if path.name == "kustomization.yaml"}
        for folder in [path.parent for path in files() if path.name == "kustomization.yaml"]:
            for entry in load(folder / "kustomization.yaml")[0]["resources"]:
                self.assertTrue((folder / entry).exists(), entry)
                used.add((folder / entry).resolve())
        self.assertEqual([path for path in files() if path.resolve() not in used], [])

    def test_no_manifest_has_a_secret(self):
        for path in files():
            text = path.read_text()
            self.assertNotIn("kind: Secret", text)
            self.assertNotIn("PRIVATE KEY", text)


class Overlays(unittest.TestCase):
    def each(self):
        for name, key in OVERLAYS.items():
            objects = overlay(name)
            yield objects, pod_of(objects[key])

    def test_selectors_match_the_pods(self):
        for objects, pod in self.each():
            pods = [pod["metadata"]["labels"], objects["StatefulSet", "etcd"]["spec"]["template"]["metadata"]["labels"]]
            for (kind, name), one in objects.items():
                spec = one.get("spec", {})
                selector = spec.get("selector", spec.get("podSelector"))
                if kind in ("Service", "PodDisruptionBudget", "NetworkPolicy", "StatefulSet"):
                    self.assertIn(selector.get("matchLabels", selector), pods, (kind, name))

    def test_a_pod_may_drain_before_it_is_killed(self):
        for objects, pod in self.each():
            settings = objects["ConfigMap", "hairnet-settings"]["data"]["server.toml"]
            drain_s = float(re.search(r"^drain_s = ([\d.]+)", settings, re.M)[1])
            pre_stop_s = int(pod["spec"]["containers"][0]["lifecycle"]["preStop"]["exec"]["command"][1])
            # After the pause before the stop and the drain, the server has five seconds more to end by itself.
            self.assertGreater(pod["spec"]["terminationGracePeriodSeconds"], pre_stop_s + drain_s + 5)

    def test_volumes_are_mounted_and_exist(self):
        for objects, pod in self.each():
            for spec in (pod["spec"], objects["StatefulSet", "etcd"]["spec"]["template"]["spec"]):
                names = {volume["name"] for volume in spec["volumes"]}
                mounts = {mount["name"] for mount in spec["containers"][0]["volumeMounts"]}
                self.assertEqual(names | {"data"}, mounts | {"data"})
            maps = [one["configMap"]["name"] for one in pod["spec"]["volumes"] if "configMap" in one]
            self.assertEqual([name for name in maps if ("ConfigMap", name) not in objects], [])

    def test_probes_and_ports_name_ports_of_the_container(self):
        for objects, pod in self.each():
            for spec in (pod["spec"], objects["StatefulSet", "etcd"]["spec"]["template"]["spec"]):
                container = spec["containers"][0]
                names = {port["name"] for port in container["ports"]}
                for probe in ("readinessProbe", "livenessProbe"):
                    for check in container.get(probe, {}).values():
                        if isinstance(check, dict):
                            self.assertIn(check["port"], names)

    def test_images_are_chosen_in_the_overlay(self):
        for name in OVERLAYS:
            images = {one["name"] for one in load(FOLDER / name / "kustomization.yaml")[0]["images"]}
            used = {pod_of(one)["spec"]["containers"][0]["image"] for (kind, _), one in overlay(name).items()
                    if kind in ("Fleet", "StatefulSet")}
            self.assertEqual(images, used)

    def test_the_server_takes_its_settings_and_arguments(self):
        server = os.environ.get("HAIRNET_SERVER")
        if not server:
            self.skipTest("HAIRNET_SERVER names no program")
        for objects, pod in self.each():
            with tempfile.TemporaryDirectory() as folder:
                # The secrets and the cache of the pod are here.
                here = lambda text: text.replace("/run/secrets", folder).replace("/var/cache/hairnet", folder + "/cache")
                for secret in ("token", "etcd"):
                    os.mkdir(f"{folder}/{secret}")
                key = subprocess.run([pathlib.Path(server).with_name("hairnet-token"), "key"], check=True, capture_output=True)
                pathlib.Path(folder, "token/token.key").write_bytes(key.stdout)
                subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                                "-subj", "/CN=test", "-keyout", f"{folder}/etcd/tls.key", "-out", f"{folder}/etcd/tls.crt"],
                               check=True, capture_output=True)
                shutil.copy(f"{folder}/etcd/tls.crt", f"{folder}/etcd/ca.crt")
                settings = pathlib.Path(folder, "server.toml")
                settings.write_text(here(objects["ConfigMap", "hairnet-settings"]["data"]["server.toml"]))
                arguments = [here(one).replace("$(HOST)", "192.0.2.1") for one in pod["spec"]["containers"][0]["args"]]
                done = subprocess.run([server, "--config", settings, "--check", *arguments], capture_output=True, text=True,
                                      env={**os.environ, "AGONES_SDK_HTTP_PORT": "9358"})
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertRegex(done.stdout, r"(?m)^service_port = 9100")

    def test_the_fleet_fits_agones_and_the_server(self):
        objects = overlay("agones")
        fleet, scaler = objects["Fleet", "hairnet"], objects["FleetAutoscaler", "hairnet"]["spec"]
        spec = fleet["spec"]["template"]["spec"]
        self.assertEqual(scaler["fleetName"], fleet["metadata"]["name"])
        self.assertIn(scaler["policy"]["type"].lower(), scaler["policy"])
        api = (ROOT / "server/agones/sidecar_api.hpp").read_text()
        constant = lambda name: re.search(rf'{name} = "(\w+)"', api)[1]
        self.assertEqual(scaler["policy"]["counter"]["key"], constant("kRoomsCounter"))
        self.assertIn(constant("kRoomsCounter"), spec["counters"])
        self.assertEqual([port["name"] for port in spec["ports"]], [constant("kPortName")])
        settings = objects["ConfigMap", "hairnet-settings"]["data"]["server.toml"]
        self.assertIn(f"rooms_max = {spec['counters']['rooms']['capacity']} ", settings)
        self.assertEqual(spec["container"], spec["template"]["spec"]["containers"][0]["name"])
        # A report comes every 2 s.
        self.assertGreater(spec["health"]["periodSeconds"] * spec["health"]["failureThreshold"], 6)


def paths_of(value, keys=()):
    """The ways to all keys and elements."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield (*keys, key)
        yield from paths_of(one, (*keys, key))


def parent_of(whole, keys):
    for key in keys[:-1]:
        whole = whole[key]
    return whole


FREE = ("labels", "matchLabels", "data", "requests", "limits", "counters", "annotations")  # any names are right there


def rename(whole, keys):
    parent, key = parent_of(whole, keys), keys[-1]
    if not isinstance(parent, dict) or (len(keys) > 1 and keys[-2] in FREE) or (whole["kind"], keys[-2:-1]) == ("Service", ("selector",)):
        return False
    parent[f"{key}X"] = parent.pop(key)
    return True


def retype(whole, keys):
    # No schema takes a number with a fraction.
    parent_of(whole, keys)[keys[-1]] = 1.5
    return True


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])

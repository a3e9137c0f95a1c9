"""What deploy/ says about the daemon, held against the daemon itself and the tools that read such files.

run by ctest: deploy_test.py --daemon HELIOGRAPHD --unit heliographd.service [--results FILE.xml]

Tests that want systemd-analyze, promtool or kubernetes-validate are skipped, by name, where those are not installed. Exit
code 77: pytest or PyYAML is not installed.
"""

import argparse
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request

try:
    import pytest
    import yaml
except ImportError as lack:
    print(f"deploy_test: {lack}", file=sys.stderr)
    sys.exit(1 if os.environ.get("CI") else 77)

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"
MOST_EXPOSURE = 3.0
UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
# In no account: the program, its threads, libraries, page tables.
LEAST_BESIDE = 1 << 30


def tool(name):
    found = shutil.which(name)
    if not found:
        pytest.skip(f"skipped: {name} is not installed")
    return found


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, timeout=120)


def read_config(text):
    """The options of a configuration file."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return dict(re.fullmatch(r"([a-z-]+) = (.*)", line).groups() for line in lines)


def count(text):
    """6G, 256M, 8Gi -> bytes."""
    number, unit = re.fullmatch(r"(\d+)([KMGT]?)i?", text).groups()
    return int(number) * UNITS.get(unit, 1)


@pytest.fixture(name="daemon")
def of_daemon(request):
    return request.config.getoption("--daemon")


@pytest.fixture(name="objects")
def of_objects():
    text = (DEPLOY / "kubernetes" / "heliographd.yaml").read_text()
    return {one["kind"]: one for one in yaml.safe_load_all(text)}


@pytest.fixture(name="config")
def of_config(objects):
    return read_config(objects["ConfigMap"]["data"]["heliographd.conf"])


class TestUnit:
    def test_exposure(self, request):
        unit = request.config.getoption("--unit")
        result = run(tool("systemd-analyze"), "security", "--no-pager", "--offline=true", unit)
        if "unrecognized option" in result.stderr or "Unknown command" in result.stderr:
            pytest.skip("skipped: systemd-analyze knows no --offline")
        found = re.search(r"Overall exposure level for \S+: ([0-9.]+)", result.stdout)
        assert found, result.stdout + result.stderr
        assert float(found.group(1)) <= MOST_EXPOSURE, result.stdout

    def test_is_a_unit(self, request, tmp_path, daemon):
        """Every line is known to systemd; the program, which is not installed here, is the one that was built."""
        text = pathlib.Path(request.config.getoption("--unit")).read_text()
        text = re.sub(r"ExecStart=\S+", f"ExecStart={daemon}", text)
        text = re.sub(r"AssertPathExists=.*\n|Documentation=.*\n", "", text)
        unit = tmp_path / "heliographd.service"
        unit.write_text(text)
        result = run(tool("systemd-analyze"), "verify", "--man=no", "--recursive-errors=no", str(unit))
        if "unrecognized option" in result.stderr:
            pytest.skip("skipped: systemd-analyze knows no --recursive-errors")
        lines = [line for line in result.stderr.splitlines() if "heliographd.service" in line]
        assert not lines, result.stderr

    def test_leaves_time_to_drain(self, request, daemon):
        text = pathlib.Path(request.config.getoption("--unit")).read_text()
        grace = re.search(r"\n#?drain-grace = (\d+)", run(daemon, "--example-config").stdout).group(1)
        assert int(re.search(r"TimeoutStopSec=(\d+)", text).group(1)) > int(grace)


class TestKubernetes:
    def test_is_valid(self):
        result = run(tool("kubernetes-validate"), "--strict", str(DEPLOY / "kubernetes" / "heliographd.yaml"))
        assert result.returncode == 0, result.stdout + result.stderr

    def test_ports(self, objects, config):
        pod = objects["StatefulSet"]["spec"]["template"]["spec"]
        ports = {port["name"]: port["containerPort"] for port in pod["containers"][0]["ports"]}
        assert ports["grpc"] == int(config["listen"].split(":")[1])
        assert ports["https"] == int(config["http"].split(":")[1])
        for port in objects["Service"]["spec"]["ports"]:
            assert port["targetPort"] in ports and port["port"] == ports[port["targetPort"]]
        labels = objects["StatefulSet"]["spec"]["template"]["metadata"]["labels"]
        assert objects["Service"]["spec"]["selector"].items() <= labels.items()
        assert objects["StatefulSet"]["spec"]["serviceName"] == objects["Service"]["metadata"]["name"]

    def test_files_and_folders(self, objects, config):
        pod = objects["StatefulSet"]["spec"]["template"]["spec"]
        mounts = {mount["mountPath"]: mount["name"] for mount in pod["containers"][0]["volumeMounts"]}
        writable = {m["mountPath"] for m in pod["containers"][0]["volumeMounts"] if not m.get("readOnly")}
        volumes = {volume["name"] for volume in pod["volumes"]}
        claims = {claim["metadata"]["name"] for claim in objects["StatefulSet"]["spec"]["volumeClaimTemplates"]}
        assert set(mounts.values()) == volumes | claims
        assert pod["containers"][0]["args"] == ["--config", "/etc/heliograph/heliographd.conf"]
        assert mounts["/etc/heliograph/heliographd.conf"] == "config"
        for option in ("token-file", "tls-certificate", "tls-key"):
            assert os.path.dirname(config[option]) in mounts, option
        assert config["output-root"] in writable
        assert any(config["state"].startswith(folder + "/") for folder in writable)

    def test_times_and_bytes(self, objects, config):
        pod = objects["StatefulSet"]["spec"]["template"]["spec"]
        container = pod["containers"][0]
        stop = int(container["lifecycle"]["preStop"]["exec"]["command"][1])
        assert pod["terminationGracePeriodSeconds"] >= stop + int(config["drain-grace"]) + 10
        limit = count(container["resources"]["limits"]["memory"])
        assert limit >= count(config["max-memory"]) + count(config["max-rpc-memory"]) + LEAST_BESIDE
        assert container["resources"]["requests"]["cpu"] == config["render-threads"]

    def test_has_no_rights(self, objects):
        pod = objects["StatefulSet"]["spec"]["template"]["spec"]
        assert pod["securityContext"]["runAsNonRoot"] and pod["securityContext"]["runAsUser"] > 0
        rights = pod["containers"][0]["securityContext"]
        assert rights["capabilities"] == {"drop": ["ALL"]}
        assert rights["readOnlyRootFilesystem"] and not rights["allowPrivilegeEscalation"]
        user = re.search(r"useradd .*--uid (\d+)", (DEPLOY / "Dockerfile").read_text()).group(1)
        assert pod["securityContext"]["runAsUser"] == int(user)

    def test_the_daemon_reads_its_configuration(self, config, daemon, tmp_path):
        """With folders and addresses of this machine, and without the certificate, which is the user's."""
        known = set(re.findall(r"^#?([a-z-]+) =", run(daemon, "--example-config").stdout, re.MULTILINE))
        assert config.keys() <= known
        (tmp_path / "out").mkdir()
        (tmp_path / "tokens").write_text("0123456789abcdef0123456789abcdef\n")
        mine = {
            "listen": "127.0.0.1:0",
            "http": "127.0.0.1:0",
            "token-file": tmp_path / "tokens",
            "state": tmp_path / "state",
            "output-root": tmp_path / "out",
        }
        lines = [f"{name} = {mine.get(name, value)}" for name, value in config.items() if not name.startswith("tls-")]
        (tmp_path / "heliographd.conf").write_text("\n".join(lines) + "\n")
        with subprocess.Popen(
            [daemon, "--config", str(tmp_path / "heliographd.conf")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            said = process.stdout.readline()
            process.send_signal(signal.SIGTERM)
            errors = process.communicate(timeout=60)[1]
        assert said.startswith("heliographd listening on"), errors
        assert process.returncode == 0, errors


class TestAlerts:
    RULES = DEPLOY / "prometheus-alerts.yaml"

    def test_are_valid(self):
        result = run(tool("promtool"), "check", "rules", str(self.RULES))
        assert result.returncode == 0, result.stdout + result.stderr

    def test_fire_when_they_should(self):
        result = run(tool("promtool"), "test", "rules", str(pathlib.Path(__file__).with_name("alerts_test.yaml")))
        assert result.returncode == 0, result.stdout + result.stderr

    def test_stand_in_the_runbook(self):
        """Each has its section, with its expression as Prometheus has it."""
        book = (DEPLOY / "RUNBOOK.md").read_text()
        rules = [rule for group in yaml.safe_load(self.RULES.read_text())["groups"] for rule in group["rules"]]
        assert len(rules) == 5
        for rule in rules:
            heading = f"\n## {rule['alert']}\n"
            assert heading in book
            section = book[book.index(heading) + len(heading) :].split("\n## ")[0]
            written = re.match(r"\n((?:    .*\n)+)", section).group(1)
            assert " ".join(written.split()) == " ".join(rule["expr"].split())
            assert rule["annotations"]["runbook"] == f"RUNBOOK.md#{rule['alert'].lower()}"

    def test_name_metrics_that_are_there(self, daemon):
        named = set(re.findall(r"heliograph_[a-z_]+", self.RULES.read_text() + (DEPLOY / "RUNBOOK.md").read_text()))
        with subprocess.Popen(
            [daemon, "--http", "127.0.0.1:0", "--state", "none", "--log-level", "error"], stdout=subprocess.PIPE, text=True
        ) as process:
            try:
                process.stdout.readline()
                address = re.search(r"http://[^/]+/", process.stdout.readline()).group(0)
                page = urllib.request.urlopen(address + "metrics", timeout=60).read().decode()
            except urllib.error.HTTPError as error:
                pytest.skip(f"skipped: /metrics answers {error.code}")
            finally:
                process.kill()
        there = set(re.findall(r"# TYPE (heliograph_[a-z_]+) ", page))
        there |= {name + suffix for name in there for suffix in ("_count", "_sum", "_bucket")}
        assert named <= there


class TestDockerfile:
    def test_its_health_check_asks_its_own_port(self):
        text = (DEPLOY / "Dockerfile").read_text()
        server = re.search(r"ENV HELIOGRAPH_SERVER=127\.0\.0\.1:(\d+)", text).group(1)
        assert re.search(r'CMD \["--listen", "0\.0\.0\.0:' + server, text)
        assert re.search(r"HEALTHCHECK .*CMD \[\"heliograph\", \"health\"\]", text)
        assert f"EXPOSE {server}\n" in text


def main():
    parser = argparse.ArgumentParser()
    for option in ("--daemon", "--unit", "--results"):
        parser.add_argument(option)
    options = parser.parse_args()

    class Options:
        @staticmethod
        def pytest_addoption(parser):
            parser.addoption("--daemon", default=str(pathlib.Path(options.daemon).resolve()))
            parser.addoption("--unit", default=str(pathlib.Path(options.unit).resolve()))

    words = [__file__, "-q", "-rs", "-p", "no:cacheprovider", f"--rootdir={pathlib.Path(__file__).parent}"]
    if options.results:
        words.append(f"--junitxml={pathlib.Path(options.results).resolve()}")
    return pytest.main(words, plugins=[Options()])


if __name__ == "__main__":
    sys.exit(main())

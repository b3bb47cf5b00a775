"""The files of tools/serve/operate that start a server elsewhere: here with their options, by their probes."""
import contextlib
import json
import re
import shlex
import shutil
import subprocess
import time
import urllib.error
import urllib.request

from parts import ROOT, Failed, Skipped

OPERATE = ROOT / "tools/serve/operate"


def require(held, what):
    if not held:
        raise Failed(what)


def option(words, name):
    return next((w.split("=", 1)[1] for w in words if w.startswith(f"--{name}=")), None)


@contextlib.contextmanager
def started(program, words, files):
    """`filiform serve` with these options, but with files and a port of this test."""
    here = [next((f"--{name}={path}" for name, path in files.items() if word.startswith(f"--{name}=")), word) for word in words]
    server = subprocess.Popen([program, "serve", *here], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        address = server.stdout.readline().strip()
        require(address, f"serve does not start: {server.stderr.read() if server.poll() is not None else ''}")
        yield f"http://127.0.0.1:{address.rsplit(':', 1)[1]}", server
    finally:
        server.kill()
        server.wait()


def status(url):
    try:
        with urllib.request.urlopen(url, timeout=10) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def compose(program, files):
    import yaml
    service = yaml.safe_load((OPERATE / "compose.yaml").read_text())["services"]["filiform"]
    words, port = service["command"], option(service["command"], "listen").rsplit(":", 1)[1]
    require(service["ports"] == [f"127.0.0.1:{port}:{port}"], "compose.yaml: other ports than --listen")
    mounted = [v.split(":")[1] for v in service["volumes"]] + [f"/run/secrets/{name}" for name in service["secrets"]]
    for name in ("catalogue", "token-file", "cache"):
        require(option(words, name) in mounted, f"compose.yaml: --{name} is not mounted")
    require(int(service["stop_grace_period"][:-1]) >= int(option(words, "drain-first")) + 10, "compose.yaml: killed early")
    kind, *check = service["healthcheck"]["test"]
    with started(program, words, files) as (address, server):
        here = [w.replace(f"/{port} ", f"/{address.rsplit(':', 1)[1]} ") for w in check]
        require(kind == "CMD" and here != check, "compose.yaml: the health check asks another port")
        require(subprocess.run(here).returncode == 0, "compose.yaml: the health check fails")
        server.kill()
        server.wait()
        require(subprocess.run(here, stderr=subprocess.DEVNULL).returncode != 0, "compose.yaml: healthy without a server")


def kubernetes(program, files, folder):
    import yaml
    home = folder / "kubernetes"
    shutil.copytree(OPERATE / "kubernetes", home)
    shutil.copy(OPERATE / "sets.toml", home)
    for name in ("token", "link-key"):
        shutil.copy(files["token-file"], home / name)
    done = subprocess.run(["kubectl", "kustomize", home], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    require(done.returncode == 0, f"kubectl kustomize: {done.stderr}")
    made = {one["kind"]: one for one in yaml.safe_load_all(done.stdout)}
    pod = made["Deployment"]["spec"]["template"]
    container, labels = pod["spec"]["containers"][0], pod["metadata"]["labels"]
    words = container["args"]
    require(int(option(words, "listen").rsplit(":", 1)[1]) == container["ports"][0]["containerPort"], "another port than --listen")
    for selector in (made["Service"]["spec"]["selector"], made["PodDisruptionBudget"]["spec"]["selector"]["matchLabels"],
                     made["Deployment"]["spec"]["selector"]["matchLabels"]):
        require(selector.items() <= labels.items(), f"nothing has the labels {selector}")
    require(made["Service"]["spec"]["ports"][0]["targetPort"] == container["ports"][0]["name"], "the service names another port")
    volumes = {v["name"]: v for v in pod["spec"]["volumes"]}
    require(volumes["sets"]["configMap"]["name"] == made["ConfigMap"]["metadata"]["name"], "another ConfigMap")
    require(volumes["access"]["secret"]["secretName"] == made["Secret"]["metadata"]["name"], "another Secret")
    content = {"sets": made["ConfigMap"]["data"], "access": made["Secret"]["data"]}
    present = [f"{m['mountPath']}/{name}" for m in container["volumeMounts"] for name in content.get(m["name"], ())]
    present += [m["mountPath"] for m in container["volumeMounts"]]
    for name in ("catalogue", "token-file", "link-key", "cache"):
        require(option(words, name) in present, f"--{name} is not mounted")
    drain_s, probe = int(option(words, "drain-first")), container["readinessProbe"]
    require(pod["spec"]["terminationGracePeriodSeconds"] >= drain_s + 10, "killed before it has drained")
    require(drain_s > probe["periodSeconds"] * probe.get("failureThreshold", 3), "drained before the service knows")
    paths = [container[f"{kind}Probe"]["httpGet"]["path"] for kind in ("startup", "liveness", "readiness")]
    with started(program, words, files) as (address, server):
        for path in paths:
            require(status(address + path) == 200, f"the probe of {path} fails")
        server.terminate()
        ended = time.monotonic() + 10
        while status(address + paths[2]) != 503:
            require(time.monotonic() < ended, "ready while it drains")
            time.sleep(0.05)
        require(status(address + paths[1]) == 200, "not alive while it drains")


def check(folder, run, program):
    if not shutil.which("kubectl"):
        raise Skipped("needs kubectl (kubernetes-client)")
    token = folder / "manifest-token"
    token.write_text("0123456789abcdef0123456789abcdef\n")
    token.chmod(0o600)
    (folder / "sets.toml").write_text('[small]\naddress = "small.fil"\n')
    files = {"catalogue": folder / "sets.toml", "token-file": token, "link-key": token, "cache": folder / "manifest-cache",
             "listen": "127.0.0.1:0", "drain-first": 3}
    compose(program, files)
    kubernetes(program, files, folder)
    known = set(re.findall(r"--[a-z-]+", run(program, "serve", "--help")))
    unit = re.search(r"^ExecStart=\S+/filiform serve (.*)", (OPERATE / "filiform-serve.service").read_text(), re.M).group(1)
    unknown = {w for w in shlex.split(unit) if w.startswith("--")} - known
    require(not unknown, f"filiform-serve.service: {unknown}")
    version = json.loads(run("kubectl", "version", "--client", "-o", "json"))["clientVersion"]["gitVersion"]
    return f"Compose and kustomize (kubectl {version}): the options start a server, which answers the probes and drains"

"""The alerts and the board of tools/serve/operate, with Debian's Prometheus and promtool."""
import json
import math
import re
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.parse
import urllib.request

from parts import ROOT, Failed, Skipped

OPERATE = ROOT / "tools/serve/operate"
TOKEN = "0123456789abcdef0123456789abcdef"


def ask(url, token=""):
    request = urllib.request.Request(url, headers={"Authorization": f"Bearer {token}"} if token else {})
    with urllib.request.urlopen(request, timeout=20) as answer:
        return answer.read()


def traffic(address, token):
    """Every kind of question that a query of the board shows."""
    for number in range(5):
        for name in ("small", "far"):
            ask(f"{address}/v1/sets/{name}/nearest?at={number},700,0", token)
    for path, wrong in (("/v1/sets/gone", token), ("/v1/sets", "wrong")):
        try:
            ask(address + path, wrong)
            raise Failed(f"{path} is answered")
        except urllib.error.HTTPError:
            pass


def answered(prometheus, query):
    """The finite values that Prometheus has for the query, with their labels."""
    url = f"{prometheus}/api/v1/query?" + urllib.parse.urlencode({"query": query.replace("$instance", ".*")})
    try:
        found = json.loads(ask(url))["data"]["result"]
    except urllib.error.HTTPError as error:
        raise Failed(f"{query}: {error.read().decode()}")
    return [one["metric"] for one in found if math.isfinite(float(one["value"][1]))]


def watch(folder, run, served):
    for tool in ("prometheus", "promtool"):
        if not shutil.which(tool):
            raise Skipped("needs prometheus")
    run("promtool", "check", "rules", OPERATE / "alerts.yml")
    run("promtool", "test", "rules", ROOT / "tests/groups/service/alerts_test.yml")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        prometheus = f"127.0.0.1:{taken.getsockname()[1]}"
    home = folder / "prometheus"
    home.mkdir()
    (home / "token").write_text(TOKEN + "\n")
    (home / "token").chmod(0o600)
    shutil.copy(OPERATE / "alerts.yml", home)
    with served(folder / "column.fil") as (far, _), \
            served(folder / "small.fil", f"far={far}/v1/sets/column", f"gone={folder}/gone.fil", "--token-file", home / "token",
                   "--cache", home / "cache") as (address, _):
        text = (OPERATE / "prometheus.yml").read_text()
        for was, now in (("15s", "1s"), ("/etc/filiform/token", str(home / "token")), ("127.0.0.1:7878", address[7:])):
            if was not in text:
                raise Failed(f"prometheus.yml has no {was}")
            text = text.replace(was, now)
        (home / "prometheus.yml").write_text(text)
        run("promtool", "check", "config", home / "prometheus.yml")
        with open(home / "log", "w") as log:
            process = subprocess.Popen(["prometheus", f"--config.file={home}/prometheus.yml", f"--storage.tsdb.path={home}/data",
                                        f"--web.listen-address={prometheus}", "--log.level=warn"], stdout=log, stderr=log)
        try:
            return queried(f"http://{prometheus}", address, process, run)
        except Failed as failure:
            raise Failed(f"{failure} {(home / 'log').read_text()[-300:]}")
        finally:
            process.terminate()
            process.wait(20)


def queried(prometheus, address, process, run):
    board = json.loads((OPERATE / "board.json").read_text())
    queries = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    began = time.monotonic()
    waiting = queries
    while time.monotonic() - began < (60 if waiting else 12):  # the picture shows some seconds
        if process.poll() is not None:
            raise Failed(f"prometheus ended with {process.returncode}")
        traffic(address, TOKEN)
        run(ROOT / "tests/support/servers/short_session", address, "small", TOKEN)
        time.sleep(0.5)
        try:
            waiting = [query for query in waiting if not answered(prometheus, query)]
        except urllib.error.URLError:  # it is starting
            pass
    if waiting:
        raise Failed(f"Prometheus has nothing for: {waiting}")
    rules = json.loads(ask(prometheus + "/api/v1/rules"))["data"]["groups"][0]["rules"]
    told = []
    for rule in rules:
        if rule["health"] == "err":
            raise Failed(f"{rule['name']}: {rule['lastError']}")
        value, compared = re.fullmatch(r"(.*?) (?:==|>) [\d.]+", rule["query"], re.S), answered(prometheus, rule["query"])
        if not value or not answered(prometheus, value.group(1)):
            raise Failed(f"{rule['name']}: Prometheus has nothing for {rule['query']}")
        told += [rule["name"]] if compared else []
    # One set is missing, one question in twelve is about it, and some requests have a wrong token.
    for name, expected in (("FiliformSetNotServed", True), ("FiliformFailedAnswers", True), ("FiliformDown", False),
                           ("FiliformDamagedTiles", False)):
        if (name in told) != expected:
            raise Failed(f"{name} is {'not ' if expected else ''}true here")
    drawn = ROOT / "build/board.png"
    run(OPERATE / "plot_board", prometheus, drawn, "--minutes", 0.3)
    return (f"{len(queries)} queries of the board, {len(rules)} alerts, each with data; true here: {', '.join(told)}; "
            f"drawn: {drawn.relative_to(ROOT)}, {drawn.stat().st_size // 1024} KiB")

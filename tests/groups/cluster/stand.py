"""What the parts of tests/groups/cluster/run stand on: the store, other programs, a slow wire, nginx. Start with start_store()."""
import contextlib
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from parts import ROOT, Failed, Skipped

# Of the caller's environment, nothing that names a store.
PLAIN = {k: v for k, v in os.environ.items() if not k.startswith("AWS_") and k not in ("FILIFORM_TOKEN", "FILIFORM_CACHE")}


def require(*programs):
    missing = [p for p in programs if not shutil.which(p)]
    if missing:
        raise Skipped(f"needs {', '.join(missing)}")


class Store:
    """The gateway, as a process."""

    def __init__(self):
        self.process = subprocess.Popen([ROOT / "tests/support/servers/gateway"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True)
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(self.process.wait())
        self.told = json.loads(line)
        self.endpoint, self.bucket = self.told["endpoint"], self.told["bucket"]

    def tell(self, word):
        self.process.stdin.write(word + "\n")
        self.process.stdin.flush()
        if self.process.stdout.readline().strip() != word:
            raise Failed(f"the gateway does not {word}")

    def environment(self, **more):
        keys = {"AWS_ENDPOINT_URL": self.endpoint, "AWS_ACCESS_KEY_ID": self.told["access_key"],
                "AWS_SECRET_ACCESS_KEY": self.told["secret_key"], "HOME": "/nonexistent"}
        return {k: v for k, v in {**PLAIN, **keys, **more}.items() if v is not None}

    def end(self):
        self.process.stdin.close()
        self.process.wait(60)


store = None


def start_store():
    """The store. The functions below use it."""
    global store
    store = Store()
    return store


def run(*words, most_s=300, expect=0, env=None):
    """The output of a program that must end with the expected code; of one that must fail, its standard error."""
    done = subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=most_s,
                          env=env or store.environment())
    if done.returncode != expect:
        raise Failed(f"{' '.join(map(str, words[:4]))}: exit code {done.returncode}: {done.stderr.decode()[-400:]}")
    return (done.stderr if expect else done.stdout).decode()


def started(*words, env=None):
    return subprocess.Popen([str(w) for w in words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                            env=env or store.environment())


def s3(name):
    return f"s3://{store.bucket}/{name}"


@contextlib.contextmanager
def nginx(folder, servers=()):
    """tools/serve/operate/nginx-cluster.conf with the addresses of this test: those of the store and of the servers, and the log
    of requests to the store."""
    require("nginx", "openssl")
    home = folder / "nginx"
    shutil.rmtree(home, ignore_errors=True)
    (home / "cache").mkdir(parents=True)
    run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj",
        "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", home / "key.pem", "-out",
        home / "certificate.pem")
    first, second = free_port(), free_port()
    text = (ROOT / "tools/serve/operate/nginx-cluster.conf").read_text()
    for was, now in (("listen 8080", f"listen 127.0.0.1:{first}"), ("listen 443", f"listen 127.0.0.1:{second}"),
                     ("127.0.0.1:7480", store.endpoint.split("//")[1]), ("/etc/ssl/filiform/", f"{home}/"),
                     ("/var/cache/nginx/store", f"{home}/cache"), ("/var/log/nginx/", f"{home}/"),
                     *((f"127.0.0.1:{7878 + i}", port) for i, port in enumerate(servers or ["127.0.0.1:9"] * 3))):
        if was not in text:
            raise Failed(f"nginx-cluster.conf has no {was}")
        text = text.replace(was, now)
    temporary = "".join(f"{kind}_temp_path {home}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi",
                                                                          "scgi"))
    user = "user root;\n" if os.getuid() == 0 else ""
    text = f"{user}daemon off;\npid {home}/pid;\n" + text.replace("http {\n", "http {\n" + temporary, 1)
    (home / "nginx.conf").write_text(text)
    process = subprocess.Popen(["nginx", "-e", home / "error.log", "-p", home, "-c", home / "nginx.conf"],
                               stderr=subprocess.DEVNULL)
    try:
        wait_for_port(first, process, home / "error.log")
        yield f"http://127.0.0.1:{first}", f"https://127.0.0.1:{second}", home / "store.log"
    finally:
        process.terminate()
        process.wait(20)


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def wait_for_port(port, process, log):
    for _ in range(200):
        with socket.socket() as trial:
            if trial.connect_ex(("127.0.0.1", port)) == 0:
                return
        if process.poll() is not None:
            raise Failed(f"{process.args[0]} ended with {process.returncode}: {log.read_text()[-300:]}")
        time.sleep(0.05)
    raise Failed(f"nobody listens at {port}")


def lines_of(log):
    time.sleep(0.2)  # nginx writes a line after the answer
    return log.read_text().count("\n")

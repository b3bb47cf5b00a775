#!/usr/bin/env python3
"""A small HTTP server for tests: serves the files below a folder, with faults on demand.

  http_server.py ROOT [--prefix PATH] [--host ADDRESS] [--token TOKEN] [--certificate FILE] [--store SECRET]

It prints `port N`. Then each line on standard input is a JSON object, answered by one line of JSON:
  {"do": "fault", "path": SUBSTRING, "times": N, "kind": KIND, ...}  faults for the next N matching requests
  {"do": "clear"}                                                      no more faults
  {"do": "log"}                                                        the requests so far, and forgets them
  {"do": "delay", "s": SECONDS}                                        before each answer
It ends at the end of standard input. Kinds of faults:
  status     answers `status` (with `retry_after`, `location` if given)
  whole      ignores Range: 200 and the whole file
  other      answers 206 with bytes that begin one later than asked for
  bare       answers 206 without Content-Range
  cut        closes the connection after half of the body
  short      states and sends half of the range
  stall      sends half of the body, then nothing for `s` seconds
  silent     answers nothing for `s` seconds
  reset      resets the connection at once
  flip       inverts one bit of the body
  large      answers 200 with `bytes` zero bytes
  coded      says that the bytes of the file have the Content-Encoding `coding`
"""
import argparse
import json
import os
import socket
import ssl
import struct
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

sys.dont_write_bytecode = True
import object_store

lock = threading.Lock()
faults, log = [], []
delay_s = 0.0


def fault_for(path):
    with lock:
        for fault in faults:
            if fault["path"] in path and fault["times"] > 0:
                fault["times"] -= 1
                return fault
    return None


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.answer(True)

    def do_HEAD(self):
        self.answer(False)

    def do_PUT(self):
        self.answer(True)

    def do_DELETE(self):
        self.answer(True)

    def plain(self, status, headers=()):
        body = b"" if status == 304 else b"status %d\n" % status
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def reset(self):
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.close_connection = True
        self.connection.close()
        raise ConnectionResetError

    def answer(self, with_body):
        try:
            self.answer_or_fail(with_body)
        except (BrokenPipeError, ConnectionResetError, ConnectionAbortedError, ValueError):
            self.close_connection = True

    def answer_or_fail(self, with_body):
        asked = self.headers.get("Range")
        with lock:
            log.append({"method": self.command, "path": self.path, "range": asked,
                        "token": self.headers.get("Authorization"), "port": self.client_address[1]})
        if delay_s:
            time.sleep(delay_s)
        fault = fault_for(self.path) or {"kind": ""}
        kind = fault["kind"]
        if kind == "reset":
            self.reset()
        if kind == "silent":
            time.sleep(fault["s"])
        if kind == "status":
            headers = [(h, str(fault[k])) for k, h in (("retry_after", "Retry-After"), ("location", "Location")) if k in fault]
            return self.plain(fault["status"], headers)
        if arguments.token and self.headers.get("Authorization") != "Bearer " + arguments.token:
            return self.plain(401)
        if kind == "large":
            self.send_response(200)
            self.send_header("Content-Length", str(fault["bytes"]))
            self.end_headers()
            for _ in range(0, fault["bytes"], 1 << 16):
                self.wfile.write(bytes(1 << 16))
            return None
        if arguments.store:
            code = object_store.refused(self, arguments.store)
            if code:
                return object_store.send(self, 403, f"<Error><Code>{code}</Code></Error>")
            if self.command in ("PUT", "DELETE") or "?" in self.path:
                return object_store.answer(self, arguments.root)
        elif self.command not in ("GET", "HEAD"):
            return self.plain(501)
        if not self.path.startswith(arguments.prefix):
            return self.plain(404)
        path = os.path.join(arguments.root, self.path[len(arguments.prefix):].lstrip("/"))
        try:
            size = os.stat(path).st_size
            file = open(path, "rb")
        except OSError:
            return self.plain(404)
        first, last, status = 0, size - 1, 200
        with file:
            if asked and kind != "whole":
                first, last = (int(n) for n in asked.removeprefix("bytes=").split("-"))
                if first >= size:
                    return self.plain(416, [("Content-Range", "bytes */%d" % size)])
                status, last = 206, min(last, size - 1)
                if kind == "other":
                    first += 1
            if kind == "short":
                last = first + (last - first) // 2
            file.seek(first)
            body = bytearray(file.read(last + 1 - first) if with_body else last + 1 - first)
        if kind == "flip":
            body[len(body) // 2] ^= 1
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        if kind == "coded":
            self.send_header("Content-Encoding", fault["coding"])
        if status == 206 and kind != "bare":
            self.send_header("Content-Range", "bytes %d-%d/%d" % (first, last, size))
        self.end_headers()
        if not with_body:
            return None
        if kind in ("cut", "stall"):
            self.wfile.write(body[:len(body) // 2])
            self.wfile.flush()
            if kind == "stall":
                time.sleep(fault["s"])
            self.close_connection = True
            self.connection.shutdown(socket.SHUT_RDWR)
            return None
        self.wfile.write(body)
        return None


class Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128

    def handle_error(self, request, client_address):
        pass


def command(told):
    global delay_s
    with lock:
        if told["do"] == "fault":
            faults.append({**told, "times": told.get("times", 1)})
        elif told["do"] == "clear":
            faults.clear()
        elif told["do"] == "delay":
            delay_s = told["s"]
        elif told["do"] == "log":
            taken = list(log)
            log.clear()
            return taken
    return {}


parser = argparse.ArgumentParser()
parser.add_argument("root")
parser.add_argument("--prefix", default="")
parser.add_argument("--host", default="127.0.0.1")
parser.add_argument("--token", default="")
parser.add_argument("--store", default="", help="be an object store (object_store.py) whose secret key is this")
parser.add_argument("--certificate", default="", help="PEM with its key: speak TLS")
arguments = parser.parse_args()
server = Server((arguments.host, 0), Handler)
if arguments.certificate:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(arguments.certificate)
    server.socket = context.wrap_socket(server.socket, server_side=True, do_handshake_on_connect=False)
threading.Thread(target=server.serve_forever, daemon=True).start()
print("port", server.server_address[1], flush=True)
for line in sys.stdin:
    print(json.dumps(command(json.loads(line))), flush=True)
os._exit(0)

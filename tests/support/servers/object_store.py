"""What http_server.py --store adds: an object store, as far as filiform asks one.

The buckets are the folders below ROOT. PUT and DELETE change files; a list has three entries a page; the age of an object is
that of its file. A file NAME.upload stands for an upload of NAME in parts that has not ended. Each request must have the
right signature (AWS Signature Version 4) of the access key `KEY` with the stated secret.
"""
import hashlib
import hmac
import os
import time
from urllib.parse import parse_qsl, quote, unquote, urlsplit

PAGE = 3


def signature(handler, secret):
    """The one that the request should have."""
    fields = dict(part.strip().split("=", 1) for part in handler.headers["Authorization"].split(" ", 1)[1].split(","))
    scope = fields["Credential"].split("/", 1)[1]
    target = urlsplit(handler.path)
    query = "&".join(sorted(f"{quote(k, safe='-._~')}={quote(v, safe='-._~')}" for k, v in
                            parse_qsl(target.query, keep_blank_values=True)))
    headers = "".join(f"{name}:{' '.join(handler.headers[name].split())}\n" for name in fields["SignedHeaders"].split(";"))
    body = handler.headers["x-amz-content-sha256"] or hashlib.sha256(handler.body).hexdigest()
    request = "\n".join([handler.command, target.path, query, headers, fields["SignedHeaders"], body])
    text = "\n".join(["AWS4-HMAC-SHA256", handler.headers["x-amz-date"], scope, hashlib.sha256(request.encode()).hexdigest()])
    key = ("AWS4" + secret).encode()
    for part in scope.split("/"):
        key = hmac.digest(key, part.encode(), "sha256")
    return fields["Signature"], hmac.digest(key, text.encode(), "sha256").hex()


def refused(handler, secret):
    """The code of the error; empty: the request is signed right."""
    handler.body = handler.rfile.read(int(handler.headers.get("Content-Length") or 0))
    if not (handler.headers.get("Authorization") or "").startswith("AWS4-HMAC-SHA256 Credential=KEY/"):
        return "AccessDenied"
    given, right = signature(handler, secret)
    return "" if hmac.compare_digest(given, right) else "SignatureDoesNotMatch"


def send(handler, status, text=""):
    handler.send_response(status)
    handler.send_header("Content-Length", str(len(text)))
    handler.end_headers()
    if handler.command != "HEAD":
        handler.wfile.write(text.encode())


def listed(root, query):
    """A page of objects or of uploads."""
    uploads, prefix = "uploads" in query, query.get("prefix", "")
    after = query.get("key-marker" if uploads else "continuation-token", "")
    names = sorted(os.path.relpath(os.path.join(folder, name), root) for folder, _, files in os.walk(root) for name in files)
    names = [n for n in names if n.startswith(prefix) and n > after and n.endswith(".upload") == uploads]
    rows = []
    for name in names[:PAGE]:
        facts = os.stat(os.path.join(root, name))
        when = time.strftime("%Y-%m-%dT%H:%M:%S.000Z", time.gmtime(facts.st_mtime))
        key = name.removesuffix(".upload")
        rows.append(f"<Upload><Key>{key}</Key><UploadId>a/{key}</UploadId><Initiated>{when}</Initiated></Upload>" if uploads else
                    f"<Contents><Key>{key}</Key><LastModified>{when}</LastModified><Size>{facts.st_size}</Size></Contents>")
    more = len(names) > PAGE
    last = names[PAGE - 1] if more else ""
    return (f"<?xml version='1.0'?><Result><IsTruncated>{'true' if more else 'false'}</IsTruncated>{''.join(rows)}"
            f"<NextContinuationToken>{last}</NextContinuationToken><NextKeyMarker>{last}</NextKeyMarker>"
            f"<NextUploadIdMarker>a</NextUploadIdMarker></Result>")


def answer(handler, root):
    """Answers what a plain server does not: PUT, DELETE, lists."""
    target = urlsplit(handler.path)
    query = dict(parse_qsl(target.query, keep_blank_values=True))
    path = os.path.join(root, unquote(target.path).lstrip("/"))
    if handler.command == "GET":
        return send(handler, 200, listed(path, query))
    if handler.command == "PUT":
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(handler.body)
        return send(handler, 200)
    try:
        os.remove(path + ".upload" if "uploadId" in query else path)
    except FileNotFoundError:
        return send(handler, 404 if "uploadId" in query else 204)
    return send(handler, 204)

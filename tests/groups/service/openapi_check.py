#!/usr/bin/env python3
"""Calls each route of a server and checks the answer against /v1/openapi.json.

  openapi_check.py ADDRESS SET [TOKEN]

SET is the name of a served set. Prints the number of routes. Exits with 1 at the first difference.
"""
import json
import sys
import urllib.error
import urllib.parse
import urllib.request

import jsonschema

address, set_name = sys.argv[1:3]
token = sys.argv[3] if len(sys.argv) > 3 else None


def ask(method, target, headers=None, body=None):
    request = urllib.request.Request(address + target, method=method, data=body, headers=headers or {})
    if token:
        request.add_header("Authorization", "Bearer " + token)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, answer.headers.get_content_type(), answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers.get_content_type(), error.read()


def get_json(target):
    status, kind, body = ask("GET", target)
    assert status == 200, (target, status, body)
    return json.loads(body)


description = get_json("/v1/openapi.json")
assert description["openapi"].startswith("3.1")
schemas = description["components"]["schemas"]
for name, schema in schemas.items():
    jsonschema.Draft202012Validator.check_schema(schema)


operations = [operation for path in description["paths"].values() for operation in path.values()]
names = [operation["operationId"] for operation in operations]
assert len(set(names)) == len(names) and all(name.isalnum() for name in names), names
assert {"getSets", "getSet", "getSetNearest", "postSetNearest", "getSetCell", "getHealthz"} <= set(names), names
tags = {tag["name"] for tag in description["tags"]}
assert {tag for operation in operations for tag in operation["tags"]} == tags, tags


def check(value, schema, where):
    document = {"components": {"schemas": schemas}, **schema}
    errors = list(jsonschema.Draft202012Validator(document).iter_errors(value))
    assert not errors, (where, errors[0].message, list(errors[0].absolute_path))


def check_answer(operation, where, status, kind, body):
    responses = operation["responses"]
    answers = responses[str(status)] if str(status) in responses else responses["default"]
    content = answers["content"]
    assert kind in content, (where, status, kind, list(content), body[:300])
    if kind.endswith("json"):
        check(json.loads(body), content[kind].get("schema", {}), where)


part = urllib.parse.quote(set_name)
revision = ask("GET", f"/v1/sets/{part}/files/CURRENT")[2].decode().strip()
cell = get_json(f"/v1/sets/{part}/cells")["cells"][0]["name"]
samples = get_json(f"/v1/sets/{part}/cells/{urllib.parse.quote(cell)}.json")["samples_by_rank"]["id"]
number = get_json(f"/precomputed/{part}/segment_properties/info")["inline"]["ids"][0]
values = {"set": [part], "revision": [revision], "file": ["manifest.json", "directory.bin"], "range": ["0-9"],
          "cell": [urllib.parse.quote(cell) + ending for ending in (".json", ".swc", ".npy")], "skeleton": [number]}
place = urllib.parse.quote(cell)
queries = {"nearest": "at=1,2,3&k=3", "box": "lo=-50,-50,-50&hi=50,50,50", "ray": "from=0,0,-1000&direction=0,0,1&tolerance=100",
           "density": "step=500", "contacts": f"cell={place}&within=5",
           "path": f"from={place}:{samples[0]}&to={place}:{samples[-1]}",
           "list": "left=-1e6&top=-1e6&z1=-1e6&right=1e6&bottom=1e6&z2=1e6", "picture": "size=64x40"}

called = 0
ids = set()
for path, operations in description["paths"].items():
    for method, operation in operations.items():
        where = method.upper() + " " + path
        called += 1
        assert operation["operationId"] not in ids, where
        ids.add(operation["operationId"])
        named = {p["name"]: p for p in operation["parameters"]}
        assert all(p["required"] for p in named.values() if p["in"] == "path"), where
        if "101" in operation["responses"]:  # a WebSocket
            continue
        targets = [path]
        for name in [p for p in named if named[p]["in"] == "path"]:
            targets = [target.replace("{" + name + "}", value) for target in targets for value in values[name]]
        assert not any("{" in target for target in targets), targets
        query = "" if method == "post" else queries.get(path.rsplit("/", 1)[-1], "")
        for parameter in query.split("&") if query else []:
            assert parameter.split("=")[0] in named, (where, parameter)
        for target in targets:
            if method == "delete" and token is None:
                expected = 400
            else:
                expected = 200
            body = json.dumps({"points": [[1, 2, 3]], "k": 2}).encode() if method == "post" else None
            headers = {"Content-Type": "application/json"} if body else {}
            answer = ask(method.upper(), target + ("?" + query if query else ""), headers, body)
            assert answer[0] == expected, (where, target, answer[0], answer[2][:300])
            check_answer(operation, where, *answer)
            # A wrong parameter is a problem, as described.
            wrong = ask(method.upper(), target + "?nonsense=1", headers, body)
            assert wrong[0] == 400, (where, wrong)
            check_answer(operation, where, *wrong)
            if "application/x-npy" in operation["responses"]["200"]["content"] and not path.endswith("{cell}"):
                array = ask(method.upper(), target + ("?" + query if query else ""),
                            {**headers, "Accept": "application/x-npy"}, body)
                assert array[:2] == (200, "application/x-npy") and array[2][:6] == b"\x93NUMPY", (where, array[:2])
print(f"{called} routes fit their description")

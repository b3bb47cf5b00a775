#!/usr/bin/python3
# SPDX-License-Identifier: MIT
# Travels through a set that `filiform serve` serves, without a solver of its own: python3 travel.py URL SET [SECONDS]
# URL is such as ws://127.0.0.1:7878/v1/session; FILIFORM_TOKEN holds the token of a server that needs one.
# The hand circles around the proxy; a real program sends its device's position instead. Needs python3-websockets.
import asyncio, json, math, os, struct, sys, time
import websockets

HAND = struct.Struct('<HHIq3dIHH3f4x')             # 64 bytes
PROXY = struct.Struct('<HHIIBxHq3d3f3fIIfHHq')      # 96 bytes
MODEL = struct.Struct('<HHIq3d3f6f4fI3d3f4fIHHB35x')  # 192 bytes, then nodes and links


def unpack_model(frame):
    """The force model about h_D, and the graph around the proxy."""
    (kind, version, hand, t_server, hx, hy, hz, fx, fy, fz, xx, xy, xz, yy, yz, zz, radius_m, ttl_s, most_N, um_m, cell,
     px, py, pz, *_, segment, nodes, links, full) = MODEL.unpack_from(frame)
    points = [struct.unpack_from('<3f', frame, MODEL.size + 12 * i) for i in range(nodes)]
    pairs = [struct.unpack_from('<2H', frame, MODEL.size + 12 * nodes + 4 * i) for i in range(links)]
    return {'h_D': (hx, hy, hz), 'force_N': (fx, fy, fz), 'stiffness_N_m': ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)),
            'radius_m': radius_m, 'ttl_s': ttl_s, 'most_N': most_N, 'nodes': points, 'links': pairs}


def force(model, x_D):
    """The force (N) at a position near the last one: what a device renders between two answers."""
    d = [a - b for a, b in zip(x_D, model['h_D'])]
    far = math.hypot(*d) / model['radius_m'] if model['radius_m'] > 0 else 1.0
    d = [v / max(1.0, far) for v in d]
    f = [f0 - sum(k * v for k, v in zip(row, d)) for f0, row in zip(model['force_N'], model['stiffness_N_m'])]
    return [v * min(1.0, model['most_N'] / max(1e-9, math.hypot(*f))) for v in f]


async def ask(socket, method, **params):
    await socket.send(json.dumps({'jsonrpc': '2.0', 'id': method, 'method': method, 'params': params}))
    while True:  # frames may come before the answer
        frame = await socket.recv()
        answer = json.loads(frame) if isinstance(frame, str) else {}
        if answer.get('id') == method:
            if 'error' in answer:
                sys.exit(f"{method}: {answer['error']['message']}")
            return answer['result']


async def listen(socket, seen):
    async for frame in socket:
        if not isinstance(frame, str) and frame[0] == 2:
            seen['ack'], seen['proxies'] = PROXY.unpack(frame)[2], seen['proxies'] + 1
        elif not isinstance(frame, str) and frame[0] == 3:
            seen['model'], seen['models'] = unpack_model(frame), seen['models'] + 1


async def travel(url, name, seconds):
    token = os.environ.get('FILIFORM_TOKEN')
    headers = {'Authorization': 'Bearer ' + token} if token else {}
    async with websockets.connect(url, subprotocols=['filiform.v1'], extra_headers=headers) as socket:
        sets = {s['name']: s for s in (await ask(socket, 'hello', client='travel.py'))['sets']}
        if name not in sets:
            sys.exit(f'no set {name}; there are: ' + ', '.join(sets))
        middle = [(a + b) / 2 for a, b in zip(sets[name]['lo_um'], sets[name]['hi_um'])]
        opened = await ask(socket, 'open', set=name, at=middle)
        await ask(socket, 'subscribe', model_Hz=20, radius_um=50)
        seen = {'ack': 0, 'proxies': 0, 'models': 0, 'model': None}
        listener = asyncio.create_task(listen(socket, seen))
        strongest, begin = 0.0, time.monotonic()
        for seq in range(1, 1 + int(seconds * 100)):  # 100 HANDs a second
            angle = 2 * math.pi * seq / 200
            h_D = (0.01 * math.sin(angle), 0.01 * (1 - math.cos(angle)), 0.0)
            await socket.send(HAND.pack(1, 1, seq, time.monotonic_ns(), *h_D, seen['ack'], 0, 0, 0.0, 0.0, 0.0))
            await asyncio.sleep(max(0.001, begin + seq / 100 - time.monotonic()))
            if seen['model']:
                strongest = max(strongest, math.hypot(*force(seen['model'], h_D)))
        listener.cancel()
        nodes = len(seen['model']['nodes']) if seen['model'] else 0
        print(f"{opened['place']['cell']}: {seen['proxies']} PROXY, {seen['models']} LOCAL MODEL, "
              f"{nodes} nodes, at most {strongest:.3f} N")


if __name__ == '__main__':
    try:
        asyncio.run(travel(sys.argv[1], sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 2.0))
    except (OSError, websockets.WebSocketException) as error:
        sys.exit(f'{sys.argv[1]}: {error}')

#!/usr/bin/python3
# SPDX-License-Identifier: MIT
# Travels through a set that `filiform serve` serves, without a solver of its own: python3 travel.py URL SET [SECONDS]
# URL is such as ws://127.0.0.1:7878/v1/session; FILIFORM_TOKEN holds the token of a server that needs one.
# The hand circles around the proxy; a real program sends its device's position instead. Needs python3-websockets.
# If the connection ends, the program connects again, to the same server or another one of the set, and goes on at its
# place. It waits 0.1 s before the first try, then twice as long each time, up to 5 s.
import asyncio, json, math, os, random, struct, sys, time
import websockets

HAND = struct.Struct('<HHIq3dIHH3f4x')             # 64 bytes
PROXY = struct.Struct('<HHIIBxHq3d3f3fIIfHHq')      # 96 bytes
JUMP_WAITS, NO_PLACE, BUSY = 8, 32, -32002         # flags of PROXY; an error that a later try may not meet
FIRST_WAIT_S, LONGEST_WAIT_S = 0.1, 5.0
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
            if 'error' not in answer:
                return answer['result']
            text = f"{method}: {answer['error']['message']}"
            raise ConnectionError(text) if answer['error']['code'] == BUSY else SystemExit(text)


async def listen(socket, seen):
    async for frame in socket:
        if not isinstance(frame, str) and frame[0] == 2:
            proxy = PROXY.unpack(frame)
            seen['ack'], seen['proxies'] = proxy[2], seen['proxies'] + 1
            if not proxy[5] & (JUMP_WAITS | NO_PLACE):
                seen['place'] = proxy[7:10]
        elif not isinstance(frame, str) and frame[0] == 3:
            seen['model'], seen['models'] = unpack_model(frame), seen['models'] + 1


async def send_hand(socket, seen, h_D):
    seen['seq'] += 1
    await socket.send(HAND.pack(1, 1, seen['seq'], time.monotonic_ns(), *h_D, seen['ack'], 0, 0, 0.0, 0.0, 0.0))


def hand_at(seconds):
    angle = math.pi * seconds
    return (0.01 * math.sin(angle), 0.01 * (1 - math.cos(angle)), 0.0)


async def begin(socket, name, seen, h_D, at_um):
    """Opens the set there, or in its middle; after a lost connection, where the proxy was, under the hand."""
    seen['ack'] = seen['seq'] = 0
    sets = {s['name']: s for s in (await ask(socket, 'hello', client='travel.py'))['sets']}
    if name not in sets:
        sys.exit(f'no set {name}; there are: ' + ', '.join(sets))
    middle = [(a + b) / 2 for a, b in zip(sets[name]['lo_um'], sets[name]['hi_um'])]
    opened = await ask(socket, 'open', set=name, at=seen['place'] or at_um or middle)
    if seen['place']:
        await send_hand(socket, seen, h_D)
        opened = await ask(socket, 'jump', at=seen['place'])
        seen['moved_um'] = max(seen['moved_um'], math.dist(opened['place']['p_um'], seen['place']))
    await ask(socket, 'subscribe', model_Hz=20, radius_um=50)
    seen['cell'] = opened['place']['cell']


async def go(socket, seen, began, seconds):
    listener = asyncio.create_task(listen(socket, seen))
    try:
        while (now := time.monotonic() - began) < seconds:  # 100 HANDs a second
            await send_hand(socket, seen, hand_at(now))
            await asyncio.sleep(0.01)
            if seen['model']:
                seen['most_N'] = max(seen['most_N'], math.hypot(*force(seen['model'], hand_at(now))))
    finally:
        listener.cancel()


async def travel(url, name, seconds, seen=None, at_um=None, **options):
    """What was seen; `reconnects` counts the lost connections that were opened again, `moved_um` is how far at most a
    session then went on from its place. `at_um`: where the proxy begins, the middle of the set unless given. `options`:
    of connect()."""
    token = os.environ.get('FILIFORM_TOKEN')
    headers = {'Authorization': 'Bearer ' + token} if token else {}
    seen = {} if seen is None else seen
    seen |= {'proxies': 0, 'models': 0, 'model': None, 'most_N': 0.0, 'place': None, 'reconnects': 0, 'moved_um': 0.0}
    began, wait = time.monotonic(), FIRST_WAIT_S
    while True:
        try:
            async with websockets.connect(url, subprotocols=['filiform.v1'], extra_headers=headers, **options) as socket:
                again = seen['place'] is not None
                await begin(socket, name, seen, hand_at(time.monotonic() - began), at_um)
                seen['reconnects'] += again
                wait = FIRST_WAIT_S
                await go(socket, seen, began, seconds)
                return seen
        except (OSError, asyncio.TimeoutError, websockets.WebSocketException):
            if seen['place'] is None or time.monotonic() - began > seconds:
                raise  # never connected, or too late
        seen['model'] = None  # a device lets its force fall to zero
        await asyncio.sleep(wait * random.uniform(0.5, 1))  # clients of one server do not come back all at once
        wait = min(2 * wait, LONGEST_WAIT_S)


if __name__ == '__main__':
    try:
        found = asyncio.run(travel(sys.argv[1], sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 2.0))
        nodes = len(found['model']['nodes']) if found['model'] else 0
        print(f"{found['cell']}: {found['proxies']} PROXY, {found['models']} LOCAL MODEL, {nodes} nodes, "
              f"at most {found['most_N']:.3f} N" + (f", {found['reconnects']} reconnects" if found['reconnects'] else ''))
    except (OSError, asyncio.TimeoutError, websockets.WebSocketException) as error:
        sys.exit(f'{sys.argv[1]}: {error}')

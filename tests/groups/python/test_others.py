"""Event loops, dask, joblib and notebooks, with the real libraries."""

import asyncio
import base64
import http.server
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import filiform as ff
from conftest import points_about


def test_an_event_loop_goes_on_while_a_search_runs(s, random):
    points = points_about(s, random, 20_000)

    async def main():
        loop = asyncio.get_running_loop()
        beats = 0
        with ThreadPoolExecutor(2) as pool:
            searches = [loop.run_in_executor(pool, s.nearest, half) for half in np.array_split(points, 2)]
            while not all(search.done() for search in searches):
                await asyncio.sleep(0)
                beats += 1
            return np.concatenate(await asyncio.gather(*searches)), beats

    hits, beats = asyncio.run(main())
    assert beats > 10 and (hits == s.nearest(points)).all()


def nearest_of(opened, points):
    return opened.nearest(points)["distance"]


def test_dask_computes_in_threads_and_processes(s, random):
    dask = pytest.importorskip("dask", reason="needs dask (tools/setup --python)")
    parts = np.array_split(points_about(s, random, 2000), 4)
    lazy = [dask.delayed(nearest_of, pure=True)(s, part) for part in parts]
    expected = [nearest_of(s, part) for part in parts]
    for scheduler in "threads", "processes":
        found = dask.compute(*lazy, scheduler=scheduler)
        assert all((a == b).all() for a, b in zip(found, expected)), scheduler
    again = dask.delayed(nearest_of, pure=True)(ff.open(s.path), parts[0])
    assert again.key == lazy[0].key  # equal sets have equal tokens


@pytest.mark.parametrize("backend", ["threading", "loky", "multiprocessing"])
def test_joblib_runs_and_remembers(s, random, tmp_path, backend):
    joblib = pytest.importorskip("joblib", reason="needs joblib (tools/setup --python)")
    parts = np.array_split(points_about(s, random, 1000), 3)
    found = joblib.Parallel(n_jobs=2, backend=backend)(joblib.delayed(nearest_of)(s, part) for part in parts)
    assert all((a == nearest_of(s, part)).all() for a, part in zip(found, parts))
    cached = joblib.Memory(tmp_path, verbose=0).cache(nearest_of)
    assert (cached(s, parts[0]) == found[0]).all()
    assert cached.check_call_in_cache(ff.open(s.path), parts[0]) if hasattr(cached, "check_call_in_cache") else True


@pytest.fixture
def page():
    """A server whose page states the policy of `policy`, and threads if it is `isolated`."""
    class Handler(http.server.BaseHTTPRequestHandler):
        policy = "default-src 'self'; frame-ancestors 'none'"
        isolated = False

        def do_HEAD(self):
            self.send_response(200)
            if self.policy:
                self.send_header("Content-Security-Policy", self.policy)
            if self.isolated:
                self.send_header("Cross-Origin-Embedder-Policy", "require-corp")
            self.end_headers()

        def log_message(self, *_):
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield Handler, f"http://127.0.0.1:{server.server_port}/travel/column"
    server.shutdown()
    thread.join()


def test_a_view_is_a_frame_where_the_server_allows_it(s, page):
    handler, address = page
    view = s.view(page=address, height=300)
    assert not view.frames and "<iframe" not in view._repr_html_() and f'href="{address}"' in view._repr_html_()
    handler.policy = "frame-ancestors http://localhost:8888"
    assert view.frames and f'<iframe src="{address}"' in view._repr_html_() and 'height="300"' in view._repr_html_()
    handler.policy = ""
    assert view.frames
    handler.isolated = True  # then the browser chooses
    shown = view._repr_html_()
    assert shown.startswith('<div id="filiform-') and f'<a href="{address}"' in shown
    assert f'if (window.crossOriginIsolated) document.getElementById("{shown.split(chr(34))[1]}").innerHTML = "<iframe src=' in shown
    assert not s.view(page="http://127.0.0.1:9/").frames


def test_a_view_without_a_page_is_a_picture(s):
    pytest.importorskip("filiform._render", reason="needs OpenGL")
    shown = s.view()._repr_html_()
    assert base64.b64decode(shown.split("base64,")[1].split('"')[0]).startswith(b"\x89PNG") and "<a " not in shown
    with pytest.raises(ValueError, match="page: expected an address"):
        s.view(page="localhost:8888")

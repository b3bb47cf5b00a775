"""View: a set in a notebook, as the page of a server or as a picture."""

from __future__ import annotations

import base64
import html
import json
import os
import re
import urllib.request
import uuid

from .pictures import notebook_png
from .scene import Scene


class View:
    """What `Set.view` returns. A notebook shows it."""

    def __init__(self, scene: Scene, page: str | None, height: int) -> None:
        self._scene = scene
        owner = scene._scene()[0]
        self._name = os.path.basename(owner.path)
        self.height = height  #: of the frame, pixels
        if page is None and "/v1/sets/" in owner.path:
            page = "/travel/".join(owner.path.rstrip("/").split("/v1/sets/", 1))
        if page is not None and not page.startswith(("http://", "https://")):
            raise ValueError(f"page: expected an address that begins with http:// or https://, got {page!r}")
        self.page = page  #: the address of the page; None: only the picture

    @property
    def frames(self) -> bool:
        """True if the server lets other pages hold its page in a frame. Asks the server.

        >>> s.view().frames
        False
        """
        return self._framing()[0]

    def _framing(self) -> tuple[bool, bool]:
        """Whether the page may be in a frame, and whether it needs a page about it that is isolated from others."""
        if self.page is None:
            return False, False
        try:
            with urllib.request.urlopen(urllib.request.Request(self.page, method="HEAD"), timeout=5) as answer:
                header = {name.lower(): value for name, value in answer.headers.items()}
        except (OSError, ValueError):
            return False, False
        ancestors = re.search(r"frame-ancestors ([^;]*)", header.get("content-security-policy", ""))
        refused = "x-frame-options" in header or (ancestors is not None and ancestors[1].split() in (["'none'"], ["'self'"]))
        return not refused, header.get("cross-origin-embedder-policy", "unsafe-none") != "unsafe-none"

    def _repr_html_(self) -> str:
        link = "" if self.page is None else html.escape(self.page, quote=True)
        framed, isolated = self._framing()
        frame = f'<iframe src="{link}" allow="cross-origin-isolated" width="100%" height="{self.height}" style="border:0"></iframe>'
        if framed and not isolated:
            return f'{frame}<p><a href="{link}">{link}</a></p>'
        png = notebook_png(self._scene)
        name = html.escape(self._name)
        picture = name if png is None else f'<img alt="{name}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        if not link:
            return picture
        shown = f'<a href="{link}" target="_blank">{picture}</a>'
        if framed:  # the browser knows whether the notebook is isolated
            place = f"filiform-{uuid.uuid4().hex}"
            shown = (
                f'<div id="{place}">{shown}</div><script>if (window.crossOriginIsolated) '
                f'document.getElementById("{place}").innerHTML = {json.dumps(frame)};</script>'
            )
        return f'{shown}<p><a href="{link}" target="_blank">Travel in this set</a></p>'

    def __repr__(self) -> str:
        what = "a picture" if self.page is None else f"the page {self.page}"
        return f"<filiform.View of {self._name!r}: {what}>"

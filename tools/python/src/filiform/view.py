"""View: a set in a notebook, as the page of a server or as a picture."""

from __future__ import annotations

import base64
import html
import os
import re
import urllib.error
import urllib.request

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
            server, name = owner.path.split("/v1/sets/", 1)
            page = f"{server}/?set={name.strip('/')}"
        if page is not None and not page.startswith(("http://", "https://")):
            raise ValueError(f"page: expected an address that begins with http:// or https://, got {page!r}")
        self.page = page  #: the address of the page; None: only the picture

    @property
    def frames(self) -> bool:
        """True if the server lets other pages hold its page in a frame. Asks the server.

        >>> s.view().frames
        False
        """
        if self.page is None:
            return False
        try:
            with urllib.request.urlopen(urllib.request.Request(self.page, method="HEAD"), timeout=5) as answer:
                policy = answer.headers.get("Content-Security-Policy", "")
                options = answer.headers.get("X-Frame-Options", "")
        except (OSError, ValueError):
            return False
        ancestors = re.search(r"frame-ancestors ([^;]*)", policy)
        return not options and (ancestors is None or ancestors[1].split() not in (["'none'"], ["'self'"]))

    def _repr_html_(self) -> str:
        link = "" if self.page is None else html.escape(self.page, quote=True)
        if link and self.frames:
            return f'<iframe src="{link}" width="100%" height="{self.height}" style="border:0"></iframe><p><a href="{link}">{link}</a></p>'
        png = notebook_png(self._scene)
        name = html.escape(self._name)
        picture = name if png is None else f'<img alt="{name}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        return picture if not link else f'<a href="{link}">{picture}</a><p><a href="{link}">Travel in this set</a></p>'

    def __repr__(self) -> str:
        what = "a picture" if self.page is None else f"the page {self.page}"
        return f"<filiform.View of {self._name!r}: {what}>"

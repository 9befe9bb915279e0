"""A web server of this machine that shows a folder as Apache does, and can be made to fail."""

import threading
from contextlib import contextmanager
from functools import partial
from hashlib import sha256
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import quote, unquote, urlsplit

from afferents.recordings.fetch import CHECKSUMS


class Site:
    """What is served, by path, and how it fails."""

    def __init__(self):
        self.url = ""
        self.files, self.pages, self.moved = {}, {}, {}
        self.next = {}
        """The page that goes on where a page ends, as its header says, by path."""
        self.breaks = {}
        """After how many bytes each next answer for a file ends, by path."""
        self.asked = []
        """Method, path and range of every request."""
        self.takes_ranges, self.validators = True, ("ETag", "Last-Modified")

    def bytes_sent(self, path):
        """Return which ranges were asked of a file."""
        return [wanted for how, where, wanted in self.asked if (how, where) == ("GET", path)]


class _Handler(BaseHTTPRequestHandler):
    def __init__(self, site, *others):
        self.site = site
        super().__init__(*others)

    def do_HEAD(self):
        self.answer(with_body=False)

    def do_GET(self):
        self.answer(with_body=True)

    def answer(self, with_body):
        site, path = self.site, unquote(urlsplit(self.path).path)
        site.asked.append((self.command, path, self.headers.get("Range")))
        if path in site.moved:
            self.send_response(HTTPStatus.FOUND)
            self.send_header("Location", site.moved[path])
            self.send_header("Content-Length", "0")
            self.end_headers()
        elif path in site.pages or path.endswith("/"):
            self.show(site.pages.get(path) or self.folder(path), with_body)
        elif path in site.files:
            self.send_file(path, site.files[path], with_body)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def folder(self, path):
        below = [name.removeprefix(path) for name in self.site.files if name.startswith(path)]
        names = {name.partition("/")[0] + ("/" if "/" in name else "") for name in below}
        rows = [f'<a href="{quote(name)}">{name}</a>' for name in sorted(names)]
        return '<a href="?C=N;O=D">Name</a> <a href="../">Parent</a> ' + " ".join(rows)

    def show(self, html, with_body):
        body = html.encode()
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        if after := self.site.next.get(urlsplit(self.path).path):
            self.send_header("Link", f'<{self.site.url}{after}>; rel="next"')
        self.end_headers()
        self.wfile.write(body if with_body else b"")

    def send_file(self, path, content, with_body):
        site, start = self.site, 0
        known = {
            "ETag": f'"{sha256(content).hexdigest()[:16]}"',
            "Last-Modified": "Thu, 1 Jan 2026",
        }
        wanted, condition = self.headers.get("Range"), self.headers.get("If-Range")
        same = condition is None or condition in [known[name] for name in site.validators]
        if wanted and site.takes_ranges and same:
            start = int(wanted.removeprefix("bytes=").rstrip("-"))
            if start >= len(content):
                self.send_error(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
                return
            self.send_response(HTTPStatus.PARTIAL_CONTENT)
            self.send_header("Content-Range", f"bytes {start}-{len(content) - 1}/{len(content)}")
        else:
            self.send_response(HTTPStatus.OK)
        for name in site.validators:
            self.send_header(name, known[name])
        self.send_header("Content-Length", str(len(content) - start))
        self.end_headers()
        if not with_body:
            return
        breaks = site.breaks.get(path)
        if breaks:
            self.wfile.write(content[start : start + breaks.pop(0)])
            self.close_connection = True
        else:
            self.wfile.write(content[start:])

    def log_message(self, *_):
        pass


@contextmanager
def serving():
    """Yield a `Site` that is served."""
    site = Site()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, site))
    site.url = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield site
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def here(folder):
    """Return what is in a folder, but for the list of checksums."""
    files = {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }
    files.pop(CHECKSUMS, None)
    return files

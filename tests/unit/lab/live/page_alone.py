"""The page without a server: its files from the folder, its web socket played by the test."""

import json
import mimetypes

import cv2
import numpy as np

from afferents.lab.live.web.application import PAGE

TEXTURES = [f"{i / 2:g}" for i in range(13)]


def hello(*models, textures=TEXTURES, named_by_spacing=True, most_sure=1.0):
    """A greeting: models by name, each of the paper's 13 textures unless others are given."""
    return {
        "type": "hello",
        "models": [
            {
                "model": m,
                "title": m,
                "textures": textures,
                "description": ["It is a test."],
                "named_by_spacing": named_by_spacing,
                "most_sure": most_sure,
            }
            for m in models
        ],
    }


def prediction(model, textures):
    rest = 0.3 / (len(textures) - 1)
    evidence = {texture: 0.7 if texture == "3" else rest for texture in textures}
    return {
        "model": model, "state": "texture", "fresh": True, "age_s": 0.0, "evidence": evidence,
        "probabilities": evidence, "sure_after_s": 1.2, "latency_ms": 3.1, "markers_found": 0.99,
        "counters": {"frames": 900, "samples": 0, "dropped": 3}, "troubles": [],
        "truth": "3 mm at 50 mm/s",
    }  # fmt: skip


def state(*models, textures=TEXTURES, sa1=None, ra1=None):
    """A state with everything in it, as the server sends it."""
    rng = np.random.default_rng(0)
    figures = [{"name": f"figure {i}", "value": f"{i} px", "issue": ""} for i in range(10)]
    sa1 = rng.uniform(0, 5.6, (19, 19)) if sa1 is None else np.array(sa1)
    ra1 = rng.uniform(0, 0.4, (19, 19)) if ra1 is None else np.array(ra1)
    return {
        "type": "state",
        "ended": None,
        "repeats": True,
        "predictions": [prediction(model, textures) for model in models],
        "video": {
            "rate_hz": 90, "sensor": "Sensor 'tip_b': square layout, 361 markers.",
            "quality": figures[:7], "size": [640, 480], "ring_px": 8.0, "sa1": sa1.tolist(),
            "markers": [[60 + 20 * i, 60 + 20 * j] for i in range(19) for j in range(19)],
            "ra1": ra1.tolist(),
        },
        "audio": {
            "rate_hz": 44100, "quality": figures[7:], "step_hz": 1.0,
            "amplitude": [1.0 if i and i % 20 == 0 else 0.01 for i in range(200)],
        },
        "spikes": [
            {"name": name, "units": [0] * n, "spikes_a_unit": 20.0,
             "ages_ms": [sorted(rng.uniform(0, 1000, 20)) for _ in range(n)]}
            for name, n in (("SA", 30), ("RA", 30), ("PC", 8))
        ],
    }  # fmt: skip


def opened(browser, size, *messages):
    """A page of a size that has been sent messages, and a picture after each."""
    page = browser.new_page(viewport=dict(zip(("width", "height"), size, strict=True)))
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    jpeg = bytes(cv2.imencode(".jpg", np.full((480, 640), 40, np.uint8))[1])

    def file(route):
        name = route.request.url.split("alone.test/")[1].removeprefix("page/") or "index.html"
        kind = mimetypes.guess_type(name)[0]
        route.fulfill(body=(PAGE / name).read_bytes(), content_type=kind)

    def socket(visitor):
        page.visitor = visitor
        for message in messages:
            visitor.send(json.dumps(message))
            visitor.send(jpeg)

    page.route("http://alone.test/**", file)
    page.route_web_socket("**/feel", socket)
    page.goto("http://alone.test/")
    page.wait_for_function("document.querySelector('#link').textContent === 'live'")
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 100)))")
    return page

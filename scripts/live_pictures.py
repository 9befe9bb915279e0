"""Take docs/images/live.png and look.png: the live page in Chromium, on the simulated rig.

    python scripts/live_pictures.py docs/images

The rig, two models and the browser run at once, so the machine should do nothing else. The models
are those of `make live`, in out/live; they are trained there if they are missing.
"""

import subprocess
import sys
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

SIZE = {"width": 1280, "height": 800}
FELT_S, LOOKED_S = 25, 15
"""How long a touch goes on before its picture is taken, s."""
PICTURES = {
    "live.png": ["--model", "demo", "--video", "rig:5.5/40", "--audio", "rig:5.5/40"],
    "look.png": ["--video", "rig", "--audio", "rig", "--sensor", "hex127"],
}
SURE = "[...document.querySelectorAll('.felt')].every(felt => felt.dataset.felt === '5.5')"
FRESH = "document.querySelector('#comb').textContent !== ''"
TROUBLED = "/trouble/.test(document.body.innerText)"
"""Two cores with a browser beside stall now and then: such a picture is taken anew."""
ATTEMPTS = 3


def take(page: Page, arguments: list[str], path: Path) -> bool:
    """Show what the command shows, keep a picture of it, and tell whether nothing was wrong."""
    command = [sys.executable, "-m", "afferents", "live", "--web", "--port", "0", *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        said = next(line for line in running.stderr if line.startswith("Page: "))
        page.goto(said.removeprefix("Page: ").strip())
        feels = "--model" in arguments
        page.wait_for_function(FRESH)
        page.wait_for_timeout(1000 * (FELT_S if feels else LOOKED_S))
        page.wait_for_function(f"{FRESH} && {SURE}" if feels else FRESH)
        page.screenshot(path=path)
        troubled = bool(page.evaluate(TROUBLED))
        running.terminate()
    print(path, f"{path.stat().st_size / 1000:.0f} KB", "with trouble" if troubled else "")
    return not troubled


def main() -> None:
    """Take all pictures."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(600_000)
        for name, arguments in PICTURES.items():
            path = Path(sys.argv[1]) / name
            any(take(page, arguments, path) for _ in range(ATTEMPTS))


if __name__ == "__main__":
    main()

"""How does a test look at a page as an operator does: in a real Chromium, at a desk's width or a phone's?

The browser is the system's, and so is its driver: Selenium is told where both are, and downloads nothing.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
DESK, PHONE = (1280, 900), (390, 844)
"""Width and height in CSS pixels."""
SWITCHES = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-extensions",
            "--disable-background-networking", "--no-first-run", "--hide-scrollbars")


@contextmanager
def chromium() -> Iterator[webdriver.Chrome]:
    """Give a headless Chromium; skip the test where none is installed."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    driver = shutil.which("chromedriver")
    if found is None or driver is None:
        pytest.skip("no browser: apt-get install chromium chromium-driver")
    options = Options()
    options.binary_location = found
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for switch in SWITCHES:
        options.add_argument(switch)
    shown = webdriver.Chrome(options=options, service=Service(driver))
    try:
        yield shown
    finally:
        shown.quit()


def at_size(shown: webdriver.Chrome, size: tuple[int, int]) -> None:
    """Give the page so many CSS pixels, also fewer than a window of the desktop may have."""
    width, height = size
    shown.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                          {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})


def overflows(shown: webdriver.Chrome, size: tuple[int, int]) -> int:
    """Return by how many CSS pixels the page is wider than what shows it: what an operator must scroll sideways.

    A page that does not say how wide it is to be laid out is given 980 by a phone, and overflows.
    """
    return int(shown.execute_script("return document.documentElement.scrollWidth")) - size[0]


def whole_page(shown: webdriver.Chrome, path: Path) -> None:
    """Write a picture of the page from its top to its end to the PNG file at ``path``."""
    import base64

    told: dict[str, Any] = shown.execute_cdp_cmd("Page.captureScreenshot",
                                                 {"format": "png", "captureBeyondViewport": True})
    path.write_bytes(base64.b64decode(told["data"]))


def complaints(shown: webdriver.Chrome) -> list[str]:
    """Return what the browser's console holds of errors since it was last asked."""
    return [entry["message"] for entry in shown.get_log("browser") if entry["level"] == "SEVERE"]  # type: ignore[no-untyped-call]

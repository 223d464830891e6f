import json
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from playwright.sync_api import expect, sync_playwright

CHROMIUM = "/usr/bin/chromium"
REPORTS = Path(__file__).parent.parent
sys.path.insert(0, str(REPORTS))

import fake_run  # noqa: E402
import make_report  # noqa: E402
from read.readers import load  # noqa: E402

expect.set_options(timeout=30_000)  # ms; builds may run beside


@pytest.fixture(scope="session")
def run(tmp_path_factory) -> Path:
    """The folder of a made-up run."""
    folder = tmp_path_factory.mktemp("data")
    fake_run.write(folder)
    return folder


@pytest.fixture(scope="session")
def written(run, tmp_path_factory) -> Path:
    """The page of the made-up run."""
    file = tmp_path_factory.mktemp("page") / "index.html"
    archived = make_report.link(file.with_name("data.tar.xz"), file, b"")
    make_report.write(file, make_report.page(load(run), archived))
    return file


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


WINDOW = {"width": 1280, "height": 720}  # Playwright's own


@pytest.fixture(scope="session")
def idle(browser) -> dict[str, list]:
    """Windows that no test uses now, by their settings: what one has compiled of Vega, it has."""
    return defaultdict(list)


@pytest.fixture
def visit(browser, idle):
    """Opens a page; fails if it complains, or asks the network for anything."""
    opened, complaints = [], []

    def visit(file, address="", script="", **settings):
        """`address` is what follows the file's own; `script` runs before the page's."""
        kind = json.dumps([script, settings], sort_keys=True)
        if idle[kind]:
            page = idle[kind].pop()
        else:
            context = browser.new_context(**{"viewport": WINDOW, "color_scheme": "light"} | settings)
            context.add_init_script(script)
            page = context.new_page()

        def request(request):
            if request.url.split("#")[0] != file.as_uri():
                complaints.append(request.url)

        listeners = {
            "console": lambda message: complaints.append(f"{message.type}: {message.text}"),
            "pageerror": lambda error: complaints.append(str(error)),
            "request": request,
        }
        for event, listener in listeners.items():
            page.on(event, listener)
        opened.append((kind, settings, page, listeners))
        page.goto(file.as_uri() + address)
        page.wait_for_selector("body[data-drawn]", state="attached")
        return page

    yield visit
    for kind, settings, page, listeners in opened:
        for event, listener in listeners.items():
            page.remove_listener(event, listener)
        page.goto("about:blank")  # what a reader has done ends with it
        page.mouse.move(0, 0)
        page.set_viewport_size(settings.get("viewport", WINDOW))
        page.emulate_media(color_scheme=settings.get("color_scheme", "light"))
        idle[kind].append(page)
    assert complaints == []


@pytest.fixture
def page(visit, written):
    """The page of the made-up run, open."""
    return visit(written)


@pytest.fixture
def read(tmp_path):
    """Reads a folder of the files that it was given so far."""

    def read(name: str, text):
        (tmp_path / name).write_text(text if isinstance(text, str) else json.dumps(text))
        return load(tmp_path)

    return read

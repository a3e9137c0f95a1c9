"""Chromium without a screen, and the daemon whose page it shows."""
import contextlib
import http.server
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
import time

SWITCHES = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--window-size=1000,700", "--hide-scrollbars", "--disable-background-networking",
            "--disable-component-update", "--no-first-run", "--force-device-scale-factor=1", "--remote-debugging-pipe"]


def missing():
    """What the tests need and the machine lacks, as a sentence; empty: nothing."""
    try:
        import selenium.webdriver  # noqa: F401
    except ImportError:
        return "python3-selenium is not installed"
    for program in ("chromium", "chromedriver"):
        if not shutil.which(program):
            return f"{program} is not installed"
    return ""


def eventually(condition, seconds=30, what="the condition"):
    """The first true value of condition()."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what} did not become true within {seconds} s")
        time.sleep(0.03)


class Daemon:
    """heliographd with a page, and without a state folder unless arguments name one. `port` 0: any free one."""

    def __init__(self, program, scenes, port=0, arguments=()):
        if "--state" not in arguments:
            arguments = ("--state", "none", *arguments)
        self.process = subprocess.Popen(
            [program, "--json", "--listen", "127.0.0.1:0", "--http", f"127.0.0.1:{port}", "--scene-root", str(scenes),
             "--log-level", "warn", *arguments], stdout=subprocess.PIPE, text=True)
        told = json.loads(self.process.stdout.readline())
        self.rpc, self.http = told["listening"], told["http"]

    @property
    def port(self):
        return int(self.http.rsplit(":", 1)[1])

    def kill(self):
        self.process.kill()
        self.process.wait()

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(20)
            self.process.kill()
        self.process.stdout.close()
        self.process.wait()


class ForeignPage:
    """A page of another origin, with nothing on it."""

    def __init__(self):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.end_headers()
                self.wfile.write(b"<!doctype html><title>elsewhere</title>")

            def log_message(self, *arguments):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.host = f"127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def stop(self):
        self.server.shutdown()
        self.server.server_close()


class Page:
    """A browser with one tab. Console errors and requests are kept for the tests to look at."""

    def __init__(self, screenshots, switches=()):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
        from selenium.webdriver.common import utils

        class LoopbackService(Service):
            """By its address: a minimal system has no name for it."""

            @property
            def service_url(self):
                return f"http://127.0.0.1:{self.port}"

            def is_connectable(self):
                return utils.is_connectable(self.port, "127.0.0.1")

        self.screenshots = pathlib.Path(screenshots)
        self.folder = tempfile.mkdtemp(prefix="heliograph-browser-")
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for switch in (*SWITCHES, f"--user-data-dir={self.folder}", *switches):
            options.add_argument(switch)
        # Not the log "performance", which copies every message of a WebSocket through several processes.
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = LoopbackService(executable_path=shutil.which("chromedriver"), log_path=os.devnull)
        self.driver = webdriver.Chrome(service=service, options=options)
        self.driver.set_script_timeout(30)

    def close(self):
        self.driver.quit()
        shutil.rmtree(self.folder, ignore_errors=True)

    def open(self, url):
        self.driver.get("about:blank")  # so that another fragment loads the page anew
        self.driver.get(url)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def wait(self, script, seconds=30):
        return eventually(lambda: self.run(f"return {script}"), seconds, script)

    def state(self):
        return self.run("return globalThis.heliograph?.state()")

    def wait_for_picture(self, seconds=40):
        """Until the film of the newest view is whole."""
        return self.wait("globalThis.heliograph?.state().complete && heliograph.state().viewId === heliograph.state().sentViewId"
                         " && heliograph.state()", seconds)

    def wait_for_end(self, seconds=60):
        """Until the newest view's budget is used up."""
        self.wait_for_picture(seconds)
        return self.wait("heliograph.state().end?.tag.view_id === heliograph.state().viewId && heliograph.state()", seconds)

    def wait_for_frames(self, count):
        """Until the browser has drawn `count` frames, or a second has passed."""
        self.driver.execute_async_script(
            "const [count, done] = arguments; let left = count; setTimeout(done, 1000);"
            "const next = () => left-- > 0 ? requestAnimationFrame(next) : done(); next();", count)

    def screenshot(self, name):
        self.screenshots.mkdir(parents=True, exist_ok=True)
        self.driver.save_screenshot(str(self.screenshots / f"{name}.png"))

    def errors(self):
        """Errors of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "ERROR")]

    def requested_hosts(self):
        """HOST:PORT of all that the page has loaded. Its policy lets a WebSocket go to its own host alone."""
        urls = self.run("return [location.href, ...performance.getEntriesByType('resource').map((entry) => entry.name)]")
        return {url.split("://", 1)[1].split("/", 1)[0] for url in urls if url.startswith("http")}

#!/usr/bin/env python3
"""What a person at the viewer waits for, in Chromium on this machine; run by `helio_bench viewer`.

usage: viewer_bench.py BROWSER_TESTS HELIOGRAPH HELIOGRAPHD SCENE.gltf

BROWSER_TESTS: the folder tests/browser. One JSON object a figure on stdout: {"name", "value"}; {"note"}: why one is missing.
"""
import json
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, sys.argv[1])
import browser  # noqa: E402

TICKS = os.sysconf("SC_CLK_TCK")
RUNS = 5
DRAG_S = 6


def tell(name, value):
    print(json.dumps({"name": name, "value": value}), flush=True)


def cpu_seconds(stat):
    fields = pathlib.Path(stat).read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def processes_below(root):
    """A process and all that it has started."""
    parents = {}
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            pass  # it has ended
    found, grown = {root}, True
    while grown:
        more = {pid for pid, parent in parents.items() if parent in found} - found
        found |= more
        grown = bool(more)
    return found


def cpu_of(pids):
    total = 0
    for pid in pids:
        try:
            total += cpu_seconds(f"/proc/{pid}/stat")
        except OSError:
            pass
    return total


def cpu_of_thread(pid, name):
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        if (task / "comm").read_text().strip() == name:
            return cpu_seconds(task / "stat")
    raise RuntimeError(f"no thread called {name}")


def time_of_view(heliograph, scene):
    """Seconds from the command to its printed address."""
    begun = time.monotonic()
    process = subprocess.Popen([heliograph, "view", scene, "--http", "127.0.0.1:0", "--json"], stdout=subprocess.PIPE, text=True)
    text = ""
    while not text.rstrip().endswith("}"):
        text += process.stdout.readline()
    seconds = time.monotonic() - begun
    json.loads(text)
    process.send_signal(signal.SIGINT)
    process.wait(20)
    return seconds


def drag(page, seconds):
    """Moves the mouse with its button down, 40 events a second, to and fro."""
    box = page.run("const r = document.getElementById('view').getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]")
    send = page.driver.execute_cdp_cmd
    send("Input.dispatchMouseEvent", {"type": "mousePressed", "x": box[0], "y": box[1], "button": "left", "clickCount": 1})
    begun = time.monotonic()
    step = 0
    while time.monotonic() < begun + seconds:
        step += 1
        x = box[0] + 60 * abs((step / 60) % 2 - 1) - 30
        send("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": x, "y": box[1], "button": "left"})
        time.sleep(max(0, begun + step / 40 - time.monotonic()))
    elapsed = time.monotonic() - begun
    send("Input.dispatchMouseEvent", {"type": "mouseReleased", "x": box[0], "y": box[1], "button": "left", "clickCount": 1})
    return elapsed


def main():
    heliograph, heliographd, scene = sys.argv[2:5]
    lack = browser.missing()
    if lack:
        print(json.dumps({"note": lack}))
        return
    tell("view.url_s", statistics.median(time_of_view(heliograph, scene) for _ in range(RUNS)))

    daemon = browser.Daemon(heliographd, pathlib.Path(scene).parent)
    with tempfile.TemporaryDirectory() as folder:
        page = browser.Page(folder, ("--window-size=1700,900",))
        try:
            measure(page, daemon, scene)
        finally:
            page.close()
            daemon.stop()


def measure(page, daemon, scene):
    base = f"http://{daemon.http}/"
    size = 0
    web = pathlib.Path(__file__).resolve().parents[3] / "client/web"
    for file in [path for pattern in ("*.html", "*.css", "*.js", "*.svg") for path in web.rglob(pattern)]:
        request = urllib.request.Request(base + file.relative_to(web).as_posix(), headers={"Accept-Encoding": "gzip"})
        size += len(urllib.request.urlopen(request).read())
    protocol = urllib.request.Request(base + "protocol.json", headers={"Accept-Encoding": "gzip"})
    size += len(urllib.request.urlopen(protocol).read())
    tell("page.bytes", size)

    name = pathlib.Path(scene).name
    opening = []
    for _ in range(RUNS):
        page.open(f"{base}#scene={name}&size=640x360")
        page.wait("globalThis.heliograph?.app.main.meter.times.whole.length + globalThis.heliograph?.app.main.meter.times.preview.length > 0")
        opening.append(page.run("const t = heliograph.app.main.meter.times; return Math.min(...t.whole, ...t.preview)") / 1000)
    tell("page.first_whole_s", statistics.median(opening))

    for budget, label in ((0, "default"), (15, "15ms")):
        page.open(f"{base}#scene={name}&size=640x360&preview_budget_ms={budget}&preview_rate=30")
        page.wait_for_picture()
        drag(page, 1)
        page.run("for (const list of Object.values(heliograph.app.main.meter.latencies)) list.length = 0")
        drag(page, DRAG_S)
        latencies = page.run("return heliograph.latencies().preview")
        tell(f"input_to_pixel.{label}.p50_ms", statistics.median(latencies))
        tell(f"input_to_pixel.{label}.p95_ms", sorted(latencies)[int(0.95 * len(latencies))])

    page.open(f"{base}#scene={name}&size=1280x720&preview_rate=20")
    page.wait_for_picture()
    drag(page, 1)
    pid = daemon.process.pid
    chromium = processes_below(page.driver.service.process.pid)
    shown_pictures = "return heliograph.app.main.meter.times.preview.length + heliograph.app.main.meter.times.whole.length"
    page.run("for (const list of Object.values(heliograph.app.main.meter.times)) list.length = 0")
    before = page.run(shown_pictures)
    http, render, shown = cpu_of_thread(pid, "http"), cpu_of([pid]), cpu_of(chromium)
    received = page.run("return heliograph.state().bytes")
    elapsed = drag(page, DRAG_S)
    after = page.run(shown_pictures)
    pictures = (after - before) / elapsed
    tell("drag.pictures_per_s", pictures)
    tell("drag.megabytes_per_s", (page.run("return heliograph.state().bytes") - received) / elapsed / 1e6)
    share = (cpu_of_thread(pid, "http") - http) / elapsed
    tell("drag.http_thread_share", share)
    tell("drag.http_thread_share_at_20", share * 20 / max(pictures, 1e-9))
    tell("drag.daemon_cores", (cpu_of([pid]) - render) / elapsed)
    tell("drag.browser_cores", (cpu_of(chromium) - shown) / elapsed)


if __name__ == "__main__":
    main()

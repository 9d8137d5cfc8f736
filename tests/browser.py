"""A headless Chromium, driven over a pipe by its own debugging protocol: no further package is needed.

Used by the tests of pages: open one, evaluate expressions in it, wait until one is true, take a picture.
"""

import base64
import json
import os
import subprocess
import tempfile
import time


class Browser:
    """One page in a browser of its own; a context manager.

    program: name or path of a Chromium. size: width and height of its window in pixels.
    """

    def __init__(self, program, size=(1200, 1500)):
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_read, self.to_write = os.pipe()
        self.from_read, from_write = os.pipe()

        def streams():
            # The browser reads commands from 3 and writes answers to 4.
            os.dup2(to_read, 13)
            os.dup2(from_write, 14)
            os.dup2(13, 3)
            os.dup2(14, 4)

        words = [program, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        words += [f"--user-data-dir={self.folder.name}", f"--window-size={size[0]},{size[1]}", "about:blank"]
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen(words, preexec_fn=streams, close_fds=False, stdout=quiet, stderr=quiet)
        os.close(to_read)
        os.close(from_write)
        self.number, self.buffer = 0, b""
        target = self._ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        self.session = None
        self.session = self._ask("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        self._ask("Page.enable", {})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.folder.cleanup()

    def _ask(self, method, params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if getattr(self, "session", None):
            message["sessionId"] = self.session
        os.write(self.to_write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def _read(self):
        while b"\0" not in self.buffer:
            piece = os.read(self.from_read, 1 << 16)
            if not piece:
                raise RuntimeError("the browser has ended")
            self.buffer += piece
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def open(self, url):
        """Loads a page."""
        self._ask("Page.navigate", {"url": url})
        self.wait("document.readyState === 'complete'")

    def evaluate(self, expression):
        """The value of a JavaScript expression in the page, as JSON; a promise is awaited."""
        params = {"expression": expression, "returnByValue": True, "awaitPromise": True}
        result = self._ask("Runtime.evaluate", params)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, expression, seconds=60):
        """Waits until an expression is true."""
        end = time.monotonic() + seconds
        while not self.evaluate(expression):
            if time.monotonic() > end:
                raise TimeoutError(f"not true within {seconds} s: {expression}\n{self.evaluate('document.body.innerText')}")
            time.sleep(0.05)

    def picture(self, path):
        """Writes what the window shows as PNG."""
        data = self._ask("Page.captureScreenshot", {"format": "png"})["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

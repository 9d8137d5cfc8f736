"""A page in Firefox over WebDriver BiDi, by its own remote agent, on a virtual display (Xvfb).

Playwright's BiDi driver sends `emulation.setMediaFeaturesOverride`, which Firefox ESR 153 does not know, so that this test
speaks the protocol itself: a few commands, no driver program.
"""

import base64
import itertools
import json
import os
import pathlib
import re
import subprocess
import tempfile
import threading

import websocket


class Firefox:
    """One window on a virtual display; `errors` and `requests` collect what the page reports and asks for."""

    def __init__(self, program: str):
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.profile = tempfile.TemporaryDirectory()
        # Firefox draws WebGL by software on a display alone, and by default not at all.
        preferences = pathlib.Path(self.profile.name) / "user.js"
        preferences.write_text('user_pref("webgl.forbid-software", false);\n')
        self.display, number = self._virtual_display()
        command = [program, "--no-remote", "--profile", self.profile.name, "--remote-debugging-port", "0", "about:blank"]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env={**os.environ, "DISPLAY": f":{number}"})
        address = self._address()
        # What Firefox writes later must not fill the pipe.
        threading.Thread(target=lambda: [None for _ in self.process.stderr], daemon=True).start()
        self.socket = websocket.create_connection(f"{address}/session", timeout=60, suppress_origin=True)
        self.numbers = itertools.count(1)
        self.command("session.new", {"capabilities": {}})
        self.command("session.subscribe", {"events": ["log.entryAdded", "network.beforeRequestSent"]})
        self.context = self.command("browsingContext.getTree", {})["contexts"][0]["context"]

    @staticmethod
    def _virtual_display() -> tuple[subprocess.Popen, str]:
        """Starts Xvfb on a free display and returns its process and number."""
        reading, writing = os.pipe()
        command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1600x1000x24", "-nolisten", "tcp"]
        process = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
        os.close(writing)
        with os.fdopen(reading) as answer:
            return process, answer.readline().strip()

    def _address(self) -> str:
        for line in self.process.stderr:
            found = re.search(r"WebDriver BiDi listening on (ws://\S+)", line)
            if found:
                return found[1]
        raise RuntimeError("Firefox ended before its remote agent listened")

    def command(self, method: str, parameters: dict) -> dict:
        """Sends a command and returns its result; events on the way are collected."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            if message.get("id") == number:
                if message["type"] == "error":
                    raise RuntimeError(f"{method}: {message['error']}: {message['message']}")
                return message["result"]
            self._event(message)

    def _event(self, message: dict) -> None:
        if message.get("method") == "log.entryAdded" and message["params"]["level"] == "error":
            self.errors.append(message["params"]["text"])
        if message.get("method") == "network.beforeRequestSent":
            self.requests.append(message["params"]["request"]["url"])

    def goto(self, url: str) -> None:
        """Opens an address and waits for the end of loading."""
        self.command("browsingContext.navigate", {"context": self.context, "url": url, "wait": "complete"})

    def evaluate(self, expression: str):
        """Returns the JSON value of an expression; a promise is awaited."""
        wrapped = f"(async () => JSON.stringify(await ({expression})))()"
        target = {"context": self.context}
        answer = self.command("script.evaluate", {"expression": wrapped, "target": target, "awaitPromise": True})
        if answer["type"] != "success":
            raise RuntimeError(answer["exceptionDetails"]["text"])
        return json.loads(answer["result"].get("value", "null"))

    def viewport(self, width: int, height: int) -> None:
        """Sets the size of the view, CSS pixels."""
        self.command("browsingContext.setViewport", {"context": self.context, "viewport": {"width": width, "height": height}})

    def screenshot(self) -> bytes:
        """Returns the view as PNG."""
        return base64.b64decode(self.command("browsingContext.captureScreenshot", {"context": self.context})["data"])

    def pdf(self) -> bytes:
        """Prints the page."""
        return base64.b64decode(self.command("browsingContext.print", {"context": self.context, "background": True})["data"])

    def close(self) -> None:
        """Ends the session and the process that it started."""
        self.socket.close()
        self.process.terminate()
        self.process.wait(timeout=20)
        self.display.terminate()
        self.display.wait(timeout=20)
        self.profile.cleanup()

"""The operator's page of a session in a headless browser: checklist, GO, STOP, end. Prints what the page showed as JSON.

usage: operator_page.py BROWSER URL PICTURE
"""

import json
import sys

from browser import Browser

program, url, picture = sys.argv[1:]
with Browser(program) as page:
    page.open(url)
    page.wait("document.getElementById('mode').textContent.startsWith('ARMED')")
    page.wait("!document.getElementById('go').disabled")
    rows = "[...document.querySelectorAll('#checks tr')].map(row => [...row.cells].map(cell => cell.innerText))"
    shown = {"checks": page.evaluate(rows)}
    shown["wide"] = page.evaluate("document.documentElement.scrollWidth > innerWidth")
    # Whoever has not got the page has not got its token.
    post = "fetch('/go', { method: 'POST', headers: { 'x-softdock-token': 'x' } }).then(answer => answer.status)"
    shown["foreign"] = page.evaluate(post)
    page.wait("document.getElementById('phase-word').textContent === 'ready'")
    page.picture(picture)
    # A lost report takes `ready` back for a moment, and GO is refused meanwhile: an operator presses it again.
    press = "document.getElementById('go').click()"
    page.wait(f"document.getElementById('phase-word').textContent === 'weighing' || ({press}, false)", 30)
    shown["moving"] = page.evaluate("document.getElementById('force').innerText")
    page.evaluate("document.getElementById('stop').click()")
    page.wait("document.getElementById('result').textContent.includes('stopped by')", 30)
    shown["result"] = page.evaluate("document.getElementById('result').textContent")
    page.wait("document.getElementById('stop').disabled", 30)
    shown["over"] = page.evaluate("document.getElementById('phase-word').textContent")
print(json.dumps(shown))

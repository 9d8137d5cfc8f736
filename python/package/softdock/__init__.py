"""Monte Carlo verification of space contact tasks, in space and on a hardware-in-the-loop facility.

>>> import softdock as sd
>>> campaign = sd.Campaign.load("campaigns/probe_drogue.toml")  # doctest: +SKIP
>>> results = campaign.run("results/dock")  # doctest: +SKIP
>>> results.verdict  # doctest: +SKIP
'not_verified'
>>> results.plot()  # doctest: +SKIP

Numbers are SI unless a function takes ``units="author"``: then they have the units of the campaign file. Tables are
Arrow: ``polars.DataFrame(table)``, ``pyarrow.table(table)`` and DuckDB read them without a copy.
"""

from softdock._campaign import Campaign, Check
from softdock._compare import Comparison, compare
from softdock._results import Results, open
from softdock._softdock import SoftdockError, __version__
from softdock._table import Table
from softdock._tasks import Report, diagnose, identify
from softdock._trace import Trace

__all__ = [
    "Campaign",
    "Check",
    "Comparison",
    "Report",
    "Results",
    "SoftdockError",
    "Table",
    "Trace",
    "__version__",
    "compare",
    "diagnose",
    "identify",
    "open",
]

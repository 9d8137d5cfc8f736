"""Monte Carlo verification of space contact tasks, in space and on a hardware-in-the-loop facility.

>>> import softdock as sd
>>> campaign = sd.Campaign.example("dock", runs=400)  # doctest: +SKIP
>>> results = campaign.run()  # doctest: +SKIP
>>> results.verdict  # doctest: +SKIP
'not_verified'
>>> results.plot()  # doctest: +SKIP

Numbers are SI unless a function takes ``units="author"``: then they have the units of the campaign file. Tables are
Arrow: ``polars.DataFrame(table)``, ``pyarrow.table(table)`` and DuckDB read them without a copy.
"""

from softdock._campaign import Campaign, Check
from softdock._compare import Comparison, compare
from softdock._lists import Listing, effects, examples, metrics, params, signals
from softdock._results import Agreement, Results, open
from softdock._softdock import SoftdockError, __version__
from softdock._table import Table
from softdock._tasks import Report, diagnose, identify
from softdock._trace import Trace

__all__ = [
    "Agreement",
    "Campaign",
    "Check",
    "Comparison",
    "Listing",
    "Report",
    "Results",
    "SoftdockError",
    "Table",
    "Trace",
    "__version__",
    "compare",
    "diagnose",
    "effects",
    "examples",
    "identify",
    "metrics",
    "open",
    "params",
    "signals",
]

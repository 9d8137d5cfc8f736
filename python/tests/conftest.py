"""Campaigns and results for all tests."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import pytest

import softdock as sd

matplotlib.use("Agg")

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
RUNS = 60


@pytest.fixture(scope="session")
def campaign() -> sd.Campaign:
    return sd.Campaign.load(CAMPAIGNS / "probe_drogue.toml", runs=RUNS)


@pytest.fixture(scope="session")
def results(campaign: sd.Campaign, tmp_path_factory: pytest.TempPathFactory) -> sd.Results:
    return campaign.run(tmp_path_factory.mktemp("results") / "dock", backend="cpu", progress=False)

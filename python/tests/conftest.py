"""Campaigns and results for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

os.environ.setdefault("MPLBACKEND", "Agg")

import softdock as sd  # noqa: E402

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
RUNS = 120


@pytest.fixture(scope="session")
def campaign() -> sd.Campaign:
    return sd.Campaign.load(CAMPAIGNS / "probe_drogue.toml", runs=RUNS)


@pytest.fixture(scope="session")
def results(campaign: sd.Campaign, tmp_path_factory: pytest.TempPathFactory) -> sd.Results:
    return campaign.run(tmp_path_factory.mktemp("results") / "dock", backend="cpu", progress=False)

"""``cdhr compensation``: pulley models against each other, and what stretch does."""

import json

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["compensation", "--step", "0.5", *arguments])
    assert result.exit_code == 0, result.stderr
    return result.stdout


def test_each_model_is_exact_on_a_machine_like_itself():
    found = json.loads(run("--models", "--json"))
    assert all(
        max(found[f"{name} on {name}"]) < 1e-9 for name in ("swivel", "fixed-plane", "caster", "point")
    )
    assert found["point on fixed-plane"] == pytest.approx([0.94512, 0.89429, 1.20205], abs=5e-3)
    assert "caster" in run("--models")


def test_stretch_costs_more_than_its_doubt():
    found = json.loads(run("--stretch", "--profile", "paper", "--json"))
    assert all(0 < doubt < lost for doubt, lost in zip(found["doubt_mm"], found["ignored_mm"], strict=True))
    assert max(found["ignored_mm"]) < 0.2
    assert "20 %" in run("--stretch", "--profile", "paper")

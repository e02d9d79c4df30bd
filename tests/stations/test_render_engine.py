"""The render engine of simulated pictures."""

import os

import pytest
from pydrake.geometry import RenderEngineVtkParams

from riseg_drake.stations.render_engine import EXTENSIONS, make_render_engine


def test_mesa_goes_without_anisotropic_filtering(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(EXTENSIONS, raising=False)
    make_render_engine(RenderEngineVtkParams())
    without = os.environ["MESA_EXTENSION_OVERRIDE"].split()
    assert without == ["-GL_EXT_texture_filter_anisotropic", "-GL_ARB_texture_filter_anisotropic"]


def test_what_a_user_told_mesa_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESA_EXTENSION_OVERRIDE", "-GL_EXT_foo")
    make_render_engine(RenderEngineVtkParams())
    assert os.environ["MESA_EXTENSION_OVERRIDE"] == "-GL_EXT_foo"

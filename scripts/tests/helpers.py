"""Helpers that several tests share."""

from typing import Any

import pytest

import mitsuba_reference as ref


def need_wavefront(mi: Any) -> None:
    """Fail if Mitsuba runs a scalar variant, whose calls take single numbers instead of arrays."""
    if "scalar" in mi.variant():
        pytest.fail(f"this test needs a wavefront, but Mitsuba runs {mi.variant()}: {ref.INSTALL_LLVM}", pytrace=False)

"""Fixtures that benchmarks share with the tests."""

from tests.browser.conftest import served

__all__ = ["served"]

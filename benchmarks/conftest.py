"""Fixtures that benchmarks share with the tests."""

from tests.browser.conftest import explored, served

__all__ = ["explored", "served"]

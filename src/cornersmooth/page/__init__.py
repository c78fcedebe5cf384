"""The report as a page: path, corners, surface and charts in one file that opens in any browser, without network."""

from __future__ import annotations

from cornersmooth.page.pages import BEGINNING, page_and_saving, surface_text, times_page, verified_page
from cornersmooth.page.scene import Story, Subject, page

__all__ = ["BEGINNING", "Story", "Subject", "page", "page_and_saving", "surface_text", "times_page", "verified_page"]

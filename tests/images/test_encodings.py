"""Encodings of images beside OpenCV's."""

from __future__ import annotations

import pytest


def test_older_versions_of_opencv_lack_a_function(monkeypatch: pytest.MonkeyPatch) -> None:
    cv2 = pytest.importorskip("cv2")
    from rosz.images.encodings import type_of

    monkeypatch.delattr(cv2, "CV_MAKETYPE", raising=False)
    type_of.cache_clear()
    assert (type_of("bgr8"), type_of("32FC4")) == (cv2.CV_8UC3, cv2.CV_32FC4)

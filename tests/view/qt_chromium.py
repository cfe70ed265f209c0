"""Qt's Chromium, which comes as wheels: an empty page in a window that nobody sees, for others to drive.

    build/chromium/bin/python tests/view/qt_chromium.py PORT WIDTH HEIGHT

Runs in an environment of its own, `make build/chromium/installed`, until it is ended.
"""

from __future__ import annotations

import os
import sys


def main(port: str, width: str, height: str) -> int:
    """Open the window and let it be driven through a port."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    os.environ["QTWEBENGINE_REMOTE_DEBUGGING"] = f"127.0.0.1:{port}"
    os.environ["QTWEBENGINE_CHROMIUM_FLAGS"] = "--no-sandbox --ignore-gpu-blocklist --enable-unsafe-swiftshader"
    from PyQt6.QtCore import QUrl  # type: ignore[import-not-found]
    from PyQt6.QtWebEngineWidgets import QWebEngineView  # type: ignore[import-not-found]
    from PyQt6.QtWidgets import QApplication  # type: ignore[import-not-found]

    application = QApplication([sys.argv[0]])
    view = QWebEngineView()
    view.resize(int(width), int(height))
    view.load(QUrl("about:blank"))
    view.show()
    return application.exec()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

"""Responses to unknown addresses and to failures: an HTML page for a browser, a plain sentence for a program."""

from __future__ import annotations

import logging
from html import escape

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, PlainTextResponse, Response
from nicegui import app
from starlette.exceptions import HTTPException

_PAGE = """<!doctype html><html lang="en-US"><meta charset="utf-8"><title>{title} · AID-SR</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="stylesheet" href="/assets/web.css">
<script>matchMedia("(prefers-color-scheme: dark)").matches &&
  document.documentElement.classList.add("body--dark")</script>
<body><header class="top"><a class="brand" href="/">AID-SR</a></header>
<main class="page narrow"><div class="sheet empty"><h1>{title}</h1><p class="soft">{said}</p>
<a href="/">All runs</a></div></main></body></html>"""
_NOTHING = "Page not found"
_FAILED = "Internal error"
_ADVICE = "The error is in the web app, not in your run. The terminal of the web app shows the traceback."


def add_error_pages(application: FastAPI) -> None:
    """Handle unknown addresses and failures, in the application and in the NiceGUI app mounted in it."""

    async def missing(request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 404
        detail = error.detail if isinstance(error, HTTPException) and error.detail != "Not Found" else ""
        return _answer(request, status, _NOTHING, detail or f"There is no page at {request.url.path}")

    async def invalid(request: Request, error: Exception) -> Response:
        del error
        return _answer(request, 404, _NOTHING, f"There is no page at {request.url.path}")

    async def failed(request: Request, error: Exception) -> Response:
        logging.getLogger(__name__).error("%s failed", request.url.path, exc_info=error)
        return _answer(request, 500, _FAILED, _ADVICE)

    for one in (application, app):
        one.add_exception_handler(HTTPException, missing)
        one.add_exception_handler(404, missing)
        one.add_exception_handler(RequestValidationError, invalid)
        one.add_exception_handler(Exception, failed)


def _answer(request: Request, status: int, title: str, said: str) -> Response:
    if "text/html" in request.headers.get("accept", ""):
        return HTMLResponse(_PAGE.format(title=title, said=escape(said)), status)
    return PlainTextResponse(f"{title}: {said}", status)
